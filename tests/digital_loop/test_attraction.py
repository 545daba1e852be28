"""Attraction against the energy of the capacitors, the textbook's pull-in, and the symmetry of the bridge."""

import numpy as np
import pytest

from ins_eval.calibration.loop_gains import scan_gain
from ins_eval.digital_loop import attraction, load
from ins_eval.digital_loop.excitation import excite
from ins_eval.errors import UsageError
from ins_eval.streams import Streams

C0, GAP, ARM, STIFFNESS = 30e-12, 20e-6, 8e-3, 1e-3  # of the preset
LOADINGS = (0.0, 0.3, 1.0, 10.0, 1e9, float("inf"))


@pytest.fixture(scope="module")
def loop():
    return load()


def coenergy(u: float, loading: float, volts: float) -> float:
    """W' in J of the three capacitors between electrodes at +-V/2 and the middle at 0, mean over the carrier.

    The plate takes the voltage at which its charge is zero; a held plate is at 0.
    """
    first, second = C0 / (1.0 - u), C0 / (1.0 + u)
    half = 0.5 * volts
    plate = 0.0 if np.isinf(loading) else half * (first - second) / (first + second + loading * C0)
    stray = 0.0 if np.isinf(loading) else loading * C0
    peak = 0.5 * first * (half - plate) ** 2 + 0.5 * second * (half + plate) ** 2 + 0.5 * stray * plate**2
    return 0.5 * peak


@pytest.mark.parametrize("loading", LOADINGS)
def test_force_is_the_derivative_of_the_energy(loop, loading):
    step, volts = 1e-5, 3.0
    for u in (-0.9, -0.4, 0.0, 0.2, 0.6, 0.95):
        slope = (coenergy(u + step, loading, volts) - coenergy(u - step, loading, volts)) / (2.0 * step * GAP)
        force = attraction.unit_force(loop, volts) * attraction.bridge(loading)(u)
        assert force == pytest.approx(slope, rel=1e-5, abs=1e-6 * attraction.unit_force(loop, volts))


def test_series_capacitance_does_not_depend_on_the_place_of_a_free_plate():
    for u in (0.0, 0.5, 0.99):
        assert coenergy(u, 0.0, 2.0) == pytest.approx(coenergy(0.0, 0.0, 2.0))
        assert attraction.bridge(attraction.FREE)(u) == 0.0


@pytest.mark.parametrize("loading", LOADINGS)
def test_a_symmetric_bridge_does_not_draw_a_plate_in_the_middle(loading):
    shape = attraction.bridge(loading)
    assert shape(0.0) == 0.0
    assert shape(0.3) == -shape(-0.3)


def test_a_single_sided_plate_is_pulled_in_at_a_third_of_the_gap():
    """V^2 = 8 k d^3 / (27 eps A): load C0 V^2 / (2 k d^2) = 4 / 27."""

    def single_sided(u):
        return 1.0 / (1.0 - u) ** 2

    load_at, u = attraction.pull_in(single_sided)
    assert u == pytest.approx(1.0 / 3.0, abs=1e-4)
    assert load_at == pytest.approx(4.0 / 27.0, rel=1e-9)
    below, above = (attraction.at_rest(single_sided, k * 4.0 / 27.0, np.zeros(1)) for k in (0.9999, 1.0001))
    assert 0.32 < below[0] < 1.0 / 3.0
    assert np.isnan(above[0])


def test_at_rest_the_torques_balance():
    free = np.linspace(-0.6, 0.6, 13)
    shape = attraction.bridge(attraction.HELD)
    u = attraction.at_rest(shape, 0.03, free)
    assert u == pytest.approx(free + 0.03 * shape(u), abs=1e-9)
    assert np.all(np.abs(u) >= np.abs(free))


def test_negative_stiffness_and_pull_in_of_a_held_plate(loop):
    """Each side at V/2: k = 2 C0 (V/2)^2 / d^2, mean over the carrier half of it; pulled in where it is D / l^2."""
    volts = 800 / 8192 * 2.5
    assert attraction.carrier_volts(loop) == pytest.approx(volts)
    stiffness = 2.0 * C0 * (0.5 * volts) ** 2 / GAP**2 / 2.0
    shape = attraction.bridge(attraction.HELD)
    assert attraction.load(loop) * attraction.softening(shape) == pytest.approx(stiffness * ARM**2 / STIFFNESS)
    pulled = np.sqrt(4.0 * GAP**2 * STIFFNESS / (C0 * ARM**2))
    assert attraction.volts_of(loop, attraction.pull_in(shape)[0]) == pytest.approx(pulled, rel=1e-5)


def test_an_excited_plate_is_pulled_in_before(loop):
    """Where the load touches: (u - 0.6) S'(u) = S(u), with S' = (1 + 3 u^2) / (1 - u^2)^3."""
    shape = attraction.bridge(attraction.HELD)
    load_at, u = attraction.pull_in(shape, 0.6)
    assert (u - 0.6) * (1.0 + 3.0 * u * u) / (1.0 - u * u) == pytest.approx(u, rel=1e-3)
    assert load_at < attraction.pull_in(shape)[0]


def test_plate_area_and_what_the_hinge_tears_off(loop):
    assert attraction.area_m2(loop) == pytest.approx(C0 * GAP / 8.854e-12, rel=1e-4)
    gap = attraction.latching_gap_m(loop)
    volts = 0.5 * attraction.carrier_volts(loop)
    pull = 8.854e-12 * attraction.area_m2(loop) * volts**2 / 2.0 / (2.0 * gap**2)
    assert pull * ARM == pytest.approx(STIFFNESS * GAP / ARM, rel=1e-4)


def test_excitation_without_loading_is_as_without_attraction_and_softer_with(loop):
    gains = [scan_gain(*excite(loop, Streams(1), loading)).value for loading in (0.0, float("inf"))]
    words, counts = excite(loop, Streams(1))
    assert scan_gain(words, counts).value == gains[0]
    more_ppm = 1e6 * (gains[1] / gains[0] - 1.0)
    steps = 0.6 * np.linspace(-1.0, 1.0, 21)  # least squares of load S(u) over the excitation
    expected = 1e6 * attraction.load(loop) * np.sum(steps**2 / (1.0 - steps**2) ** 2) / np.sum(steps**2)
    assert more_ppm == pytest.approx(expected, rel=0.05)


def test_a_plate_that_is_pulled_in_is_refused(loop):
    with pytest.raises(UsageError, match="pulls the plate"):
        attraction.attracted(loop, np.array([0.6]), attraction.HELD, 15.0)
