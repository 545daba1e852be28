"""The words and figures of the comparison at sensor level; the numbers here are made up."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from ins_eval import figures
from ins_eval.analysis.compare import Known, RecordingComparison
from ins_eval.channels import CHANNELS, ChannelEstimate, FittedChannel, Windows
from ins_eval.figures import style
from ins_eval.figures.results.comparison import units
from ins_eval.recording import Fixes, Imu, Recording, Start
from ins_eval.recording.belief import AccelerometerBelief, Belief, GyroBelief
from ins_eval.report.comparison import comparison_content
from ins_eval.report.content import Paragraph, Table
from ins_eval.units import DEG, DEG_PER_H, UG

LARGEST_SVG_BYTES = 150_000
MANY = 3000  # windows


def estimate(value: float, reach: float) -> ChannelEstimate:
    return ChannelEstimate(value, reach / 2.0, value - reach, value + reach)


def channel(name: str, unit: float, mean: float, reach: float, **changes) -> FittedChannel:
    own = CHANNELS.index(name) % 3
    made = FittedChannel(
        name=name,
        mean_difference=estimate(mean * unit, reach * unit),
        bias=estimate(mean * unit, reach * unit),
        terms=tuple(estimate(-4.4e-4, 2.5e-4) if k == own else estimate(5e-3, 1e-4) for k in range(3)),
        rms_before=0.05 * unit,
        rms_without_mean=0.02 * unit,
        rms_after=0.02 * unit,
        attenuation=6e-5,
        density=1e-5,
        neighbour_correlation=-0.4,
        largest=-0.01 * unit,
        largest_s=39.0,
        remaining=np.zeros(98),
    )
    return replace(made, **changes)


def triads(gyro: float, force: float, means: tuple[float, ...], reaches: tuple[float, float]) -> tuple:
    sizes = (gyro, gyro, gyro, force, force, force)
    return tuple(channel(n, sizes[k], means[k], reaches[k // 3]) for k, n in enumerate(CHANNELS))


@pytest.fixture
def found() -> RecordingComparison:
    """A drive beside a better navigator whose clock is 15 ms ahead."""
    time_s, epochs_s = np.arange(1, 10001) / 100.0, np.arange(0.0, 100.0, 0.1)
    imu = Imu(time_s, np.zeros((time_s.size, 3)), np.zeros((time_s.size, 3)), "increment")
    still = np.zeros((epochs_s.size, 3))
    fixes = Fixes.of(epochs_s, still, still, np.ones(epochs_s.size, dtype=bool), still)
    none = (0.0, 0.0, 0.0)
    belief = Belief(gyro=GyroBelief(bias_radps=none), accelerometer=AccelerometerBelief(bias_mps2=none))
    start = Start(0.0, 0.0, 0.0, 0.0)
    recording = Recording("drive", "drive", start, imu, reference=fixes, belief=belief, notes=("one gap",))
    windows = Windows(np.arange(1.0, 99.0), 1.0, np.zeros((98, 6)), np.zeros((98, 6)))
    fitted = triads(DEG, 1.0, (0.0445, -0.0596, 0.0002, 0.02, 0.02, 0.02), (0.001, 0.003))
    with_clock = tuple(replace(one, rms_after=0.25 * one.rms_after) for one in fitted)
    clock, known = estimate(0.0155, 0.0005), Known(fixes, "ins", "reference")
    return RecordingComparison(recording, known, windows, windows, fitted, with_clock, clock, 0.0)


def said(found: RecordingComparison) -> str:
    answer, sections = comparison_content(found)
    blocks = [block.text for section in sections for block in section.blocks if isinstance(block, Paragraph)]
    return "\n".join([answer, *blocks])


def tables(found: RecordingComparison) -> dict[str, Table]:
    return {b.title: b for s in comparison_content(found)[1] for b in s.blocks if isinstance(b, Table)}


def test_first_lines_answer_with_direction_uncertainty_and_clock(found):
    first, second = comparison_content(found)[0].splitlines()
    assert first == (
        "drive: against the reference gyro y 0.0596 °/s low and accelerometer x 0.0200 m/s² high differ most, and the "
        "clocks are not those believed."
    )
    assert second == (
        "Against the reference the gyros read 0.0445 °/s high on x and 0.0596 °/s low on y, no more than "
        "0.0012 °/s off on z, the accelerometers read 0.0200 m/s² high on x, 0.0200 m/s² high on y and 0.0200 m/s² "
        "high on z; the two clocks differ by 15.50 ± 0.50 ms; what remains is 0.020 °/s and 0.020 m/s² RMS over 1 s, "
        "with the clock set right 0.0050 °/s and 0.0050 m/s²."
    )


def glance(found: RecordingComparison) -> tuple[list[tuple[str, str]], str]:
    numbers, step, _ = comparison_content(found)[1][0].blocks
    return [(one.value, one.interval) for one in numbers.items], step.text


def test_the_first_screen_has_three_numbers_and_what_to_do_next(found):
    numbers, step = glance(found)
    values = ("−0.0596 °/s", "0.0200 m/s²", "15.50 ms")
    assert numbers == list(zip(values, ("± 0.0010 (95 %)", "± 0.0030 (95 %)", "± 0.50 (95 %)"), strict=True))
    assert step.startswith("Compare again with --use-found-offset") and "time_offset_s = 0.0155" in step
    agrees = replace(found, known=replace(found.known, time_offset_s=0.0152), used_s=0.0152)
    assert glance(agrees)[1].startswith("The believed bias of gyro x, gyro y, accelerometer x")
    fitted = tuple(replace(one, mean_difference=estimate(0.0, 1.0)) for one in found.fitted)
    assert glance(replace(agrees, fitted=fitted))[1].startswith("Nothing here asks for a change")


def test_a_clock_that_is_used_or_agrees_is_not_held_against_the_rest(found):
    used = replace(found, used_s=found.clock.value)
    assert "set right" not in said(used) and "The offset found was used" in said(used)
    agrees = replace(found, known=replace(found.known, time_offset_s=0.0152), used_s=0.0152)
    assert "differ by the believed 15.2 ms" in said(agrees) and "which agrees" in said(agrees)


def test_a_clock_behind_is_earlier(found):
    behind = said(replace(found, clock=estimate(-0.0155, 0.0005)))
    assert "15.50 ± 0.50 ms earlier than the IMU" in behind
    assert "set time_offset_s = -0.0155 in [reference]" in behind


def test_what_is_not_determined_is_said_and_not_printed(found):
    belief = GyroBelief(bias_radps=(0.04 * DEG, 0.0, 0.0))
    recording = replace(found.recording, belief=found.recording.belief.model_copy(update={"gyro": belief}))
    fitted = tuple(replace(one, bias=None, terms=(None, None, None)) for one in found.fitted)
    open_ = replace(found, recording=recording, fitted=fitted)
    answer = comparison_content(open_)[0]
    assert "No scale factor of any channel is given: the motion is too small to determine it to 0.5 %" in answer
    assert tables(open_)["Gyros"].header == ("axis", "mean difference [°/s]")
    assert tables(open_)["Bias"].rows == [("gyro x [°/s]", "0.0400", "0.0045 ± 0.0010")]


def test_a_channel_without_scale_factor_is_named(found):
    terms = found.fitted[1].terms
    fitted = list(found.fitted)
    fitted[1] = replace(fitted[1], terms=(terms[0], None, terms[2]))
    one = replace(found, fitted=tuple(fitted))
    assert "No scale factor of gyro y is given" in comparison_content(one)[0]
    rows = tables(one)["Gyros"].rows
    assert rows[0][3:] == ("−440 ± 250", "", "5.00 ± 0.10", "5.00 ± 0.10")
    assert rows[1][3:5] == ("–", "5.00 ± 0.10")


def test_a_standstill_says_what_its_attitude_hides(found):
    known = replace(found.known, kind="standstill", attitude="aligned", attitude_sigma_rad=(1e-5, 1e-5, 1e-3))
    stands = replace(found, known=known, clock=None, fitted_with_clock=None)
    assert "went into it" in said(stands) and "nothing moves at a standstill" in said(stands)
    assert "housing" not in said(stands) and "clocks differ" not in said(stands)
    sigmas = (0.003 * DEG, 0.003 * DEG, 0.06 * DEG)
    given = replace(stands, known=replace(known, attitude="given", attitude_sigma_rad=sigmas))
    assert "known to 0.003° (1 σ), so biases of the horizontal accelerometers below 52 µg" in said(given)


def test_small_differences_have_small_units(found):
    small = replace(found, fitted=triads(DEG_PER_H, UG, (3.0,) * 6, (0.5, 0.5)))
    assert [unit.text for unit in units(small).values()] == ["°/h", "µg"]
    assert "3.00 °/h high on x" in said(small) and "3.00 µg high on x" in said(small)


def test_the_tree_holds_what_the_page_says_and_nothing_that_json_lacks(found):
    fitted = tuple(replace(one, density=float("nan"), attenuation=float("inf")) for one in found.fitted)
    unknown = replace(found, fitted=fitted)
    tree = json.loads(json.dumps(unknown.tree, allow_nan=False))
    assert tree["gyro"]["x"]["mean_difference"]["value"] == found.channels["gyro"][0].fitted.mean_difference.value
    assert tree["accelerometer"]["z"]["misalignment"].keys() == {"x", "y"}
    assert tree["gyro"]["x"]["noise_density"] is None and tree["gyro"]["x"]["attenuation"] is None
    assert "None" not in said(unknown) and "nan" not in said(unknown) and "inf" not in said(unknown)


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
