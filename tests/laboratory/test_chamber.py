"""The four-point chamber: its programme against the paper's arithmetic, its readings against eq. (2)."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from ins_eval.accelerometer import Population
from ins_eval.errors import UsageError
from ins_eval.laboratory import Chamber
from ins_eval.recording import ChamberReadings
from ins_eval.streams import Streams

RATES_C_PER_MIN = (0.3, 0.5, 0.7, 0.9)
RUN_H = (29.4, 23.7, 21.2, 19.8)  # one position: soak, 260 degC of ramp, 3 min at each whole degree
MEAN_RATE_C_PER_MIN = (0.158, 0.200, 0.226, 0.243)
STREAMS = Streams(5).at("instrument", 3)
PULSE = 1.0 / 60.0 + 1e-6  # one count in a reading of a minute, in pulse/s


@pytest.fixture(scope="module")
def population() -> Population:
    return Population.load()


@pytest.fixture(scope="module")
def readings(population: Population) -> ChamberReadings:
    return Chamber().measure(population.draw(STREAMS)[0], STREAMS, "unit 3 x")


@pytest.mark.parametrize("k", range(4))
def test_durations_and_mean_rates(k: int) -> None:
    chamber = Chamber()
    assert chamber.rates_c_per_min == RATES_C_PER_MIN
    assert chamber.run_h(RATES_C_PER_MIN[k]) == pytest.approx(RUN_H[k], abs=0.05)
    assert chamber.mean_rate_c_per_min(RATES_C_PER_MIN[k]) == pytest.approx(MEAN_RATE_C_PER_MIN[k], abs=0.0005)


def test_the_whole_test_takes_376_hours_and_168_without_dwell() -> None:
    assert 4 * sum(Chamber().run_h(rate) for rate in RATES_C_PER_MIN) == pytest.approx(376.0, abs=0.5)
    steady = Chamber(dwell_s=0.0)
    assert 4 * sum(steady.run_h(rate) for rate in RATES_C_PER_MIN) == pytest.approx(168.0, abs=0.5)
    assert steady.mean_rate_c_per_min(0.7) == pytest.approx(0.7)


def test_the_profile_visits_every_whole_degree_and_waits() -> None:
    time_s, air_c = Chamber().profile(0.5)
    assert time_s[1] == 7200.0 and air_c[0] == air_c[1] == air_c[-1] == 22.0
    assert (air_c.min(), air_c.max()) == (-60.0, 70.0)
    waits = np.diff(time_s)[(np.diff(air_c) == 0.0)][1:]
    assert waits == pytest.approx(np.full(260, 180.0))
    moving = np.diff(air_c) != 0.0
    assert np.abs(np.diff(air_c)[moving] / np.diff(time_s)[moving]) * 60.0 == pytest.approx(np.full(260, 0.5))


def test_the_surface_is_warmer_and_late() -> None:
    run = Chamber(dwell_s=0.0).thermal_run(0.6)
    elapsed_s = run.time_s - 7200.0
    falling = (elapsed_s > 3600.0) & (elapsed_s < 8000.0)
    air_c = 22.0 - 0.01 * elapsed_s[falling]
    assert run.temperature_c[falling] == pytest.approx(air_c + 8.0 + 0.01 * 300.0, abs=1e-4)
    soak = run.time_s < 7200.0
    assert run.temperature_c[soak] == pytest.approx(30.0 - 8.0 * np.exp(-run.time_s[soak] / 300.0), abs=1e-9)


def test_sixteen_runs_one_after_another(readings: ChamberReadings) -> None:
    assert np.all(np.diff(readings.time_s) > 0.0)
    assert list(np.unique(readings.run)) == list(range(16))
    per_run = [(readings.rate_c_per_min[readings.run == k], readings.input_g[readings.run == k]) for k in range(16)]
    assert all(np.ptp(rate) == 0.0 and np.ptp(force) == 0.0 for rate, force in per_run)
    assert [rate[0] for rate, _ in per_run] == list(np.repeat(RATES_C_PER_MIN, 4))
    assert [force[0] for _, force in per_run] == [1.0, 0.0, -1.0, 0.0] * 4
    assert readings.unit_id == "unit 3 x"


def test_a_reading_is_stamped_in_the_middle_of_its_minute(readings: ChamberReadings) -> None:
    assert readings.time_s[0] == 7200.0 + 30.0  # the first after the soak
    # the second run begins with the whole minute in which the first ended
    minutes = int(Chamber().run_h(0.3) * 60.0)
    assert readings.time_s[readings.run == 1][0] == pytest.approx(60.0 * minutes + 7230.0)


def test_a_reading_is_a_minute_of_whole_counts_and_steps_of_the_thermometer(readings: ChamberReadings) -> None:
    counts = readings.output * 60.0
    assert counts == pytest.approx(np.round(counts), abs=1e-6)
    steps = readings.temperature_c / 0.0625
    assert np.all(steps == np.round(steps))
    same_run = np.diff(readings.run) == 0
    assert np.diff(readings.time_s)[same_run] == pytest.approx(np.full(same_run.sum(), 60.0))
    assert readings.temperature_c.min() == pytest.approx(-52.0, abs=1.0)  # Paper A: -54 to -52
    assert readings.temperature_c.max() == pytest.approx(78.0, abs=1.0)  # Paper A: 81 to 82


@pytest.mark.parametrize("axis", range(3))
def test_an_ideal_unit_reads_scale_times_bias_and_force(population: Population, axis: int) -> None:
    chamber = Chamber(rates_c_per_min=(0.9,))
    unit = population.only("scale_polynomial", "bias_temperature", "quantisation").draw(STREAMS)[axis]
    readings = chamber.measure(unit, STREAMS)
    run = chamber.thermal_run(0.9)
    recorded = run.time_s > 7200.0
    d = (run.temperature_c - 22.0)[recorded]
    r = run.rate_c_per_min(180.0)[recorded]
    alpha, beta, eta, epsilon, mu, gamma = unit.units["scale_polynomial"]
    k1 = alpha * r**2 + beta * d**2 + eta * r * d + epsilon * r + mu * d + gamma
    w1, w2, w3 = unit.units["bias_temperature"]
    k0_g = 1e-6 * (w1 * d + w2 * d**2 + w3 * d**3)
    for number, force in enumerate((1.0, 0.0, -1.0, 0.0)):
        output = readings.output[readings.run == number]
        assert np.abs(output - k1 * (k0_g + force)).max() < 2 * PULSE  # two where the sign of the output turns
        owed = np.cumsum(output - k1 * (k0_g + force)) * 60.0
        assert np.abs(owed).max() < 1.0 + 1e-3


def test_the_zero_g_pair_cancels_the_misalignment_and_excludes_the_quadratic_term(population: Population) -> None:
    chamber = Chamber(rates_c_per_min=(0.9,))
    effect = population["nonlinearity"].model_copy(update={"k2_sigma_ug_per_g2": 300.0, "delta_o_sigma_urad": 500.0})
    unit = population.replacing(effect).only("nonlinearity").draw(STREAMS)[2]
    up, level, down, other = chamber.measure(unit, STREAMS).output.reshape(4, -1) / unit.gamma
    drawn = unit.units["nonlinearity"]
    assert 1e6 * (up + down) / 2 == pytest.approx(drawn.k2, abs=1e-6)
    assert 1e6 * (level - other) / 2 == pytest.approx(drawn.delta_o, abs=1e-6)
    assert level + other == pytest.approx(0.0, abs=1e-12)


def test_each_run_is_a_fresh_switch_on(population: Population) -> None:
    chamber = Chamber()
    offsets = []
    for instrument in range(40):
        streams = Streams(8).at("instrument", instrument)
        unit = population.only("turn_on").draw(streams)[0]
        found = chamber.measure(unit, streams)
        first = np.concatenate(([True], np.diff(found.run) > 0))
        offsets.append(1e6 * (found.output[first] / unit.gamma - found.input_g[first]))
    offsets = np.array(offsets)
    assert offsets.std() == pytest.approx(20.0, rel=0.12)
    assert offsets.std(axis=1).min() > 8.0  # it differs between the runs of one unit


def test_common_random_numbers(population: Population, readings: ChamberReadings) -> None:
    chamber = Chamber()
    again = chamber.measure(population.draw(STREAMS)[0], STREAMS)
    assert np.array_equal(again.output, readings.output)
    unit = population.without("creep").draw(STREAMS)[0]
    without = chamber.measure(unit, STREAMS)
    alone = chamber.measure(population.only("creep", "thermal_lag").draw(STREAMS)[0], STREAMS)
    creep = (alone.output - unit.gamma * alone.input_g) / unit.gamma
    level = readings.input_g == 0.0
    difference = (readings.output - without.output)[level] / unit.gamma
    assert np.abs(creep).max() > 50e-6
    assert difference == pytest.approx(creep[level], rel=0.02, abs=3 * PULSE / unit.gamma)
    assert not np.array_equal(chamber.measure(population.draw(STREAMS)[0], Streams(6)).output, readings.output)


def test_columns_that_units_share_cannot_be_spoilt(readings: ChamberReadings) -> None:
    with pytest.raises(ValueError, match="read-only"):
        readings.temperature_c[0] = 0.0


@pytest.mark.parametrize(
    "wrong",
    [
        {"rates_c_per_min": ()},
        {"rates_c_per_min": (0.3, -0.5)},
        {"soak_c": 80.0},
        {"dwell_s": -1.0},
        {"reading_s": 0.0},
    ],
)
def test_an_impossible_programme_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(UsageError, match=r"^chamber: [^\n]+$"):
        Chamber(**wrong)


def test_the_air_is_read_beside_the_surface(readings: ChamberReadings) -> None:
    air_c = Chamber().air_c
    assert air_c.shape == readings.time_s.shape
    # each run passes 260 degC of air and ends where it began; the surface is warmer by its own heat
    for run in (0, 7, 15):
        of_run = air_c[readings.run == run]
        assert (of_run.min(), of_run.max()) == pytest.approx((-60.0, 70.0), abs=0.1)
        assert of_run[[0, -1]] == pytest.approx([22.0, 22.0], abs=1.0)
    assert np.mean(readings.temperature_c - air_c) == pytest.approx(8.0, abs=0.1)


@pytest.mark.parametrize("dwell_s", [180.0, 0.0])
def test_dwells_or_none(population: Population, dwell_s: float) -> None:
    chamber = Chamber(rates_c_per_min=(0.5,), dwell_s=dwell_s)
    found = chamber.measure(population.draw(STREAMS)[0], STREAMS)
    waits = np.mean(np.diff(chamber.air_c[found.run == 0]) == 0.0)
    # a degree takes two minutes to pass and three to wait: five readings, two pairs of which lie in the wait
    assert waits == pytest.approx(0.4 if dwell_s else 0.0, abs=0.005)


def test_every_value_of_the_programme_has_a_source() -> None:
    assert all(field.metadata["source"] for field in fields(Chamber))
