"""Where navigation may begin when nobody stated an attitude: the state found from IMU and fixes, with its covariance.

The recording is navigated over a window from a first guess. What fixes and standstills say against that solution is
the measurement of its linear error model, a Kalman filter whose fixed-point smoother corrects the guess:

    dr' = dv
    dv' = phi x f - C (b_a + f_b s_a) - (2 w_ie + w_en) x dv + 2 g/R dr_D + noise
    phi' = -w_in x phi - C (b_g + w_b s_g) + noise

with constant biases b and scale factor errors s of three accelerometers and gyros. The window is navigated again from
the corrected state until nothing changes: least squares, of which the process noise is a part. Levelling, gyro
compassing, offsets at rest and a heading from motion are all what this model makes of the data; where it makes
nothing of the heading, the heading is unknown and its sigma says so.

Source: Titterton and Weston, 2nd ed., chapters 10 and 12; Groves, 2nd ed., chapters 5 and 14.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np

from ins_eval.earth import EARTH_RATE, gravity, radii
from ins_eval.errors import DataRefused
from ins_eval.recording import Fixes, Recording, Start
from ins_eval.recording.belief import EarthBelief, GpsBelief
from ins_eval.recording.stillness import Stretch, still_stretches
from ins_eval.strapdown import SAMPLES_PER_STEP, Solution, navigate, quaternion_from_attitude
from ins_eval.units import DEG, DEG_PER_H, DEG_PER_SQRT_H, UG

STATES = 21
POSITION, VELOCITY, ATTITUDE = slice(0, 3), slice(3, 6), slice(6, 9)
GYRO_BIAS, ACCELEROMETER_BIAS, GYRO_SCALE, ACCELEROMETER_SCALE = (slice(k, k + 3) for k in (9, 12, 15, 18))

MOTION_S = 60.0  # of motion that a window holds
LONGEST_S = 300.0  # of a window that is made longer because its heading is not yet known
REST_S = 120.0  # of standstill before the motion
MOVING_MPS = 2.0
FAST = 0.3  # of the highest speeds: motion that tells a heading
STANDS_MPS = 0.5  # that a receiver shows of a vehicle that stands, or `GATE` sigmas of it
HALF_SPAN_S = 2.0  # over which positions are differentiated, to both sides: 0.7 m/s where they are good to 2 m
GUESSED_VELOCITY_MPS = 5.0  # sigma of the first velocity where it was differentiated
STILL_S = 5.0  # shortest standstill that is used
EDGE_S = 3.0  # of a standstill that is not used: the vehicle comes to rest and leaves it
STATED_HEADING_RAD = 5.0 * DEG
KNOWN_HEADING_RAD = 45.0 * DEG
ENOUGH_HEADING_RAD = 3.0 * DEG

TILT_SIGMA_RAD = 10.0 * DEG  # of a first guess
HEADING_SIGMA_RAD = 103.0 * DEG  # that of any heading: pi / sqrt(3)
WIDE_GYRO_BIAS_RADPS = 2000.0 * DEG_PER_H  # where no sigma of it is known
WIDE_ACCELEROMETER_BIAS_MPS2 = 5e4 * UG
COARSE_RADPS = 10.0 * DEG_PER_H  # a unit of a larger bias has scale factor errors of a MEMS, a better one those below
SCALE_SIGMA, FINE_SCALE_SIGMA = 5e-3, 1e-4
BIAS_WALK = 0.01  # of its sigma that a bias wanders in a minute
ZERO_VELOCITY_MPS = 0.02  # sway of a vehicle that stands
ZERO_RATE_RADPS = 2e-4  # mean rate of that sway over a second
DRIVE_SIDEWAYS_RAD = 5.0 * DEG  # of a wheeled vehicle, mounting included
WIND_MPS = 12.0  # turns the nose of a craft in flight away from its course

HEADINGS = 12  # first guesses
KEPT = (12, 6, 4, 2)  # guesses that go on, as the part of the window grows to whole
GROWTH = (10.0, 20.0, 40.0, np.inf)  # s of motion in each of these parts
PASSES = 8
SETTLED = 0.02  # of the sigmas: a change of the start that ends the passes
APART = np.log(20.0)  # a heading whose likelihood is nearer than this to the best's is a rival
LARGEST = 1e5  # of any error in its unit, beyond which a guess is given up
GATE = 5.0  # sigmas beyond which a fix is an outlier
PIECE_S, LEAST_PIECE_S = 30.0, 1.0  # of a recording that is followed from its first window on
MEDIAN_OF_SQUARE = 0.4549  # of a standard normal variable
MEDIAN_SPREAD = 2.34  # sigma of the median of n such squares, relative to it, times sqrt(n)
BEYOND_CHANCE = 2.0  # sigmas by which scatter or memory of the fixes must exceed chance to count


@dataclass(frozen=True, eq=False)
class Initialization:
    """A state to begin at, found from `window`.

    `covariance` (21, 21) belongs to errors, true less found: position (north, east, down) in m, velocity in m/s,
    attitude phi in rad (C_true = exp(phi x) C_found), biases of gyros in rad/s and of accelerometers in m/s^2, which
    are in the outputs beyond what is believed and were found to be `gyro_bias_radps` and `accelerometer_bias_mps2`,
    and scale factor errors. `fix_scale` is by how much the fixes scatter beyond their sigmas, position and velocity.
    `rival_headings_rad` are others that the window does not rule out.
    """

    start: Start
    gyro_bias_radps: np.ndarray
    accelerometer_bias_mps2: np.ndarray
    covariance: np.ndarray
    window: Stretch
    fix_scale: tuple[float, float] = (1.0, 1.0)
    rival_headings_rad: tuple[float, ...] = ()
    walks: tuple[float, float] = (0.0, 0.0)  # white noise of the increments: rad/sqrt(s), m/s/sqrt(s)
    first_error: np.ndarray | None = None  # smoothed (21,), of the window's first state
    path: Solution | None = None  # smoothed over the window, a row each step
    about: tuple[np.ndarray, np.ndarray] | None = None  # smoothed C (rows, 3, 3), C f (steps, 3): the next pass is
    # linear about them, and not about the noise that the solution has integrated, which would show a heading at rest
    log_likelihood: float = 0.0

    @property
    def sigmas(self) -> np.ndarray:
        """One sigma of each error, (21,)."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def heading_sigma_rad(self) -> float:
        """That of any heading where this is larger."""
        return float(min(self.sigmas[8], HEADING_SIGMA_RAD))

    @property
    def heading_known(self) -> bool:
        """Whether the window says anything of the heading; where it does not, that of the solution is arbitrary."""
        return self.heading_sigma_rad < KNOWN_HEADING_RAD


@dataclass(frozen=True, eq=False)
class Window:
    """What one window holds: increments, what was measured against them, and how good either is."""

    time_s: np.ndarray
    dtheta_b: np.ndarray
    dv_b: np.ndarray
    fixes: Fixes | None
    still_s: np.ndarray  # seconds at rest, (k, 2) begin and end
    lever_arm_m: np.ndarray
    fix_sigma: tuple[np.ndarray, np.ndarray]  # of position and velocity of each fix
    angle_walk: float  # rad/sqrt(s)
    velocity_walk: float  # m/s/sqrt(s)
    course_sigma: float | None  # rad for a drive; None: of a flight, by the wind
    moves_s: float  # when it first moves fast; the begin where it does not


def _until(window: Window, end_s: float) -> Window:
    """The part of a window that ends then."""
    n = max(SAMPLES_PER_STEP, int(np.searchsorted(window.time_s, end_s + 1e-6)))
    if n >= len(window.time_s):
        return window
    return replace(window, time_s=window.time_s[:n], dtheta_b=window.dtheta_b[:n], dv_b=window.dv_b[:n])


def find(recording: Recording, dtheta_b: np.ndarray, dv_b: np.ndarray) -> Initialization:
    """The state at the end of the first window that shows it.

    Parameters
    ----------
    dtheta_b, dv_b : (n, 3) increments in rad and m/s, with what is believed taken off

    The window holds the standstill before the first motion and a minute of motion, and is made longer, up to five
    minutes, while the heading is not known to 3 degrees. Without motion it is the standstill alone.
    Raises: DataRefused where there is neither a standstill nor fixes that move.
    """
    begin_s, moves_s, end_s, last_s = _first_window(recording)
    while True:
        window = replace(_window(recording, dtheta_b, dv_b, begin_s, end_s), moves_s=moves_s)
        found = _best(recording, window, begin_s)
        if end_s >= last_s or found.heading_sigma_rad < ENOUGH_HEADING_RAD:
            return found
        end_s = min(last_s, begin_s + 1.6 * (end_s - begin_s))


def follow(
    recording: Recording,
    begin: Initialization,
    dtheta_b: np.ndarray,
    dv_b: np.ndarray,
    until_s: float,
    gate: float = GATE,
) -> Initialization:
    """The state at `until_s`, from that of `begin` and what was measured in between, up to `gate` sigmas."""
    window = _window(recording, dtheta_b, dv_b, begin.start.time_s, until_s)
    window = replace(window, fix_sigma=tuple(s * x for s, x in zip(window.fix_sigma, begin.fix_scale, strict=True)))
    begin = replace(begin, about=None)
    first = _pass(window, begin, begin.covariance, np.zeros(STATES), gate)
    return replace(
        _pass(window, replace(begin, about=first.about), begin.covariance, np.zeros(STATES), gate), about=None
    )


def track(recording: Recording, begin: Initialization, dtheta_b: np.ndarray, dv_b: np.ndarray) -> Solution:
    """The whole way, from what was measured on it: smoothed over the window of `begin`, and piece by piece after it.

    Before the window the vehicle stands as it does at its begin.
    """
    last_s = float(recording.imu.time_s[-1])
    state, pieces = begin, [begin.path]
    while state.start.time_s < last_s - LEAST_PIECE_S:
        end_s = state.start.time_s + PIECE_S
        # no fix is left out: one that is late looks like an outlier wherever the motion is fast
        state = follow(recording, state, dtheta_b, dv_b, last_s if end_s > last_s - LEAST_PIECE_S else end_s, np.inf)
        pieces.append(state.path)
    parts = {name: [getattr(one, name)[:-1] for one in pieces] for name in Solution.__dataclass_fields__}
    return Solution(**{name: np.concatenate([*of, getattr(pieces[-1], name)[-1:]]) for name, of in parts.items()})


def _first_window(recording: Recording) -> tuple[float, float, float, float]:
    """Begin of the window, of the motion, end and latest end; the begin is that of a sample."""
    edges_s = np.concatenate([[recording.start.time_s], recording.imu.time_s])
    first_s, last_s = recording.start.time_s, float(recording.imu.time_s[-1])
    fixes, section, _ = _fixes(recording)
    offset_s = section.time_offset_s if fixes is not None else 0.0
    still = _still(recording, fixes, offset_s)
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
    chosen = max(still, key=lambda s: s.duration_s)
    end_s = min(chosen.end_s, chosen.start_s + REST_S)
    begin_s = float(edges_s[np.searchsorted(edges_s, chosen.start_s + 1e-6) - 1])
    return begin_s, begin_s, end_s, end_s


def _still(recording: Recording, fixes: Fixes | None, offset_s: float) -> list[Stretch]:
    """Standstills without their edges, those of the recording apart."""
    first_s, last_s = recording.start.time_s, float(recording.imu.time_s[-1])
    out = []
    for s in still_stretches(recording.imu, STILL_S + EDGE_S):
        begin_s = s.start_s if s.start_s <= first_s + 1.0 else s.start_s + EDGE_S
        end_s = s.end_s if s.end_s >= last_s - 1.0 else s.end_s - EDGE_S
        if end_s - begin_s >= STILL_S and _stands(fixes, offset_s, Stretch(begin_s, end_s)):
            out.append(Stretch(begin_s, end_s))
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
        time_s, latitude = fixes.time_s[use], fixes.latitude_rad[use]
        meridian, transverse = (r + float(fixes.height_m[use[0]]) for r in radii(float(latitude[0])))
        metre = np.column_stack(
            [meridian * latitude, transverse * np.cos(latitude[0]) * fixes.longitude_rad[use], -fixes.height_m[use]]
        )
        behind = np.searchsorted(time_s, time_s - HALF_SPAN_S - 1e-6)
        ahead = np.searchsorted(time_s, time_s + HALF_SPAN_S + 1e-6) - 1
        span_s = (time_s[ahead] - time_s[behind])[:, None]
        whole = span_s[:, 0] >= HALF_SPAN_S
        velocity_n[use[whole]] = (metre[ahead] - metre[behind])[whole] / span_s[whole]
    own = sigma_m if fixes.position_sigma_m is None else float(np.median(fixes.position_sigma_m))
    sigma = np.full(len(fixes.time_s), np.sqrt(2.0) * own / (2.0 * HALF_SPAN_S))
    return replace(fixes, velocity_n=velocity_n, velocity_sigma_mps=sigma)


def _stands(fixes: Fixes | None, offset_s: float, stretch: Stretch) -> bool:
    """Whether no fix within the stretch moves."""
    if fixes is None:
        return True
    at_s = fixes.time_s - offset_s
    inside = (at_s > stretch.start_s) & (at_s <= stretch.end_s) & fixes.valid
    sigma = 0.0 if fixes.velocity_sigma_mps is None else np.nanmedian(fixes.velocity_sigma_mps)
    return not (np.linalg.norm(fixes.velocity_n[inside], axis=1) > max(STANDS_MPS, GATE * sigma)).any()


def _window(recording, dtheta_b, dv_b, begin_s: float, end_s: float) -> Window:
    imu, belief = recording.imu, recording.belief
    rows = slice(*np.searchsorted(imu.time_s, [begin_s + 1e-6, end_s + 1e-6]))
    fixes, section, derived = _fixes(recording)
    offset_s = section.time_offset_s if fixes is not None else 0.0
    still = [s for s in _still(recording, fixes, offset_s) if s.end_s > begin_s and s.start_s < end_s]
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
    seconds = [
        np.column_stack([edges[:-1], edges[1:]])
        for s in still
        for edges in [np.arange(max(s.start_s, begin_s), min(s.end_s, end_s) + 1e-9, 1.0)]
        if edges.size > 1
    ]
    step_s = float(np.median(recording.interval_s[rows]))
    return Window(
        imu.time_s[rows],
        dtheta_b[rows],
        dv_b[rows],
        fixes,
        np.concatenate(seconds) if seconds else np.empty((0, 2)),
        np.asarray(section.lever_arm_m, dtype=float),
        sigma,
        _white(dtheta_b[rows], step_s, DEG_PER_SQRT_H * _stated(belief.gyro, "angle_random_walk_deg_per_sqrt_h")),
        _white(dv_b[rows], step_s, UG * _stated(belief.accelerometer, "velocity_random_walk_ug_per_sqrt_hz")),
        DRIVE_SIDEWAYS_RAD if recording.kind == "drive" else None,
        begin_s,
    )


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


def _prior(recording: Recording, window: Window, still: bool) -> np.ndarray:
    """Covariance (21,) of a first guess, squared sigmas."""
    belief = recording.belief
    gyro = DEG_PER_H * _stated(belief.gyro, "bias_sigma_deg_per_h") or WIDE_GYRO_BIAS_RADPS
    force = UG * _stated(belief.accelerometer, "bias_sigma_ug") or WIDE_ACCELEROMETER_BIAS_MPS2
    scale = SCALE_SIGMA if gyro > COARSE_RADPS else FINE_SCALE_SIGMA
    sigma = np.empty(STATES)
    sigma[POSITION] = 3.0 * window.fix_sigma[0].max(initial=1.0)
    velocity = window.fix_sigma[1]
    derived = velocity.size > 0 and not velocity.any()
    moving = GUESSED_VELOCITY_MPS if derived else max(1.0, 10.0 * velocity.max(initial=0.0))
    sigma[VELOCITY] = ZERO_VELOCITY_MPS if still else moving
    sigma[ATTITUDE] = TILT_SIGMA_RAD, TILT_SIGMA_RAD, _stated_heading_sigma(recording)
    sigma[GYRO_BIAS], sigma[ACCELEROMETER_BIAS] = gyro, force
    sigma[GYRO_SCALE], sigma[ACCELEROMETER_SCALE] = scale, scale
    return sigma**2


def _stated_heading_sigma(recording: Recording) -> float:
    """That of any heading where none is stated; a stated one without sigma is believed to 5 degrees."""
    if recording.start.attitude_rad is None:
        return HEADING_SIGMA_RAD
    stated = recording.start.attitude_sigma_rad
    return min(HEADING_SIGMA_RAD, STATED_HEADING_RAD if stated is None else stated[2])


def _best(recording: Recording, window: Window, begin_s: float) -> Initialization:
    """The most likely of several first headings, settled; what it leaves open is in its covariance."""
    still = bool(window.still_s.size) and window.still_s[0, 0] < begin_s + 1.0
    prior = np.diag(_prior(recording, window, still))
    guess = _guess(recording, window, begin_s, still)
    moving = window.fixes is not None and bool((np.linalg.norm(window.fixes.velocity_n, axis=1) > MOVING_MPS).any())
    open_heading = moving and _stated_heading_sigma(recording) > KNOWN_HEADING_RAD
    turns = 2.0 * np.pi * np.arange(HEADINGS) / HEADINGS if open_heading else [0.0]
    ends = [_turned(guess, angle) for angle in turns]
    for kept, seconds in zip(KEPT, GROWTH, strict=True):
        part = _until(window, window.moves_s + seconds)
        settled = (_settled(part, one, prior, PASSES) for one in ends)
        ends = sorted(settled, key=lambda one: -one.log_likelihood)[:kept]
    first = ends[0]
    if not np.isfinite(first.log_likelihood):
        raise DataRefused(
            f"{recording.name}: no attitude makes IMU and fixes agree from {begin_s:.6g} to {window.time_s[-1]:.6g} s; "
            "check axes, units and clocks (ins-eval import examines them), or give attitude_deg in [start]"
        )
    if window.fixes is not None:
        scale = _scatter(window, first, prior)
        wider = replace(window, fix_sigma=tuple(s * x for s, x in zip(window.fix_sigma, scale, strict=True)))
        ends = sorted((_settled(wider, one, prior, PASSES) for one in ends), key=lambda one: -one.log_likelihood)
        first, window = replace(ends[0], fix_scale=scale), wider
    end = replace(_pass(window, first, prior, np.zeros(STATES), GATE), fix_scale=first.fix_scale)
    return _with_rivals(end, [_pass(window, one, prior, np.zeros(STATES), GATE) for one in ends[1:]])


def _with_rivals(best: Initialization, others: list[Initialization]) -> Initialization:
    """Headings nearly as likely widen the covariance: that of the mixture about the best."""
    covariance = best.covariance.copy()
    rivals: list[float] = []
    heading = best.start.attitude_rad[2]
    for other in others:
        below = best.log_likelihood - other.log_likelihood
        away = _wrapped(other.start.attitude_rad[2] - heading)
        known = [0.0, *(_wrapped(one - heading) for one in rivals)]
        if below < APART and min(abs(_wrapped(away - one)) for one in known) > 3.0 * best.sigmas[8]:
            rivals.append(other.start.attitude_rad[2])
            covariance[8, 8] += np.exp(-below) / (1.0 + np.exp(-below)) * away**2
    return replace(best, covariance=covariance, rival_headings_rad=tuple(rivals))


def _guess(recording: Recording, window: Window, begin_s: float, still: bool) -> Initialization:
    """Level from gravity at rest, else attitude from the match of specific force and the velocities of the fixes."""
    start, fixes = recording.start, window.fixes
    gyro_bias = np.zeros(3)
    rest = window.time_s <= begin_s
    if window.still_s.size:
        spans = [(window.time_s > a) & (window.time_s <= b) for a, b in window.still_s]
        rest = np.any(spans, axis=0)
        gyro_bias = window.dtheta_b[rest].sum(axis=0) / window.still_s.shape[0]
        if np.linalg.norm(gyro_bias) < 3.0 * EARTH_RATE:  # as good as the turn of the Earth: the filter parts them
            gyro_bias = np.zeros(3)
    place = {"time_s": begin_s, "velocity_n": (0.0, 0.0, 0.0)}
    if fixes is not None and fixes.time_s.size and np.isfinite(fixes.latitude_rad).any():
        k = int(np.argmax(np.isfinite(fixes.latitude_rad)))
        v = fixes.velocity_n[k]
        meridian, transverse = radii(float(fixes.latitude_rad[k]))
        back_s = float(fixes.time_s[k] - begin_s)
        place |= {
            "latitude_rad": float(fixes.latitude_rad[k] - v[0] * back_s / meridian),
            "longitude_rad": float(
                fixes.longitude_rad[k] - v[1] * back_s / (transverse * np.cos(fixes.latitude_rad[k]))
            ),
            "height_m": float(fixes.height_m[k] + v[2] * back_s),
            "velocity_n": (0.0, 0.0, 0.0) if still else tuple(float(one) for one in v),
        }
    start = replace(start, **place, attitude_sigma_rad=None, still_until_s=None)
    if still:
        first = window.dv_b[rest & (window.time_s <= window.still_s[0, 0] + 10.0)]
        down = -first.sum(axis=0) / np.linalg.norm(first.sum(axis=0))
        attitude = (float(np.arctan2(down[1], down[2])), float(np.arcsin(np.clip(-down[0], -1.0, 1.0))), 0.0)
    elif fixes is not None:
        attitude = _matched(window, start, gyro_bias)
    else:
        attitude = (0.0, 0.0, 0.0)
    if recording.start.attitude_rad is not None:
        attitude = (*attitude[:2], recording.start.attitude_rad[2])
    start = replace(start, attitude_rad=attitude)
    return Initialization(
        start, gyro_bias, np.zeros(3), np.zeros((STATES, STATES)), Stretch(begin_s, float(window.time_s[-1]))
    )


def _matched(window: Window, start: Start, gyro_bias: np.ndarray) -> tuple[float, float, float]:
    """Attitude at the start for which integrated specific force agrees best with the velocities (Wahba's problem).

    v_k - v_j - g (t_k - t_j) e_D = C s_jk,   s the specific force integrated in the axes of the start.
    """
    from scipy.spatial.transform import Rotation

    still_earth = EarthBelief(
        rotation=False, coriolis=False, transport_rate=False, gravity_height=False, gravity_latitude=False
    )
    at = replace(start, velocity_n=(0.0, 0.0, 0.0), attitude_rad=(0.0, 0.0, 0.0))
    interval_s = np.diff(window.time_s, prepend=start.time_s)[:, None]
    turning = navigate(
        window.time_s, window.dtheta_b - gyro_bias * interval_s, window.dv_b, at, None, "free", earth=still_earth
    )
    g = gravity(0.25 * np.pi, 0.0)
    felt = turning.velocity_n - g * (turning.time_s - turning.time_s[0])[:, None] * [0.0, 0.0, 1.0]
    fixes = window.fixes
    use = np.isfinite(fixes.velocity_n).all(axis=1) & (fixes.time_s <= turning.time_s[-1])
    at_s, velocity = fixes.time_s[use], fixes.velocity_n[use]
    felt_at = np.column_stack([np.interp(at_s, turning.time_s, column) for column in felt.T])
    apart = max(1, round(1.0 / max(1e-3, float(np.median(np.diff(at_s)))))) if at_s.size > 1 else 1
    if at_s.size <= apart + 1:
        return (0.0, 0.0, 0.0)
    wanted = velocity[apart:] - velocity[:-apart]
    wanted[:, 2] -= g * (at_s[apart:] - at_s[:-apart])
    turn, _ = Rotation.align_vectors(wanted, felt_at[apart:] - felt_at[:-apart])
    heading, pitch, roll = turn.as_euler("ZYX")
    return float(roll), float(pitch), float(heading)


def _turned(guess: Initialization, angle: float) -> Initialization:
    """The guess with another heading."""
    roll, pitch, heading = guess.start.attitude_rad
    return replace(guess, start=replace(guess.start, attitude_rad=(roll, pitch, _wrapped(heading + angle))))


def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2.0 * np.pi) - np.pi)


def _settled(window: Window, guess: Initialization, prior: np.ndarray, passes: int) -> Initialization:
    """The guess of the window's first state, corrected until it changes no more."""
    taken = np.zeros(STATES)  # by how much the guess was corrected since the prior was its own
    guess = replace(guess, about=None)
    best = guess
    for k in range(passes):
        done = _pass(window, guess, prior, taken, GATE if k > 2 else np.inf)
        correction = done.first_error
        if not np.isfinite(done.log_likelihood) or np.abs(correction).max() > LARGEST:
            return replace(guess, log_likelihood=-np.inf)  # so far off that its linear model says nothing
        guess = _corrected(guess, correction)
        guess = replace(guess, log_likelihood=done.log_likelihood, about=done.about)
        taken = taken + correction
        if prior[8, 8] >= HEADING_SIGMA_RAD**2:
            taken[8] = 0.0  # the prior of any heading is flat
        best = guess
        if k > 0 and (np.abs(correction) < SETTLED * done.sigmas).all():
            break
    return best


def _corrected(state: Initialization, error: np.ndarray) -> Initialization:
    """The state with an error (21,), true less found, taken in."""
    from scipy.spatial.transform import Rotation

    start = state.start
    meridian, transverse = (r + start.height_m for r in radii(start.latitude_rad))
    turned = Rotation.from_rotvec(error[ATTITUDE]) * Rotation.from_quat(
        quaternion_from_attitude(start.attitude_rad), scalar_first=True
    )
    heading, pitch, roll = turned.as_euler("ZYX")
    return replace(
        state,
        start=replace(
            start,
            latitude_rad=float(start.latitude_rad + error[0] / meridian),
            longitude_rad=float(start.longitude_rad + error[1] / (transverse * np.cos(start.latitude_rad))),
            height_m=float(start.height_m - error[2]),
            velocity_n=tuple(float(v) for v in np.asarray(start.velocity_n) + error[VELOCITY]),
            attitude_rad=(float(roll), float(pitch), float(heading)),
        ),
        gyro_bias_radps=state.gyro_bias_radps + error[GYRO_BIAS],
        accelerometer_bias_mps2=state.accelerometer_bias_mps2 + error[ACCELEROMETER_BIAS],
    )


def _pass(window: Window, begin: Initialization, prior: np.ndarray, taken: np.ndarray, gate: float) -> Initialization:
    """Navigate the window from `begin` and filter what was measured; `prior` is about `begin` less `taken`."""
    solution, force_b, rate_b = _navigated(window, begin)
    if not np.isfinite(solution.velocity_n).all() or np.abs(solution.velocity_n).max() > LARGEST:
        return replace(begin, log_likelihood=-np.inf, first_error=np.zeros(STATES))
    mat_nb = _matrices(solution.quaternion_nb)
    about = begin.about or (mat_nb, np.einsum("nij,nj->ni", 0.5 * (mat_nb[:-1] + mat_nb[1:]), force_b))
    row, _, z, h, variance = _measured(window, begin, solution, mat_nb, about[0], rate_b)
    transition, noise = _dynamics(window, solution, about, force_b, rate_b, prior)
    smoothed, mean, covariance, log_likelihood, _ = filtered(
        transition, noise, row, z, h, variance, -taken, np.ascontiguousarray(prior), gate
    )
    last = len(solution.time_s) - 1
    path = _moved(solution, mat_nb, smoothed)
    end = replace(
        begin,
        start=replace(
            begin.start,
            time_s=float(solution.time_s[last]),
            latitude_rad=float(solution.latitude_rad[last]),
            longitude_rad=float(solution.longitude_rad[last]),
            height_m=float(solution.height_m[last]),
            velocity_n=tuple(float(v) for v in solution.velocity_n[last]),
            attitude_rad=tuple(float(a) for a in solution.attitude_rad[last]),
        ),
        covariance=covariance,
        window=Stretch(begin.window.start_s, float(solution.time_s[last])),
        first_error=smoothed[0],
        path=path,
        walks=(window.angle_walk, window.velocity_walk),
        about=(_matrices(path.quaternion_nb), _force(solution, path.velocity_n)),
        log_likelihood=float(log_likelihood),
    )
    return _corrected(end, mean)


def _navigated(window: Window, begin: Initialization) -> tuple[Solution, np.ndarray, np.ndarray]:
    """The solution, a row each step of four samples, with mean specific force and rate of each step, body axes."""
    interval_s = np.diff(window.time_s, prepend=begin.start.time_s)[:, None]
    dtheta_b = window.dtheta_b - begin.gyro_bias_radps * interval_s
    dv_b = window.dv_b - begin.accelerometer_bias_mps2 * interval_s
    solution = navigate(window.time_s, dtheta_b, dv_b, begin.start, None, "free")
    steps = len(solution.time_s) - 1
    by_step = slice(0, steps * SAMPLES_PER_STEP)
    length = np.diff(solution.time_s)[:, None]
    force_b = dv_b[by_step].reshape(steps, SAMPLES_PER_STEP, 3).sum(axis=1) / length
    rate_b = dtheta_b[by_step].reshape(steps, SAMPLES_PER_STEP, 3).sum(axis=1) / length
    return solution, force_b, rate_b


def _matrices(quaternion_nb: np.ndarray) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(quaternion_nb, scalar_first=True).as_matrix()


def _moved(solution: Solution, mat_nb: np.ndarray, errors: np.ndarray) -> Solution:
    """The solution, whose attitude is `mat_nb`, with errors (rows, 21), true less solution, taken in."""
    from scipy.spatial.transform import Rotation

    meridian, transverse = (r + solution.height_m for r in radii(solution.latitude_rad))
    turned = Rotation.from_rotvec(errors[:, ATTITUDE]) * Rotation.from_matrix(mat_nb)
    return Solution(
        solution.time_s,
        solution.latitude_rad + errors[:, 0] / meridian,
        solution.longitude_rad + errors[:, 1] / (transverse * np.cos(solution.latitude_rad)),
        solution.height_m - errors[:, 2],
        solution.velocity_n + errors[:, VELOCITY],
        turned.as_quat(scalar_first=True),
    )


def _cross(v: np.ndarray) -> np.ndarray:
    """The matrices (..., 3, 3) of v x."""
    out = np.zeros((*v.shape, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    return out - np.swapaxes(out, -1, -2)


def _turning(solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Rate of the Earth and transport rate (steps, 3) in the navigation frame."""
    latitude, v = solution.latitude_rad[:-1], solution.velocity_n[:-1]
    meridian, transverse = (r + solution.height_m[:-1] for r in radii(latitude))
    earth = EARTH_RATE * np.column_stack([np.cos(latitude), np.zeros_like(latitude), -np.sin(latitude)])
    return earth, np.column_stack([v[:, 1] / transverse, -v[:, 0] / meridian, -v[:, 1] * np.tan(latitude) / transverse])


def _force(solution: Solution, velocity_n: np.ndarray) -> np.ndarray:
    """Specific force (steps, 3) in the navigation frame that makes these velocities: v' + (2 w_ie + w_en) x v - g."""
    earth, transport = _turning(solution)
    middle = 0.5 * (velocity_n[:-1] + velocity_n[1:])
    force = np.diff(velocity_n, axis=0) / np.diff(solution.time_s)[:, None] + np.cross(2.0 * earth + transport, middle)
    force[:, 2] -= gravity(solution.latitude_rad[:-1], solution.height_m[:-1])
    return force


def _dynamics(window: Window, solution: Solution, about, force_b, rate_b, prior) -> tuple[np.ndarray, np.ndarray]:
    """Transitions (steps, 21, 21) and process noise (steps, 21, 21) from row to row; linear `about` C and C f."""
    c, force_n = about
    rest = np.zeros(len(force_n), dtype=bool)
    for begin_s, end_s in window.still_s:
        rest |= (solution.time_s[:-1] >= begin_s) & (
            solution.time_s[1:] <= end_s + solution.time_s[1] - solution.time_s[0]
        )
    force_n = np.where(rest[:, None], force_n * [0.0, 0.0, 1.0], force_n)  # at rest it is gravity
    middle = 0.5 * (c[:-1] + c[1:])
    dt = np.diff(solution.time_s)
    latitude, height = solution.latitude_rad[:-1], solution.height_m[:-1]
    earth, transport = _turning(solution)
    f = np.zeros((len(dt), STATES, STATES))
    f[:, POSITION, VELOCITY] = np.eye(3)
    f[:, 5, 2] = 2.0 * gravity(float(latitude[0]), float(height[0])) / (radii(latitude)[0] + height)
    f[:, VELOCITY, VELOCITY] = -_cross(2.0 * earth + transport)
    f[:, VELOCITY, ATTITUDE] = -_cross(force_n)
    f[:, ATTITUDE, ATTITUDE] = -_cross(earth + transport)
    f[:, ATTITUDE, GYRO_BIAS] = -middle
    f[:, VELOCITY, ACCELEROMETER_BIAS] = -middle
    f[:, ATTITUDE, GYRO_SCALE] = -middle * rate_b[:, None, :]
    f[:, VELOCITY, ACCELEROMETER_SCALE] = -middle * force_b[:, None, :]
    a = f * dt[:, None, None]
    transition = np.eye(STATES) + a + 0.5 * a @ a
    q = np.zeros((len(dt), STATES))
    q[:, VELOCITY], q[:, ATTITUDE] = window.velocity_walk**2, window.angle_walk**2
    walk = BIAS_WALK**2 / 60.0 * np.diag(prior)
    q[:, GYRO_BIAS], q[:, ACCELEROMETER_BIAS] = walk[GYRO_BIAS], walk[ACCELEROMETER_BIAS]
    return transition, np.einsum("ij,ni->nij", np.eye(STATES), q * dt[:, None])


def _measured(window: Window, begin: Initialization, solution: Solution, c, about, rate_b):
    """What was measured less the solution, whose attitude is `c`; designs are linear about the attitude `about`.

    Rows of the solution (k,), kinds (k,), values z (k, 3), designs (k, 3, 21) and variances (k, 3).

    Kinds are position 0, velocity 1, zero velocity 2, zero rate 3, course 4. What is not measured has a variance of 0.
    """
    rows, kinds, values, designs, variances = [], [], [], [], []

    def add(row: int, kind: int, z, h: np.ndarray, variance) -> None:
        rows.append(row)
        kinds.append(kind)
        values.append(z)
        designs.append(h)
        variances.append(np.where(np.isfinite(z), variance, 0.0))

    time_s = solution.time_s
    fixes, arm = window.fixes, window.lever_arm_m
    if fixes is not None:
        inside = fixes.time_s <= time_s[-1]
        at = np.clip(np.searchsorted(time_s, fixes.time_s), 1, len(time_s) - 1)
        share = np.clip((fixes.time_s - time_s[at - 1]) / (time_s[at] - time_s[at - 1]), 0.0, 1.0)
        meridian, transverse = (r + solution.height_m[0] for r in radii(solution.latitude_rad[0]))
        metre = np.array([meridian, transverse * np.cos(solution.latitude_rad[0]), -1.0])
        place = np.column_stack([solution.latitude_rad, solution.longitude_rad, solution.height_m])
        seen = np.column_stack([fixes.latitude_rad, fixes.longitude_rad, fixes.height_m])
        arm_n = c @ arm
        arm_v = np.einsum("nij,nj->ni", c, np.cross(np.vstack([rate_b[:1], rate_b]), arm))
        for k in np.flatnonzero(inside):
            j, x = at[k], share[k]
            p = (1.0 - x) * place[j - 1] + x * place[j]
            v = (1.0 - x) * solution.velocity_n[j - 1] + x * solution.velocity_n[j]
            h = np.zeros((3, STATES))
            h[:, POSITION], h[:, ATTITUDE] = np.eye(3), -_cross(arm_n[j])
            add(j, 0, (seen[k] - p) * metre - arm_n[j], h, window.fix_sigma[0][k] ** 2)
            h = np.zeros((3, STATES))
            h[:, VELOCITY], h[:, ATTITUDE] = np.eye(3), -_cross(arm_v[j])
            add(j, 1, fixes.velocity_n[k] - v - arm_v[j], h, window.fix_sigma[1][k] ** 2)
        _add_course(window, solution, add, at)
    latitude = solution.latitude_rad[0]
    earth_n = EARTH_RATE * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    for begin_s, end_s in window.still_s:
        j = int(np.searchsorted(time_s, end_s))
        if j >= len(time_s) or end_s <= begin_s:
            continue
        h = np.zeros((3, STATES))
        h[:, VELOCITY] = np.eye(3)
        add(j, 2, -solution.velocity_n[j], h, ZERO_VELOCITY_MPS**2)
        first = int(np.searchsorted(time_s, begin_s))
        if j > first:
            h = np.zeros((3, STATES))
            h[:, GYRO_BIAS], h[:, ATTITUDE] = np.eye(3), about[j].T @ _cross(earth_n)
            z = rate_b[first:j].mean(axis=0) - c[j].T @ earth_n
            add(j, 3, z, h, window.angle_walk**2 / (end_s - begin_s) + ZERO_RATE_RADPS**2)
    order = np.argsort(rows, kind="stable")
    if not rows:
        return (np.empty(0, int), np.empty(0, int), np.empty((0, 3)), np.empty((0, 3, STATES)), np.empty((0, 3)))
    pick = [np.asarray(one)[order] for one in (rows, kinds, values, designs, variances)]
    return pick[0], pick[1], np.nan_to_num(pick[2]), pick[3], pick[4]


def _add_course(window: Window, solution: Solution, add, at: np.ndarray) -> None:
    """The nose points along the course at the fastest fix, as far as such a vehicle does."""
    v = window.fixes.velocity_n
    speed = np.where(np.isfinite(v).all(axis=1), np.hypot(v[:, 0], v[:, 1]), 0.0)
    if not speed.size or speed.max() < MOVING_MPS:
        return
    k = int(np.argmax(speed))
    if window.fixes.time_s[k] > solution.time_s[-1]:
        return
    sigma = window.course_sigma or min(HEADING_SIGMA_RAD, np.arctan2(WIND_MPS, speed[k]))
    heading = solution.attitude_rad[at[k], 2]
    h = np.zeros((3, STATES))
    h[0, 8] = 1.0
    away = _wrapped(np.arctan2(v[k, 1], v[k, 0]) - heading)
    add(int(at[k]), 4, np.array([away, np.nan, np.nan]), h, sigma**2)


def _scatter(window: Window, first: Initialization, prior: np.ndarray) -> tuple[float, float]:
    """By how much positions and velocities scatter beyond their sigmas, at least 1; their memory counts as scatter."""
    solution, force_b, rate_b = _navigated(window, first)
    c = _matrices(solution.quaternion_nb)
    row, kind, z, h, variance = _measured(window, first, solution, c, first.about[0], rate_b)
    transition, noise = _dynamics(window, solution, first.about, force_b, rate_b, prior)
    *_, innovations = filtered(transition, noise, row, z, h, variance, np.zeros(STATES), np.ascontiguousarray(prior),
                                np.inf)  # fmt: skip
    out = []
    for of in (0, 1):
        mine = innovations[kind == of]
        mine = mine[np.isfinite(mine).all(axis=1)]
        if len(mine) < 8:
            out.append(1.0)
            continue
        mine = mine[len(mine) // 4 :]  # the first ones find the state
        size = float(np.median(mine**2)) / MEDIAN_OF_SQUARE
        bounded = np.clip(mine, -GATE * np.sqrt(size), GATE * np.sqrt(size))
        memory = float((bounded[1:] * bounded[:-1]).sum() / np.maximum((bounded**2).sum(), 1e-300))
        # what chance alone shows of either would widen every sigma a little, since nothing makes them narrower
        chance = BEYOND_CHANCE / np.sqrt(mine.size)
        memory = float(np.clip(memory, 0.0, 0.95)) if memory > chance else 0.0
        size = size if size > 1.0 + MEDIAN_SPREAD * chance else 1.0
        out.append(float(np.sqrt(size * (1.0 + memory) / (1.0 - memory))))
    return out[0], out[1]


@numba.njit(cache=True)
def filtered(transition, noise, row, z, h, variance, mean, covariance, gate):
    """Smoothed means of all rows (n, 21), mean and covariance of the last, log-likelihood, innovations (k, 3).

    Innovations are in sigmas, NaN where nothing was measured; one beyond `gate` is left out. The smoother is that of
    Bryson and Frazier: going back, lambda <- (I - K h')' lambda - h e / S at a measurement, F' lambda over a step, and
    the smoothed mean is x - P lambda.
    """
    n, rows = mean.shape[0], transition.shape[0] + 1
    x, p = mean.copy(), covariance.copy()
    means, covariances = np.empty((rows, n)), np.empty((rows, n, n))
    innovations = np.full((row.shape[0], 3), np.nan)
    gains, weighted = np.zeros((row.shape[0], 3, n)), np.zeros((row.shape[0], 3))
    logs = 0.0
    m = 0
    for k in range(rows):
        if k > 0:
            f = transition[k - 1]
            x = f @ x
            p = f @ p @ f.T + noise[k - 1]
        while m < row.shape[0] and row[m] <= k:
            for i in range(3):
                if variance[m, i] <= 0.0:
                    continue
                hi = h[m, i]
                ph = p @ hi
                s = hi @ ph + variance[m, i]
                e = z[m, i] - hi @ x
                innovations[m, i] = e / np.sqrt(s)
                if abs(innovations[m, i]) > gate:
                    logs -= 0.5 * (gate**2 + np.log(s))
                    continue
                logs -= 0.5 * (e * e / s + np.log(s))
                gains[m, i] = ph / s
                weighted[m, i] = e / s
                x += gains[m, i] * e
                p -= np.outer(gains[m, i], ph)
                for a in range(n):
                    for b in range(a):
                        p[a, b] = p[b, a] = 0.5 * (p[a, b] + p[b, a])
            m += 1
        means[k] = x
        covariances[k] = p
    smoothed = means.copy()
    back = np.zeros(n)
    for k in range(rows - 1, -1, -1):
        smoothed[k] = means[k] - covariances[k] @ back
        while m > 0 and row[m - 1] >= k:
            m -= 1
            for i in range(2, -1, -1):
                if weighted[m, i] != 0.0 or gains[m, i].any():
                    hi = h[m, i]
                    back = back - hi * (gains[m, i] @ back) - hi * weighted[m, i]
        if k > 0:
            back = transition[k - 1].T @ back
    return smoothed, x, p, logs, innovations
