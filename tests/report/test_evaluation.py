"""The words of the evaluation of one real recording."""

from __future__ import annotations

import copy

from ins_eval.report.content import Table
from ins_eval.report.evaluation import evaluation_content


def test_answer_gives_velocity_rate_window_and_heading(evaluation_metrics):
    first, heading, limit = evaluation_content(evaluation_metrics)[0].splitlines()
    assert first == (
        "rlg_static_vehicle: without compensation horizontal velocity RMS is 0.39 m/s and the radial error rate "
        "(final) 0.51 nmi/h, over 2970 s of pure-inertial navigation."
    )
    assert "218.43° ± 0.12° (1 σ), 0.17° from the documented 218.60°, within 3 σ" in heading
    assert "not a CEP" in limit


def test_heading_words_follow_the_difference_across_north(evaluation_metrics):
    evaluation_metrics["alignment"] |= {"heading_deg": 359.9, "documented_heading_deg": 0.6}
    heading = evaluation_content(evaluation_metrics)[0].splitlines()[1]
    assert "0.70° from the documented 0.60°, more than 3 σ" in heading


def test_no_documented_heading_is_said(evaluation_metrics):
    del evaluation_metrics["alignment"]["documented_heading_deg"]
    assert "none is documented" in evaluation_content(evaluation_metrics)[0]


def test_missing_keys_are_survived(evaluation_metrics):
    for key in evaluation_metrics:
        cut = copy.deepcopy(evaluation_metrics)
        del cut[key]
        answer, sections = evaluation_content(cut)
        assert answer and "None" not in answer and all(section.blocks for section in sections)
        if isinstance(evaluation_metrics[key], dict):
            for inner in evaluation_metrics[key]:
                cut = copy.deepcopy(evaluation_metrics)
                del cut[key][inner]
                assert "None" not in evaluation_content(cut)[0]
    assert evaluation_content({})[0].endswith("nothing of it was navigated.")


def test_tables_have_a_row_for_each_compensation(evaluation_metrics):
    arms = evaluation_metrics["compensations"]
    arms["simple"] = copy.deepcopy(arms["none"])
    _, sections = evaluation_content(evaluation_metrics)
    velocity, radial = [b for s in sections for b in s.blocks if isinstance(b, Table)][:2]
    assert [row[0] for row in velocity.rows] == [row[0] for row in radial.rows] == ["none", "simple"]
    assert radial.header[-1] == "at the end [m]" and [row[-1] for row in radial.rows] == ["779", "779"]


def test_many_compensations_are_not_all_spoken(evaluation_metrics):
    arms = evaluation_metrics["compensations"]
    for name, velocity in (("simple", 0.2), ("hysteresis", 0.7)):
        arms[name] = copy.deepcopy(arms["none"])
        arms[name]["velocity_rms_mps"]["horizontal"] = velocity
    first = evaluation_content(evaluation_metrics)[0].splitlines()[0]
    assert "of 3 compensations simple is the best" in first and "with hysteresis compensation it is 0.70 m/s" in first


def test_restarts_are_told_where_there_are_any(evaluation_metrics):
    evaluation_metrics["restarts"] = {
        "none": {
            "count": 7,
            "after_s": [1.0, 2.0, 3.0, 4.0],
            "position_rms_m": [0.1, 0.4, 0.9, 1.6],
            "velocity_rms_mps": [0.2, 0.4, 0.6, 0.8],
        }
    }
    _, sections = evaluation_content(evaluation_metrics)
    table = next(b for s in sections if s.heading == "Between fixes" for b in s.blocks if isinstance(b, Table))
    assert [row[0] for row in table.rows] == ["1", "2", "4"] and table.rows[-1][1:] == ("1.6", "0.80")


def test_a_hopeless_instrument_is_sent_to_restarts(evaluation_metrics):
    assert "--restart-every" not in evaluation_content(evaluation_metrics)[0]
    evaluation_metrics["compensations"]["none"]["velocity_rms_mps"]["horizontal"] = 500.0
    assert "--restart-every" in evaluation_content(evaluation_metrics)[0]
