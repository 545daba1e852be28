"""Figures of solutions that end so far off that some epochs are lost."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from ins_eval.figures.results import recording
from ins_eval.reference import Errors
from ins_eval.units import DEG


def errors(time_s: np.ndarray, north_m: float) -> Errors:
    n, zero = time_s.size, np.zeros(time_s.size)
    return Errors(time_s, np.full(n, north_m), zero, zero, np.zeros((n, 3)), np.ones(n, dtype=bool), ())


def test_errors_are_drawn_at_the_epochs_that_all_have() -> None:
    long, short = np.arange(10.0), np.arange(2.0, 7.0)
    found = recording._together({"a": errors(long, 1.0), "b": errors(short, 2.0)})
    for one in found.values():
        np.testing.assert_array_equal(one.time_s, short)
        assert one.velocity_n.shape == (short.size, 3)


def test_a_reference_beyond_a_pole_is_not_drawn() -> None:
    """An error of a quarter of the Earth to the south leads from 45 degrees beyond the north pole."""
    time_s = np.arange(3.0)
    place = {"latitude_rad": np.full(3, 45.0 * DEG), "longitude_rad": np.zeros(3), "height_m": np.zeros(3)}
    solution = SimpleNamespace(time_s=time_s, **place)
    far = errors(time_s, 0.0)
    far.north_m[2] = -1e7
    way = recording._from_start_m(solution, far)
    np.testing.assert_allclose(way[:2], 0.0, atol=1e-6)
    assert np.isnan(way[2]).all()
