"""Loops of the magnet: what makes them loops of a Preisach kind, and what opens the loop of the scale factor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.accelerometer import Accelerometer, Population
from ins_eval.errors import UsageError
from ins_eval.laboratory import Chamber, draw_printed_units
from ins_eval.laboratory.magnet import FULL_LOOP_C, HysteresisLoop, loop, opening
from ins_eval.streams import Streams
from ins_eval.thermal import Thermometer

NESTED_LOOPS_C = (22.0, -60.0, 70.0, -40.0, 50.0, -20.0, 30.0, 0.0, 20.0)

AMPLITUDE_PPM = 200.0
EXACT_PPM = 1e-9
HALF_WIDTHS_C = np.array((3.0, 10.0, 25.0))
EPSILON = {"JB-KT8 #1": 88.14, "JB-KT8 #2": 21.01, "JB-KT8 #3": 48.53}
ETA = {"JB-KT8 #1": -0.02409, "JB-KT8 #2": -1.4912, "JB-KT8 #3": -0.0972}
GAMMA = {"JB-KT8 #1": 320320.0, "JB-KT8 #2": 308000.0, "JB-KT8 #3": 328000.0}


def leg(of: HysteresisLoop, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Temperature and ppm along one leg of a path, ends included."""
    turns = np.flatnonzero(np.diff(np.sign(np.diff(of.temperature_c)))) + 1
    ends = [0, *turns.tolist(), of.temperature_c.size - 1]
    part = slice(ends[number], ends[number + 1] + 1)
    return of.temperature_c[part], of.scale_ppm[part]


def test_the_full_loop_closes_and_opens_to_twice_the_amplitude() -> None:
    down_c, down = leg(loop((*FULL_LOOP_C, 70.0)), 2)
    up_c, up = leg(loop((*FULL_LOOP_C, 70.0)), 3)
    assert up[0] == down[-1] and up[-1] == pytest.approx(leg(loop(), 1)[1][-1], abs=EXACT_PPM)
    opened = np.interp(0.0, down_c[::-1], down[::-1]) - np.interp(0.0, up_c, up)
    assert opened == pytest.approx(2.0 * AMPLITUDE_PPM, abs=EXACT_PPM)


def test_the_branch_after_a_turn_is_the_mean_of_plays() -> None:
    # after `d` degrees from an end each play has come d / h of the 2 from one branch to the other
    down_c, down = leg(loop(), 2)
    d = down_c[0] - down_c
    expected = AMPLITUDE_PPM * np.mean([np.minimum(-1.0 + d / h, 1.0) for h in HALF_WIDTHS_C], axis=0)
    assert down == pytest.approx(expected, abs=EXACT_PPM)


@pytest.mark.parametrize("turns_c", [FULL_LOOP_C, NESTED_LOOPS_C])
def test_the_loop_is_the_same_at_any_ramp(turns_c: tuple[float, ...]) -> None:
    slow, fast = loop(turns_c, ramp_c_per_min=0.01), loop(turns_c, ramp_c_per_min=30.0)
    assert np.array_equal(slow.temperature_c, fast.temperature_c)
    assert np.array_equal(slow.scale_ppm, fast.scale_ppm)
    assert slow.time_s[-1] == pytest.approx(3000.0 * fast.time_s[-1])


def test_it_remembers_the_turning_point_and_wipes_out_the_minor_loop() -> None:
    with_detour, without = loop((70.0, 10.0, 25.0, 10.0, -30.0)), loop((70.0, 10.0, -30.0))
    _, detour = leg(with_detour, 1)
    assert detour[-1] < detour[0] - 0.5 * AMPLITUDE_PPM  # it was a loop
    back_c, back = leg(with_detour, 2)
    at_10_c = np.searchsorted(-back_c, -10.0)
    assert back[at_10_c] == pytest.approx(detour[0], abs=EXACT_PPM)  # return-point memory
    onward = without.temperature_c <= 10.0
    assert back[at_10_c:] == pytest.approx(without.scale_ppm[onward], abs=EXACT_PPM)  # wiped out


@pytest.mark.parametrize("inner_c", [(10.0, 25.0), (-5.0, 45.0), (0.0, 4.0)])
def test_minor_loops_between_the_same_temperatures_are_congruent(inner_c: tuple[float, float]) -> None:
    low_c, high_c = inner_c
    cycle = (low_c, high_c, low_c)
    after_heat, after_cold = loop((70.0, *cycle)), loop((22.0, -60.0, 60.0, *cycle))
    from_below = loop((-60.0, high_c, low_c, high_c))
    shapes = [leg(after_heat, 1)[1], leg(after_cold, 3)[1], leg(from_below, 2)[1]]
    for shape in shapes[1:]:
        assert shape - shape[0] == pytest.approx(shapes[0] - shapes[0][0], abs=EXACT_PPM)


def test_nested_loops_lie_inside_each_other() -> None:
    nested = loop(NESTED_LOOPS_C)
    spans = [np.ptp(leg(nested, k)[1]) for k in range(1, len(NESTED_LOOPS_C) - 1)]
    assert all(inner <= outer + EXACT_PPM for outer, inner in zip(spans, spans[1:], strict=False))
    assert spans[-1] < 0.95 * spans[0]
    assert np.abs(nested.scale_ppm).max() <= AMPLITUDE_PPM + EXACT_PPM


def test_amplitude_and_magnet_can_be_given() -> None:
    magnet = Population.load()["magnet_hysteresis"].model_copy(update={"half_widths_c": (5.0,)})
    assert np.ptp(loop((0.0, 30.0, 0.0), magnet, half_opening_ppm=80.0).scale_ppm) == pytest.approx(160.0)


@pytest.mark.parametrize("turns_c", [(22.0,), (22.0, 22.0, 30.0)])
def test_a_path_that_goes_nowhere_is_refused(turns_c: tuple[float, ...]) -> None:
    with pytest.raises(UsageError, match=r"^magnet: [^\n]+$"):
        loop(turns_c)


# ---- what opens the loop of the scale factor in the chamber


@pytest.fixture(scope="module")
def units() -> dict[str, Accelerometer]:
    """The printed units with the median amplitude of the magnet."""
    drawn = draw_printed_units(Streams(2))
    return {name: with_amplitude(unit, AMPLITUDE_PPM) for name, unit in drawn.items()}


def with_amplitude(unit: Accelerometer, ppm: float) -> Accelerometer:
    return replace(unit, units={**unit.units, "magnet_hysteresis": ppm})


@pytest.mark.parametrize("name", GAMMA)
def test_the_parts_add_up_and_the_magnet_does_not_know_the_ramp(units, name: str) -> None:
    found = opening(units[name])
    assert found.magnet_ppm + found.rate_ppm + found.reading_ppm == pytest.approx(found.total_ppm, abs=1e-9)
    assert list(found.ramp_c_per_min) == [0.3, 0.5, 0.7, 0.9]
    # the first falling branch comes from a fresh magnet at 22, which the soak takes to 30: of the three plays only the
    # narrowest has turned over at 22 degC; the rising branch comes from the cold end: A (1/3 + 0 + 0 + 1)
    assert found.magnet_ppm == pytest.approx(AMPLITUDE_PPM * 4.0 / 3.0, rel=0.04)
    assert np.ptp(found.magnet_ppm) < 1.0
    assert np.all(np.diff(found.rate_ppm) > 0.0)


@pytest.mark.parametrize("name", GAMMA)
def test_the_rate_terms_open_by_twice_the_odd_terms(units, name: str) -> None:
    # steady ramps without dwell, far from the turns, where the filtered rate is the ramp's
    chamber = Chamber(rates_c_per_min=(0.3, 0.5), dwell_s=0.0)
    found = opening(units[name], chamber, at_c=0.0)
    by_hand = [2e6 * r * (EPSILON[name] + ETA[name] * (0.0 - 22.0)) / GAMMA[name] for r in chamber.rates_c_per_min]
    assert found.rate_ppm == pytest.approx(by_hand, rel=0.01)


def test_the_printed_sign_of_the_rate_closes_the_loop_that_the_magnet_opens(units) -> None:
    population = Population.load()
    polynomial = population["scale_polynomial"].model_copy(update={"rate_sign": "printed"})
    printed = draw_printed_units(Streams(2), population.replacing(polynomial))
    for name, unit in printed.items():
        other, ours = opening(with_amplitude(unit, AMPLITUDE_PPM)), opening(units[name])
        assert other.rate_ppm == pytest.approx(-ours.rate_ppm, rel=0.02)
        assert np.all(other.magnet_ppm / other.total_ppm > 1.0) and np.all(ours.magnet_ppm / ours.total_ppm < 1.0)


def test_a_thermometer_that_is_late_opens_the_loop_by_the_slope(units) -> None:
    # 2 mu r tau, to which the mean over its own period adds nothing: readings are taken at the instant
    chamber = Chamber(rates_c_per_min=(0.6,), dwell_s=0.0, thermometer=Thermometer(lag_s=60.0, step_c=1e-6))
    found = opening(units["JB-KT8 #1"], chamber, at_c=10.0)
    slope_ppm_per_c = 1e6 * (-32.76 + 2 * 0.1008 * (10.0 - 22.0)) / 320320.0
    assert found.reading_ppm == pytest.approx([-2.0 * slope_ppm_per_c * 0.6], rel=0.01)
    exact = replace(chamber, thermometer=Thermometer(lag_s=0.0, step_c=1e-6))
    assert opening(units["JB-KT8 #1"], exact, at_c=10.0).reading_ppm == pytest.approx([0.0], abs=0.5)


def test_what_is_redrawn_at_each_switch_on_does_not_enter(units) -> None:
    whole = draw_printed_units(Streams(2))["JB-KT8 #3"]
    alone = draw_printed_units(Streams(2), Population.load().only("scale_polynomial", "magnet_hysteresis"))["JB-KT8 #3"]
    assert np.array_equal(opening(whole).total_ppm, opening(alone).total_ppm)
    without = draw_printed_units(Streams(2), Population.load().without("magnet_hysteresis"))["JB-KT8 #3"]
    assert opening(without).magnet_ppm == pytest.approx(np.zeros(4), abs=EXACT_PPM)


@pytest.mark.parametrize("at_c", [-80.0, -52.0, 90.0])
def test_a_temperature_that_is_not_passed_both_ways_is_refused(units, at_c: float) -> None:
    with pytest.raises(UsageError, match=r"^magnet: the chamber's readings do not pass through [^\n]+$"):
        opening(units["JB-KT8 #1"], at_c=at_c)
