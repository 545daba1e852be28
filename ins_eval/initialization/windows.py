"""Which part of a recording shows a start, and what was measured in it: standstills, fixes, noise of the increments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ins_eval.earth import radii
from ins_eval.errors import DataRefused
from ins_eval.initialization.rest import Felt, rate_sigma, seconds_at_rest, velocity_sigma
from ins_eval.initialization.state import GATE, MOVING_MPS, Window
from ins_eval.recording import PARKED, Fixes, Recording
from ins_eval.recording.belief import GpsBelief
from ins_eval.recording.stillness import Stretch, still_stretches
from ins_eval.units import DEG, DEG_PER_H, DEG_PER_SQRT_H, UG

MOTION_S = 60.0  # of motion that a window holds
LONGEST_S = 300.0  # of a window that is made longer because its heading is not yet known
REST_S = 120.0  # of standstill before the motion
WIDE_GYRO_BIAS_RADPS = 2000.0 * DEG_PER_H  # where no sigma of it is known
WIDE_ACCELEROMETER_BIAS_MPS2 = 5e4 * UG
FAST = 0.3  # of the highest speeds: motion that tells a heading
STANDS_MPS = 0.5  # that a receiver shows of a vehicle that stands, or `GATE` sigmas of it
CREEP_S, CREEP_MPS = 10.0, 0.2  # over which slow motion stays and noise of fixes goes, what is left of it: by reasoning
CREEP_SHARE = 0.4  # sigma of such a mean over that of one velocity: of ten, or of positions that were differentiated
HALF_SPAN_S = 2.0  # over which positions are differentiated, to both sides: 0.7 m/s where they are good to 2 m
STILL_S = 5.0  # shortest standstill that is used
QUARTER_S = 0.25  # that a sample lasts at rest: by reasoning, four of them are a step
EDGE_S = 3.0  # of a standstill that is not used: the vehicle comes to rest and leaves it
DRIVE_SIDEWAYS_RAD = 5.0 * DEG  # of a wheeled vehicle, mounting included


def first_window(recording: Recording) -> tuple[float, float, float, float]:
    """Begin of the window, of the motion, end and latest end; the begin is that of a sample."""
    edges_s = np.concatenate([[recording.start.time_s], recording.imu.time_s])
    first_s, last_s = recording.start.time_s, float(recording.imu.time_s[-1])
    fixes, section, _ = _fixes(recording)
    offset_s = section.time_offset_s if fixes is not None else 0.0
    still = standstills(recording)
    if fixes is not None:
        speed = np.where(fixes.valid, np.linalg.norm(np.nan_to_num(fixes.velocity_n), axis=1), 0.0)
        fast = max(MOVING_MPS, FAST * float(np.quantile(speed, 0.95)))  # a receiver that settles shows some speed too
        moving = fixes.time_s[speed > fast] - offset_s
        moving = moving[(moving > first_s) & (moving < last_s)]
        if moving.size:
            before = [s for s in still if s.start_s < moving[0]]
            begin_s = max(first_s, min(before[-1].end_s, float(moving[0])) - REST_S) if before else first_s
            begin_s = max(begin_s, before[-1].start_s) if before else max(begin_s, float(moving[0]) - MOTION_S)
            begin_s = float(edges_s[np.searchsorted(edges_s, begin_s + 1e-6) - 1])
            end_s = min(last_s, float(moving[0]) + MOTION_S)
            return (
                begin_s,
                float(moving[0]),
                end_s,
                max(end_s, min(0.5 * (first_s + last_s), float(moving[0]) + LONGEST_S)),
            )
    if not still:
        raise DataRefused(
            f"{recording.name}: the attitude of the start is unknown, no standstill of {STILL_S:g} s was found and no "
            f"fix moves faster than {MOVING_MPS:g} m/s; give attitude_deg in [start], record some seconds at rest, or "
            "add the fixes of a GPS"
        )
    # a stated attitude is that of the first, and who is turned is followed from it on
    first = recording.start.attitude_rad is not None or recording.kind in PARKED
    chosen = still[0] if first else max(still, key=lambda s: s.duration_s)
    end_s = min(chosen.end_s, chosen.start_s + REST_S)
    begin_s = float(edges_s[np.searchsorted(edges_s, chosen.start_s + 1e-6) - 1])
    return begin_s, begin_s, end_s, end_s


def standstills(recording: Recording) -> list[Stretch]:
    """Standstills without their edges, those of the recording apart.

    Of a quiet stretch in which fixes move nothing is left, but of one on wheels what the fixes leave of it: on a smooth
    road noise hides from the IMU where it drives off. In the air a vehicle that hovers would stand.
    """
    fixes, section, _ = _fixes(recording)
    offset_s = section.time_offset_s if fixes is not None else 0.0
    first_s, last_s = recording.start.time_s, float(recording.imu.time_s[-1])
    out = []
    for s in still_stretches(recording.imu, STILL_S + EDGE_S):
        begin_s = s.start_s if s.start_s <= first_s + 1.0 else s.start_s + EDGE_S
        end_s = s.end_s if s.end_s >= last_s - 1.0 else s.end_s - EDGE_S
        whole = Stretch(begin_s, end_s)
        if fixes is None or not _moves(fixes, offset_s, whole).any():
            parts = [whole]
        else:
            parts = _parts(fixes, offset_s, whole) if recording.kind == "drive" else []
        out += [part for part in parts if part.duration_s >= STILL_S]
    return out


def _fixes(recording: Recording) -> tuple[Fixes | None, GpsBelief, bool]:
    """What velocities come from, what is believed of it, and whether they are positions that were differentiated."""
    tables = (recording.gps, recording.belief.gps), (recording.reference, recording.belief.reference)
    for fixes, section in tables:
        if fixes is not None and _has_velocities(fixes):
            return fixes, section, False
    for fixes, section in tables:
        if fixes is not None and _has_velocities(moving := _differentiated(fixes, section.position_sigma_m)):
            return moving, section, True
    return None, recording.belief.reference, False


def _has_velocities(fixes: Fixes) -> bool:
    return bool((fixes.valid & np.isfinite(fixes.velocity_n).all(axis=1)).any())


def _differentiated(fixes: Fixes, sigma_m: float) -> Fixes:
    """Positions with the velocities (p(t + h) - p(t - h)) / 2 h, of sigma sqrt(2) sigma_p / 2 h; NaN over gaps."""
    use = np.flatnonzero(fixes.valid & np.isfinite(fixes.latitude_rad + fixes.longitude_rad + fixes.height_m))
    velocity_n = np.full((len(fixes.time_s), 3), np.nan)
    if use.size > 1:
        time_s, latitude, longitude = fixes.time_s[use], fixes.latitude_rad[use], np.unwrap(fixes.longitude_rad[use])
        meridian, transverse = (r + float(fixes.height_m[use[0]]) for r in radii(float(latitude[0])))
        metre = np.column_stack(
            [meridian * latitude, transverse * np.cos(latitude[0]) * longitude, -fixes.height_m[use]]
        )
        behind = np.searchsorted(time_s, time_s - HALF_SPAN_S - 1e-6)
        ahead = np.searchsorted(time_s, time_s + HALF_SPAN_S + 1e-6) - 1
        span_s = (time_s[ahead] - time_s[behind])[:, None]
        whole = span_s[:, 0] >= HALF_SPAN_S
        velocity_n[use[whole]] = (metre[ahead] - metre[behind])[whole] / span_s[whole]
    own = sigma_m if fixes.position_sigma_m is None else float(np.median(fixes.position_sigma_m))
    sigma = np.full(len(fixes.time_s), np.sqrt(2.0) * own / (2.0 * HALF_SPAN_S))
    return replace(fixes, velocity_n=velocity_n, velocity_sigma_mps=sigma)


def _moves(fixes: Fixes, offset_s: float, stretch: Stretch) -> np.ndarray:
    """Which fixes move within the stretch, each one or on average, as of one who hovers or creeps."""
    at_s = fixes.time_s - offset_s
    inside = (at_s > stretch.start_s) & (at_s <= stretch.end_s) & fixes.valid
    sigma = GATE * _velocity_sigma(fixes)
    fast = np.linalg.norm(fixes.velocity_n, axis=1) > max(STANDS_MPS, sigma)
    rows = np.flatnonzero(inside & ~fast & np.isfinite(fixes.velocity_n).all(axis=1))
    fast[rows] = _creep(at_s[rows], fixes.velocity_n[rows], max(CREEP_MPS, CREEP_SHARE * sigma))
    return inside & fast


def _creep(at_s: np.ndarray, velocity_n: np.ndarray, least_mps: float) -> np.ndarray:
    """Which velocities (k, 3) lie in some `CREEP_S` over which they are at least so fast on average."""
    sums = np.concatenate([np.zeros((1, 3)), np.cumsum(velocity_n, axis=0)])
    begin, end = np.searchsorted(at_s, at_s - CREEP_S), np.arange(1, at_s.size + 1)
    mean = np.linalg.norm(sums[end] - sums[begin], axis=1) / (end - begin)
    of_windows = (mean > least_mps) & (at_s - at_s[begin] > 0.5 * CREEP_S)
    marks = np.zeros(at_s.size + 1)
    np.add.at(marks, begin[of_windows], 1.0)
    np.add.at(marks, end[of_windows], -1.0)
    return np.cumsum(marks[:-1]) > 0.0


def _velocity_sigma(fixes: Fixes) -> float:
    return 0.0 if fixes.velocity_sigma_mps is None else float(np.nanmedian(fixes.velocity_sigma_mps))


def _parts(fixes: Fixes, offset_s: float, stretch: Stretch) -> list[Stretch]:
    """What is left of a stretch in which fixes move: where they stand one after the other, without the edges.

    None where the receiver says that its velocities are too coarse for that: at walking pace they would stand as well.
    """
    if GATE * _velocity_sigma(fixes) > STANDS_MPS:
        return []
    moves = _moves(fixes, offset_s, stretch)
    at_s = fixes.time_s - offset_s
    rows = np.flatnonzero(fixes.valid & np.isfinite(fixes.velocity_n).all(axis=1))
    rows = rows[(at_s[rows] > stretch.start_s) & (at_s[rows] <= stretch.end_s)]
    broken = moves[rows[1:]] | moves[rows[:-1]] | (np.diff(at_s[rows]) > EDGE_S)
    runs = [run for run in np.split(rows, np.flatnonzero(broken) + 1) if run.size and not moves[run[0]]]
    begins = [stretch.start_s if run[0] == rows[0] else at_s[run[0]] + EDGE_S for run in runs]
    ends = [stretch.end_s if run[-1] == rows[-1] else at_s[run[-1]] - EDGE_S for run in runs]
    return [Stretch(float(begin_s), float(end_s)) for begin_s, end_s in zip(begins, ends, strict=True)]


def window_of(
    recording, dtheta_b, dv_b, begin_s: float, end_s: float, still: Sequence[Stretch] | None = None
) -> Window:
    """What is known between two instants; `still` are the standstills of the whole, where this is a part of it."""
    imu, belief = recording.imu, recording.belief
    rows = slice(*np.searchsorted(imu.time_s, [begin_s + 1e-6, end_s + 1e-6]))
    fixes, section, derived = _fixes(recording)
    offset_s = section.time_offset_s if fixes is not None else 0.0
    still = standstills(recording) if still is None else still
    still = [s for s in still if s.end_s > begin_s and s.start_s < end_s]
    sigma = np.empty(0), np.empty(0)
    if fixes is not None:
        at_s = fixes.time_s - offset_s
        use = fixes.valid & (at_s > begin_s) & (at_s <= end_s)
        fixes = _rows_of(replace(fixes, time_s=at_s), use)
        sigma = tuple(
            np.full(use.sum(), believed or least) if own is None else np.maximum(own, least)
            for own, believed, least in (
                (fixes.position_sigma_m, section.position_sigma_m, 0.05),
                (fixes.velocity_sigma_mps, section.velocity_sigma_mps, 0.01),
            )
        )
        if derived:  # the positions they come from are measured already, once
            sigma = sigma[0], np.zeros(use.sum())
    felt = Felt(imu.time_s[rows], dtheta_b[rows], dv_b[rows], recording.interval_s[rows])
    spans = (Stretch(max(s.start_s, begin_s), min(s.end_s, end_s)) for s in still)
    still_s = np.concatenate([np.empty((0, 2)), *(seconds_at_rest(felt, span) for span in spans)])
    step_s = float(np.median(felt.interval_s))
    angle_walk = _white(
        felt.dtheta_b, step_s, DEG_PER_SQRT_H * _stated(belief.gyro, "angle_random_walk_deg_per_sqrt_h")
    )
    return Window(
        *_longer_at_rest(felt, still_s),
        fixes,
        still_s,
        np.maximum(rate_sigma(felt, still_s), angle_walk),
        velocity_sigma(felt, still_s),
        np.asarray(section.lever_arm_m, dtype=float),
        sigma,
        angle_walk,
        _white(felt.dv_b, step_s, UG * _stated(belief.accelerometer, "velocity_random_walk_ug_per_sqrt_hz")),
        (
            DEG_PER_H * _stated(belief.gyro, "bias_sigma_deg_per_h") or WIDE_GYRO_BIAS_RADPS,
            UG * _stated(belief.accelerometer, "bias_sigma_ug") or WIDE_ACCELEROMETER_BIAS_MPS2,
        ),
        DRIVE_SIDEWAYS_RAD if recording.kind == "drive" else None,
        begin_s,
    )


def _longer_at_rest(felt: Felt, second_s: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (k,) and increments (k, 3) of samples of which those of a second at rest are taken together by quarters.

    Nothing turns there that would need more, and a standstill of minutes is most of a window.
    """
    if not len(second_s):
        return felt.time_s, felt.dtheta_b, felt.dv_b
    second = np.searchsorted(second_s[:, 0], felt.time_s - 1e-6) - 1
    at_rest = (second >= 0) & (felt.time_s <= second_s[second, 1] + 1e-6)
    quarter = np.minimum((felt.time_s - second_s[second, 0] - 1e-6) // QUARTER_S, 3)
    of = np.where(at_rest, 4 * second + quarter, -1 - np.arange(felt.time_s.size))
    first = np.flatnonzero(np.diff(of, prepend=np.nan) != 0.0)
    last = np.append(first[1:], felt.time_s.size) - 1
    return felt.time_s[last], *(np.add.reduceat(one, first) for one in (felt.dtheta_b, felt.dv_b))


def _rows_of(fixes: Fixes, use: np.ndarray) -> Fixes:
    columns = {name: None if values is None else values[use] for name, values in vars(fixes).items()}
    return Fixes(**columns)


def _stated(section, key: str) -> float:
    """The believed value, 0 where nobody stated one."""
    return float((section.model_dump(exclude_unset=True).get(key)) or 0.0)


def _white(increments: np.ndarray, step_s: float, stated: float) -> float:
    """White noise per square root of a second: what was stated, at least what the quieter half of the window shows."""
    if len(increments) < 3:
        return stated
    parts = max(1, min(40, len(increments) // 10))
    change = np.diff(increments, n=2, axis=0) / np.sqrt(6.0)  # second differences leave noise, smooth motion goes
    seen = [float(np.sqrt((part**2).mean())) for part in np.array_split(change, parts)]
    return max(stated, float(np.quantile(seen, 0.5)) / np.sqrt(step_s))
