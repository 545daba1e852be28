"""The words and figures of a calibration; the numbers here are made up."""

from __future__ import annotations

import re
from dataclasses import is_dataclass, replace

import numpy as np
import pytest

from ins_eval.analysis.calibration_numbers import (
    AccelerometerNumbers,
    BiasFit,
    CalibrationNumbers,
    ChamberFacts,
    ChosenModel,
    Determined,
    FittedModel,
    NewReading,
    NotDetermined,
    ScaleFit,
)
from ins_eval.calibration import Coefficient
from ins_eval.calibration.labelings import Printed
from ins_eval.figures import calibration as figures
from ins_eval.figures import style
from ins_eval.report.calibration import calibration_content, with_half_width
from ins_eval.report.content import Paragraph, Picture, Table

LARGEST_SVG_BYTES = 150_000
LOOP_PPM, LOOP_UG = 120.0, 40.0  # falling above, rising below the line
ROUND_OFF_PPM = 1e-6


def term(name: str, value: float, half: float, unit: str = "ug") -> Coefficient:
    return Coefficient(name, unit, value, (value - half, value + half))


def model(rms_ppm: float, sensitivity: float, alpha_half: float = 100.0) -> FittedModel:
    alpha = term("alpha", 273.0, alpha_half, "pulse/(g s)/(degC/min)^2")
    branches = term("falling at -40.0 degC", 2473.4, 17.0), term("rising at -40.0 degC", 2531.0, 48.0)
    return FittedModel(
        ScaleFit((alpha, term("gamma", 320320.0, 47.0, "pulse/(g s)")), rms_ppm, sensitivity),
        BiasFit(branches, 30.0),
        (),
        {"+1": 207.0, "+0": 107.0, "-1": 212.0},
    )


def unit(axis: str = "") -> AccelerometerNumbers:
    within = {"+1": (-142.0, 122.0), "+0": (-105.0, 105.0), "-1": (-83.0, 182.0)}
    return AccelerometerNumbers(
        name=f"unit {axis}".strip(),
        axis=axis,
        recording=ChamberFacts("c", 20660, 16, (0.3, 0.5, 0.7, 0.9), (-51.5, 77.5), ()),
        determined=Determined(6, 6, 6, 7.3, "", True, ("falling", "rising"), (0.16, 0.2, 0.22, 0.24), 0.26),
        sensitivity_ppm_per_c=112.0,
        models={"simple": model(468.0, 13.3), "quadratic": model(234.0, 4.7), "hysteresis": model(67.0, 2.9)},
        new_run=(NewReading(-40.0, "falling", -0.2, within),),
        printed={
            angles: Printed(sign * 160160.0, -0.4997, k1, 3e-4)
            for angles, sign, k1 in (("Fig. 4", -1.0, 0.0), ("turned", 1.0, 320320.0))
        },
    )


def changed(numbers: CalibrationNumbers, **of_unit) -> CalibrationNumbers:
    """The numbers with other fields of the one accelerometer; those of a table within it as a dict."""
    (one,) = numbers.accelerometers
    fields = {k: replace(getattr(one, k), **v) if is_dataclass(getattr(one, k)) else v for k, v in of_unit.items()}
    return replace(numbers, accelerometers=(replace(one, **fields),))


@pytest.fixture
def numbers() -> CalibrationNumbers:
    return CalibrationNumbers(ChosenModel("hysteresis", None, "it.toml"), (unit(),))


def said(numbers: CalibrationNumbers) -> str:
    answer, sections = calibration_content(numbers)
    blocks = [block.text for section in sections for block in section.blocks if isinstance(block, Paragraph)]
    return "\n".join([answer, *blocks])


def rows(numbers: CalibrationNumbers, heading: str) -> list[tuple[str, ...]]:
    """All rows of the tables of one section."""
    (section,) = [s for s in calibration_content(numbers)[1] if s.heading == heading]
    return [tuple(row) for block in section.blocks if isinstance(block, Table) for row in block.rows]


def test_the_answer_has_the_sensitivities_the_new_run_and_the_file(numbers):
    answer = calibration_content(numbers)[0]
    assert "112.0 ppm/°C with temperature, 13.3 after simple compensation, 2.9 after hysteresis" in answer
    assert "no more than 107 µg at 0 g and 212 µg at ±1 g" in answer
    assert "it.toml holds the hysteresis compensation" in answer


def test_coefficients_stand_with_their_half_widths(numbers):
    assert ("hysteresis", "α", "273", "100", "pulse/(g s)/(degC/min)^2") in rows(numbers, "Scale factor")
    assert ("−40.0 degC", "2473", "17", "2531", "48") in rows(numbers, "Bias")
    assert rows(numbers, "A reading in a new run") == [("−40", "falling", "−142 to 122", "−105 to 105", "−83 to 182")]


@pytest.mark.parametrize(
    ("value", "half", "expected"),
    [
        (320308.81, 48.84, ("320309", "49")),
        (0.10319, 0.00693, ("0.1032", "0.0069")),
        (-355.0, 1234.0, ("−355", "1234")),
        (33.28448, None, ("33.284", "–")),
        (0.0, None, ("0", "–")),
        (5.0, 0.0, ("5.0000", "0.0000")),
    ],
)
def test_half_widths_have_two_digits_that_count(value, half, expected):
    interval = None if half is None else [value - half, value + half]
    assert with_half_width(Coefficient("", "", value, interval)) == expected


def test_both_labelings_are_told(numbers):
    turned, drawn = rows(numbers, "Four positions, by specific force")[::-1]
    assert drawn[1:] == ("−160160 = −K1/2", "−0.49970 = K0 − 1/2", "0 = 0", "0.00030 = K0")
    assert turned[1:] == ("160160 = K1/2", "−0.49970 = K0 − 1/2", "320320 = K1", "0.00030 = K0")


def test_a_model_left_open_gives_its_reason_and_another_is_taken(numbers):
    open_ = {**numbers.accelerometers[0].models, "hysteresis": NotDetermined("calibration: nothing to see")}
    numbers = changed(numbers, models=open_, determined={"hysteresis": False})
    numbers = replace(numbers, compensation=ChosenModel("quadratic", None, "it.toml"))
    text = said(numbers)
    assert "do not determine the hysteresis compensation; the best that they determine is quadratic" in text
    assert "nevertheless" not in text
    assert "Hysteresis: calibration: nothing to see." in text
    assert [row[0] for row in rows(numbers, "What each model leaves")] == ["simple", "quadratic"]


ADVICE = {
    "one rate": (
        {"recording": {"ramps_c_per_min": (0.4,)}},
        r"One rate \(0.4 °C/min\) cannot separate alpha from gamma, .* 0.2 or 0.8 °C/min\.",
    ),
    "one direction": ({"determined": {"directions": ("rising",)}}, "only rising, .* while it falls: .* the way back"),
    "two rates": ({"recording": {"ramps_c_per_min": (0.3, 0.9)}}, "Only 2 rates show how runs differ"),
}


@pytest.mark.parametrize("case", ADVICE)
def test_what_is_lacking_comes_with_the_run_that_would_tell(numbers, case):
    of_unit, expected = ADVICE[case]
    assert not re.search(expected, said(numbers), re.S)
    assert re.search(expected, said(changed(numbers, **of_unit)), re.S)


def test_dwells_are_blamed_only_where_alpha_is_open_and_the_rates_lie_together(numbers):
    assert "α cannot be told from 0" not in said(numbers)
    wide = changed(numbers, models={"hysteresis": model(67.0, 2.9, alpha_half=800.0)})
    assert "the mean rates are 0.16 to 0.24 °C/min, close together, though 0.3 to 0.9 were commanded" in said(wide)
    apart = changed(wide, determined={"mean_rates_c_per_min": (0.3, 0.5, 0.7, 0.9)})
    assert "A faster one would show which" in said(apart)


def test_a_remark_of_some_models_names_them(numbers):
    of_all = ("calibration: of all",)
    models = {name: replace(one, remarks=of_all) for name, one in numbers.accelerometers[0].models.items()}
    models["simple"] = replace(models["simple"], remarks=(*of_all, "calibration: of one"))
    text = said(changed(numbers, models=models))
    assert "Of all." in text and "Simple: of one." in text


def test_three_accelerometers_have_sections_of_their_own(numbers):
    numbers = replace(numbers, accelerometers=tuple(unit(axis) for axis in "xyz"))
    answer, sections = calibration_content(numbers)
    assert answer.count("the scale factor moves by") == 3
    anchors = [section.anchor for section in sections]
    assert len(set(anchors)) == len(anchors)
    pictures = [block.name for section in sections[1:] for block in section.blocks if isinstance(block, Picture)]
    assert len(set(pictures)) == len(pictures) == 15
    assert {name[0] for name in pictures} == set("xyz")


def test_what_no_run_tells_is_left_out(numbers):
    """One ramp gives neither intervals nor a new run."""
    bare = replace(model(67.0, 2.9), new_run_ug=None)
    bare = replace(bare, scale=replace(bare.scale, sensitivity_ppm_per_c=None))
    alone = changed(numbers, models={"hysteresis": bare}, new_run=(), sensitivity_ppm_per_c=None, printed={})
    answer, sections = calibration_content(changed(alone, determined={"condition": None}))
    text = answer + str(sections)
    assert "None" not in text and "condition number" not in text and "new run are off" not in answer
    assert "A reading in a new run" not in [section.heading for section in sections]


# ------------------------------------------------------------------------------------------------ figures


@pytest.fixture
def points() -> dict[str, np.ndarray]:
    """Two ramps, down and up, with a scale factor and a bias whose branches lie apart by a known loop."""
    parts = []
    for ramp in (0.3, 0.9):
        temperature = np.concatenate([np.linspace(70.0, -50.0, 1200), np.linspace(-50.0, 70.0, 1200)])
        rate = ramp * np.repeat([-1.0, 1.0], 1200)
        line = 320000.0 - 33.0 * temperature
        side = -np.sign(rate)
        parts.append(
            {
                "temperature_c": temperature,
                "rate_c_per_min": rate,
                "ramp_c_per_min": np.full(2400, ramp),
                "elapsed_s": 600.0 + 60.0 * np.arange(2400),
                "line": line,
                "scale": line + 1e-6 * LOOP_PPM * 320000.0 * side,
                "bias_ug": 40.0 * temperature + LOOP_UG * side,
                "bias_line": 40.0 * temperature,
            }
        )
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def fitted(points, quantity, line) -> dict[str, np.ndarray]:
    return {"none": np.full(4800, points[quantity].mean()), "simple": points[line], "hysteresis": points[quantity]}


def drawn(points) -> dict:
    scale, bias = fitted(points, "scale", "line"), fitted(points, "bias_ug", "bias_line")
    left_ppm = {name: 1e6 * (points["scale"] / curve - 1.0) for name, curve in scale.items()}
    left_ug = {name: points["bias_ug"] - curve for name, curve in bias.items()}
    return {
        "scale": figures.scale_against_temperature(points=points, fitted=scale),
        "bias": figures.bias_against_temperature(points=points, fitted=bias),
        "residual": figures.residual_against_temperature(points=points, residual=left_ppm, quantity=figures.SCALE),
        "time": figures.residual_against_time(points=points, scale_ppm=left_ppm, bias_ug=left_ug),
    }


def lines(ax, text: str) -> list:
    return [line for line in ax.get_lines() if line.get_label() == text]


def test_a_loop_stands_on_both_sides_of_the_line(points):
    """320000 pulse/(g s) and its loop: in ppm of the mean K1, falling above and rising below, once for each ramp."""
    detail = drawn(points)["scale"].axes[1]
    expected_ppm = LOOP_PPM * 320000.0 / points["scale"].mean()
    for branch, side in (("falling", 1.0), ("rising", -1.0)):
        for text in (branch, f"hysteresis, {branch}"):
            found = lines(detail, text)
            assert len(found) == 2
            for line in found:
                np.testing.assert_allclose(line.get_ydata(), side * expected_ppm, atol=ROUND_OFF_PPM)


def test_bias_has_its_loop_in_micro_g(points):
    detail = drawn(points)["bias"].axes[1]
    for line in lines(detail, "rising"):
        np.testing.assert_allclose(line.get_ydata(), -LOOP_UG, atol=1e-6)


def test_each_model_has_a_panel_and_both_branches(points):
    panels = [ax for ax in drawn(points)["residual"].axes if ax.get_visible()]
    assert [ax.get_title() for ax in panels] == ["none", "simple", "hysteresis"]
    for ax in panels:
        assert len(lines(ax, "falling")) == len(lines(ax, "rising")) == 2


def test_ramps_follow_each_other_in_time(points):
    """Twice 2400 readings a minute: 80 h, the second ramp from 40 h on."""
    above, below = drawn(points)["time"].axes
    assert below.get_xlim()[1] == pytest.approx(80.0, abs=0.02)
    starts = [line.get_xdata()[0] for line in above.get_lines() if line.is_dashed()]
    assert starts == [pytest.approx(40.0)]


def test_noise_about_a_turning_point_makes_no_stretch(points):
    noisy = points | {"rate_c_per_min": points["rate_c_per_min"].copy()}
    noisy["rate_c_per_min"][1190:1210:2] *= -1.0
    assert len(lines(figures.scale_against_temperature(points=noisy, fitted={}).axes[0], "falling")) == 2


@pytest.mark.parametrize("name", ["scale", "bias", "residual", "time"])
def test_figures_are_labelled_small_and_the_same_each_time(points, name):
    figure = drawn(points)[name]
    for ax in figure.axes:
        assert not ax.get_visible() or ax.get_ylabel()
    drawing = style.svg(figure)
    assert len(drawing) < LARGEST_SVG_BYTES
    assert style.svg(drawn(points)[name]) == drawing
