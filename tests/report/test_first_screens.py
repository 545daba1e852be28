"""The first screen of pages that set numbers side by side: at most three numbers, a figure that is drawn, a next step.

The numbers here are made up.
"""

from __future__ import annotations

import runpy
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from ins_eval.analysis.predict import Prediction
from ins_eval.analysis.results import Run, RunComparison
from ins_eval.analysis.several import Refused, Row, SeveralEvaluations, Summary
from ins_eval.figures.results.summary import prediction_figures, runs_figures, several_figures
from ins_eval.metrics import DEFINITIONS
from ins_eval.report.calibration import calibration_content
from ins_eval.report.content import GLANCE, Numbers, Paragraph, Picture, Section
from ins_eval.report.prediction import prediction_content
from ins_eval.report.runs import runs_content
from ins_eval.report.several import several_content

calibrated = runpy.run_path(str(Path(__file__).with_name("test_calibration.py")))


def screen(sections: Sequence[Section]) -> tuple[list[tuple[str, str, str]], str, str]:
    """Numbers, name of the picture and next step."""
    (glance,) = (one for one in sections if one.heading == GLANCE)
    numbers = [tuple(n) for one in glance.blocks if isinstance(one, Numbers) for n in one.items]
    (picture,) = (one.name for one in glance.blocks if isinstance(one, Picture))
    (step,) = (one.text for one in glance.blocks if isinstance(one, Paragraph))
    return numbers, picture, step


def labels(figures: Mapping[str, Figure], name: str) -> list[str]:
    (ax,) = figures[name].axes
    return [one.get_text() for one in ax.get_yticklabels()]


def row(name: str, rms: float, arm: str = "none") -> Row:
    return Row(name, arm, "flight", 900.0, rms, rms, rms, None, 100.0 * rms)


def test_few_recordings_show_those_with_the_smallest_errors_and_no_interval():
    recordings = [
        Summary((row(name, rms), row(name, 2 * rms, "simple"))) for name, rms in zip("abcd", (4, 2, 3, 9), strict=True)
    ]
    found = SeveralEvaluations([*recordings, Summary((Refused("e", "so it was"),))])
    numbers, picture, step = screen(several_content(found)[1])
    assert [value for _, value, _ in numbers] == ["2.00 m/s", "3.00 m/s", "4.00 m/s"]
    assert {sure for *_, sure in numbers} == {"one run, no interval"}
    assert "refused" in step and "ins-eval diagnose" in step
    assert labels(several_figures(found), picture) == ["a", "b", "c", "d"]


def test_many_flights_show_their_cep_and_velocity_with_intervals():
    time_s = np.arange(1.0, 3600.0)
    track = np.outer(time_s, [0.3, 0.4])
    each = {"velocity_rms_horizontal": np.array(1.0)}
    each |= {f"cep_rate_{key}": np.asarray(of.per_flight(track, time_s)) for key, of in DEFINITIONS.items()}
    flights = [Summary((row(str(k), 1.0),), {"none": {n: (1 + k / 10) * x for n, x in each.items()}}) for k in range(6)]
    numbers, *_ = screen(several_content(SeveralEvaluations(flights))[1])
    assert [what.split(",")[0] for what, *_ in numbers] == ["CEP rate (final)", "horizontal velocity RMS"]
    assert all(sure.startswith("95 %: ") and " to " in sure for *_, sure in numbers)


def test_runs_show_the_change_of_horizontal_velocity_first_and_one_pair_has_no_interval():
    def run(name: str, factor: float, count: int) -> Run:
        of = {str(k): np.asarray(factor * (1.0 + k)) for k in range(count)}
        return Run(name, {"none": {"final_radial_error": of, "velocity_rms_horizontal": of}})

    for count in (1, 5):
        found = RunComparison((run("old", 1.0, count), run("new", 0.8, count)))
        numbers, picture, step = screen(runs_content(found)[1])
        assert numbers[0][0].startswith("horizontal velocity RMS") and numbers[0][1].startswith("−20")
        assert numbers[0][2] == ("one pair, no interval" if count == 1 else "95 %: −20 to −20 %")
        assert "--fail-if velocity_rms_horizontal+5%" in step
        assert len(labels(runs_figures(found), picture)) == 2


def test_a_prediction_shows_the_share_that_is_left_and_what_it_is_of():
    draws = dict(zip(("own_before", "own_after", "share", "with_switch_on_before", "with_switch_on_after"),
                     np.outer((2.0, 1.0, 0.5, 3.0, 2.5), np.linspace(0.9, 1.1, 1001)), strict=True))  # fmt: skip
    found = Prediction("straight", draws)
    numbers, picture, step = screen(prediction_content(found.tree, "better.toml")[1])
    assert numbers[0] == ("share that is left", "50 %", "95 %: 45 to 55 %")
    assert numbers[1][1:] == ("2.00 m/s", "95 %: 1.81 to 2.19 m/s")
    assert "--belief better.toml" in step
    assert len(labels(prediction_figures(found), picture)) == 4


@pytest.mark.parametrize("axes", [("",), ("x", "y", "z")])
def test_a_calibration_shows_how_far_a_new_reading_is_off(axes):
    found = calibrated["CalibrationNumbers"](
        calibrated["ChosenModel"]("hysteresis", None, "model.toml"), tuple(map(calibrated["unit"], axes))
    )
    numbers, picture, step = screen(calibration_content(found)[1])
    assert [value for _, value, _ in numbers] == (
        ["within 212 µg", "within 107 µg", "112.0 ppm/°C"] if len(axes) == 1 else ["within 212 µg"] * 3
    )
    assert picture == f"{axes[0]}_residual_against_time".lstrip("_")
    assert "--compensation model.toml" in step
    unwritten = replace(found, compensation=replace(found.compensation, file=None))
    assert "--write-model FILE.toml" in screen(calibration_content(unwritten)[1])[2]
