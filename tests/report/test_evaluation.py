"""The words of the evaluation of one real recording."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from ins_eval.analysis.evaluation_numbers import FoundStart
from ins_eval.grade import NoiseTerm
from ins_eval.navigation import Measures
from ins_eval.report.content import Table
from ins_eval.report.evaluation import evaluation_content
from ins_eval.report.evaluation_glance import evaluation_glance
from ins_eval.restarts import Restarts


def with_heading(numbers, **changed):
    return replace(numbers, alignment=replace(numbers.alignment, **changed))


def with_velocity(of: Measures, horizontal_mps: float) -> Measures:
    return replace(of, velocity_rms_mps={**of.velocity_rms_mps, "horizontal": horizontal_mps})


def test_answer_gives_velocity_rate_window_and_heading(evaluation_numbers):
    first, heading, limit = evaluation_content(evaluation_numbers)[0].splitlines()
    assert first == (
        "rlg_static_vehicle: without compensation horizontal velocity RMS is 0.39 m/s and the radial error rate "
        "(final) 0.51 nmi/h, over 2970 s of pure-inertial navigation."
    )
    assert "218.43° ± 0.12° (1 σ), 0.17° from the documented 218.60°, within 3 σ" in heading
    assert "not a CEP" in limit


def test_heading_words_follow_the_difference_across_north(evaluation_numbers):
    across = with_heading(evaluation_numbers, heading_deg=359.9, documented_heading_deg=0.6)
    assert "0.70° from the documented 0.60°, more than 3 σ" in evaluation_content(across)[0].splitlines()[1]


def test_no_documented_heading_is_said(evaluation_numbers):
    undocumented = with_heading(evaluation_numbers, documented_heading_deg=None)
    assert "none is documented" in evaluation_content(undocumented)[0]


def test_a_heading_that_was_given_is_said(evaluation_numbers):
    given = with_heading(evaluation_numbers, heading_sigma_deg=None, stretch_s=None, documented_heading_deg=None)
    assert "Heading at the start, as the recording gives it: 218.43°." in evaluation_content(given)[0]


def test_what_was_not_compared_is_left_out(evaluation_numbers):
    attitude = Measures(attitude_rms_deg={"north": 0.1, "east": 0.2, "down": 0.3})
    answer, sections = evaluation_content(replace(evaluation_numbers, compensations={"none": attitude}))
    assert "no velocity: without compensation attitude RMS is 0.10° about north" in answer and "None" not in answer
    (result,) = [s for s in sections if s.heading == "Result"]
    assert [b.title for b in result.blocks if isinstance(b, Table)] == ["Attitude error, RMS"]


def test_tables_have_a_row_for_each_compensation(evaluation_numbers):
    arms = evaluation_numbers.compensations
    _, sections = evaluation_content(replace(evaluation_numbers, compensations={**arms, "simple": arms["none"]}))
    velocity, radial = [b for s in sections for b in s.blocks if isinstance(b, Table)][:2]
    assert [row[0] for row in velocity.rows] == [row[0] for row in radial.rows] == ["none", "simple"]
    assert radial.header[-1] == "at the end [m]" and [row[-1] for row in radial.rows] == ["779", "779"]


def test_many_compensations_are_not_all_spoken(evaluation_numbers):
    arms = dict(evaluation_numbers.compensations)
    arms |= {name: with_velocity(arms["none"], mps) for name, mps in (("simple", 0.2), ("hysteresis", 0.7))}
    first = evaluation_content(replace(evaluation_numbers, compensations=arms))[0].splitlines()[0]
    assert "of 3 compensations “simple” is the best" in first and "with hysteresis compensation it is 0.70 m/s" in first


def test_restarts_are_told_where_there_are_any(evaluation_numbers):
    unknown = np.full((2, 4), np.nan)
    grown = Restarts(
        np.array([1.0, 2.0, 3.0, 4.0]),
        np.array([0.1, 0.4, 0.9, 1.6]),
        np.array([0.2, 0.4, 0.6, 0.8]),
        unknown,
        unknown,
        7,
    )
    _, sections = evaluation_content(replace(evaluation_numbers, restarts={"none": grown}))
    table = next(b for s in sections if s.heading == "Between fixes" for b in s.blocks if isinstance(b, Table))
    assert [row[0] for row in table.rows] == ["1", "2", "4"] and table.rows[-1][1:] == ("1.6", "0.80")


def test_what_is_lost_leads_with_how_far_it_goes_from_a_fix(evaluation_numbers):
    lost = {"none": with_velocity(evaluation_numbers.compensations["none"], 500.0)}
    alone = evaluation_content(replace(evaluation_numbers, compensations=lost))[0].splitlines()[0]
    assert "drifts too fast to be left alone" in alone and "500.00 m/s" in alone
    interval = np.array([[0.5, 30.0], [0.9, 60.0]])
    grown = Restarts(np.array([1.0, 10.0]), np.array([0.7, 44.0]), np.array([0.2, 9.0]), interval, interval, 20)
    answer, sections = evaluation_content(replace(evaluation_numbers, compensations=lost, restarts={"none": grown}))
    first, second = answer.splitlines()[:2]
    assert "off by 44 m (95 % interval 30 to 60 m) after 10 s" in first and "500.00 m/s" not in first
    assert second.startswith("Left alone for longer it is lost: ") and "500.00 m/s" in second
    table = next(b for s in sections if s.heading == "Between fixes" for b in s.blocks if isinstance(b, Table))
    assert "95 % interval" in table.note


def glance(numbers) -> tuple[list[str], list[str], str]:
    """Values and intervals of the three numbers, and the figure, of the first screen."""
    first, _, picture = evaluation_content(numbers)[1][0].blocks
    return [one.value for one in first.items], [one.interval for one in first.items], picture.name


def test_the_first_screen_has_three_numbers_each_with_how_sure_it_is(evaluation_numbers):
    values, intervals, picture = glance(evaluation_numbers)
    assert values == ["0.39 m/s", "0.51 nmi/h", "218.43°"]
    assert intervals == ["one run, no interval", "one run, no interval", "± 0.24° (95 %)"]
    assert picture == "position_error"


def test_between_fixes_leads_where_navigation_was_started_afresh(evaluation_numbers):
    seconds = np.arange(1.0, 31.0)
    band = np.outer([0.9, 1.1], seconds)
    pieces = {"none": Restarts(seconds, seconds, seconds, band, band, 20)}
    values, intervals, picture = glance(replace(evaluation_numbers, restarts=pieces))
    assert values[:2] == ["10.0 m", "30.0 m"]
    assert intervals[:2] == ["95 %: 9.0 to 11.0", "95 %: 27.0 to 33.0"]
    assert picture == "error_growth"


def test_a_white_noise_is_the_largest_only_where_no_other_may_be_larger(evaluation_numbers):
    def channel(axis: str, value: float, high: float, visible: bool):
        white = NoiseTerm(value, (0.1, high), visible, "deg/sqrt(h)")
        return SimpleNamespace(name=f"gyro {axis}", fit=True, terms={"white": white})

    def tile(bound: float):
        channels = (channel("x", 0.0, 0.2, False), channel("y", 0.223, 0.278, True), channel("z", 0.0, bound, False))
        shown = evaluation_glance(replace(evaluation_numbers, compensations={"none": Measures({"horizontal": 900.0})},
                                          grade=SimpleNamespace(channels=channels)))  # fmt: skip
        return shown.blocks[0].items[0]

    assert tile(0.2)[:1] == ("white noise of gyro y, the largest",)
    what, _, sure = tile(0.505)
    assert what == "white noise of gyro y, the largest that is seen"
    assert sure == "95 %: 0.100 to 0.278; gyro z below 0.505"


def found_start(**changed) -> FoundStart:
    three, scales = (0.0, 0.0, 0.0), (1.0, 1.0)
    triads = {
        f"{name}_{kind}{of}": three
        for name, units in (("gyro", ("deg_per_h", "ppm")), ("accelerometer", ("ug", "ppm")))
        for kind, unit in zip(("bias", "scale"), units, strict=True)
        for of in (f"_{unit}", f"_sigma_{unit}")
    }
    begin = FoundStart(
        roll_deg=0.1, pitch_deg=0.2, heading_deg=211.92, heading_sigma_deg=102.67, window_s=(438.0, 558.0),
        roll_pitch_sigma_deg=0.45, heading_known=False, rival_headings_deg=(), velocity_sigma_mps=(0.01, 0.01, 0.01),
        position_sigma_m=three, fix_scale=scales, **triads,
    )  # fmt: skip
    return replace(begin, **changed)


def test_biases_found_at_the_start_are_said_to_be_taken_off_in_every_arm(evaluation_numbers):
    said = "the gyro and accelerometer biases estimated at the start (see Alignment) are taken off throughout."
    assert said not in evaluation_content(evaluation_numbers)[0]
    assert said in evaluation_content(replace(evaluation_numbers, alignment=found_start()))[0].splitlines()[0]


def test_a_heading_that_is_not_known_has_no_digits(evaluation_numbers):
    answer, sections = evaluation_content(replace(evaluation_numbers, alignment=found_start()))
    (alignment,) = [one for one in sections if one.heading == "Alignment"]
    words, _, angles, *_ = alignment.blocks
    assert "heading not known" in words.text and "102.67" not in words.text and "taken as 212°" in answer
    assert angles.rows == [("heading, taken as [°]", "212"), ("roll [°]", "0.100"), ("pitch [°]", "0.200")]
