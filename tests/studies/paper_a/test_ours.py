"""The small computations of the page: against closed forms, and against what nature was told."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.accelerometer import Population
from ins_eval.accelerometer.creep import epoxy
from ins_eval.imu import Mission
from ins_eval.laboratory import draw_printed_units
from ins_eval.profile import load
from ins_eval.streams import Streams
from ins_eval.studies.paper_a import ours
from ins_eval.studies.paper_a.single import central, single_flights, single_runs

SEED = 5
ROUNDING = 1e-13  # of 1 g, or of the output


@pytest.fixture(scope="module")
def found() -> dict:
    return ours.compute(SEED)


def units(population: Population, draws: int = 2) -> list:
    return [u for k in range(draws) for u in draw_printed_units(Streams(SEED).at(k), population).values()]


def test_the_full_equation_is_the_printed_one_and_can_be_turned_back(found: dict) -> None:
    model = found["model"]
    assert max(model["forward"], model["inverse"], model["compensated"]) < ROUNDING * 10
    assert 100.0 < model["neglected_ug"] < 3000.0  # six terms of some 30 ug/g^n at up to 2 g


def test_thermal_history(found: dict) -> None:
    thermal = found["thermal"]
    assert thermal["cruise_end_c"] == pytest.approx(-11.0, abs=0.01)
    temperature = Mission(load(ours.PROFILE), 1.0).temperature
    travelled = np.abs(np.diff(temperature.temperature_c[temperature.time_s >= 0.0])).sum()
    assert thermal["mean_rate"] == pytest.approx(travelled / (8400.0 / 60.0), rel=1e-3)
    assert thermal["mean_rate_cruise"] == pytest.approx((thermal["cruise_start_c"] + 11.0) / 90.0, rel=1e-2)
    assert thermal["mean_rate"] * 8400.0 == pytest.approx(
        thermal["early_rate"] * 6000.0 + thermal["late_rate"] * 2400.0, rel=1e-3
    )
    assert thermal["max_rate"] >= max(thermal["early_rate"], thermal["late_rate"])
    assert 0.0 <= thermal["rise_without_own_heat_c"] < thermal["rise_c"]


def test_without_a_magnet_the_loop_is_that_of_the_printed_coefficients() -> None:
    population = Population.load().without("magnet_hysteresis")
    single = [draw_printed_units(Streams(SEED), population)["JB-KT8 #2"]]
    found = ours.scale(single)
    assert found["magnet_share"]["value"] == pytest.approx(0.0, abs=1e-9)
    # both odd terms turned: 2 r (epsilon + eta dT) at dT = 18; r lies between the mean and the commanded rate
    epsilon, eta, gamma = 21.01, -1.4912, 308000.0
    at_18 = 2e6 * (epsilon + eta * 18.0) / gamma
    rate_ppm = found["rate_share"]["value"] * found["falling_minus_rising_ppm"]["value"]
    assert at_18 * 0.3 < rate_ppm < at_18 * 0.1 < 0.0


def test_opening_is_the_sum_of_its_parts(found: dict) -> None:
    scale = ours.scale(units(Population.load(), 1)[:1])
    assert scale["magnet_share"]["value"] + scale["rate_share"]["value"] + scale["reading_share"][
        "value"
    ] == pytest.approx(1.0, rel=1e-9)
    assert found["scale"]["falls_share"] == 1.0


def test_bias_loop_without_lag_is_all_creep_and_without_creep_none() -> None:
    jb = Population.load()
    streams = Streams(SEED).at("bias")
    chamber = ours.Chamber()
    no_lag, no_creep = units(jb.without("thermal_lag"), 1)[0], units(jb.without("creep"), 1)[0]
    assert ours._creep_share(no_lag, chamber, streams) == pytest.approx(1.0, abs=0.01)
    assert ours._creep_share(no_creep, chamber, streams) == 0.0


def test_a_curve_for_each_branch_leaves_less_of_the_bias_than_one_and_that_less_than_a_line(found: dict) -> None:
    bias = found["bias"]
    line, curve, branches = (bias[f"open_by_{n}_percent"]["value"] for n in ("line", "curve", "branches"))
    assert 0.0 < branches < curve < line < 100.0
    straight = Population.load().only("thermal_lag", "scale_polynomial", "bias_temperature", "quantisation")
    prompt = straight["thermal_lag"].model_copy(update={"lag_s": 1.0})
    linear = straight["bias_temperature"].model_copy(
        update={"omega2_sigma_ug_per_c2": 0.0, "omega3_sigma_ug_per_c3": 0.0}
    )
    left = ours.bias(units(straight.replacing(linear, prompt), 1), Streams(SEED))["open_by_line_percent"]
    assert left["interval95"][1] < 0.01  # the thermometer's lag against the surface is all there is


def test_omitted_terms_vanish_where_nature_is_the_six_terms() -> None:
    flight = Mission(load(ours.PROFILE), 1.0)
    six = Population.load().only("scale_polynomial", "quantisation")
    with_magnet = Population.load().only("scale_polynomial", "magnet_hysteresis", "quantisation")
    exact, full = (ours.high_order(units(p), flight.run, Streams(SEED)) for p in (six, with_magnet))
    assert exact["most_ppm"]["interval95"][1] < 0.5
    assert full["most_ppm"]["value"] > 50.0


def test_creep_rig(found: dict) -> None:
    creep = found["creep"]
    data = epoxy()
    first = (data["thermal_um"] + data["creep_um"])[:, 0] * data["direction"]
    assert creep["elongation_um"] == pytest.approx(first.tolist(), rel=1e-6)
    assert np.all(np.diff(creep["finished_share"]) > 0.0) and max(creep["finished_share"]) <= 1.0
    for key, recomputed in (("creep_um", (86.74, 53.48, 77.60)), ("thermal_um", (1.01, 1.36, 6.95))):
        for estimate, value in zip(creep[f"{key}_variation_percent"], recomputed, strict=True):
            low, high = estimate["interval95"]
            assert low < value < high


def test_position_in_the_oven(found: dict) -> None:
    position = found["oven_position"]
    for axis in ours.POSITION_AXES:
        best, median = position[f"best_{axis}"], position[f"median_{axis}"]
        assert all(e["interval95"][0] <= e["value"] <= e["interval95"][1] <= 100.0 for e in (best, median))
        if not 0.4 < position[f"improved_{axis}"] < 0.6:
            assert (median["value"] > 0.0) == (position[f"improved_{axis}"] > 0.5)
    # the best by velocity, over instruments, gains more in position than the median run does
    assert position["best_horizontal"]["value"] > position["median_horizontal"]["value"]


def test_the_same_seed_gives_the_same_numbers(found: dict) -> None:
    assert ours.compute.__wrapped__(SEED) == found


def test_single_flights() -> None:
    rng = np.random.default_rng(1)
    before = rng.rayleigh(size=4000)
    arms = {"simple": {"m": before}, "hysteresis_refined": {"m": 0.8 * before}}
    found = single_flights(arms, ("m",))
    # quantiles of a Rayleigh distribution: sqrt(-2 ln(1 - p))
    exact = [np.sqrt(-2.0 * np.log(1.0 - p)) for p in (0.5, 0.025, 0.975)]
    simple = found["simple"]["m"]
    assert [simple["value"], *simple["interval95"]] == pytest.approx(exact, rel=0.06)
    gain = found["gain_percent"]["m"]
    assert [gain["value"], *gain["interval95"]] == pytest.approx([20.0] * 3)
    assert central(np.arange(201.0)) == {"value": 100.0, "interval95": [5.0, 195.0]}


def test_single_runs() -> None:
    def member(first: float) -> dict:
        runs = first + np.arange(100.0)
        return {
            f"{arm}/{case}": {f"velocity_rms_{a}": factor * runs for a in ("east", "north", "horizontal")}
            for arm, factor in (("simple", 1.0), ("hysteresis_refined", 0.5), ("none", 9.0))
            for case in ("given", "aligned")
        }

    found = single_runs([member(0.0), member(100.0)])  # 0 to 199
    assert set(found) == {"given", "aligned"} and set(found["given"]) == {"simple", "hysteresis_refined"}
    east = found["given"]["simple"]["east"]
    assert [east["value"], *east["interval95"]] == pytest.approx([99.5, 4.975, 194.025])
    assert found["aligned"]["hysteresis_refined"]["north"]["value"] == pytest.approx(49.75)
