"""What an INS put out itself: its figures beside closed forms, the mechanization, a real flight and an ensemble."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.io import netcdf_file

from ins_eval.analysis.correlated import Series, mean, regress
from ins_eval.analysis.schuler import fit_schuler, responses
from ins_eval.analysis.several import SeveralEvaluations, summary
from ins_eval.analysis.solution import NODES, evaluate_solution
from ins_eval.cli import main
from ins_eval.ensemble import STATISTICS, Plan, World, contributions, stacked
from ins_eval.ensemble.world import beginning
from ins_eval.error_model.geometry import States
from ins_eval.navigation import compensate, evaluate, samples
from ins_eval.recording import Fixes, Recording, Start, form
from ins_eval.recording.belief import Belief, GpsBelief
from ins_eval.strapdown import Solution, navigate
from ins_eval.units import ARCSEC, DEG, DEG_PER_H, UG

EARTH_RATE, RADIUS_M, GRAVITY = 7.292115e-5, 6335439.0, 9.7803  # at the equator: meridian, WGS-84
SCHULER_RADPS = np.sqrt(GRAVITY / RADIUS_M)
CLOSED_FORM = 0.03  # of a curve: Schuler's equations without the 24 h terms, the meridian's radius for both
LINEAR = 0.01  # of a curve: linear error equations beside the mechanization
COVERED = (0.90, 0.985)  # share of 95 % intervals that hold, over 200 and 300 draws
SAME_CEP = 1e-6  # relative: the same flights, through degrees on disk


# ------------------------------------------------------------------------------------------------ statistics


def first_order(rng: np.random.Generator, n: int, rho: float) -> np.ndarray:
    x = np.empty(n)
    x[0] = rng.standard_normal()
    for k in range(1, n):
        x[k] = rho * x[k - 1] + np.sqrt(1.0 - rho**2) * rng.standard_normal()
    return x


@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_intervals_of_a_mean_hold_as_often_as_they_say(rho):
    rng = np.random.default_rng(1)
    found = [mean(first_order(rng, 600, rho)) for _ in range(300)]
    assert COVERED[0] < np.mean([one.low <= 0.0 <= one.high for one in found]) < COVERED[1]


def test_an_interval_that_ignores_correlation_would_not():
    rng = np.random.default_rng(1)
    series = [first_order(rng, 600, 0.9) for _ in range(300)]
    naive = [1.96 * x.std() / np.sqrt(x.size) for x in series]
    assert np.mean([abs(x.mean()) < half for x, half in zip(series, naive, strict=True)]) < 0.6


def test_intervals_of_a_regression_hold_in_correlated_noise():
    rng, held = np.random.default_rng(2), []
    time_s = np.arange(400.0)
    design = np.column_stack([np.sin(time_s / 20.0), np.ones(400)])
    for _ in range(200):
        series = [Series(time_s, design, design @ [2.0, -1.0] + first_order(rng, 400, 0.8)) for _ in range(2)]
        estimate = regress(series).estimate(0)
        held.append(estimate.low <= 2.0 <= estimate.high)
    assert COVERED[0] < np.mean(held) < COVERED[1]


def test_a_series_of_one_wave_has_no_interval():
    assert np.isnan(mean(np.cos(np.linspace(0.0, 1.0, 300))).low)


# ------------------------------------------------------------------------------------------------ Schuler


def at_rest(latitude_rad: float, hours: float) -> States:
    time_s = np.arange(0.0, 3600.0 * hours + 0.5 * NODES, NODES)
    nothing, still = np.zeros(time_s.size), np.zeros((time_s.size, 3))
    axes = np.broadcast_to(np.eye(3), (time_s.size, 3, 3))
    return States(time_s, nothing + latitude_rad, nothing, nothing, still, still, axes)


def test_curves_at_the_equator_are_those_of_schuler():
    path = at_rest(0.0, hours=1.0)
    found, t, w = responses(path, in_body=False), path.time_s, SCHULER_RADPS
    for name, expected in {
        "velocity_north": np.cos(w * t),
        "tilt_east": RADIUS_M * w * np.sin(w * t),
        "accelerometer_north": np.sin(w * t) / w,
        "gyro_east": -RADIUS_M * (1.0 - np.cos(w * t)),
    }.items():
        assert np.abs(found[name][:, 0] - expected).max() < CLOSED_FORM * np.abs(expected).max(), name


ERRORS = {
    "velocity_east": (0.1, 0.1), "tilt_north": (20.0 * ARCSEC, 20.0), "heading": (300.0 * ARCSEC, 300.0),
    "accelerometer_north": (50.0 * UG, 50.0), "gyro_north": (0.01 * DEG_PER_H, 0.01),
    "gyro_down": (0.02 * DEG_PER_H, 0.02),
}  # fmt: skip


def drifting(name: str, value: float, latitude_rad: float, hours: float) -> Solution:
    """What the mechanization makes of a parked unit, level and heading north, with one error."""
    n, dt, gravity = round(3600.0 * hours), 1.0, 9.780325335 * (1.0 + 0.00193185265 * np.sin(latitude_rad) ** 2)
    gravity /= np.sqrt(1.0 - 0.00669437999 * np.sin(latitude_rad) ** 2)  # Somigliana, WGS-84
    rate = EARTH_RATE * np.array([np.cos(latitude_rad), 0.0, -np.sin(latitude_rad)])
    force = np.array([0.0, 0.0, -gravity])
    kind, _, axis = name.partition("_")
    along = {"north": 0, "east": 1, "down": 2}.get(axis, 2) == np.arange(3)
    rate = rate + value * along * (kind == "gyro")
    force = force + value * along * (kind == "accelerometer")
    attitude = -value * along * (kind in ("tilt", "heading"))  # C_ins = (I - phi x) C, small, from level and north
    start = Start(
        0.0, latitude_rad, 0.0, 0.0, tuple(value * along * (kind == "velocity")), tuple(attitude), (0.0, 0.0, 0.0)
    )
    return navigate(dt * np.arange(1, n + 1), np.tile(rate * dt, (n, 1)), np.tile(force * dt, (n, 1)), start)


@pytest.mark.parametrize("name", ERRORS)
def test_curves_at_latitude_45_are_those_of_the_mechanization(name):
    value, latitude = ERRORS[name][0], 45.0 * DEG
    solution, path = drifting(name, value, latitude, hours=3.0), at_rest(latitude, hours=2.9)
    without = drifting("none", 0.0, latitude, hours=3.0)
    moved = (solution.velocity_n - without.velocity_n)[:, :2]
    found = value * responses(path, in_body=False)[name]
    for axis in range(2):
        expected = np.interp(path.time_s, solution.time_s, moved[:, axis])
        assert np.abs(found[:, axis] - expected).max() < LINEAR * np.abs(moved).max()


def test_the_fit_finds_what_was_put_in_and_says_what_it_cannot_tell():
    rng, latitude = np.random.default_rng(3), 45.0 * DEG
    put_in = {"velocity_east": (0.2, 0.2), "tilt_north": (10.0 * ARCSEC, 10.0), "gyro_east": (0.02 * DEG_PER_H, 0.02)}
    path = at_rest(latitude, hours=3.0)
    curves = responses(path, in_body=False)
    error = sum(value * curves[name] for name, (value, _) in put_in.items())
    fit = fit_schuler(path.time_s, error + 0.02 * rng.standard_normal(error.shape), path, in_body=False)
    told_together = {name for group in (*fit.alike, *fit.inseparable) for name in group}
    assert {"tilt_north", "accelerometer_east"} <= told_together and {"heading", "gyro_east"} <= told_together
    assert "velocity_east" not in told_together
    found = fit.estimates["velocity_east"]
    assert found.low < 0.2 < found.high < 0.22
    assert np.abs(fit.curve - fit.seen).std() < 0.02  # what was put in is explained, but for its noise


def test_a_short_span_tells_only_combinations():
    path = at_rest(45.0 * DEG, hours=0.1)
    rng = np.random.default_rng(4)
    fit = fit_schuler(path.time_s, 0.05 * rng.standard_normal((path.time_s.size, 2)), path, in_body=False)
    long = at_rest(45.0 * DEG, hours=12.0)
    told = fit_schuler(long.time_s, 0.05 * rng.standard_normal((long.time_s.size, 2)), long, in_body=False)
    unknown = [sum(len(group) for group in (*one.alike, *one.inseparable)) for one in (fit, told)]
    assert unknown[0] > unknown[1]


# ------------------------------------------------------------------------------------------------ recordings


def turning(rng: np.random.Generator, offset_s: float, seconds: int = 600) -> Recording:
    """A drive in slow bends: the INS is off by a constant, and GPS stamps are late by `offset_s`."""
    time_s = np.arange(float(seconds))

    def velocity(t: np.ndarray) -> np.ndarray:
        course = 0.8 * np.sin(t / 30.0)
        return 20.0 * np.column_stack([np.cos(course), np.sin(course), np.zeros(t.size)])

    nothing, valid = np.full(time_s.size, np.nan), np.ones(time_s.size, dtype=bool)
    solution = Fixes(time_s, nothing, nothing, nothing, velocity(time_s) + np.array([0.1, -0.2, 0.0]), valid)
    noise = 0.05 * rng.standard_normal((time_s.size, 3))
    gps = Fixes(time_s, nothing, nothing, nothing, velocity(time_s - offset_s) + noise, valid)
    return Recording("bends", "drive", Start(0.0, np.nan, np.nan, 0.0), None, gps=gps, solution=solution)


def test_the_clock_offset_is_found_with_its_interval():
    rng, held = np.random.default_rng(5), []
    for _ in range(60):
        found = evaluate_solution(turning(rng, offset_s=0.3)).clock.estimate(0)
        held.append(found.low <= 0.3 <= found.high)
        assert abs(found.value - 0.3) < 0.05
    assert np.mean(held) > 0.85


def test_a_believed_offset_is_taken_out_and_found_again():
    recording = turning(np.random.default_rng(6), offset_s=0.3)
    believed = replace(recording, belief=Belief(gps=GpsBelief(time_offset_s=0.3)))
    as_it_is, right = (evaluate_solution(one).tree["solution"] for one in (recording, believed))
    assert right["velocity_rms_mps"]["horizontal"]["value"] < as_it_is["velocity_rms_mps"]["horizontal"]["value"]
    assert right["clock"]["found_s"] == pytest.approx(as_it_is["clock"]["found_s"], abs=1e-3)
    assert right["velocity_mean_mps"]["north"]["value"] == pytest.approx(0.1, abs=0.01)
    assert right["velocity_mean_mps"]["east"]["value"] == pytest.approx(-0.2, abs=0.01)


def test_straight_and_level_tells_no_clock():
    recording = turning(np.random.default_rng(7), offset_s=0.3)
    straight = np.tile([20.0, 0.0, 0.0], (recording.gps.time_s.size, 1))
    noise = 0.05 * np.random.default_rng(8).standard_normal(straight.shape)
    steady = replace(
        recording,
        gps=replace(recording.gps, velocity_n=straight + noise),
        solution=replace(recording.solution, velocity_n=straight + 1e-3 * noise[::-1]),
    )
    assert evaluate_solution(steady).tree["solution"]["clock"]["found_s"] is None


IRS = Path("shared", "recordings", "irs_solution_flight", "RAFdata.nc")


@pytest.fixture(scope="module")
def irs() -> Recording:
    """Five minutes of a research aircraft: the inertial velocity and attitude beside GPS."""
    path = Path(__file__).resolve().parents[2] / IRS
    if not path.exists():
        pytest.skip(f"the real recording ../{IRS} is absent here")
    with netcdf_file(path, "r", mmap=False) as file:
        of = {name: np.array(variable.data, dtype=float) for name, variable in file.variables.items()}
    time_s, nothing = of["Time"] - of["Time"][0], np.full(of["Time"].size, np.nan)
    valid = np.ones(time_s.size, dtype=bool)
    attitude = np.column_stack([of["ROLL"], of["PITCH"], of["THDG"]]) * DEG
    down = np.column_stack([of["GGVNS"], of["GGVEW"], -of["GGVSPD"]])
    gps = Fixes(time_s, of["LATC"] * DEG, of["LONC"] * DEG, of["GGALT"], down, valid)
    solution = Fixes(
        time_s, nothing, nothing, nothing, np.column_stack([of["VNS"], of["VEW"], nothing]), valid, attitude
    )
    return Recording("irs", "flight", Start(0.0, np.nan, np.nan, 0.0), None, gps=gps, solution=solution)


def test_a_real_flight_gives_what_its_documentation_says(irs, tmp_path):
    folder = form.write(irs, tmp_path / "irs")
    assert main(["evaluate", str(folder), "--output", str(tmp_path / "page"), "--quiet"]) == 0
    tree = json.loads((tmp_path / "page" / "metrics.json").read_text())["solution"]
    means = tree["velocity_mean_mps"]
    assert round(means["east"]["value"], 3) == -0.052 and round(means["north"]["value"], 3) == -0.059
    low, high = tree["clock"]["interval95_s"]
    assert 0.0 < low < tree["clock"]["found_s"] < high < 0.1
    assert "radial_error_rate_nmi_per_h" not in tree
    text = (tmp_path / "page" / "report.txt").read_text()
    assert "6 % of a Schuler period" in text and "no CEP" in text


# ------------------------------------------------------------------------------------------------ an ensemble


def flown(size: int, tmp_path: Path) -> tuple[dict, dict]:
    """CEP and velocity RMS of `size` flights: of the ensemble itself, and evaluated from their solutions on disk."""
    world = World(Plan(arms=("simple",), seed=1))
    members, kept = [], []
    for index in range(size):
        mission = world.mission(index)
        recording = mission.record(world.instrument(index), world.streams(index).at("flight"))
        velocity = compensate(samples(recording), world.triads(index)["simple"], recording.interval_s)
        one = evaluate(recording, velocity, **beginning(mission, recording, world.alignment))
        members.append({"simple": contributions(one.errors)})
        state = one.solution
        rows = Fixes(
            state.time_s, state.latitude_rad, state.longitude_rad, state.height_m, state.velocity_n,
            np.ones(state.time_s.size, dtype=bool), state.attitude_rad,
        )  # fmt: skip
        put_out = replace(recording, imu=None, solution=rows, start=mission.start(0.0, aligned=True))
        folder = form.write(put_out, tmp_path / f"flight-{index}")
        kept.append(summary(folder.name, evaluate_solution(form.read(folder, solution_alone=True))))
    data = stacked(members)["simple"]
    direct = {measure: float(statistic(data[measure])) for measure, statistic in STATISTICS.items()}
    return direct, SeveralEvaluations(kept).tree["ensemble"]["solution"]


def check_same(direct: dict, found: dict, size: int) -> None:
    assert found["size"] == size
    for group, prefix in (("cep_rate_nmi_per_h", "cep_rate_"), ("velocity_rms_mps", "velocity_rms_")):
        for key, estimate in found[group].items():
            assert estimate["value"] == pytest.approx(direct[prefix + key], rel=SAME_CEP), key
            low, high = estimate["interval95"]
            assert low <= estimate["value"] <= high
    assert len(found["cep_rate_nmi_per_h"]) == sum(measure.startswith("cep_rate_") for measure in direct)


def test_a_few_flights_evaluated_from_their_solutions_have_the_cep_of_the_ensemble(tmp_path):
    direct, found = flown(10, tmp_path)
    check_same(direct, found, 10)


@pytest.mark.slow
def test_flights_evaluated_from_their_solutions_have_the_cep_of_the_flight_report(tmp_path):
    direct, found = flown(200, tmp_path)
    check_same(direct, found, 200)
