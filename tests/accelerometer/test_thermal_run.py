"""What all units of a run share is computed once."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.accelerometer import Population, ThermalRun
from ins_eval.streams import Streams


def test_a_state_is_computed_once(flight: ThermalRun) -> None:
    calls: list[ThermalRun] = []

    def compute(run: ThermalRun) -> np.ndarray:
        calls.append(run)
        return run.temperature_c + 1.0

    first = flight.state("one warmer", compute)
    assert flight.state("one warmer", compute) is first
    assert calls == [flight]


def test_a_second_unit_computes_no_state(population: Population, flight: ThermalRun, monkeypatch) -> None:
    first, second, third = population.draw(Streams(1))
    first.slow(flight, Streams(1))

    def refuse(*_: object) -> None:
        raise AssertionError("a state was computed again")

    monkeypatch.setattr("ins_eval.accelerometer.run.lagged", refuse)
    monkeypatch.setattr("ins_eval.accelerometer.run.filtered_rate", refuse)
    monkeypatch.setattr("ins_eval.accelerometer.magnet_hysteresis.play", refuse)
    monkeypatch.setattr("ins_eval.accelerometer.creep.relax", refuse)
    second.slow(flight, Streams(1))
    third.slow(flight, Streams(2))
    with pytest.raises(AssertionError, match="computed again"):
        first.slow(ThermalRun(flight.time_s, flight.temperature_c, "flight"), Streams(1))


def test_a_run_without_lag_has_elements_at_the_surface(flight: ThermalRun) -> None:
    assert flight.element_c is flight.temperature_c
    lagged = flight.with_element_lag(180.0)
    assert lagged is flight.with_element_lag(180.0)
    assert not np.allclose(lagged.element_c, flight.temperature_c, atol=0.1)


@pytest.mark.parametrize(
    ("time_s", "temperature_c"),
    [((0.0, 1.0, 1.0), (1.0, 2.0, 3.0)), ((0.0, 1.0), (1.0, 2.0, 3.0)), ((0.0, 1.0), (1.0, np.nan)), ((0.0,), (1.0,))],
)
def test_refuses_what_is_no_run(time_s: tuple[float, ...], temperature_c: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="thermal run"):
        ThermalRun(np.array(time_s), np.array(temperature_c), "flight")


def test_what_was_before_is_remembered(population: Population, flight: ThermalRun) -> None:
    """Elements, rate, magnet and epoxy are as if the accelerometer had been on all the time, cut to the run."""
    earlier_s = np.arange(-36000.0, -1.0, 60.0)
    time_s = np.concatenate((earlier_s, flight.time_s))
    temperature_c = np.concatenate((25.0 + 5.0 * np.sin(earlier_s / 7000.0), flight.temperature_c))
    early = time_s < -1.0
    before = ThermalRun(time_s[early], temperature_c[early], "flight")
    run = ThermalRun(flight.time_s, flight.temperature_c, "flight", before=before)
    whole = ThermalRun(time_s, temperature_c, "flight")
    memories = population.only("thermal_lag", "scale_polynomial", "magnet_hysteresis", "bias_temperature", "creep")
    unit = memories.draw(Streams(5))[0]
    seen, expected, fresh = (unit.slow(r, Streams(5)) for r in (run, whole, flight))
    for of_run, of_whole, of_fresh in zip(seen, expected, fresh, strict=True):
        assert np.array_equal(of_run, of_whole[-of_run.size :])
        assert not np.allclose(of_run, of_fresh, rtol=1e-9)


def test_what_was_before_moves_no_draw_of_the_run(population: Population, flight: ThermalRun) -> None:
    unit = population.only("turn_on", "in_run").draw(Streams(5))[0]
    before = ThermalRun(np.arange(-7200.0, -1.0, 60.0), np.full(120, 30.0), "flight")
    run = ThermalRun(flight.time_s, flight.temperature_c, "flight", before=before)
    assert np.array_equal(unit.slow(run, Streams(5)).bias_ug, unit.slow(flight, Streams(5)).bias_ug)


def test_refuses_a_run_that_begins_before_what_was_before(flight: ThermalRun) -> None:
    with pytest.raises(ValueError, match="after all that was before"):
        ThermalRun(flight.time_s, flight.temperature_c, "flight", before=flight)
