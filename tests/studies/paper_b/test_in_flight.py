"""The numbers of a stretch of flight, from a response that is known."""

import numpy as np
import pytest

from ins_eval.digital_loop.in_flight import LoopResponse
from ins_eval.studies.paper_b import in_flight

UG = 9.80665e-6


def test_a_pure_delay_is_found_and_gives_its_velocity_back():
    """f = A sin wt over two whole periods: -tau f', velocity -tau (f - f0), largest tau A, none at the end."""
    time_s = 0.01 * np.arange(1, 401)
    amplitude, w, tau = 0.4, np.pi, 50e-6
    force, slope = amplitude * np.sin(w * time_s), amplitude * w * np.cos(w * time_s)
    noise = 5.0 * UG * np.where(np.arange(400) % 2, 1.0, -1.0)
    found = in_flight.numbers(LoopResponse(time_s, force, -tau * slope, -tau * slope, noise, slope))
    assert found["delay_us"] == pytest.approx(50.0)
    assert found["rest_ug"] == 0.0
    assert found["rms_ug"] == pytest.approx(tau * amplitude * w / np.sqrt(2.0) / UG)
    assert found["mean_ug"] == pytest.approx(0.0, abs=1e-9)
    assert found["end_mm_s"] == pytest.approx(0.0, abs=1e-9)
    assert found["largest_mm_s"] == pytest.approx(1e3 * tau * amplitude, rel=0.03)  # of samples of 10 ms
    assert found["noise_ug"] == pytest.approx(5.0)
    assert found["noise_mm_s"] == pytest.approx(0.0, abs=1e-9)
