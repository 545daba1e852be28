"""What electrostatic attraction does to the plate of our loop, and to the test that the paper rejects for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ins_eval.calibration import loop_gains
from ins_eval.digital_loop import Loop, attraction, excitation
from ins_eval.errors import UsageError
from ins_eval.streams import Streams
from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.units import PPM

LOADINGS = {"free": attraction.FREE, "as much as C0": 1.0, "held": attraction.HELD}
DRIFT_PPM = 200.0  # of the carrier's amplitude, as put into the forward gain
SHOWN_V = np.geomspace(0.1, 20.0, 81)


def attracted(loop: Loop, streams: Sequence[Streams]) -> dict[str, Any]:
    """Stiffness, pull-in, stop and the rejected test, excited once with each of `streams`.

    stiffness_ppm             negative stiffness over D, by how the plate is loaded
    gain_ppm                  what attraction adds to the gain of the rejected test, same noise: mean, 95 % interval
    added_scatter_ppm         standard deviation of that from one excitation to the next, without converters
    scatter_ppm               standard deviation of the gain itself
    drift_ppm                 change of the gain when the carrier drifts by `DRIFT_PPM`, plate held
    pull_in_v, excited_v      amplitude of the carrier that pulls a held plate in: from the middle, at the largest
                              excitation
    spoiling_v                amplitude at which added_scatter_ppm of a held plate reaches the paper's 10 ppm
    by_carrier                of a held plate: "volts", "gain_ppm" and "added_scatter_ppm" up to pull-in
    latching_um, scanned_um   gap at the stop that would keep a held plate at 0 g, with the carrier at work and at the
                              top of the scan
    """
    limit = PRINTED["text"]["estimation_error_ppm"]
    shape, load = attraction.bridge(attraction.HELD), attraction.load(loop)
    scan = loop.parameters.scan
    top = loop.parameters.carrier.amplitude.value + scan.step.value * scan.steps.value
    gain = {name: _gains(loop, streams, loading) for name, loading in LOADINGS.items()}
    more = {name: (values / gain["free"] - 1.0) / PPM for name, values in gain.items()}
    held = attraction.carrier_volts(loop)
    drifted = _softer_ppm(loop, streams, volts=held * (1.0 + PPM * DRIFT_PPM)) - _softer_ppm(loop, streams)
    by_carrier = _by_carrier(loop, streams)
    return {
        "carrier_v": held,
        "area_mm2": 1e6 * attraction.area_m2(loop),
        "stiffness_ppm": {n: load * attraction.softening(attraction.bridge(s)) / PPM for n, s in LOADINGS.items()},
        "gain_ppm": {name: _mean(values) for name, values in more.items() if name != "free"},
        "added_scatter_ppm": {n: float(_softer_ppm(loop, streams, s).std(ddof=1)) for n, s in LOADINGS.items()},
        "scatter_ppm": {name: float(v.std(ddof=1) / abs(v.mean()) / PPM) for name, v in gain.items()},
        "drift_ppm": float(drifted.mean()),
        "pull_in_v": attraction.volts_of(loop, attraction.pull_in(shape)[0]),
        "excited_v": attraction.volts_of(loop, attraction.pull_in(shape, excitation.SHARE_OF_GAP)[0]),
        "spoiling_v": float(np.interp(limit, by_carrier["added_scatter_ppm"], by_carrier["volts"])),
        "by_carrier": by_carrier,
        "latching_um": 1e6 * attraction.latching_gap_m(loop),
        "scanned_um": 1e6 * attraction.latching_gap_m(loop, loop.volts_per_count * top),
    }


def _gains(loop: Loop, streams: Sequence[Streams], loading: float) -> np.ndarray:
    """Gain (r,) of the rejected test, eq. (23); NaN where the plate is pulled in."""
    found = []
    for one in streams:
        try:
            found.append(loop_gains.scan_gain(*excitation.excite(loop, one, loading)).value)
        except UsageError:
            found.append(np.nan)
    return np.array(found)


def _softer_ppm(
    loop: Loop, streams: Sequence[Streams], loading: float = attraction.HELD, volts: float | None = None
) -> np.ndarray:
    """What attraction adds to the slope (r,) of the deflection itself, ppm, with a carrier of `volts`."""
    found = []
    for one in streams:
        words, free = excitation.deflections(loop, one)
        drawn = attraction.attracted(loop, free, loading, volts)
        slopes = [loop_gains.scan_gain(words, u).value for u in (free, drawn)]
        found.append((slopes[1] / slopes[0] - 1.0) / PPM)
    return np.array(found)


def _by_carrier(loop: Loop, streams: Sequence[Streams]) -> dict[str, list[float]]:
    """Up to the amplitude at which one of the excitations pulls the plate in."""
    found: dict[str, list[float]] = {"volts": [], "gain_ppm": [], "added_scatter_ppm": []}
    for volts in SHOWN_V:
        try:
            more = _softer_ppm(loop, streams, volts=volts)
        except UsageError:
            break
        for key, value in zip(found, (volts, more.mean(), more.std(ddof=1)), strict=True):
            found[key].append(float(value))
    return found


def _mean(values: np.ndarray) -> dict[str, Any]:
    of = loop_gains.over_repetitions(values)
    return {"value": of.value, "interval95": [of.low, of.high]}
