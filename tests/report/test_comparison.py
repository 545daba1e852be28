"""The words and figures of the comparison at sensor level; the numbers here are made up."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from ins_eval import figures
from ins_eval.figures import style
from ins_eval.report.comparison import comparison_content, units
from ins_eval.report.content import Paragraph, Table
from ins_eval.units import DEG, DEG_PER_H, UG

LARGEST_SVG_BYTES = 150_000
MANY = 3000  # windows


def estimate(value: float, reach: float) -> dict:
    return {"value": value, "standard_error": reach / 2.0, "interval95": [value - reach, value + reach]}


def channel(axis: str, unit: float, mean: float, reach: float) -> dict:
    return {
        "mean_difference": estimate(mean * unit, reach * unit),
        "bias": estimate(mean * unit, reach * unit),
        "scale_error": estimate(-4.4e-4, 2.5e-4),
        "misalignment": {other: estimate(5e-3, 1e-4) for other in "xyz" if other != axis},
        "rms": {
            "as_recorded": 0.05 * unit,
            "without_mean": 0.02 * unit,
            "after_fit": 0.02 * unit,
            "after_fit_found_clock": 0.005 * unit,
        },
        "attenuation": 6e-5,
        "noise_density": 1e-5,
        "neighbour_correlation": -0.4,
        "largest": {"value": -0.01 * unit, "time_s": 39.0},
        "believed_bias": 0.0,
    }


@pytest.fixture
def metrics() -> dict:
    """A drive beside a better navigator whose clock is 15 ms ahead."""
    return {
        "recording": {"name": "drive", "kind": "drive", "rate_hz": 100.0, "duration_s": 100.0, "notes": ["one gap"]},
        "reference": {
            "kind": "ins",
            "attitude": "reference",
            "epoch_spacing_s": 0.1,
            "window_s": 1.0,
            "windows": 98,
            "blocks": 20,
            "scale_limit": 5e-3,
        },
        "clock": {"believed_s": 0.0, "used_s": 0.0, "found_s": 0.0155, "interval95_s": [0.015, 0.016]},
        "gyro": {
            "x": channel("x", DEG, 0.0445, 0.001),
            "y": channel("y", DEG, -0.0596, 0.001),
            "z": channel("z", DEG, 0.0002, 0.001),
        },
        "accelerometer": {axis: channel(axis, 1.0, 0.02, 0.003) for axis in "xyz"},
    }


def said(metrics: dict) -> str:
    answer, sections = comparison_content(metrics)
    blocks = [block.text for section in sections for block in section.blocks if isinstance(block, Paragraph)]
    return "\n".join([answer, *blocks])


def test_first_line_answers_with_direction_uncertainty_and_clock(metrics):
    assert comparison_content(metrics)[0] == (
        "drive: against the reference the gyros read 0.0445 °/s high on x and 0.0596 °/s low on y, no more than "
        "0.0012 °/s off on z, the accelerometers read 0.0200 m/s² high on x, 0.0200 m/s² high on y and 0.0200 m/s² "
        "high on z; the two clocks differ by 15.50 ± 0.50 ms; what remains is 0.020 °/s and 0.020 m/s² RMS over 1 s, "
        "with the clock set right 0.0050 °/s and 0.0050 m/s²."
    )


def test_a_clock_that_is_used_or_agrees_is_not_held_against_the_rest(metrics):
    metrics["clock"]["used_s"] = metrics["clock"]["found_s"]
    assert "set right" not in said(metrics) and "The offset found was used" in said(metrics)
    metrics["clock"] |= {"believed_s": 0.0152, "used_s": 0.0152}
    assert "differ by the believed 15.2 ms" in said(metrics) and "which agrees" in said(metrics)


def test_a_clock_behind_is_earlier(metrics):
    metrics["clock"] |= {"found_s": -0.0155, "interval95_s": [-0.016, -0.015]}
    assert "15.50 ± 0.50 ms earlier than the IMU" in said(metrics)
    assert "set time_offset_s = -0.0155 in [reference]" in said(metrics)


def test_what_is_not_determined_is_said_and_not_printed(metrics):
    for sensor in ("gyro", "accelerometer"):
        for values in metrics[sensor].values():
            values |= {"bias": None, "scale_error": None, "misalignment": {}}
    metrics["gyro"]["x"]["believed_bias"] = 0.04 * DEG
    metrics["gyro"]["x"]["found_minus_believed"] = estimate(0.0045 * DEG, 0.001 * DEG)
    answer, sections = comparison_content(metrics)
    assert "No scale factor of any channel is given: the motion is too small to tell it to 0.5 %" in answer
    tables = {b.title: b for s in sections for b in s.blocks if isinstance(b, Table)}
    assert tables["Gyros"].header == ("axis", "mean difference [°/s]")
    assert tables["Bias"].rows == [("gyro x [°/s]", "0.0400", "0.0045 ± 0.0010")]


def test_a_channel_without_scale_factor_is_named(metrics):
    metrics["gyro"]["y"]["scale_error"] = None
    answer, sections = comparison_content(metrics)
    assert "No scale factor of gyro y is given" in answer
    gyros = next(b for s in sections for b in s.blocks if isinstance(b, Table))
    assert gyros.rows[0][3:] == ("−440 ± 250", "", "5.00 ± 0.10", "5.00 ± 0.10")
    assert gyros.rows[1][3:5] == ("–", "5.00 ± 0.10")


def test_a_standstill_says_what_its_attitude_hides(metrics):
    metrics["reference"] |= {"kind": "standstill", "attitude": "aligned"}
    metrics["clock"] = {"believed_s": 0.0, "used_s": 0.0, "found_s": None, "reason": "nothing moves at a standstill"}
    assert "went into it" in said(metrics) and "nothing moves at a standstill" in said(metrics)
    assert "housing" not in said(metrics) and "clocks differ" not in said(metrics)
    metrics["reference"] |= {"attitude": "given", "level_sigma_deg": 0.003, "heading_sigma_deg": 0.06}
    assert "known to 0.003° (1 σ), so biases of the horizontal accelerometers below 52 µg" in said(metrics)


def test_small_differences_have_small_units(metrics):
    for sensor, size in (("gyro", DEG_PER_H), ("accelerometer", UG)):
        metrics[sensor] = {axis: channel(axis, size, 3.0, 0.5) for axis in "xyz"}
    assert [unit.text for unit in units(metrics).values()] == ["°/h", "µg"]
    assert "3.00 °/h high on x" in said(metrics) and "3.00 µg high on x" in said(metrics)


def test_missing_keys_are_survived(metrics):
    for key in metrics:
        cut = copy.deepcopy(metrics)
        del cut[key]
        assert "None" not in said(cut) and "nan" not in said(cut)
    assert comparison_content({})[0].endswith("nothing of it was compared.")


@pytest.fixture(scope="module")
def drawn() -> dict:
    rng = np.random.default_rng(1)
    time_s = np.arange(1.0, MANY + 1.0)
    time_s[MANY // 2 :] += 100.0  # a gap
    implied = rng.standard_normal((MANY, 6)).cumsum(axis=0) / 20.0
    after = 0.01 * rng.standard_normal((MANY, 6))
    common = {"units": ("°/s", "m/s²"), "window_s": 1.0}
    return {
        "signals": figures.sensor_signals(
            time_s=time_s[:300], recorded=implied[:300] + after[:300], implied=implied[:300], **common
        ),
        "residuals": figures.sensor_residuals(time_s=time_s, before=after + 0.1, after=after, **common),
        "scatter": figures.sensor_scatter(
            implied=implied, difference=after + 0.1, fitted=[(0.1, 0.0)] * 4 + [None] * 2, **common
        ),
    }


def test_figures_have_six_labelled_panels_and_stay_small(drawn):
    for name, figure in drawn.items():
        assert len(figure.axes) == 6 and figure.legends, name
        assert [ax.get_ylabel().split()[0] for ax in figure.axes] == ["gyro", "accelerometer"] * 3
        assert all("[" in ax.get_ylabel() for ax in figure.axes)
        assert len(style.svg(figure).encode()) < LARGEST_SVG_BYTES, name


def test_a_gap_is_left_open_and_an_undetermined_slope_is_not_drawn(drawn):
    for line in drawn["residuals"].axes[0].lines[:2]:
        t, v = line.get_data()
        assert np.isnan(v[(t > MANY // 2) & (t < MANY // 2 + 101)]).any()
    lines = [len(ax.lines) for ax in drawn["scatter"].axes]  # row by row: gyro and accelerometer of each axis
    assert lines == [2, 2, 2, 1, 2, 1]
