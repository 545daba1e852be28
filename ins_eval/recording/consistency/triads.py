"""Order, signs and units of the gyros and accelerometers, judged by what another navigator says of the motion.

With an attitude C (body to north, east, down) and velocity v of a reference, over an interval dt:

    rate = rotation vector of C_1^T C_2 / dt,   specific force = C^T (dv / dt - g).

Without one, a vehicle on wheels goes where it points: heading is the course, and the rate about down that of the
course; along, across and down the specific force is dv/dt, v times the rate of the course, and -g. In the air the
specific force is taken to point up in the body, of size |dv/dt - g|. Down is z and ahead is x, unless a start states
otherwise: then the axis that it states to be down is judged alone. How the vehicle points is not needed to hold the
triads against each other: `windows`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from ins_eval.earth import gravity
from ins_eval.random_processes import NORMAL_MAD
from ins_eval.recording import Fixes, Recording
from ins_eval.recording.consistency.alternatives import (
    AXIS_PRIOR,
    BEYOND_DOUBT,
    EXPLAINED,
    LIKELY,
    MATRICES,
    MISTAKES,
    UNIT_PRIOR,
    Finding,
    channel_scores,
    equations,
    order_scores,
    undecided,
    undecided_axes,
)
from ins_eval.recording.consistency.limits import changes
from ins_eval.recording.consistency.places import check_places
from ins_eval.recording.consistency.track import rows_apart, without_missing_down
from ins_eval.recording.consistency.windows import (
    FORCE_OFFSET,
    GYRO_OFFSET,
    HANDED,
    OFFSETS_S,
    RATE_FACTORS,
    RELATIVE,
    RELATIVE_FACTORS,
    Integrals,
    integrated,
    relative_scores,
)
from ins_eval.units import DEG, DEG_PER_SQRT_H, STANDARD_GRAVITY

FORCE_FACTORS = np.array([1.0, STANDARD_GRAVITY, 1.0 / STANDARD_GRAVITY, 1e-3 * STANDARD_GRAVITY,
                          1e3 / STANDARD_GRAVITY, 1e3, 1e-3, 2.0, 0.5])  # fmt: skip
RATE_FLOOR = np.full(3, 2e-3)  # rad/s
RATE_OFFSET = np.full(3, GYRO_OFFSET)
AHEAD = 0.25 * np.pi  # of a heading about the next of four ways to mount a box
FORCE_FLOOR = np.full(3, 0.1)  # m/s^2
LEVEL_OFFSET = np.array([FORCE_OFFSET, FORCE_OFFSET, 0.0])  # along and across; down it is little beside gravity
QUIET = np.log(3.0)  # of the logarithm by which gyros are quieter than their sheet, filtered ones too; by reasoning
ATTITUDES = {"as read": 1.0, "radians read as degrees": 1.0 / DEG, "degrees read as radians": DEG}
MOST_ROWS = 1500
MOVING_MPS = 3.0
FEWEST_FIXES = 20
ATTITUDE_STEP_S = 0.1
HELD_SHARE = 0.1
IN_AIR = 0.7  # of the rate of the course, that a gyro about down may leave: a wing that rocks shows it in none
MOST_NAMED = 3  # alternatives that the motion cannot tell apart
MOST_TRIED = 12  # of those that a navigation may tell apart: by reasoning
LEFT_HANDED_PRIOR = 3.0  # log prior against a mirrored set of both triads; to turn one is a commoner mistake
ONE_TRIAD_PRIOR = 1.0  # the same against triads that are not turned alike, a mistake of its own; both by reasoning
TURN_INTERVAL_S, FORCE_INTERVAL_S = 1.0, 1.0


def check_triads(recording: Recording) -> list[Finding]:
    """The alternative of both triads that the motion prefers by more than 20 to 1, or what it leaves open."""
    integrals = integrated(recording)
    moving, table = _table(recording, lambda fixes: fixes.velocity_n)
    if integrals is None or _holds(recording):
        return []
    attitude = _attitude(recording)
    if attitude is not None:
        return _by_attitude(recording, integrals, attitude, moving, table)
    if moving is None:
        placed, table = _table(recording, lambda fixes: fixes.latitude_rad)
        return [] if placed is None else [*check_places(recording, integrals, placed, table)]
    return _by_course(recording, integrals, moving, table)


def _holds(recording: Recording) -> bool:
    """Whether a channel holds one value for a tenth of the recording: it says nothing, and `validate` notes it."""
    imu = recording.imu
    for values in (*imu.gyro.T, *imu.accelerometer.T):
        rows = changes(values, recording.interval_s)
        if np.diff(np.concatenate([[-1], rows, [len(values) - 1]])).max() > HELD_SHARE * len(values):
            return True
    return False


def _table(recording: Recording, column: Callable[[Fixes], np.ndarray]) -> tuple[Fixes | None, str]:
    """The first table with enough values in a column, and its name."""
    for table in ("gps", "reference"):
        fixes = getattr(recording, table)
        if fixes is None:
            continue
        fixes, _ = without_missing_down(fixes)  # which is near enough to what a level way makes in a second
        use = fixes.valid & np.isfinite(column(fixes)).reshape(len(fixes.time_s), -1).all(axis=1)
        if use.sum() > FEWEST_FIXES and _together(recording, fixes.time_s[use]):
            return fixes, table
    return None, ""


def _attitude(recording: Recording) -> Fixes | None:
    fixes = recording.reference
    if fixes is None or fixes.attitude_rad is None:
        return None
    use = np.isfinite(fixes.attitude_rad).all(axis=1)
    return fixes if use.sum() > FEWEST_FIXES and _together(recording, fixes.time_s[use]) else None


def _together(recording: Recording, time_s: np.ndarray) -> bool:
    """Whether the stamps cover half of the IMU's time; with less the clocks themselves are in doubt."""
    first_s, last_s = recording.start.time_s, float(recording.imu.time_s[-1])
    common_s = min(last_s, float(time_s[-1])) - max(first_s, float(time_s[0]))
    return common_s > 0.5 * (last_s - first_s)


def _by_attitude(recording, integrals: Integrals, reference: Fixes, moving: Fixes | None, table: str) -> list[Finding]:
    use = np.flatnonzero(np.isfinite(reference.attitude_rad).all(axis=1))
    use = use[:: max(1, int(ATTITUDE_STEP_S / float(np.median(np.diff(reference.time_s[use])))))]
    time_s = reference.time_s[use] - recording.belief.reference.time_offset_s
    attitude = np.unwrap(reference.attitude_rad[use], axis=0)
    first, last = rows_apart(time_s, TURN_INTERVAL_S)
    rate = []
    for factor in ATTITUDES.values():
        turn = _rotations(factor * attitude)
        rate.append((turn[first].inv() * turn[last]).as_rotvec() / (time_s[last] - time_s[first])[:, None])
    rate = np.array(rate)
    chosen = _liveliest(rate[0])
    rate, first, last = rate[:, chosen], first[chosen], last[chosen]
    seen = _synchronous(rate[0], lambda o: integrals.rates("angle", time_s[first] - o, time_s[last] - o))
    by_rate = order_scores(
        channel_scores(rate, np.repeat(seen[None], 3, axis=0), RATE_FACTORS, RATE_FLOOR, RATE_OFFSET)
    )
    by_force = np.zeros((3, 48, len(FORCE_FACTORS)))
    if moving is not None:
        by_force = _force_by_attitude(recording, integrals, (time_s, attitude), moving, table)
    by_rate = by_rate + _quiet(recording)
    return _decided(by_rate, by_force, None, "the attitude of the reference" + (f" and {table}" if table else ""))


def _force_by_attitude(recording, integrals: Integrals, known, moving: Fixes, table: str) -> np.ndarray:
    """log L (3, 48, s) of the accelerometers under each unit of the attitude."""
    time_s, attitude = known
    at_s, velocity_n, down = _velocities(recording, moving, table)
    inside = (at_s >= time_s[0]) & (at_s <= time_s[-1])
    at_s, velocity_n = at_s[inside], velocity_n[inside]
    if len(at_s) < FEWEST_FIXES:
        return np.zeros((3, 48, len(FORCE_FACTORS)))
    first, last = rows_apart(at_s, FORCE_INTERVAL_S)
    dt = (at_s[last] - at_s[first])[:, None]
    felt_n = (velocity_n[last] - velocity_n[first]) / dt - np.array([0.0, 0.0, down])
    chosen = _liveliest(felt_n + np.array([0.0, 0.0, down]))
    felt_n, first, last = felt_n[chosen], first[chosen], last[chosen]
    middle_s = 0.5 * (at_s[first] + at_s[last])

    turns = [Slerp(time_s, _rotations(factor * attitude)) for factor in ATTITUDES.values()]

    def expected(offset_s: float, turn: Slerp) -> np.ndarray:
        return turn(np.clip(middle_s - offset_s, time_s[0], time_s[-1])).inv().apply(felt_n)

    # the stamps of the velocity against those of the attitude and the IMU, which here share a clock
    best, at = -1.0, 0.0
    for offset_s in OFFSETS_S:
        seen = integrals.rates("velocity", at_s[first] - offset_s, at_s[last] - offset_s)
        if (agreed := _agreement(expected(offset_s, turns[0]), seen)) > best:
            best, at = agreed, offset_s
    seen = integrals.rates("velocity", at_s[first] - at, at_s[last] - at)
    wanted = np.array([expected(at, turn) for turn in turns])
    return order_scores(channel_scores(wanted, np.repeat(seen[None], 3, axis=0), FORCE_FACTORS, FORCE_FLOOR))


def _by_course(recording: Recording, integrals: Integrals, moving: Fixes, table: str) -> list[Finding]:
    at_s, velocity_n, down = _velocities(recording, moving, table)
    first, last = rows_apart(at_s, FORCE_INTERVAL_S)
    dt = at_s[last] - at_s[first]
    speed = np.hypot(velocity_n[:, 0], velocity_n[:, 1])
    course = np.unwrap(np.arctan2(velocity_n[:, 1], velocity_n[:, 0]))
    turning = (course[last] - course[first]) / dt
    slow = np.minimum(speed[first], speed[last]) < MOVING_MPS
    along = (speed[last] - speed[first]) / dt
    across = 0.5 * (speed[first] + speed[last]) * turning
    wheels = recording.kind == "drive"
    down_b = _down(recording)
    (axis,) = np.flatnonzero(down_b)
    upwards = (velocity_n[last] - velocity_n[first]) / dt[:, None] - np.array([0.0, 0.0, down])
    rate, force = np.full((2, len(dt), 3), np.nan)
    rate[:, axis] = down_b[axis] * np.where(slow, np.nan, turning)
    force[:, axis] = down_b[axis] * (upwards[:, 2] if wheels else -np.linalg.norm(upwards, axis=1))
    if wheels and down_b[2] > 0.0 and _ahead(recording, course[first[~slow]]):
        force[:, 0], force[:, 1] = np.where(slow, np.nan, along), np.where(slow, np.nan, across)
    chosen = _liveliest(np.column_stack([along, across, across]))
    rate, force, first, last = rate[chosen], force[chosen], first[chosen], last[chosen]

    def seen(name: str, expected: np.ndarray) -> np.ndarray:
        return _synchronous(expected, lambda o: integrals.rates(name, at_s[first] - o, at_s[last] - o))

    left = EXPLAINED if wheels else IN_AIR
    angle = seen("angle", rate)[None]
    by_rate = order_scores(channel_scores(rate[None], angle, RATE_FACTORS, RATE_FLOOR, RATE_OFFSET, left))
    observed = seen("velocity", force)[None]
    by_force = order_scores(channel_scores(force[None], observed, FORCE_FACTORS, FORCE_FLOOR, LEVEL_OFFSET))
    arm_m = np.asarray(getattr(recording.belief, table).lever_arm_m, dtype=float)
    by_rate = by_rate + _quiet(recording)
    relative = relative_scores(integrals, at_s, velocity_n, down, arm_m)
    return _decided(by_rate, by_force, relative, f"{table} and its course" if wheels else table)


def _down(recording: Recording) -> np.ndarray:
    """The body axis (3,), with its sign, that points down at the start as it is stated; z where nothing is."""
    if recording.start.attitude_rad is None:
        return np.array([0.0, 0.0, 1.0])
    down_b = _rotations(np.array([recording.start.attitude_rad])).as_matrix()[0, 2]
    axis = int(np.argmax(np.abs(down_b)))
    return np.sign(down_b[axis]) * np.eye(3)[axis]


def _ahead(recording: Recording, course: np.ndarray) -> bool:
    """Whether x points where a vehicle drives off, on the first `course`, by the heading that its start states.

    Yes where none is stated. Of one that turned before it moved that fast fewer axes are judged.
    """
    attitude, sigma = recording.start.attitude_rad, recording.start.attitude_sigma_rad
    if attitude is None or (sigma is not None and sigma[2] > AHEAD) or not course.size:
        return True
    return bool(np.cos(course[0] - attitude[2]) > np.cos(AHEAD))


def _velocities(recording: Recording, moving: Fixes, table: str) -> tuple[np.ndarray, np.ndarray, float]:
    use = moving.valid & np.isfinite(moving.velocity_n).all(axis=1)
    at_s = moving.time_s[use] - getattr(recording.belief, table).time_offset_s
    down = float(gravity(recording.start.latitude_rad, recording.start.height_m))
    return at_s, moving.velocity_n[use], down


def _rotations(attitude_rad: np.ndarray) -> Rotation:
    return Rotation.from_euler("ZYX", attitude_rad[:, ::-1])


def _quiet(recording: Recording) -> np.ndarray:
    """Log prior (s,) of each unit of the gyros by their noise: motion makes it more than is believed, nothing less.

    It is -1/2 (log(n) / QUIET)^2 where n < 1 of the believed angle random walk of a sample is left.
    """
    density = recording.belief.gyro.angle_random_walk_deg_per_sqrt_h
    noise = float(np.median(np.abs(np.diff(recording.imu.gyro, axis=0)))) / (NORMAL_MAD * np.sqrt(2.0))
    if not density or noise == 0.0:  # nothing is stated, or rounding hides it
        return np.zeros(len(RATE_FACTORS))
    believed = DEG_PER_SQRT_H * density * np.sqrt(float(np.median(recording.interval_s)))
    return -0.5 * (np.minimum(0.0, np.log(RATE_FACTORS * noise / believed)) / QUIET) ** 2


def _liveliest(values: np.ndarray) -> np.ndarray:
    """Rows with the most motion, in order, without the largest hundredth, which may be faults."""
    size = np.linalg.norm(np.nan_to_num(values), axis=1)
    order = np.argsort(size)[: max(1, int(0.99 * len(size)))]
    return np.sort(order[-MOST_ROWS:])


def _agreement(expected: np.ndarray, seen: np.ndarray) -> float:
    """Sum over channels of the largest correlation, of either sign, with any column."""
    use = np.isfinite(seen).all(axis=1)
    total = 0.0
    for wanted in expected.T:
        rows = use & np.isfinite(wanted)
        if rows.sum() < 8 or np.std(wanted[rows]) == 0.0:
            continue
        a = wanted[rows] - wanted[rows].mean()
        b = seen[rows] - seen[rows].mean(axis=0)
        norm = np.linalg.norm(a) * np.linalg.norm(b, axis=0)
        total += float(np.max(np.abs(a @ b) / np.maximum(norm, 1e-300)))
    return total


def _synchronous(expected: np.ndarray, seen_at) -> np.ndarray:
    """What the IMU shows at the offset of the clocks at which it agrees best."""
    agreed = [_agreement(expected, seen_at(offset_s)) for offset_s in OFFSETS_S]
    plain = _agreement(expected, seen_at(0.0))
    offset_s = float(OFFSETS_S[int(np.argmax(agreed))]) if max(agreed) > 1.02 * plain else 0.0
    return seen_at(offset_s)


def _decided(by_rate, by_force, relative, by: str) -> list[Finding]:
    """The best of all orders and units of both triads (and units of the attitude) against what was read.

    by_rate (a, 48 g, s), by_force (a, 48 p, t), relative (2, 48, 4) or None.
    """
    rate_unit = UNIT_PRIOR * (RATE_FACTORS != 1.0)
    force_unit = UNIT_PRIOR * (FORCE_FACTORS != 1.0)
    rates = by_rate + rate_unit  # (a, g, s)
    if relative is not None:
        far = np.full((2, 48, len(RATE_FACTORS)), relative.min())
        far[:, :, : len(RELATIVE_FACTORS)] = relative
        joint = far[HANDED[:, None], RELATIVE]  # (p, g, s)
        rates = rates[:, None] + joint[None]
    else:
        rates = np.repeat(rates[:, None], 48, axis=1)  # (a, p, g, s)
    s_best, t_best = rates.argmax(axis=3), (by_force + force_unit).argmax(axis=2)
    total = rates.max(axis=3) + (by_force + force_unit).max(axis=2)[:, :, None]
    same = np.eye(48, dtype=bool)
    mistakes = np.where(same, MISTAKES, MISTAKES + MISTAKES[:, None])  # to turn the whole unit is no more than a triad
    against = np.where(same, LEFT_HANDED_PRIOR * HANDED, ONE_TRIAD_PRIOR)
    total = total + AXIS_PRIOR * mistakes - against
    total += UNIT_PRIOR * (np.arange(len(total)) > 0)[:, None, None]
    best = np.unravel_index(np.argmax(total), total.shape)
    log_odds = float(total[best] - rates[0, 0, 0, 0] - by_force[0, 0, 0])
    units = s_best[best], t_best[best[:2]]
    if log_odds < LIKELY or (*best, *units) == (0, 0, 0, 0, 0):
        near = total[0] > total[0, 0, 0] - LIKELY
        parts = [f"gyro {'xyz'[i]}" for i in undecided_axes(np.flatnonzero(near.any(axis=0)))]
        parts += [f"accelerometer {'xyz'[i]}" for i in undecided_axes(np.flatnonzero(near.any(axis=1)))]
        return undecided(
            f"the motion against {by.replace('gps', 'GPS')}", [f"order and sign of {', '.join(parts)}"] if parts else []
        )
    near = sorted(
        zip(*np.nonzero(total[best[0]] > total[best] - LIKELY), strict=True), key=lambda k: -total[best[0]][k]
    )
    near = [(int(p), int(g)) for p, g in near if p or g]
    orders = list(dict.fromkeys([*near[:MOST_NAMED], *[(p, g) for p, g in near if p == g][:1]]))
    named = _named(int(best[0]), orders, float(RATE_FACTORS[units[0]]), float(FORCE_FACTORS[units[1]]), log_odds, by)
    return [replace(named, orders=_matrices([*orders, *_alike(total[best[0]])])) if named.orders else named]


def _alike(total: np.ndarray) -> list[tuple[int, int]]:
    """Accelerometers and gyros by total (48, 48): one of the triads wrong, or the whole unit turned, likeliest first.

    Where it hardly turns the motion in windows tells little; a navigation tells more.
    """
    apart = [(p, g) for p, g in np.ndindex(total.shape) if (p or g) and (p == g or not p or not g)]
    near = [k for k in apart if total[k] > total.max() - BEYOND_DOUBT]
    return sorted(near, key=lambda k: -total[k])[:MOST_TRIED]


def _matrices(orders: Sequence[tuple[int, int]]) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    return tuple((MATRICES[p], MATRICES[g]) for p, g in dict.fromkeys(orders))


def _named(a: int, orders: list[tuple[int, int]], rate: float, force: float, log_odds: float, by: str) -> Finding:
    """The first thing to correct of the alternative that holds; what is left shows when it is read again."""
    seen = f"gyros and accelerometers contradict {by}, expected the same motion; it looks as if "
    if a:
        words = list(ATTITUDES)[a]
        mend = "give roll, pitch and heading in degrees, or state their unit"
        return Finding("attitude.unit", f"{seen}roll, pitch and heading are {words}", mend, log_odds,
                       value=words.split()[0][:3])  # fmt: skip
    if rate != 1.0:
        mend = f"multiply the gyros by {rate:.6g}"
        return Finding("gyro.unit", f"{seen}the gyros are in another unit, {rate:.6g} of the one read", mend, log_odds,
                       factor=rate)  # fmt: skip
    if force != 1.0:
        mend = f"multiply the accelerometers by {force:.6g}, or correct their scale"
        return Finding("accelerometer.unit",
                       f"{seen}the accelerometers are in another unit, {force:.6g} of the one read", mend, log_odds,
                       factor=force)  # fmt: skip
    words = " or ".join(_order_words(p, g) for p, g in orders)
    matrix = MATRICES[orders[0][0]] if orders[0][0] == orders[0][1] else None
    mend = f"correct order and signs of the columns ({words})"
    return Finding("axes", f"{seen}{words}", mend, log_odds, matrix=matrix, orders=_matrices(orders))


def _order_words(p: int, g: int) -> str:
    if p == g:
        handed = "" if np.linalg.det(MATRICES[p]) > 0.0 else ", a left-handed set as read"
        return f"the axes are {equations(MATRICES[p])}{handed}"
    parts = [f"the {name} are {equations(MATRICES[k])}" for name, k in (("gyros", g), ("accelerometers", p)) if k]
    return f"{' and '.join(parts)}, ours from those read"
