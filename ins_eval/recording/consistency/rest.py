"""Units and signs of what is at rest, judged by what a standstill must show: gravity, and the rate of the Earth.

At rest  |f| = g  and  w . f = |f| W sin(latitude),  W the Earth's rate. A unit that is mixed up multiplies one of them
by a known factor. A gyro with the wrong sign shows its part of w . f with the wrong sign; as it was read it has a bias
that is twice this part, by chance. The size of a bias has the scale-free prior p(b) ~ 1 / |b|, so that the odds of the
sign are those of two sizes, |b as read| / |b with the sign changed|.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ins_eval.earth import EARTH_RATE, gravity
from ins_eval.recording import PARKED, Imu, Recording
from ins_eval.recording.consistency.alternatives import AXIS_PRIOR, MATRICES, MISTAKES, SIGN, SOURCE, Finding
from ins_eval.recording.stillness import still_stretches
from ins_eval.units import ARCSEC, DEG, DEG_PER_H, STANDARD_GRAVITY

SHORTEST_REST_S = 10.0
# Of the logarithm of a factor, by which what is no mix-up of units may be off, by reasoning: accelerometers of MEMS
# units by a bias of 100 mg beside gravity; gyros show theirs beside the rate of the Earth.
BIAS_OF_GRAVITY, GYRO_TOLERANCE = 0.1, 0.35
EARTH_RATE_FACTOR = 25.0  # a gyro at rest shows Earth rate and its bias; degrees for radians is a factor 57
EARTH_DIRECTION = 0.1  # part along gravity, from sin(latitude): Earth rate in another unit
LARGE_BIAS, SAME_DIRECTION = 5.0, 0.95  # of Earth rate; cosine to the bias
LEAST_BIAS = 1e-3  # of Earth rate: no smaller bias counts, for the mean is not known better
LEAST_INPUT_G = 0.5  # below it a bias shows more than a scale factor
CHAMBER_TOLERANCE = 0.35  # of the logarithm of a factor: of a single position a bias is a part
OF_CHAMBER = {
    1.0: "its sign is wrong",
    1e-3: "its output is given in thousands",
    1e3: "its output is given in thousandths",
    STANDARD_GRAVITY: "m/s^2 given for g",
    1.0 / STANDARD_GRAVITY: "g given for m/s^2",
    1e3 * STANDARD_GRAVITY: "mm/s^2 given for g",
    1e-3 / STANDARD_GRAVITY: "g given for mm/s^2",
}


def mix_up(factor: float, step_s: float, sensor: str) -> tuple[float, str] | None:
    """The mix-up of units that makes `factor`, exact and in words, if one does.

    None is taken for one that a bias or a scale factor could make: of increments at 10 Hz the two of g and the interval
    are 1.02 together.
    """
    known = {
        "accelerometer": {
            1.0 / STANDARD_GRAVITY: "g given for m/s^2",
            STANDARD_GRAVITY: "multiplied by g twice",
            1.0 / step_s: "rates given for increments",
            1.0 / step_s / STANDARD_GRAVITY: "rates in g given for increments in m/s",
            step_s: "increments divided or multiplied by the interval twice",
        },
        "gyro": {
            1.0 / DEG: "degrees given for radians",
            DEG: "radians converted from degrees twice",
            1.0 / ARCSEC: "arc seconds given for radians",
            1.0 / step_s: "rates given for increments",
            1.0 / step_s / DEG: "rates in degrees given for increments in radians",
        },
    }[sensor]
    known = {one: words for one, words in known.items() if abs(np.log(one)) > GYRO_TOLERANCE}
    if factor <= 0.0 or not known:
        return None
    tolerance = BIAS_OF_GRAVITY if sensor == "accelerometer" else GYRO_TOLERANCE
    near = min(known, key=lambda one: abs(np.log(factor / one)))
    return (near, known[near]) if abs(np.log(factor / near)) < tolerance else None


def check_chamber(input_g: np.ndarray, shown_g: np.ndarray) -> Iterator[Finding]:
    """Another unit or sign of an accelerometer that is turned to known parts of gravity, both (n,)."""
    fed = np.abs(input_g) > LEAST_INPUT_G
    size = float(np.median(shown_g[fed] / input_g[fed])) if fed.any() else 0.0
    if size == 0.0:
        return
    near = min(OF_CHAMBER, key=lambda one: abs(np.log(abs(size) / one)))
    if abs(np.log(abs(size) / near)) < CHAMBER_TOLERANCE and (near != 1.0 or size < 0.0):
        seen = f"the accelerometer shows {size:.3g} times the part of gravity that it feels: {OF_CHAMBER[near]}"
        mend = "correct the output, or what a pulse is worth"
        yield Finding("accelerometer.unit", seen, mend, factor=float(np.sign(size)) / near)


def at_rest(recording: Recording) -> tuple[Imu, float]:
    """The samples of the longest quiet stretch, and its length: a parked unit may be handled before and between."""
    return max(rests(recording), key=lambda one: one[1])


def rests(recording: Recording) -> list[tuple[Imu, float]]:
    """The samples of each quiet stretch, and its length; of all of it where it has none."""
    imu, quiet = recording.imu, still_stretches(recording.imu, SHORTEST_REST_S)
    if not quiet:
        return [(imu, float(imu.time_s[-1] - recording.start.time_s))]
    edges = [np.searchsorted(imu.time_s, [one.start_s + 1e-6, one.end_s + 1e-6]) for one in quiet]
    return [(imu.rows(slice(*rows)), float(recording.interval_s[slice(*rows)].sum())) for rows in edges]


def turns_as_the_earth(recording: Recording, rate_b: np.ndarray, force_b: np.ndarray) -> bool:
    """Whether the mean rate (3,) points as the Earth's does: a bias seldom has just its part along gravity."""
    size = float(np.linalg.norm(rate_b) * np.linalg.norm(force_b))
    along = float(rate_b @ force_b) / size if size > 0.0 else 0.0
    return bool(abs(along - np.sin(recording.start.latitude_rad)) < EARTH_DIRECTION)


def check_rest(recording: Recording) -> Iterator[Finding]:
    """Another unit of a triad of a parked unit, or another sign of one gyro."""
    if recording.kind not in PARKED or recording.imu.accelerometer_form != "increment":
        return
    imu, duration_s = at_rest(recording)
    force_b, rate_b = imu.accelerometer.sum(axis=0) / duration_s, imu.gyro.sum(axis=0) / duration_s
    step_s = duration_s / len(imu.time_s)
    size = float(np.linalg.norm(force_b)) / float(gravity(recording.start.latitude_rad, recording.start.height_m))
    unit = mix_up(size, step_s, "accelerometer")
    if unit is not None:
        yield Finding("accelerometer.unit", f"at rest the specific force is {size:.3g} times gravity: {unit[1]}",
                      "convert the accelerometer to m/s over the sample", factor=1.0 / unit[0])  # fmt: skip
    bias = np.zeros(3) if recording.belief.gyro.bias_radps is None else np.asarray(recording.belief.gyro.bias_radps)
    shown = _of_believed_bias(rate_b, bias, step_s)
    if shown is not None:
        yield shown
        return
    rate_b = rate_b - bias
    rate = float(np.linalg.norm(rate_b)) / EARTH_RATE
    unit = mix_up(rate, step_s, "gyro")
    if unit is not None and not 1.0 / EARTH_RATE_FACTOR < rate < EARTH_RATE_FACTOR:
        if turns_as_the_earth(recording, rate_b, force_b):
            yield Finding("gyro.unit", f"at rest the gyros show {rate:.3g} times Earth rate: {unit[1]}",
                          "convert the gyro to rad over the sample", factor=1.0 / unit[0])  # fmt: skip
    elif size > 0.0 and rate > 0.0 and abs(np.log(rate)) < GYRO_TOLERANCE:  # a unit that feels the Earth
        yield from _sign(recording, rate_b, force_b / np.linalg.norm(force_b))


def _of_believed_bias(rate_b: np.ndarray, bias: np.ndarray, step_s: float) -> Finding | None:
    """Another unit of gyros whose bias (3,) is known and hides the Earth: at rest they show it, in that unit."""
    size = float(np.linalg.norm(bias))
    if size < LARGE_BIAS * EARTH_RATE:
        return None
    times = float(np.linalg.norm(rate_b)) / size
    unit = mix_up(times, step_s, "gyro")
    if unit is None or rate_b @ bias < SAME_DIRECTION * size * size * times:
        return None
    seen = f"at rest the gyros show {times:.3g} times the bias that is believed of them: {unit[1]}"
    return Finding("gyro.unit", seen, "convert the gyro to rad over the sample", factor=1.0 / unit[0])


def _sign(recording: Recording, rate_b: np.ndarray, up_b: np.ndarray) -> Iterator[Finding]:
    """The gyro of which another sign leaves far less bias along gravity than is there as it was read."""
    expected = EARTH_RATE * np.sin(recording.start.latitude_rad)
    least = LEAST_BIAS * EARTH_RATE
    single = [k for k in range(len(MATRICES)) if (SOURCE[k] == range(3)).all() and MISTAKES[k] <= 1]
    biases = {k: max(abs(float(rate_b * SIGN[k] @ up_b) - expected), least) for k in single}
    best = min(biases, key=biases.__getitem__)
    log_odds = np.log(biases[0] / biases[best]) + AXIS_PRIOR * MISTAKES[best]
    if best == 0 or log_odds <= 0.0:
        return
    axis = "xyz"[int(np.argmin(SIGN[best]))]
    seen = (
        f"at rest gyro {axis} has a bias of {biases[0] / DEG_PER_H:.4g} deg/h along gravity, and of "
        f"{biases[best] / DEG_PER_H:.2g} deg/h if its sign is changed"
    )
    orders = ((np.eye(3), MATRICES[best]),)
    yield Finding("axes", seen, f"change the sign of gyro {axis}", float(log_odds), orders=orders)
