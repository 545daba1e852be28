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


def test_table_has_a_column_for_each_compensation(evaluation_metrics):
    arms = evaluation_metrics["compensations"]
    arms["simple"] = copy.deepcopy(arms["none"])
    _, sections = evaluation_content(evaluation_metrics)
    table = next(b for s in sections for b in s.blocks if isinstance(b, Table))
    assert table.header == ("measure", "none", "simple")
    assert ("radial error at the end [m]", "779", "779") in table.rows
