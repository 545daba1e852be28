"""By how much the clock of GPS or of a reference differs from the IMU's, found from the motion itself.

Both see the same motion. For every offset tried, the IMU's motion over short intervals is compared with the other
navigator's, and the offset with the smallest residual is the answer; its uncertainty is a bootstrap over blocks of
10 s. Nothing need be known of attitude or of constant errors: they are fitted anew for every offset.

With attitude (a reference):  theta_k = M theta_gyro(t - offset) + b dt,  M (3, 3) and b (3,) for the whole recording.
With a course likewise, the course in place of the heading. With velocity (GPS):

    dv_k - g dt = C_w ds(t - offset),   s = integral of R f,

R the attitude from the gyros alone and C_w one rotation for each block (Wahba's problem, solved by singular values).
The offset is that of the horizontal channels; a receiver filters its vertical velocity in another way, so the spread
of the three channels is part of the uncertainty.

A clock that steps or drifts has another offset in the second half of a recording than in the first.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from ins_eval.earth import gravity
from ins_eval.recording import Fixes, Imu

BLOCK_S = 10.0
INTERVAL_S = 0.4  # over which velocities are differenced
COURSE_INTERVAL_S = 1.0
MOVING_MPS = 3.0  # slower, a course is noise
# between two clocks: a receiver of 1 Hz that smooths is late by less, and what jumps farther is no delay. By reasoning;
# fixes 1.0 and 1.5 s late are found in drives and a flight.
WIDEST_S = 2.0
COARSE_S = 0.02
FINE_S = 0.002
BOOTSTRAPS = 200
FEWEST_BLOCKS = 5
LONGEST_SIGMA_S = 0.1  # an offset known worse than this is not known
CLEAR_GAIN = 1.02  # residual at the ends of the search over that at the best offset
HORIZONTAL = slice(0, 2)
FINEST_STEP_S = 0.01  # the IMU is summed to about this step first
PRIOR = float(np.log(100.0))
SOMEWHERE_RAD = 0.25 * np.pi  # gravity of the receiver that gives no position: right to 0.3 per cent


@dataclass(frozen=True)
class Offset:
    """Stamp minus the IMU's stamp of the same instant, one sigma of it, and the residual there and without it.

    `gyro_scale` is the mean of the diagonal of M, 1 where the attitude was not used.
    """

    offset_s: float
    sigma_s: float
    method: str
    residual_rms: float
    residual_rms_unshifted: float
    unit: str
    gyro_scale: float = 1.0


@dataclass(frozen=True)
class Change:
    """Offsets of the first and of the second half, s, and one sigma of their difference."""

    before_s: float
    after_s: float
    sigma_s: float

    @property
    def log_odds(self) -> float:
        """Of a change against none: half the square of the difference in sigmas, with a prior of 100 to 1 against."""
        return 0.5 * ((self.after_s - self.before_s) / self.sigma_s) ** 2 - PRIOR


def clock_offset(imu: Imu, start_s: float, fixes: Fixes) -> Offset | None:
    """The offset of the clock of `fixes`, or None where the motion does not show it; `imu` in increments."""
    if fixes.attitude_rad is not None and np.isfinite(fixes.attitude_rad[fixes.valid]).all():
        return _from_attitude(imu, start_s, fixes)
    found = [one for one in (_from_velocity(imu, start_s, fixes), _from_course(imu, start_s, fixes)) if one is not None]
    return min(found, key=lambda one: one.sigma_s, default=None)


def clock_change(imu: Imu, start_s: float, fixes: Fixes) -> Change | None:
    """How the offset differs between the halves of a recording, or None where the motion does not show both."""
    middle_s = 0.5 * (start_s + float(imu.time_s[-1]))
    halves = []
    for part, begin_s, inside in (
        (imu.time_s <= middle_s, start_s, fixes.time_s <= middle_s),
        (imu.time_s > middle_s, middle_s, fixes.time_s > middle_s),
    ):
        if part.sum() < 2 or not (fixes.valid & inside).any():
            return None
        cut = Imu(imu.time_s[part], imu.gyro[part], imu.accelerometer[part], imu.accelerometer_form)
        halves.append(clock_offset(cut, begin_s, replace(fixes, valid=fixes.valid & inside)))
    if None in halves:
        return None
    before, after = halves
    sigma_s = float(np.hypot(np.hypot(before.sigma_s, after.sigma_s), COARSE_S))
    return Change(before.offset_s, after.offset_s, sigma_s)


def _from_attitude(imu: Imu, start_s: float, fixes: Fixes) -> Offset | None:
    use = np.flatnonzero(fixes.valid)
    roll, pitch, heading = fixes.attitude_rad[use].T
    mat_nb = Rotation.from_euler("ZYX", np.column_stack([heading, pitch, roll]))
    return _from_turning(imu, start_s, fixes.time_s[use], mat_nb, 0.0, "turn rates against the reference's attitude")


def _from_course(imu: Imu, start_s: float, fixes: Fixes) -> Offset | None:
    """As if the course were the heading of a level vehicle; M finds the gyro that turns with it, if any does."""
    north, east = fixes.velocity_n[:, 0], fixes.velocity_n[:, 1]
    use = np.flatnonzero(fixes.valid & (np.hypot(north, east) > MOVING_MPS))  # NaN compares false
    course = np.arctan2(east[use], north[use])
    mat_nb = Rotation.from_euler("Z", course[:, None])
    how = "turn rates against the course"
    found = _from_turning(imu, start_s, fixes.time_s[use], mat_nb, COURSE_INTERVAL_S, how)
    return None if found is None else replace(found, gyro_scale=1.0)


def _from_turning(imu: Imu, start_s, time_s, mat_nb: Rotation, interval_s: float, method: str) -> Offset | None:
    pairs = _pairs(time_s, interval_s, imu.time_s)
    if pairs is None:
        return None
    first, last, block = pairs
    turned = (mat_nb[first].inv() * mat_nb[last]).as_rotvec()
    clock_s, angle = _cumulative(imu.time_s, imu.gyro, start_s)
    dt = time_s[last] - time_s[first]

    def by_block(offset_s: float) -> np.ndarray:
        seen = _at(clock_s, angle, time_s - offset_s)
        row = np.column_stack([seen[last] - seen[first], dt, turned])
        return _by_block(row[:, :, None] * row[:, None, :], block)

    def residuals(offsets_s: np.ndarray):
        products = np.array([by_block(offset_s) for offset_s in offsets_s])  # (offsets, blocks, 7, 7)

        def total(weight: np.ndarray) -> np.ndarray:
            gram = np.einsum("b,obij->oij", weight, products)
            explained = np.einsum("oij,oij->o", gram[:, :4, 4:], _fitted(gram))
            return np.trace(gram[:, 4:, 4:], axis1=1, axis2=2) - explained

        return total

    found = _best(residuals, block, len(turned), method, "rad")
    if found is None:
        return None
    fitted = _fitted(by_block(found.offset_s).sum(axis=0)[None])[0]
    return replace(found, gyro_scale=float(np.trace(fitted[:3])) / 3.0)


def _fitted(gram: np.ndarray) -> np.ndarray:
    """M and b (offsets, 4, 3) from the products (offsets, 7, 7) of what the gyros and what the reference saw."""
    normal = gram[:, :4, :4] + 1e-12 * np.trace(gram[:, :4, :4], axis1=1, axis2=2)[:, None, None] * np.eye(4)
    return np.linalg.solve(normal, gram[:, :4, 4:])


@dataclass(frozen=True, eq=False)
class VelocityScan:
    """Changes of velocity of fixes (n, 3), m/s, gravity taken off, held against the IMU's at any offset of clocks.

    `first` and `last` (n,) are the rows of `time_s` between which each is, `block` (n,) the block of 10 s that it is
    in. `seen_s` and `seen` are times and integrals of the specific force.
    """

    wanted: np.ndarray
    time_s: np.ndarray
    first: np.ndarray
    last: np.ndarray
    block: np.ndarray
    seen_s: np.ndarray
    seen: np.ndarray

    @classmethod
    def of(cls, imu: Imu, start_s: float, fixes: Fixes) -> VelocityScan | None:
        """None where too few fixes have a velocity; `imu` in increments."""
        use = np.flatnonzero(fixes.valid & np.isfinite(fixes.velocity_n).all(axis=1))
        time_s, velocity_n = fixes.time_s[use], fixes.velocity_n[use]
        pairs = _pairs(time_s, INTERVAL_S, imu.time_s)
        if pairs is None:
            return None
        first, last, block = pairs
        down = float(gravity(_median(fixes.latitude_rad, SOMEWHERE_RAD), _median(fixes.height_m, 0.0)))
        wanted = velocity_n[last] - velocity_n[first]
        wanted[:, 2] -= down * (time_s[last] - time_s[first])
        return cls(wanted, time_s, first, last, block, *_integrated_force(imu, start_s))

    def squares(self, offsets_s: np.ndarray, channels: slice = HORIZONTAL) -> np.ndarray:
        """Sums of squares (offsets, blocks, channels) that are left at each offset."""
        return np.array([
            _left_over(self.wanted, _at(self.seen_s, self.seen, self.time_s - o), self.first, self.last, self.block)
            for o in offsets_s
        ])[:, :, channels]  # fmt: skip

    @property
    def block_s(self) -> np.ndarray:
        """The middle of each block (blocks,), s."""
        middle_s = 0.5 * (self.time_s[self.first] + self.time_s[self.last])
        return _by_block(middle_s, self.block) / np.bincount(self.block)

    @property
    def freedom(self) -> np.ndarray:
        """Horizontal differences of each block (blocks,) that tell something of their own, less a rotation.

        Of those that overlap one, and of neighbours, which share a fix, a half.
        """
        overlap = np.median(self.last - self.first)
        return np.maximum(0.5 * (2.0 * np.bincount(self.block) / overlap - 3.0), 0.0)


def _median(values: np.ndarray, otherwise: float) -> float:
    """Of what is known; a receiver may give velocities alone."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else otherwise


def _from_velocity(imu: Imu, start_s: float, fixes: Fixes) -> Offset | None:
    scan = VelocityScan.of(imu, start_s, fixes)
    if scan is None:
        return None

    def residuals(offsets_s: np.ndarray):
        squares = scan.squares(offsets_s, slice(None))

        def total(weight: np.ndarray, channels: slice = HORIZONTAL) -> np.ndarray:
            return np.einsum("obc,b->o", squares[:, :, channels], weight)

        return total

    block = scan.block
    found = _best(residuals, block, len(scan.wanted), "specific force against changes of velocity", "m/s")
    if found is None:
        return None
    near_s = found.offset_s + np.arange(-0.1, 0.1 + 0.5 * FINE_S, FINE_S)
    total, once = residuals(near_s), np.ones(block.max() + 1)
    channels_s = [_lowest(near_s, total(once, slice(axis, axis + 1))) for axis in range(3)]
    return replace(found, sigma_s=float(np.hypot(found.sigma_s, np.std(channels_s))))


def _left_over(wanted: np.ndarray, seen: np.ndarray, first: np.ndarray, last: np.ndarray, block: np.ndarray):
    """Sums of squares (blocks, 3) that the best rotation of each block leaves, by channel north, east, down."""
    felt = seen[last] - seen[first]
    left, _, right = np.linalg.svd(_by_block(wanted[:, :, None] * felt[:, None, :], block))
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    rotation = left @ right
    return _by_block((wanted - np.einsum("nij,nj->ni", rotation[block], felt)) ** 2, block)


def _best(residuals, block: np.ndarray, count: int, method: str, unit: str) -> Offset | None:
    """Search coarsely over a second either way, then finely; bootstrap over blocks."""
    blocks = int(block.max()) + 1
    once = np.ones(blocks)
    coarse_s = np.arange(-WIDEST_S, WIDEST_S + 0.5 * COARSE_S, COARSE_S)
    total = residuals(coarse_s)(once)
    k = int(np.argmin(total))
    if k in (0, len(total) - 1) or not np.isfinite(total).all() or total[[0, -1]].min() < CLEAR_GAIN * total[k]:
        return None
    fine_s = coarse_s[k] + np.arange(-0.1, 0.1 + 0.5 * FINE_S, FINE_S)
    curves = residuals(np.append(fine_s, 0.0))
    whole = curves(once)
    rng = np.random.default_rng(0)
    weights = rng.multinomial(blocks, np.full(blocks, 1.0 / blocks), BOOTSTRAPS)
    drawn_s = np.array([_lowest(fine_s, curves(weight.astype(float))[:-1]) for weight in weights])
    sigma_s = float(np.std(drawn_s))
    if sigma_s > LONGEST_SIGMA_S:
        return None
    rms, unshifted = np.sqrt(np.maximum([whole[:-1].min(), whole[-1]], 0.0) / count)
    return Offset(_lowest(fine_s, whole[:-1]), sigma_s, method, float(rms), float(unshifted), unit)


def _lowest(offsets_s: np.ndarray, values: np.ndarray) -> float:
    """Where the smallest value lies, by a parabola through its neighbourhood."""
    k = int(np.clip(np.argmin(values), 10, len(values) - 11))
    near = slice(k - 10, k + 11)
    curve = np.polyfit(offsets_s[near] - offsets_s[k], values[near], 2)
    shift_s = -curve[1] / (2.0 * curve[0]) if curve[0] > 0.0 else 0.0
    return float(offsets_s[k] + np.clip(shift_s, -0.02, 0.02))


def _pairs(time_s: np.ndarray, interval_s: float, imu_s: np.ndarray):
    """Pairs (first, last) of fixes at least `interval_s` apart that the IMU covers at every offset, and their block."""
    if len(time_s) < 3:
        return None
    step_s = float(np.median(np.diff(time_s)))
    ahead = max(1, round(interval_s / step_s))
    first = np.arange(len(time_s) - ahead)
    last = first + ahead
    inside = (time_s[first] - WIDEST_S >= imu_s[0]) & (time_s[last] + WIDEST_S <= imu_s[-1])
    inside &= time_s[last] - time_s[first] < 1.5 * ahead * step_s
    first, last = first[inside], last[inside]
    if not len(first):
        return None
    block = ((time_s[first] - time_s[first[0]]) / BLOCK_S).astype(int)
    _, block = np.unique(block, return_inverse=True)
    return (first, last, block) if block.max() + 1 >= FEWEST_BLOCKS else None


def _by_block(values: np.ndarray, block: np.ndarray) -> np.ndarray:
    """Sums over the rows of each block; `block` is sorted."""
    return np.add.reduceat(values, np.flatnonzero(np.diff(block, prepend=-1)), axis=0)


def _cumulative(time_s: np.ndarray, increments: np.ndarray, start_s: float):
    return np.append(start_s, time_s), np.vstack([np.zeros(3), np.cumsum(increments, axis=0)])


def _at(clock_s: np.ndarray, values: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    return np.column_stack([np.interp(time_s, clock_s, line) for line in values.T])


def _integrated_force(imu: Imu, start_s: float):
    """Times and the integral of the specific force in a frame that the gyros hold."""
    step_s = float(np.median(np.diff(imu.time_s)))
    together = max(1, int(FINEST_STEP_S / step_s))
    ends = np.arange(together - 1, len(imu.time_s), together)
    starts = ends - together + 1
    gyro = np.add.reduceat(imu.gyro, starts, axis=0)[: len(ends)]
    velocity = np.add.reduceat(imu.accelerometer, starts, axis=0)[: len(ends)]
    attitude = _chained(Rotation.from_rotvec(gyro).as_quat())
    before = np.vstack([[0.0, 0.0, 0.0, 1.0], attitude[:-1]])
    turned = Rotation.from_quat(before).apply(velocity + 0.5 * np.cross(gyro, velocity))
    return _cumulative(imu.time_s[ends], turned, start_s)


def _chained(quaternions: np.ndarray) -> np.ndarray:
    """All products q_0 q_1 ... q_k, by doubling the length of the chain."""
    chain, reach = quaternions, 1
    while reach < len(chain):
        product = (Rotation.from_quat(chain[:-reach]) * Rotation.from_quat(chain[reach:])).as_quat()
        chain = np.vstack([chain[:reach], product])
        reach *= 2
    return chain
