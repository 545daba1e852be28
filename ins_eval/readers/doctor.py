"""What a recording shows of itself, held against what its reader took it for.

Of every reader's result alike: sample rate and its spread, size and direction of the specific force in the quietest
second, gyro rates there, clocks, overlap of the streams, temperature; and the list of `consistency`, which tries other
orders, signs and units. What is found is written into the notes; what cannot be right is refused in one sentence with
the ``--assume`` that mends it, where one does, and the one that insists. Nothing is converted here: a reader took a
value for g because a mapping, a format or the user said so.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np
from pymap3d import geodetic2enu

from ins_eval.earth import gravity
from ins_eval.errors import DataRefused
from ins_eval.readers.layout import ACCELEROMETER_UNITS, GYRO_UNITS, choose, frd_from, letters
from ins_eval.recording import Fixes, Imu, Recording, consistency
from ins_eval.recording.begin import NAMES
from ins_eval.recording.consistency.alternatives import LIKELY, equations
from ins_eval.recording.consistency.clocks import Offset, clock_change, clock_offset
from ins_eval.units import DEG, STANDARD_GRAVITY

KEYS = ("overlap", "position.unit", consistency.KEY)  # beside those of a format's layout

FEWEST_SAMPLES = 3
WINDOW_S = 1.0
FORCE_FACTOR = 2.0  # the quietest second of a moving vehicle still feels gravity within this factor
QUIET_RATE_RADPS = 1.0  # no vehicle turns at 57 deg/s in its quietest second
LARGEST_RATE_RADPS = 40.0  # that a hundredth of all samples may exceed: 2300 deg/s, beyond the range of any triad
SMALLEST_COSINE = 0.5  # between the specific force and up
OVERLAP = 0.5
CLOCK_WARNING_S = 0.005
SMALLEST_CHANGE_S = 0.1  # of the offset, between the halves of a recording
STAMP_NOTE = 0.05  # of the step, spread of the stamps that is mentioned
MOVED_M = 50.0
POSITION_FACTOR = 10.0
GYRO_FACTOR = 1.5

# what the readers say they took, in the words of `Layout.notes`
TAKEN_AXES = re.compile(r"The axes x, y, z are taken as (\S+?)(?: and were turned to forward-right-down)?, because")
TAKEN_GYRO = re.compile(r"The gyro values are taken as \w+ in (.+?), because")
TAKEN_ACCELEROMETER = re.compile(r"The accelerometer values are taken as \w+ in (.+?), because")

AXES = ("forward", "right", "down")
OPPOSITE = {"forward": "backward", "right": "left", "down": "up"}


@dataclass(frozen=True)
class Quietest:
    """The quietest second: its end, mean specific force (3,) in m/s^2 or None in pulses, mean rate (3,) in rad/s."""

    time_s: float
    force_b: np.ndarray | None
    rate_b: np.ndarray


def examine(recording: Recording, assumed: Mapping[str, str], keys: Collection[str]) -> Recording:
    """The recording with what was found added to its notes; `keys` are those that its format lets a user assume.

    Raises `DataRefused` for a finding that cannot be right and that `assumed` does not insist on.
    """
    if recording.imu is None or len(recording.imu.time_s) < FEWEST_SAMPLES:
        return recording  # nothing to be found; validation refuses it
    if "overlap" in assumed:
        choose("overlap", assumed["overlap"], ("short",))
    if consistency.KEY in assumed:
        choose(consistency.KEY, assumed[consistency.KEY], ("warn",))
    with np.errstate(all="ignore"):  # damaged values overflow, and are refused by the size of what comes of them
        notes = _findings(recording, assumed, keys)
    return replace(recording, notes=(*recording.notes, *(note for note in notes if note not in recording.notes)))


def _findings(recording: Recording, assumed: Mapping[str, str], keys: Collection[str]) -> list[str]:
    where = f"recording '{recording.name}'"
    imu = recording.imu
    found = consistency.findings(recording)
    remedy = _remedy(recording, keys)
    of_motion = {"axes", "gyro.unit", "accelerometer.unit", "attitude.unit"}
    mends = _remedy(recording, keys, insist=False)
    mending = {key: next((f"; {mends(one)}" for one in found if one.key == key), "") for key in of_motion}
    others = [one for one in found if one.key not in of_motion]
    notes = [_rate(recording), *consistency.report(recording, others, where, assumed, remedy)]
    if _all_finite(imu):
        quietest = _quietest(imu)
        notes += _force(recording, quietest, assumed, keys, where, mending)
        notes += _turning(recording, quietest, assumed, keys, where, mending)
        for table, fixes in (("gps", recording.gps), ("reference", recording.reference)):
            if fixes is not None and fixes.valid.any():
                notes += _overlap(recording, table, fixes, assumed, where)
                _check_position_unit(table, fixes, assumed, keys, where)
        motion = [one for one in found if one not in others]
        notes += consistency.report(recording, motion, where, assumed, remedy)
        for table, fixes in (("gps", recording.gps), ("reference", recording.reference)):
            if fixes is not None and fixes.valid.any():
                notes += consistency.report(recording, _steadiness(recording, table, fixes), where, assumed, remedy)
                notes.append(_clock(recording, table, fixes, assumed, keys, where))
    if recording.gps is None and recording.reference is None:
        notes.append("Found one clock: there is no GPS and no reference.")
    return [*notes, _temperature(imu)]


def _all_finite(imu: Imu) -> bool:
    return bool(np.isfinite(imu.time_s).all() and np.isfinite(imu.gyro).all() and np.isfinite(imu.accelerometer).all())


def _insist(key: str, value: str, keys: Collection[str]) -> str:
    """How to insist on a finding, where the format lets one."""
    return f"; --assume {key}={value} takes it all the same" if key in keys else ""


def _remedy(recording: Recording, keys: Collection[str], insist: bool = True) -> Callable[[consistency.Finding], str]:
    """How to mend a finding: with --assume where the format knows the key, else in words; and how to insist."""
    more = _insist(consistency.KEY, "warn", keys) if insist else ""

    def remedy(found: consistency.Finding) -> str:
        value = _value(found, recording.notes) if found.key in keys else None
        return f"--assume {found.key}={value} mends it{more}" if value is not None else f"{found.mend}{more}"

    return remedy


def _value(found: consistency.Finding, notes: Collection[str]) -> str | None:
    """What to assume for the key of a finding, from what its reader's notes say that it took; None if unknown."""
    if found.value is not None:
        return found.value
    taken = "\n".join(notes)
    if found.key == "axes" and found.matrix is not None and (said := TAKEN_AXES.search(taken)):
        turn = found.matrix @ frd_from(said[1])
        return equations(turn) if np.linalg.det(turn) > 0.0 else None
    for key, units, pattern in (
        ("gyro.unit", GYRO_UNITS, TAKEN_GYRO),
        ("accelerometer.unit", ACCELEROMETER_UNITS, TAKEN_ACCELEROMETER),
    ):
        if found.key == key and (said := pattern.search(taken)) and said[1] in units:
            form, scale = units[said[1]]
            fitting = (
                u for u, (f, one) in units.items() if f == form and np.isclose(one, scale * found.factor, rtol=1e-3)
            )
            return next(fitting, None)
    return None


def _rate(recording: Recording) -> str:
    steps = np.diff(recording.imu.time_s)
    step_s = float(np.median(steps))
    lasted_s = float(recording.imu.time_s[-1] - recording.start.time_s)
    spread = f"the steps spread by {1e3 * np.std(steps):.3g} ms (standard deviation)"
    even = "the steps are even" if np.std(steps) < STAMP_NOTE * 1e-2 * step_s else spread
    rate_hz = len(recording.imu.time_s) / lasted_s if lasted_s > 0.0 else float("nan")
    return f"Found {len(recording.imu.time_s)} samples over {lasted_s:.6g} s, {rate_hz:.4g} Hz; {even}."


def _quietest(imu: Imu) -> Quietest:
    """The window of 1 s with the least variation, gyros and accelerometers counting alike."""
    step_s = float(np.median(np.diff(imu.time_s)))
    samples = int(np.clip(round(WINDOW_S / step_s) if step_s > 0.0 else 1, 2, len(imu.time_s)))
    windows = len(imu.time_s) // samples
    agitation = np.zeros(windows)
    means = []
    for increments in (imu.gyro, imu.accelerometer):
        parts = increments[: windows * samples].reshape(windows, samples, 3)
        spread = np.sqrt(parts.var(axis=1).sum(axis=1))
        agitation += spread / max(float(np.median(spread)), 1e-300)
        means.append(parts.mean(axis=1) / step_s)
    k = int(np.argmin(agitation))
    force_b = means[1][k] if imu.accelerometer_form == "increment" else None
    return Quietest(float(imu.time_s[(k + 1) * samples - 1]), force_b, means[0][k])


def _force(
    recording: Recording, quietest: Quietest, assumed, keys, where: str, mending: Mapping[str, str]
) -> list[str]:
    """Size against gravity, direction against up."""
    if quietest.force_b is None:
        return ["The accelerometers are in pulses: their unit is a matter of what is believed of them."]
    start = recording.start
    expected = float(gravity(start.latitude_rad, start.height_m))
    size = float(np.linalg.norm(quietest.force_b))
    sized = expected / FORCE_FACTOR < size < FORCE_FACTOR * expected
    if not sized and "accelerometer.unit" not in assumed:
        raise DataRefused(
            f"{where}: in the quietest second, up to {quietest.time_s:.6g} s, the specific force is {size:.4g} m/s^2 "
            f"as read, expected about {expected:.3g}; {_unit_guess(size / expected, recording)}, so correct the unit "
            f"of the accelerometer{mending['accelerometer.unit']}{_insist('accelerometer.unit', 'UNIT', keys)}"
        )
    found = (
        f"Found in the quietest second, up to {quietest.time_s:.6g} s, a specific force of {size:.4g} m/s^2, "
        f"{size / expected:.3f} times gravity, along {_along(quietest.force_b)}"
    )
    if size == 0.0:
        return [f"{found}."]
    cosine = float(quietest.force_b @ _up_b(start.attitude_rad)) / size
    if cosine < SMALLEST_COSINE and "axes" not in assumed:
        same_axis = np.argmax(np.abs(quietest.force_b)) == np.argmax(np.abs(_up_b(start.attitude_rad)))
        seen = "that axis has the other sign" if same_axis else "the axes are in another order"
        mend = mending["axes"] or (_upright(recording, keys) if same_axis else "")
        raise DataRefused(
            f"{where}: in the quietest second, up to {quietest.time_s:.6g} s, gravity makes the specific force point "
            f"{_along(quietest.force_b)}, expected {_along(_up_b(start.attitude_rad))}; it looks as if {seen}, so "
            f"correct the axes{mend}{_insist('axes', 'AXES', keys)}"
        )
    right = sized and cosine >= SMALLEST_COSINE
    return [f"{found}, {'as it should be' if right else 'which you assume to be right'}."]


def _upright(recording: Recording, keys: Collection[str]) -> str:
    """How to turn a unit that is upside down by what its reader took, where the format lets one."""
    said = TAKEN_AXES.search("\n".join(recording.notes))
    if said is None or "axes" not in keys:
        return ""
    along = int(np.argmax(np.abs(_up_b(recording.start.attitude_rad))))
    half_turn = np.diag([-1.0, -1.0, 1.0] if along == 0 else [1.0, -1.0, -1.0])
    about = AXES[2 if along == 0 else 0]
    return (
        f", such as by --assume axes={letters(half_turn @ frd_from(said[1]))}, half a turn about {about}; where the "
        "accelerometers count gravity instead of specific force, negate their columns"
    )


def _unit_guess(factor: float, recording: Recording) -> str:
    step_s = float(np.median(np.diff(recording.imu.time_s)))
    known = {
        "g read as m/s^2": 1.0 / STANDARD_GRAVITY,
        "m/s^2 read as g": STANDARD_GRAVITY,
        "milli-g read as m/s^2": 1e3 / STANDARD_GRAVITY,
        "milli-g read as g": 1e3,
        "m/s^2 read as milli-g": 1e-3 * STANDARD_GRAVITY,
        "g read as milli-g": 1e-3,
        "rates read as increments": 1.0 / step_s,
        "increments read as rates": step_s,
    }
    if factor <= 0.0:
        return "it looks like a dead channel"
    near = [name for name, value in known.items() if abs(np.log(factor / value)) < np.log(1.3)]
    return f"it looks like {' or '.join(near)}" if near else "it looks like no unit that is known"


def _along(vector: np.ndarray) -> str:
    """Words for the direction of a vector: the nearest axis, and its share."""
    size = float(np.linalg.norm(vector))
    if size == 0.0:
        return "no axis"
    axis = int(np.argmax(np.abs(vector)))
    word = AXES[axis] if vector[axis] > 0.0 else OPPOSITE[AXES[axis]]
    return f"{word} ({abs(vector[axis]) / size:.2f} of it)"


def _up_b(attitude_rad: tuple[float, float, float] | None) -> np.ndarray:
    """Unit vector upwards in the body at the start's roll and pitch, level where there are none."""
    roll, pitch, _ = attitude_rad or (0.0, 0.0, 0.0)
    return np.array([np.sin(pitch), -np.sin(roll) * np.cos(pitch), -np.cos(roll) * np.cos(pitch)])


def _turning(
    recording: Recording, quietest: Quietest, assumed, keys, where: str, mending: Mapping[str, str]
) -> list[str]:
    step_s = float(np.median(np.diff(recording.imu.time_s)))
    quiet = float(np.linalg.norm(quietest.rate_b))
    fast = float(np.quantile(np.linalg.norm(recording.imu.gyro, axis=1), 0.99)) / step_s
    if (quiet > QUIET_RATE_RADPS or fast > LARGEST_RATE_RADPS) and "gyro.unit" not in assumed:
        raise DataRefused(
            f"{where}: the gyros turn at {quiet / DEG:.4g} deg/s in the quietest second and at {fast / DEG:.4g} deg/s "
            f"at the fastest, expected below {QUIET_RATE_RADPS / DEG:.0f} and {LARGEST_RATE_RADPS / DEG:.0f}; it looks "
            "like degrees read as radians or rates read as increments, so correct the unit of the gyro"
            f"{mending['gyro.unit']}{_insist('gyro.unit', 'UNIT', keys)}"
        )
    insisted = quiet > QUIET_RATE_RADPS or fast > LARGEST_RATE_RADPS
    return [
        f"Found gyro rates of {quiet / DEG:.3g} deg/s in the quietest second and up to {fast / DEG:.3g} deg/s (99 % of "
        "samples)" + (", which you assume to be right." if insisted else ".")
    ]


def _overlap(recording: Recording, table: str, fixes: Fixes, assumed, where: str) -> list[str]:
    start_s, end_s = recording.start.time_s, float(recording.imu.time_s[-1])
    time_s = fixes.time_s[fixes.valid]
    first_s, last_s = float(time_s[0]), float(time_s[-1])
    common_s = max(0.0, min(end_s, last_s) - max(start_s, first_s))
    share = common_s / (end_s - start_s) if end_s > start_s else 0.0
    spans = f"{NAMES[table]} covers {first_s:.6g} to {last_s:.6g} s and the IMU {start_s:.6g} to {end_s:.6g} s"
    if common_s == 0.0 or (share < OVERLAP and assumed.get("overlap") != "short"):
        raise DataRefused(
            f"{where}: {spans}, an overlap of {100.0 * share:.0f} %, expected at least {100.0 * OVERLAP:.0f} %; check "
            "the clocks and the units of both time columns"
            + ("; --assume overlap=short takes it all the same" if common_s > 0.0 else "")
        )
    step_s = (end_s - start_s) / len(recording.imu.time_s)
    outside = int(((time_s < start_s - step_s) | (time_s > end_s + step_s)).sum())
    return [f"Found that {spans}; {outside} of {len(time_s)} epochs lie outside."]


def _check_position_unit(table: str, fixes: Fixes, assumed, keys, where: str) -> None:
    """Way by positions against way by velocities."""
    if "position.unit" in assumed:
        return
    use = fixes.valid & np.isfinite(fixes.velocity_n).all(axis=1)
    time_s, velocity_n = fixes.time_s[use], fixes.velocity_n[use]
    if len(time_s) < 3:
        return
    latitude, longitude = fixes.latitude_rad[use], fixes.longitude_rad[use]
    first = (latitude[0], longitude[0], 0.0)
    east, north, _ = geodetic2enu(latitude, longitude, np.zeros_like(latitude), *first, deg=False)
    dt = np.diff(time_s)[:, None]
    by_velocity = np.cumsum(0.5 * (velocity_n[1:, :2] + velocity_n[:-1, :2]) * dt, axis=0)
    of_velocity, of_position = float(np.ptp(by_velocity, axis=0).max()), float(np.hypot(np.ptp(north), np.ptp(east)))
    if max(of_velocity, of_position) < MOVED_M:
        return
    if of_position > POSITION_FACTOR * of_velocity or of_velocity > POSITION_FACTOR * of_position:
        raise DataRefused(
            f"{where}, {table}: positions move by {of_position:.4g} m and velocities by {of_velocity:.4g} m, expected "
            "the same; check whether latitude and longitude are in degrees or radians and the unit of the velocity"
            f"{_insist('position.unit', 'UNIT', keys)}"
        )


def _clock(recording: Recording, table: str, fixes: Fixes, assumed, keys: Collection[str], where: str) -> str:
    """The offset of the clocks; on the way the size of the gyro rates against the attitude of a reference."""
    believed_s = getattr(recording.belief, table).time_offset_s
    found = _offset(recording, fixes)
    if found is None:
        return (
            f"Found two clocks, the IMU's and that of {NAMES[table]}: the motion does not show their offset; believed "
            f"is {believed_s:g} s."
        )
    if not 1.0 / GYRO_FACTOR < found.gyro_scale < GYRO_FACTOR and "gyro.unit" not in assumed:
        raise DataRefused(
            f"{where}: the attitude of {NAMES[table]} turns {found.gyro_scale:.3g} times as fast as the gyros, "
            "expected the same; it looks like degrees and radians mixed up or the gyros' axes, so correct them"
            f"{_insist('gyro.unit', 'UNIT', keys)}"
        )
    words = (
        f"Found two clocks: the stamps of {NAMES[table]} minus the IMU's of the same instant are "
        f"{found.offset_s:+.4f} +- {found.sigma_s:.4f} s, by {found.method} (residual "
        f"{found.residual_rms:.3g} {found.unit}, {found.residual_rms_unshifted:.3g} without an offset); "
        f"believed is {believed_s:g} s"
    )
    differs = abs(found.offset_s - believed_s)
    if differs > CLOCK_WARNING_S and differs > 2.0 * found.sigma_s:
        key = f"{table}.time_offset_s"
        way = f", --assume {key}={found.offset_s:.4f} would take it" if key in keys else f"; believe another in {key}"
        return f"Warning: {words[0].lower()}{words[1:]}; the found one was not applied{way}."
    return f"{words}, which agrees."


def _steadiness(recording: Recording, table: str, fixes: Fixes) -> list[consistency.Finding]:
    """A clock whose offset differs between the halves of the recording."""
    imu = _in_mps(recording)
    change = None if imu is None else clock_change(imu, recording.start.time_s, fixes)
    if change is None or change.log_odds < LIKELY or abs(change.after_s - change.before_s) < SMALLEST_CHANGE_S:
        return []
    seen = (
        f"{table}: the stamps minus the IMU's of the same instant are {change.before_s:+.3f} s in the first half and "
        f"{change.after_s:+.3f} s in the second, +- {change.sigma_s:.3f} s between them, expected one offset; it looks "
        "as if a clock drifts or jumps"
    )
    return [consistency.Finding(f"{table}.clock", seen, "bring both to one clock, or cut it there", change.log_odds)]


def _offset(recording: Recording, fixes: Fixes) -> Offset | None:
    imu = _in_mps(recording)
    return None if imu is None else clock_offset(imu, recording.start.time_s, fixes)


def _in_mps(recording: Recording) -> Imu | None:
    """Pulses are turned to m/s by the believed scale, which is good enough for this; None where there is none."""
    imu = recording.imu
    if imu.accelerometer_form == "pulse":
        size_mps = recording.belief.accelerometer.mps_per_pulse
        return None if size_mps is None else replace(imu, accelerometer=imu.accelerometer * size_mps)
    return imu


def _temperature(imu: Imu) -> str:
    if imu.temperature_c is None:
        return "Found no temperature: thermal effects cannot be judged."
    return f"Found temperatures of {imu.temperature_c.min():.4g} to {imu.temperature_c.max():.4g} degC."
