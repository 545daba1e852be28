"""The grade of a real MEMS unit that warms up, parked on ice: ../shared/recordings/mems_static_warmup."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

from ins_eval import datasheets
from ins_eval.allan import allan_deviation
from ins_eval.believed import believed
from ins_eval.figures.results.grade import FIGURE, grade_figures
from ins_eval.grade import Grade, measure_grade
from ins_eval.recording import Imu, Recording, Start
from ins_eval.recording.validation import validate
from ins_eval.report.grade import grade_section

FOLDER = Path(__file__).resolve().parents[2] / "shared" / "recordings" / "mems_static_warmup"
DEG, DEG_PER_H = np.pi / 180.0, np.pi / 180.0 / 3600.0
AT_REST_S = (44.0, 899.0)  # of the logger's clock, by the note of the recording
# by the same note, measured independently: offsets, and what 20 s means differ by from one to the next
OFFSETS_DEG_PER_S = np.array([0.20, -0.03, 0.38])
ROUNDED_DEG_PER_S = 0.005
MEANS_20_S_DEG_PER_H = np.array([4.7, 7.0, 7.7])
NORM_TREND_UG = 1507.0  # standard deviation of the norm over the warming
INTERVAL = 1.96
LIKE = 1.5  # a factor


@pytest.fixture(scope="module")
def warming() -> Recording:
    """Samples as they were logged, at their own times; a rate holds over its sample."""
    if not FOLDER.is_dir():
        pytest.skip("the real recording ../shared/recordings/mems_static_warmup is absent here")
    with gzip.open(FOLDER / "F00379_B.gz", "rt") as file:
        lines = file.read().splitlines()[1:]
    with gzip.open(FOLDER / "F00379_Bt.gz", "rt") as file:
        stamps_s = np.array(file.read().split(), dtype=float) / 1e3
    whole = [k for k, line in enumerate(lines) if line.count(",") > 10]
    samples = np.array([[float(value) for value in lines[k].split(",")[:10]] for k in whole])
    inside = (stamps_s[whole] >= AT_REST_S[0]) & (stamps_s[whole] <= AT_REST_S[1])
    time_s, samples = stamps_s[whole][inside], samples[inside]
    interval_s = np.diff(time_s, prepend=time_s[0] - 0.1)[:, None]
    return Recording(
        name="warming up",
        kind="static",
        start=Start(time_s[0] - 0.1, 78.22 * DEG, 15.65 * DEG, 0.0),
        imu=Imu(time_s, samples[:, 6:9] * interval_s, samples[:, 3:6] * interval_s, "increment", samples[:, 9]),
    )


@pytest.fixture(scope="module")
def grade(warming: Recording) -> Grade:
    return measure_grade(warming, warming.imu.accelerometer)


def test_offsets_are_the_documented_ones_within_their_interval(grade: Grade) -> None:
    off = np.abs(grade.gyro_offset / DEG - OFFSETS_DEG_PER_S)
    assert (off < INTERVAL * grade.gyro_offset_sigma / DEG + ROUNDED_DEG_PER_S).all()
    assert (INTERVAL * grade.gyro_offset_sigma / DEG < 0.05).all()  # not so wide that anything would be within


def test_the_deviation_of_means_is_the_documented_one(grade: Grade) -> None:
    for channel, documented in zip(grade.channels[:3], MEANS_20_S_DEG_PER_H, strict=True):
        at = np.argmin(np.abs(channel.allan.tau_s - 20.0))
        assert documented / LIKE < channel.allan.deviation[at] / DEG_PER_H < documented * LIKE


def test_white_noise_is_near_the_data_sheet_of_that_unit(grade: Grade) -> None:
    """The unit is a VN-100."""
    sheet = datasheets.unit("vn-100")
    assert grade.white["angle_random_walk_deg_per_sqrt_h"] == pytest.approx(
        sheet.gyro.angle_random_walk_deg_per_sqrt_h, rel=0.4
    )
    assert grade.white["velocity_random_walk_ug_per_sqrt_hz"] == pytest.approx(
        sheet.accelerometer.velocity_random_walk_ug_per_sqrt_hz, rel=0.4
    )
    assert "MEMS" in grade.grade


def test_several_rests_and_the_range_of_temperature_are_said(grade: Grade) -> None:
    assert len(grade.rests) > 1 and 300.0 < grade.rest_s < AT_REST_S[1] - AT_REST_S[0]
    low, high = grade.temperature_c
    assert 9.0 < low < 10.5 and 14.5 < high < 16.0
    words = str(grade_section(grade).blocks)
    assert "Thermometer" in words and "218 s from 403 s" in words


def test_the_norm_wanders_with_temperature_as_documented(grade: Grade) -> None:
    assert NORM_TREND_UG / 2.0 < grade.force_offset_sigma / 9.80665e-6 < NORM_TREND_UG * LIKE


def test_the_figure_holds_six_channels_and_what_was_measured(grade: Grade, warming: Recording) -> None:
    figure = grade_figures(grade)[FIGURE]
    panels = [ax for ax in figure.axes if ax.get_visible()]
    assert [ax.get_ylabel().split("\n")[0] for ax in panels[::2]] == ["gyro x", "gyro y", "gyro z"]
    points = next(line for line in panels[0].lines if line.get_label() == "measured")
    rate = warming.imu.gyro[:, 0] / warming.interval_s
    edges = np.searchsorted(warming.imu.time_s, [[r.start_s + 1e-6, r.end_s + 1e-6] for r in grade.rests])
    seen = allan_deviation([rate[a:b] for a, b in edges], 0.1)
    np.testing.assert_allclose(points.get_ydata()[0], seen.deviation[0] / DEG_PER_H, rtol=0.02)


@pytest.mark.parametrize("step_s", [12.0, 20.0, 1000.0])
def test_samples_slower_than_any_noise_bound_give_none(step_s: float) -> None:
    """As of milliseconds that were taken for seconds."""
    rng, n = np.random.default_rng(2), 60
    columns = 1e-3 * step_s * rng.standard_normal((n, 3))
    imu = Imu(step_s * np.arange(1, n + 1), columns, columns - np.array([0.0, 0.0, 9.8 * step_s]), "increment")
    slow = Recording("slow", "drive", Start(0.0, 0.7, 0.2, 0.0), imu)
    assert measure_grade(slow, imu.accelerometer).bounds == {}


def test_it_is_believed_and_not_refused(warming: Recording) -> None:
    """A hundred times Earth rate, of which nobody stated anything."""
    time_s = np.arange(AT_REST_S[0] + 0.1, AT_REST_S[1] - 0.1, 0.1)  # evenly, over the samples that are missing
    columns = np.concatenate([warming.imu.gyro, warming.imu.accelerometer], axis=1) / warming.interval_s[:, None]
    gyro, force = np.split(np.stack([np.interp(time_s, warming.imu.time_s, c) for c in columns.T], axis=1), 2, axis=1)
    start = Start(time_s[0] - 0.1, 78.22 * DEG, 15.65 * DEG, 0.0)
    part = Recording("part", "static", start, Imu(time_s, 0.1 * gyro, 0.1 * force, "increment"))
    filled = believed(validate(part))
    off = np.abs(np.array(filled.belief.gyro.bias_radps) / DEG - OFFSETS_DEG_PER_S)
    assert (off < 0.02).all()
