"""What was recorded against what a reference implies, channel by channel, and what the two clocks make of it.

Both are averaged over windows that IMU and reference can follow. Each channel is then taken as

    recorded - implied = bias + scale_error implied_own + misalignment implied_others + what remains

by least squares. What remains is coloured: noise at the epochs of the reference makes neighbouring windows differ in
opposite senses, slow drift makes them alike. So no formula for white noise gives a standard error here; all come from
the delete-one-block jackknife over 20 blocks of consecutive windows, intervals from Student's t with 19 degrees of
freedom. Source: Kunsch, Annals of Statistics 17 (1989) 1217, section 2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import signal
from scipy.special import stdtrit

from ins_eval.errors import DataRefused
from ins_eval.trajectory import Increments

CHANNELS = ("gyro_x", "gyro_y", "gyro_z", "accelerometer_x", "accelerometer_y", "accelerometer_z")
BLOCKS = 20
FEWEST_WINDOWS = 2 * BLOCKS
LIMIT = 5e-3  # a scale factor (or misalignment in rad) that is less sure than this is not determined
CLOCK_LIMIT_S = 0.02  # likewise for the offset of two clocks
FARTHEST_CLOCK_S = 2.0  # from the believed offset, that is searched
MISSING_FACTOR = 1.5  # a step longer than this many usual ones lacks samples
ROUNDING = 1e-6  # of a window or a sample


@dataclass(frozen=True)
class ChannelEstimate:
    """A value with its standard error and 95 % interval."""

    value: float
    standard_error: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class Windows:
    """Means over windows: `recorded` and `implied` (w, 6), gyros in rad/s, accelerometers in m/s^2.

    `time_s` (w,) is the end of each window, `length_s` their common length. Only windows that the reference covers
    wholly are here, so `time_s` may jump.
    """

    time_s: np.ndarray
    length_s: float
    recorded: np.ndarray
    implied: np.ndarray

    @property
    def difference(self) -> np.ndarray:
        return self.recorded - self.implied


@dataclass(frozen=True, eq=False)
class FittedChannel:
    """One channel; bias and departures in rad/s or m/s^2, `terms` on the implied x, y, z of its own triad.

    `mean_difference` mixes the bias with whatever scale factor and misalignment make of the mean input. Where terms
    could be separated, `bias` is the difference at zero input; else it is None, as are the terms that are not
    determined. `attenuation` is by how much noise of the reference, were it all that remains, could shrink the own
    gain. `density` is the Allan deviation of what remains at `Windows.length_s`, times its root: the density
    of white noise that would look the same there, in rad/sqrt(s) or m/s/sqrt(s).
    """

    name: str
    mean_difference: ChannelEstimate
    bias: ChannelEstimate | None
    terms: tuple[ChannelEstimate | None, ChannelEstimate | None, ChannelEstimate | None]
    rms_before: float
    rms_without_mean: float
    rms_after: float
    attenuation: float
    density: float
    neighbour_correlation: float  # of what remains, from window to window
    largest: float
    largest_s: float
    remaining: np.ndarray  # (w,)

    @property
    def axis(self) -> int:
        return CHANNELS.index(self.name) % 3

    def level_and_slope(self, windows: Windows) -> np.ndarray:
        """What bias and scale factor, as far as they are determined, make of the input of the own axis, (w,)."""
        level = (self.bias or self.mean_difference).value
        slope = self.terms[self.axis]
        return level + (0.0 if slope is None else slope.value) * windows.implied[:, CHANNELS.index(self.name)]


def in_windows(recorded: Increments, implied: Increments, start_s: float, length_s: float, epoch_s: float) -> Windows:
    """Means over windows of `length_s`, one of whose edges is at `epoch_s`, of two series at the same samples.

    Edges belong on the epochs of the reference, where its attitude and velocity are its own and not a curve's: so
    `length_s` is a multiple of their spacing. An edge within a sample divides its increment in proportion.
    Windows with a sample that is not implied, or with a gap in the recording, are left out.
    Raises DataRefused where fewer than 40 are left.
    """
    edges_s, intervals_s = np.concatenate([[start_s], recorded.time_s]), np.diff(recorded.time_s, prepend=start_s)
    both = np.hstack([recorded.dtheta_b, recorded.dv_b, implied.dtheta_b, implied.dv_b])
    known = np.isfinite(both).all(axis=1) & (intervals_s < MISSING_FACTOR * np.median(intervals_s))
    sums = np.vstack([np.zeros(12), np.cumsum(np.where(known[:, None], both, 0.0), axis=0)])
    unknown = np.concatenate([[0], np.cumsum(~known)])

    first_s = epoch_s + np.ceil((start_s - epoch_s) / length_s - ROUNDING) * length_s
    count = int((edges_s[-1] - first_s) / length_s + ROUNDING)
    bounds_s = np.clip(first_s + length_s * np.arange(count + 1), edges_s[0], edges_s[-1])
    sample = np.clip(np.searchsorted(edges_s, bounds_s, side="right") - 1, 0, intervals_s.size - 1)
    share = (bounds_s - edges_s[sample]) / intervals_s[sample]
    means = np.diff(sums[sample] + share[:, None] * (sums[sample + 1] - sums[sample]), axis=0) / length_s
    # the samples a window needs: not one that its edge only touches
    first, last = sample + (share > 1.0 - ROUNDING), sample + (share > ROUNDING)
    keep = unknown[last[1:]] == unknown[first[:-1]]
    if np.count_nonzero(keep) < FEWEST_WINDOWS:
        raise DataRefused(
            f"reference: it covers {np.count_nonzero(keep)} windows of {length_s:g} s of the recording, "
            f"expected at least {FEWEST_WINDOWS} to separate a difference from noise; check its clock and its gaps"
        )
    return Windows(bounds_s[1:][keep], length_s, means[keep, :6], means[keep, 6:])


def fit_channels(windows: Windows) -> tuple[FittedChannel, ...]:
    """The six channels in the order of `CHANNELS`."""
    difference = windows.difference
    out = []
    for triad in (slice(0, 3), slice(3, 6)):
        implied = windows.implied[:, triad]
        centred = implied - implied.mean(axis=0)
        variance = centred.var(axis=0)
        moves = variance > 1e-20 * np.maximum(1.0, np.square(implied).mean(axis=0))
        rest = difference[:, triad] - difference[:, triad].mean(axis=0)
        rest = rest - centred[:, moves] @ np.linalg.lstsq(centred[:, moves], rest, rcond=None)[0]
        attenuation = np.divide(rest.var(axis=0), variance, out=np.full(3, np.inf), where=moves)
        for axis, name in enumerate(CHANNELS[triad]):
            out.append(_fit(name, windows, difference[:, triad][:, axis], implied, attenuation))
    return tuple(out)


def _fit(
    name: str, windows: Windows, difference: np.ndarray, implied: np.ndarray, attenuation: np.ndarray
) -> FittedChannel:
    """Least squares on those of the three implied signals whose coefficient is determined."""
    axis = CHANNELS.index(name) % 3
    blocks = _blocks(difference.size)
    candidates = [j for j in range(3) if attenuation[j] <= LIMIT]
    while True:
        regressors = np.column_stack([np.ones(difference.size), implied[:, candidates]])
        estimates, coefficients = _jackknife(regressors, difference, blocks)
        errors = [e.standard_error for e in estimates[1:]]
        if not errors or max(errors) <= LIMIT:
            break
        candidates.pop(int(np.argmax(errors)))
    terms: list[ChannelEstimate | None] = [None, None, None]
    for j, estimate in zip(candidates, estimates[1:], strict=True):
        terms[j] = estimate
    mean_difference = _jackknife(np.ones((difference.size, 1)), difference, blocks)[0][0]
    remaining = difference - regressors @ coefficients
    worst = int(np.argmax(np.abs(remaining)))
    return FittedChannel(
        name=name,
        mean_difference=mean_difference,
        bias=estimates[0] if candidates else None,
        terms=tuple(terms),
        rms_before=_rms(difference),
        rms_without_mean=_rms(difference - difference.mean()),
        rms_after=_rms(remaining),
        attenuation=float(attenuation[axis]),
        **_noise(remaining, windows),
        largest=float(remaining[worst]),
        largest_s=float(windows.time_s[worst]),
        remaining=remaining,
    )


def _noise(remaining: np.ndarray, windows: Windows) -> dict[str, float]:
    """Allan deviation at one window and correlation of neighbours, both over neighbours that touch."""
    touch = np.diff(windows.time_s) < MISSING_FACTOR * windows.length_s
    earlier, later = remaining[:-1][touch], remaining[1:][touch]
    variance = float(np.mean(np.square(remaining)))
    return {
        "density": float(np.sqrt(0.5 * np.mean((later - earlier) ** 2) * windows.length_s)) if touch.any() else np.nan,
        "neighbour_correlation": float(np.mean(earlier * later) / variance) if touch.any() and variance else 0.0,
    }


def find_clock(
    recorded: Increments,
    implied_at: Callable[[float], Increments],
    start_s: float,
    length_s: float,
    stamp_s: float,
    believed_s: float,
) -> ChannelEstimate | None:
    """Offset of the reference's clock from the IMU's, stamp minus stamp of the same instant, from the gyros.

    The lag of the highest cross-correlation, within 2 s of `believed_s`, is refined by Gauss-Newton: the
    difference that bias, scale factors and misalignments leave, regressed on what one second of offset would change.
    `implied_at` gives the increments that the reference implies with an offset, `stamp_s` is one of its stamps.
    None where the motion does not determine the offset to 20 ms.
    """
    step_s = float(np.median(np.diff(recorded.time_s)))
    lag = _lag(recorded.dtheta_b, implied_at(believed_s).dtheta_b, round(FARTHEST_CLOCK_S / step_s))
    offset_s = believed_s + step_s * lag
    for _ in range(5):
        ahead, behind = implied_at(offset_s + 0.5 * step_s), implied_at(offset_s - 0.5 * step_s)
        middle = Increments(ahead.time_s, 0.5 * (ahead.dtheta_b + behind.dtheta_b), 0.5 * (ahead.dv_b + behind.dv_b))
        windows = in_windows(recorded, middle, start_s, length_s, stamp_s - offset_s)
        slope = in_windows(ahead, behind, start_s, length_s, stamp_s - offset_s)  # the same windows
        correction = _shift(windows, slope.difference[:, :3] / step_s)
        if correction is None or correction.standard_error > CLOCK_LIMIT_S:
            return None
        offset_s += correction.value
        if abs(correction.value) < 0.01 * correction.standard_error:
            break
    if abs(offset_s - believed_s) > FARTHEST_CLOCK_S:
        return None
    reach = 0.5 * (correction.high - correction.low)
    return ChannelEstimate(offset_s, correction.standard_error, offset_s - reach, offset_s + reach)


def _lag(recorded: np.ndarray, implied: np.ndarray, farthest: int) -> int:
    """Samples by which the reference's stamps are ahead of the IMU's, by cross-correlation of three channels."""
    known = np.isfinite(implied).all(axis=1)
    a = np.where(known[:, None], recorded - recorded[known].mean(axis=0), 0.0)
    b = np.where(known[:, None], implied - implied[known].mean(axis=0), 0.0)
    together = sum(signal.correlate(b[:, j], a[:, j], method="fft") for j in range(3))
    middle = recorded.shape[0] - 1
    reach = min(farthest, middle)
    return int(np.argmax(together[middle - reach : middle + reach + 1])) - reach


def _shift(windows: Windows, effect: np.ndarray) -> ChannelEstimate | None:
    """One offset that the three gyros share; `effect` (w, 3) is what one second of it changes."""
    regressors = np.column_stack([np.ones(windows.time_s.size), windows.implied[:, :3]])
    both = np.hstack([windows.difference[:, :3], effect])
    both = both - regressors @ np.linalg.lstsq(regressors, both, rcond=None)[0]
    rest, effect = both[:, :3], both[:, 3:]
    scale = rest.std(axis=0)
    if not scale.all() or not effect.any():
        return None
    # one column a window each gyro, equally sure; the blocks hold all three
    blocks = np.repeat(_blocks(windows.time_s.size), 3)
    return _jackknife((effect / scale).reshape(-1, 1), (rest / scale).ravel(), blocks)[0][0]


def _blocks(count: int) -> np.ndarray:
    """The block, 0 to 19, of each of `count` windows."""
    return np.arange(count) * BLOCKS // count


def _jackknife(
    regressors: np.ndarray, values: np.ndarray, blocks: np.ndarray
) -> tuple[list[ChannelEstimate], np.ndarray]:
    """Least squares of `values` (n,) on `regressors` (n, p), each with its error from leaving out a block at a time."""
    size = np.linalg.norm(regressors, axis=0)
    scaled = regressors / size
    products = np.array([scaled[blocks == b].T @ scaled[blocks == b] for b in range(BLOCKS)])
    sums = np.array([scaled[blocks == b].T @ values[blocks == b] for b in range(BLOCKS)])
    whole = np.linalg.lstsq(scaled, values, rcond=None)[0] / size
    without = np.array(
        [
            np.linalg.lstsq(products.sum(axis=0) - product, sums.sum(axis=0) - part, rcond=1e-13)[0] / size
            for product, part in zip(products, sums, strict=True)
        ]
    )
    error = np.sqrt((BLOCKS - 1) / BLOCKS * np.square(without - without.mean(axis=0)).sum(axis=0))
    reach = stdtrit(BLOCKS - 1, 0.975) * error
    return [
        ChannelEstimate(float(v), float(e), float(v - r), float(v + r))
        for v, e, r in zip(whole, error, reach, strict=True)
    ], whole


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
