"""What grade an instrument is, from its stretches at rest: offsets, noise, range of temperature."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from ins_eval import datasheets
from ins_eval.allan import AllanDeviation, Coefficient, NoiseFit, allan_deviation, fit_noise
from ins_eval.earth import EARTH_RATE, gravity
from ins_eval.recording import PARKED, Imu, Recording
from ins_eval.recording.stillness import Stretch, still_stretches
from ins_eval.temperature_law import TemperatureLaw, temperature_laws
from ins_eval.tree import as_tree
from ins_eval.units import ARCSEC, DEG_PER_H, DEG_PER_SQRT_H, UG

BIAS = {"gyro": "bias_repeatability_deg_per_h", "accelerometer": "bias_repeatability_ug"}
CHANNELS = ("gyro x", "gyro y", "gyro z", "accelerometer x", "accelerometer y", "accelerometer z")
OF_THE_PLACE = 0.5  # weight of noise that a sheet does not have
VISIBLE_SIGMAS = 3.0  # of an offset at rest before it is believed
SHORTEST_REST_S = 10.0
STANDING_SPEED_MPS = 0.3
BLOCK_S, LEAST_BLOCKS = 20.0, 5  # means that show how an offset wanders
GRAVITY_SIGMA = 50e-6  # of gravity: what normal gravity lacks of the real one
PIECE_S, QUIETEST_SHARE = 10.0, 0.1  # of a recording that never rests
ANGLE_RANDOM_WALK, VELOCITY_RANDOM_WALK = "angle_random_walk_deg_per_sqrt_h", "velocity_random_walk_ug_per_sqrt_hz"


@dataclass(frozen=True)
class NoiseTerm:
    """A coefficient of noise with its 95 % interval in the field's unit; not visible: no more than its upper end."""

    value: float
    interval95: tuple[float, float]
    visible: bool
    unit: str


@dataclass(frozen=True)
class Offset:
    """An offset at rest with one sigma."""

    value: float
    sigma: float


@dataclass(frozen=True)
class Slope:
    """How a channel at rest moves with temperature."""

    slope: float
    interval95: tuple[float, float]
    unit: str
    reference_c: float


@dataclass(frozen=True, eq=False)
class ChannelNoise:
    """The noise of one channel at rest in SI; `fit` is None where the rest is too short or no noise is seen."""

    name: str
    allan: AllanDeviation
    fit: NoiseFit | None

    @property
    def terms(self) -> dict[str, NoiseTerm]:
        """Each term of the fit in the field's unit; empty where there is none."""
        found = {}
        for term, (unit, si) in units_of(self.name).items() if self.fit else ():
            one = getattr(self.fit, term)
            found[term] = NoiseTerm(one.value / si, (one.low / si, one.high / si), bool(one.visible), unit)
        return found


@dataclass(frozen=True, eq=False)
class Grade:
    """What stretches at rest show of an instrument.

    `gyro_offset` (3,) rad/s and `force_offset` m/s^2, that of the norm of specific force from gravity, have one sigma
    beside them: how they wander in this recording and what rotation and gravity of the Earth leave open. They are None
    without a rest. `bounds` are upper bounds of the white noise by its key, for where none is seen: motion adds to it,
    or a filter of the output hides it. `standing` is the longest stretch in which fixes stand, where none is at rest.
    """

    rests: tuple[Stretch, ...]
    channels: tuple[ChannelNoise, ...]
    gyro_offset: np.ndarray | None
    gyro_offset_sigma: np.ndarray | None
    force_offset: float | None
    force_offset_sigma: float | None
    temperature_c: tuple[float, float] | None
    bounds: Mapping[str, float]
    laws: tuple[TemperatureLaw, ...] = ()
    standing: Stretch | None = None

    @property
    def rest_s(self) -> float:
        """Length of all rests together."""
        return sum(rest.duration_s for rest in self.rests)

    @cached_property
    def white(self) -> dict[str, float]:
        """White noise of gyros and accelerometers by its key, root mean square of the axes that show it."""
        found = {}
        for key, sensor, si in ((ANGLE_RANDOM_WALK, "gyro", DEG_PER_SQRT_H), (VELOCITY_RANDOM_WALK, "accel", UG)):
            terms: list[Coefficient] = [c.fit.white for c in self.channels if c.fit and c.name.startswith(sensor)]
            if seen := [term.value for term in terms if term.visible]:
                found[key] = float(np.sqrt(np.mean(np.square(seen)))) / si
        return found

    @cached_property
    def nearest(self) -> str | None:
        """The unit whose sheet is nearest; None where no noise is known."""
        return nearest_unit(self.white or self.bounds, self.offsets)

    @property
    def offsets(self) -> dict[str, tuple[float, float]]:
        """Size of the offsets and one sigma, by the table of a sheet: deg/h, root mean square of the gyros, and ug."""
        found = {}
        if self.gyro_offset is not None:
            size, sigma = (np.sqrt(np.mean(of**2)) / DEG_PER_H for of in (self.gyro_offset, self.gyro_offset_sigma))
            found["gyro"] = (float(size), float(sigma))
        if self.force_offset is not None:
            found["accelerometer"] = (abs(self.force_offset) / UG, self.force_offset_sigma / UG)
        return found

    @property
    def grade(self) -> str | None:
        """In words, one of `datasheets.GRADES`: that of the nearest sheet."""
        return None if self.nearest is None else datasheets.unit(self.nearest).grade

    @property
    def words(self) -> str:
        """One sentence: the grade, and from what it was told."""
        if self.grade is None:
            why = f"{self.rest_s:.0f} s at rest show none" if self.rests else self._unrest
            return f"The grade is unknown, since no noise is seen: {why[0].lower()}{why[1:]}."
        seen = self.white or self.bounds
        units = {
            ANGLE_RANDOM_WALK: "deg/sqrt(h) of the gyros",
            VELOCITY_RANDOM_WALK: "ug/sqrt(Hz) of the accelerometers",
        }
        noise = " and ".join(f"{value:.3g} {units[key]}" for key, value in seen.items())
        near = datasheets.unit(self.nearest).name
        if not self.white:
            where = f"In {self.rest_s:.0f} s at rest white" if self.rests else f"{self._unrest}. White"
            return (
                f"{where} noise is at most {noise}, so the grade is {self.grade}{'' if self.rests else ' or better'} "
                f"(nearest sheet: {near})."
            )
        each = ", ".join(f"{rest.duration_s:.0f} s" for rest in self.rests[:6]) + (
            ", ..." if len(self.rests) > 6 else ""
        )
        return (
            f"Grade: {self.grade}, by offsets and white noise of {noise} in {each} at rest, the noise of the place "
            f"included (nearest sheet: {near})."
        )

    @property
    def _unrest(self) -> str:
        """Why no stretch counts as rest."""
        if self.standing is None:
            return f"No stretch of {SHORTEST_REST_S:.0f} s is at rest"
        begin_s, end_s = self.standing.start_s, self.standing.end_s
        return (
            f"It stands still from {begin_s:.0f} to {end_s:.0f} s by the fixes, but is disturbed there: no stretch "
            f"of {SHORTEST_REST_S:.0f} s is quiet enough to count as rest"
        )

    def as_tree(self) -> dict[str, Any]:
        """The part ``grade`` of ``metrics.json``, in the field's units."""
        tree: dict[str, Any] = {
            "grade": self.grade,
            "nearest": self.nearest,
            "words": self.words,
            "rests_s": [[rest.start_s, rest.end_s] for rest in self.rests],
            "temperature_c": None if self.temperature_c is None else list(self.temperature_c),
            "bounds": dict(self.bounds),
            "noise": {channel.name: as_tree(channel.terms) for channel in self.channels if channel.fit is not None},
        }
        if self.gyro_offset is not None:
            tree["gyro_offset_deg_per_h"] = as_tree(self.gyro_offset_deg_per_h)
        if self.force_offset is not None:
            tree["force_offset_ug"] = as_tree(self.force_offset_ug)
        if self.laws:
            tree["temperature_laws"] = as_tree(self.laws_in_units)
        return tree

    @property
    def gyro_offset_deg_per_h(self) -> dict[str, Offset]:
        """Offset of each gyro; empty without a rest."""
        if self.gyro_offset is None:
            return {}
        both = np.stack([self.gyro_offset, self.gyro_offset_sigma], axis=1) / DEG_PER_H
        return {axis: Offset(float(v), float(s)) for axis, (v, s) in zip("xyz", both, strict=True)}

    @property
    def force_offset_ug(self) -> Offset | None:
        """Offset of the norm of specific force."""
        return None if self.force_offset is None else Offset(self.force_offset / UG, self.force_offset_sigma / UG)

    @property
    def laws_in_units(self) -> dict[str, Slope]:
        """How each channel moves with temperature, in the field's units."""
        found = {}
        for law in self.laws:
            unit, si = units_of(law.name)["flicker"]
            low, high = (bound / si for bound in law.interval95)
            found[law.name] = Slope(law.slope / si, (low, high), f"{unit}/degC", law.reference_c)
        return found


def units_of(channel: str) -> dict[str, tuple[str, float]]:
    """The field's unit of each noise term of a channel, and its size in SI."""
    if channel.startswith("gyro"):
        return {
            "quantisation": ("arcsec", ARCSEC),
            "white": ("deg/sqrt(h)", DEG_PER_SQRT_H),
            "flicker": ("deg/h", DEG_PER_H),
            "random_walk": ("deg/h/sqrt(h)", DEG_PER_H / 60.0),
        }
    return {
        "quantisation": ("ug s", UG),
        "white": ("ug/sqrt(Hz)", UG),
        "flicker": ("ug", UG),
        "random_walk": ("ug/sqrt(s)", UG),
    }


def measure_grade(recording: Recording, velocity: np.ndarray | None) -> Grade:
    """Measure noise and offsets in every stretch at rest.

    Offsets of the gyros are mean rates less the vertical part of Earth rate, W sin(latitude) along the specific force;
    the horizontal part, W cos(latitude), has an unknown direction and stands in the sigma. Any believed bias is left
    in.

    Parameters
    ----------
    velocity : (n, 3) velocity increments in m/s; None where nothing says what a pulse is worth
    """
    imu, start = recording.imu, recording.start
    rests = tuple(_rests(recording))
    step_s = float(np.median(np.diff(imu.time_s)))
    columns = np.empty((3 if velocity is None else 6, len(imu.time_s)))
    for of, increments in zip((columns[:3], columns[3:]), (imu.gyro, velocity), strict=True):
        if increments is not None:
            np.divide(increments.T, recording.interval_s, out=of)
    rows = [slice(*np.searchsorted(imu.time_s, [r.start_s + 1e-6, r.end_s + 1e-6])) for r in rests]
    if not rests:
        bounds = _bounds(columns, step_s)
        return Grade(rests, (), None, None, None, None, None, bounds, standing=_standing(recording))
    channels = []
    for name, column in zip(CHANNELS, columns, strict=False):
        allan = allan_deviation([column[r] for r in rows], step_s, per_octave=3)
        channels.append(ChannelNoise(name, allan, fit_noise(allan)))
    blocks = _blocks(columns, rows, step_s)
    mean, wander = np.average(blocks[0], axis=0, weights=blocks[1]), blocks[0].std(axis=0, ddof=1)
    up = mean[3:] / np.linalg.norm(mean[3:]) if velocity is not None and np.linalg.norm(mean[3:]) else None
    vertical = EARTH_RATE * np.sin(start.latitude_rad)
    across = EARTH_RATE * abs(np.cos(start.latitude_rad)) / np.sqrt(2.0)
    offset, unknown = mean[:3].copy(), np.full(3, EARTH_RATE / np.sqrt(3.0))
    if up is not None:
        offset -= vertical * up
        unknown = across * np.sqrt(np.clip(1.0 - up**2, 0.0, 1.0))
    force_offset = force_sigma = None
    if up is not None:
        norms = np.linalg.norm(blocks[0][:, 3:], axis=1)
        expected = float(gravity(start.latitude_rad, start.height_m))
        force_offset = float(np.average(norms, weights=blocks[1]) - expected)
        force_sigma = float(np.hypot(norms.std(ddof=1), GRAVITY_SIGMA * expected))
    return Grade(
        rests,
        tuple(channels),
        offset,
        np.hypot(wander[:3], unknown),
        force_offset,
        force_sigma,
        _temperature(imu, rows),
        _bounds(
            columns[:, rows[0]] if len(rows) == 1 else np.concatenate([columns[:, r] for r in rows], axis=1), step_s
        ),
        () if imu.temperature_c is None else temperature_laws(CHANNELS, columns, imu.temperature_c, rows, step_s),
    )


def nearest_unit(white: Mapping[str, float], offsets: Mapping[str, tuple[float, float]]) -> str | None:
    """The unit nearest in white noise and offsets: the least distance of logarithms.

    Noise above that of a sheet counts `OF_THE_PLACE`, since wind and engines add to it; below it counts in full. An
    offset is held against the repeatability of the sheet, or that of its grade where the sheet states none; neither
    counts below the sigma of the offset, where a better unit looks the same.
    """
    distances = {}
    for name, sheet in datasheets.units().items():
        stated = {
            ANGLE_RANDOM_WALK: sheet.gyro.angle_random_walk_deg_per_sqrt_h,
            VELOCITY_RANDOM_WALK: sheet.accelerometer.velocity_random_walk_ug_per_sqrt_hz,
        }
        both = [np.log(white[key] / stated[key]) for key in white if stated[key] and white[key] > 0.0]
        if len(both) == len(white) and both:
            noise = np.mean([-one if one < 0.0 else OF_THE_PLACE * one for one in both])
            away = [
                abs(np.log(max(_repeatability(sheet, table), sigma) / max(size, sigma)))
                for table, (size, sigma) in offsets.items()
            ]
            distances[name] = float(noise + np.sum(away))
    return min(distances, key=distances.get) if distances else None


def _repeatability(sheet: datasheets.UnitSheet, table: str) -> float:
    key = BIAS[table]
    return getattr(getattr(sheet, table), key) or typical(sheet.grade, table, key)


@cache
def typical(grade: str, table: str, key: str) -> float | None:
    """The geometric mean of a figure over the sheets of a grade that state it."""
    sheets = [sheet for sheet in datasheets.units().values() if sheet.grade == grade]
    stated = [value for sheet in sheets if (value := getattr(getattr(sheet, table), key)) is not None]
    return float(np.exp(np.mean(np.log(stated)))) if stated else None


def _rests(recording: Recording) -> list[Stretch]:
    """Quiet stretches; of a recording that moves only those in which a reference or GPS stands, or that are stated."""
    quiet = still_stretches(recording.imu, SHORTEST_REST_S)
    if recording.kind in PARKED:
        return quiet
    if recording.start.still_until_s is not None:
        stated = Stretch(recording.start.time_s, recording.start.still_until_s)
        return [stated] if stated.duration_s >= SHORTEST_REST_S else []
    stands = []
    for fixes in filter(None, (recording.reference, recording.gps)):
        speed = np.hypot(*fixes.velocity_n[:, :2].T)
        known = fixes.valid & np.isfinite(speed)
        if not known.any():
            continue
        for rest in quiet:
            inside = known & (fixes.time_s > rest.start_s) & (fixes.time_s <= rest.end_s)
            if inside.any() and speed[inside].max() < STANDING_SPEED_MPS:
                stands.append(rest)
        break
    return stands


def _standing(recording: Recording) -> Stretch | None:
    """The longest stretch, of at least `SHORTEST_REST_S`, in which a reference or GPS stands."""
    found: list[Stretch] = []
    for fixes in filter(None, (recording.reference, recording.gps)):
        speed = np.hypot(*fixes.velocity_n[:, :2].T)
        time_s, stands = fixes.time_s[fixes.valid], (speed < STANDING_SPEED_MPS)[fixes.valid]
        edges = np.flatnonzero(np.diff(np.concatenate([[False], stands, [False]]).astype(int)))
        found += [Stretch(float(time_s[a]), float(time_s[b - 1])) for a, b in edges.reshape(-1, 2)]
    longest = max(found, key=lambda one: one.duration_s, default=None)
    return longest if longest is not None and longest.duration_s >= SHORTEST_REST_S else None


def _blocks(columns: np.ndarray, rows: Sequence[slice], step_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Means of the channels over blocks at rest (b, channels), and the samples in each (b,)."""
    whole = sum(r.stop - r.start for r in rows)
    size = max(1, min(round(BLOCK_S / step_s), whole // (2 * LEAST_BLOCKS), min(r.stop - r.start for r in rows) // 2))
    means = []
    for r in rows:
        part = columns[:, r]
        count = part.shape[1] // size
        means.append(part[:, : count * size].reshape(len(part), count, size).mean(axis=2).T)
    blocks = np.concatenate(means)
    return blocks, np.full(len(blocks), size)


def _bounds(columns: np.ndarray, step_s: float) -> dict[str, float]:
    """Upper bounds of white noise: N^2 <= tau s2(tau) in the quietest pieces, where motion adds to it.

    tau is 1 s, where a filter of the output hides nothing any more.
    """
    size, second = round(PIECE_S / step_s), max(1, round(1.0 / step_s))
    if size < 4 * second or columns.shape[1] < size:
        return {}
    found, count = {}, columns.shape[1] // size
    for key, of, si in ((ANGLE_RANDOM_WALK, columns[:3], DEG_PER_SQRT_H), (VELOCITY_RANDOM_WALK, columns[3:], UG)):
        if not len(of):
            continue
        whole = of[:, : count * size].reshape(len(of), count, size)[:, :, : size // second * second]
        pieces = whole.reshape(len(of), count, size // second, second)
        variance = 0.5 * np.mean(np.diff(pieces.mean(axis=3), axis=2) ** 2, axis=2) * second * step_s
        quietest = np.quantile(variance, QUIETEST_SHARE, axis=1)
        if quietest.min() > 0.0:
            found[key] = float(np.sqrt(quietest.mean())) / si
    return found


def _temperature(imu: Imu, rows: Sequence[slice]) -> tuple[float, float] | None:
    if imu.temperature_c is None:
        return None
    seen = np.concatenate([imu.temperature_c[r].ravel() for r in rows])
    return float(seen.min()), float(seen.max())
