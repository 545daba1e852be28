"""How well an effect in a real recording can be seen by one who knows which it is: sigma of its size, D in nats.

Of the unmodified recording all that a belief leaves open is fitted (start attitude of each arc, sensor biases, the
delay of the fixes), and what is left is its noise, whatever its law. The effect's response c is the difference that it
makes to the same navigation, arc by arc; at rest to means over stretches. Its share s of the response (1: as large as
it was put in) is that of least squares, b = H^-1 X'r with H = X'X + P and X = [c, nuisances], and has the sigma that
the arcs have among themselves (jackknife over clusters; MacKinnon, Nielsen and Webb, J. Appl. Econometrics 38, 2023),

    V = (K - 1) / K sum_k (b_k - b) (b_k - b)' + H^-1 P H^-1,   D = 1 / (2 V_cc),

b_k without arc k of K, and P the inverse prior covariance of the nuisances. What is left after the fit, arc by arc,
would do for many arcs (White, Econometrica 48, 1980), but with 20 arcs and 11 parameters it gives a sigma up to a
third too small. Every arc has a start of its own, so nothing is gained from one arc to the next: D is less than could
be known. At rest a curve in temperature is taken off as the recording's own, so r lacks a part of its slow noise:
there V = H^-1, with the long-run variance of each channel from its sums over stretches (Newey and West, Econometrica
55, 1987). That D belongs to one who knows what the unit did before. Who has the recording alone has to leave the curve
open too: then its columns stand among the nuisances, with no prior to speak of.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numba
import numpy as np

from benchmark.worlds.earth import W, from_euler, gravity, radii
from benchmark.worlds.into_data import DEG_PER_H, G0, UG
from benchmark.worlds.recorded import ACCEL, ANGLES, DEG, GYRO, Recorded, attitudes

CLIP = 5.0  # robust sigma: what is farther off is an outlier
STRETCH_ARCS = 6  # stretches at rest whose sum shows the slow noise
TINY = 1e-12  # of a channel that is exactly constant
STILL = 3.0  # times the median scatter within a stretch: people and engines beyond it
MARGIN_S = 1.0  # within an arc, so that shifted fixes stay in it
ROUNDS = 4  # of Gauss and Newton
ATTITUDE_RAD = 5.0 * DEG  # prior of the start of an arc, as the recording's own filter has it
VELOCITY_MPS, POSITION_M = 1.0, 10.0  # likewise
MOUNTING_RAD = 0.01  # of two boxes on one plate
DELAY_S = 0.3  # receivers are late by tenths of a second
BIAS_DEG_PER_H, BIAS_UG = 600.0, 20000.0  # of a consumer MEMS, where the recording believes none
OPEN = 1e3  # sigmas of a mean: the prior of a law of which nothing is known
STEP = 1e-3  # of a prior, for finite differences


@dataclass(frozen=True)
class Seen:
    """`own`: the share of the effect that the unmodified recording shows already; `sigma` of the share.

    `open_sigma` is that with the recording's own laws of temperature open.
    """

    own: float
    sigma: float
    open_sigma: float

    @property
    def d(self) -> float:
        return 0.5 / self.sigma**2

    @property
    def open_d(self) -> float:
        return 0.5 / self.open_sigma**2


class Oracle:
    """What an effect in a recording looks like; the recording as it is is fitted once."""

    def __init__(self, recorded: Recorded, arc_s: float) -> None:
        still = recorded.kind in ("static", "chamber")
        self._of = _Still(recorded, arc_s) if still else _Arcs(recorded, arc_s)

    @property
    def delay_s(self) -> float:
        """How late the fixes of the unmodified recording are."""
        return self._of.delay_s

    def seen(self, after: Recorded) -> Seen | None:
        """Of the effect that made `after` of the recording; None where it changes nothing that is measured."""
        return self._of.seen(after)


def _solved(column, nuisances, residual, sigma, cluster=None) -> Seen | None:
    """Share and sigma from a response (n, d), nuisances (n, d, m) of unit prior, residual (n, d), sigma (d,)."""
    good = np.isfinite(residual) & (np.abs(residual) < CLIP * _robust(residual))
    x = np.concatenate([column[..., None], nuisances], axis=-1) / sigma[:, None]
    x, r = np.where(good[..., None], x, 0.0), np.where(good, residual / sigma, 0.0)
    size = math.sqrt(float(np.sum(x[..., 0] ** 2)))
    if size == 0.0:
        return None
    x[..., 0] /= size  # the response may be huge
    p = np.diag(np.append(0.0, np.ones(nuisances.shape[-1])))
    h, g = np.einsum("nda,ndb->ab", x, x) + p, np.einsum("nda,nd->a", x, r)
    v = inverse = np.linalg.inv(h)
    share = inverse @ g
    if cluster is not None:
        arcs = [(x[cluster == k], r[cluster == k]) for k in np.unique(cluster)]
        own_h = np.stack([np.einsum("nda,ndb->ab", a, a) for a, _ in arcs])
        own_g = np.stack([np.einsum("nda,nd->a", a, b) for a, b in arcs])
        without = np.linalg.solve(h - own_h, (g - own_g)[..., None])[..., 0] - share
        v = (len(arcs) - 1) / len(arcs) * without.T @ without + inverse @ p @ inverse
    sigma = math.sqrt(v[0, 0]) / size
    return Seen(float(share[0]) / size, sigma, sigma)


def _robust(residual: np.ndarray) -> np.ndarray:
    """Sigma of each channel from the median of its size, (d,)."""
    return 1.4826 * np.nanmedian(np.abs(residual), axis=0)


def _long_run(residual: np.ndarray, cluster: np.ndarray, spent: int) -> np.ndarray:
    """Sigma of white noise with the slow variance of what is left, (d,): from sums over stretches, `spent` fitted."""
    sums = np.stack([residual[cluster == k].sum(axis=0) for k in np.unique(cluster)])
    return np.sqrt(np.sum(sums**2, axis=0) / len(residual) * len(sums) / max(len(sums) - spent, 1))


# ------------------------------------------------------------------------------------------------ at rest


def _means(recorded: Recorded, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means of rate rad/s and force m/s^2 (or a chamber's output in g), scatter, and time, each stretch."""
    if recorded.kind == "chamber":
        table = recorded.tables["chamber"]
        axis = next(one for one in "xyz" if one in recorded.head["accelerometer"])
        values = table["output"][:, None] / recorded.head["accelerometer"][axis]["scale"]["gamma"] * G0
    else:
        values = np.column_stack([recorded.triad(GYRO), recorded.triad(ACCEL)]) / recorded.step_s[:, None]
    blocks = [values[a:b] for a, b in zip(edges[:-1], edges[1:], strict=True)]
    middle = recorded.time_s[(edges[:-1] + edges[1:] - 1) // 2]
    return np.stack([one.mean(axis=0) for one in blocks]), np.stack([one.std(axis=0) for one in blocks]), middle


class _Still:
    """Means at rest: constants of each sensor, tilt and heading are open; a curve in temperature is the recording's."""

    delay_s = 0.0

    def __init__(self, recorded: Recorded, arc_s: float) -> None:
        rows = max(round(arc_s / float(np.median(recorded.step_s))), 1)
        self.edges = np.arange(0, recorded.time_s.size + 1, rows)
        self.means, scatter, at = _means(recorded, self.edges)
        n, d = self.means.shape
        self.quiet = np.ones(n, bool)
        if rows > 1:
            self.quiet = np.all(scatter < STILL * np.median(scatter, axis=0), axis=1)
        cluster = ((at - at[0]) // (STRETCH_ARCS * arc_s))[self.quiet]
        basis, quiet = _curve(recorded, at), self.quiet
        fitted = basis @ np.linalg.lstsq(basis[quiet], self.means[quiet], rcond=None)[0]
        self.residual = (self.means - fitted)[quiet]
        self.sigma = np.maximum(_long_run(self.residual, cluster, basis.shape[1]), TINY)
        one = np.full((1, 1), BIAS_UG * UG) if d == 1 else _open_at_rest(recorded, self.means[quiet])
        self.nuisances = np.broadcast_to(one, (len(self.residual), *one.shape))
        laws = np.einsum("nk,de->ndek", OPEN * basis[quiet, 1:], np.diag(self.sigma)).reshape(len(self.residual), d, -1)
        self.open = np.concatenate([self.nuisances, laws], axis=-1)

    def seen(self, after: Recorded) -> Seen | None:
        column = (_means(after, self.edges)[0] - self.means)[self.quiet]
        known = _solved(column, self.nuisances, self.residual, self.sigma)
        if known is None:
            return None
        return replace(known, open_sigma=_solved(column, self.open, self.residual, self.sigma).sigma)


def _curve(recorded: Recorded, at: np.ndarray) -> np.ndarray:
    """A constant, and where a temperature was recorded that, its square and its rate, (n, 1 or 4)."""
    table = recorded.tables["chamber" if recorded.kind == "chamber" else "imu"]
    if "temperature_c" not in table:
        return np.ones((at.size, 1))
    warm = np.interp(at, recorded.time_s, table["temperature_c"])
    warm = (warm - warm.mean()) / max(float(np.std(warm)), 1e-9)
    return np.column_stack([np.ones(at.size), warm, warm**2, np.gradient(warm)])


def _open_at_rest(recorded: Recorded, means: np.ndarray) -> np.ndarray:
    """What is open of a triad at rest, (6, 9): six biases, tilt about two axes, heading."""
    out, (gyro, accel) = np.zeros((6, 9)), _bias_sigmas(recorded)
    force = np.median(means[:, 3:], axis=0)
    up = force / np.linalg.norm(force)
    for i in range(3):
        out[i, i], out[3 + i, 3 + i] = gyro, accel
    level = np.linalg.svd(up[None])[2][1:]  # two horizontal directions of the box
    for i in range(2):
        out[3:, 6 + i] = np.linalg.norm(force) * level[i]  # a radian of tilt
    latitude = recorded.head["start"]["latitude_deg"] * DEG
    out[:3, 8] = W * math.cos(latitude) * _east(recorded, level, up)  # a radian of heading
    return out


def _bias_sigmas(recorded: Recorded) -> tuple[float, float]:
    """Believed sigma of the biases of gyros rad/s and accelerometers m/s^2."""
    gyro = recorded.head.get("gyro", {}).get("bias_sigma_deg_per_h", BIAS_DEG_PER_H)
    return gyro * DEG_PER_H, recorded.head.get("accelerometer", {}).get("bias_sigma_ug", BIAS_UG) * UG


def _east(before: Recorded, level: np.ndarray, up: np.ndarray) -> np.ndarray:
    """East in the box, (3,): where a radian of heading takes the north part of the Earth's rate."""
    heading = before.head["start"].get("attitude_deg", [0.0, 0.0, 0.0])[2] * DEG
    forward = np.array([1.0, 0.0, 0.0]) - up[0] * up
    if np.linalg.norm(forward) < 0.1:
        forward = level[0]
    forward /= np.linalg.norm(forward)
    right = np.cross(-up, forward)
    return math.sin(heading) * forward + math.cos(heading) * right


# ------------------------------------------------------------------------------------------------ in arcs


@numba.njit(cache=True)
def _navigate(gyro, accel, step_s, c, v, latitude, height):
    """Velocity and position NED (n + 1, 3) and attitude (n + 1, 3, 3) from increments, over some seconds."""
    n = len(gyro)
    vs, rs, cs = np.empty((n + 1, 3)), np.empty((n + 1, 3)), np.empty((n + 1, 3, 3))
    r, g = np.zeros(3), gravity(latitude, height)
    spin = np.array((W * math.cos(latitude), 0.0, -W * math.sin(latitude)))
    vs[0], rs[0], cs[0] = v, r, c
    for k in range(n):
        dt = step_s[k]
        turned = gyro[k] - c.T @ spin * dt
        angle = math.sqrt(turned @ turned)
        x = np.array(((0.0, -turned[2], turned[1]), (turned[2], 0.0, -turned[0]), (-turned[1], turned[0], 0.0)))
        a, b = 1.0 - angle**2 / 6.0, 0.5 - angle**2 / 24.0
        if angle > 1e-3:
            a, b = math.sin(angle) / angle, (1.0 - math.cos(angle)) / angle**2
        rotation = np.eye(3) + a * x + b * (x @ x)
        felt = c @ (accel[k] + 0.5 * np.cross(turned, accel[k]))
        c = c @ rotation
        old = v
        v = v + felt - 2.0 * np.cross(spin, v) * dt
        v[2] += g * dt
        r = r + 0.5 * (old + v) * dt
        vs[k + 1], rs[k + 1], cs[k + 1] = v, r, c
    return vs, rs, cs


@dataclass(frozen=True)
class _Arc:
    """Rows of the IMU and of the fixes of an arc, and where it starts."""

    imu: slice
    fixes: np.ndarray
    tilts: np.ndarray
    attitude: np.ndarray
    velocity: np.ndarray
    latitude: float
    longitude: float
    height: float


def _fixes_of(recorded: Recorded) -> str:
    return "gps" if "gps" in recorded.tables else "reference"


def _arcs(recorded: Recorded, arc_s: float) -> list[_Arc]:
    t, fixes = recorded.time_s, recorded.tables[_fixes_of(recorded)]
    c = recorded.tables["reference"]
    out, judged = [], "latitude_deg" in c
    for begin in np.arange(t[0], t[-1] - 0.8 * arc_s, arc_s):
        rows = slice(*np.searchsorted(t, [begin, begin + arc_s]))
        use = np.flatnonzero((fixes["time_s"] > begin + MARGIN_S) & (fixes["time_s"] < begin + arc_s - MARGIN_S))
        if rows.stop - rows.start < 10 or use.size < 5:
            continue
        at = t[rows.start]
        place = [float(np.interp(at, fixes["time_s"], fixes[name])) for name in
                 ("latitude_deg", "longitude_deg", "height_m")]  # fmt: skip
        velocity = [np.interp(at, fixes["time_s"], fixes[f"velocity_{axis}_mps"]) for axis in "ned"]
        out.append(_Arc(rows, use, use if judged else use[:0], attitudes(c, np.array([at]))[0], np.array(velocity),
                        place[0] * DEG, place[1] * DEG, place[2]))  # fmt: skip
    return out


ZERO = (0.0, 0.0, 0.0)
SHARED = 10  # biases of gyros and accelerometers, delay, mounting of a reference


def _priors(recorded: Recorded) -> np.ndarray:
    """One sigma of the 9 of an arc's start (tilt, velocity, position) and of the shared ones."""
    gyro, accel = _bias_sigmas(recorded)
    start = [ATTITUDE_RAD] * 3 + [VELOCITY_MPS] * 3 + [POSITION_M] * 3
    return np.array(start + [gyro] * 3 + [accel] * 3 + [DELAY_S] + [MOUNTING_RAD] * 3)


def _left(recorded: Recorded, arc: _Arc, p: np.ndarray) -> np.ndarray:
    """Fixes less navigation with the parameters p, (fixes, d): position m, velocity m/s, and tilt where it is given."""
    fixes, head = recorded.tables[_fixes_of(recorded)], recorded.head
    imu, rows = recorded.tables["imu"], arc.imu
    t = imu["time_s"][rows]
    step_s = np.diff(t)
    off = (
        np.array(head["gyro"].get("bias_radps", ZERO)) + p[9:12],
        p[12:15] + head["accelerometer"].get("bias_mps2", ZERO),
    )
    gyro, force = (
        np.column_stack([imu[name][rows][1:] for name in names]) - bias * step_s[:, None]
        for names, bias in zip((GYRO, ACCEL), off, strict=True)
    )
    turned = from_euler(*p[:3])
    v, r, c = _navigate(gyro, force, step_s, turned @ arc.attitude, arc.velocity + p[3:6], arc.latitude, arc.height)
    r = r + p[6:9]
    at = fixes["time_s"][arc.fixes] - p[15]
    m, n = radii(arc.latitude)
    place = np.column_stack([
        (fixes["latitude_deg"][arc.fixes] * DEG - arc.latitude) * (m + arc.height),
        (fixes["longitude_deg"][arc.fixes] * DEG - arc.longitude) * (n + arc.height) * math.cos(arc.latitude),
        arc.height - fixes["height_m"][arc.fixes],
    ])  # fmt: skip
    speed = np.column_stack([fixes[f"velocity_{axis}_mps"][arc.fixes] for axis in "ned"])
    own = [np.column_stack([np.interp(at, t, one) for one in x.T]) for x in (r, v)]
    out = [place - own[0], speed - own[1]]
    if arc.tilts.size:
        out.append(_tilt(fixes, arc, c, t, at, p[16:19]))
    return np.hstack(out)


def _tilt(fixes, arc, c, t, at, mounting) -> np.ndarray:
    """Small rotation in body axes between the navigated attitude and that of the reference, (fixes, 3) rad."""
    k = np.clip(np.searchsorted(t, at), 1, len(t) - 1)
    share = ((at - t[k - 1]) / (t[k] - t[k - 1]))[:, None]
    between = np.einsum("nji,njk->nik", c[k - 1], c[k])
    small = np.column_stack([between[:, 2, 1], between[:, 0, 2], between[:, 1, 0]]) * share
    told = np.stack([from_euler(*(fixes[name][row] * DEG for name in ANGLES)) for row in arc.fixes])
    off = np.einsum("nji,njk->nik", c[k - 1], told)
    angles = np.column_stack([off[:, 2, 1] - off[:, 1, 2], off[:, 0, 2] - off[:, 2, 0], off[:, 1, 0] - off[:, 0, 1]])
    return 0.5 * angles - small - mounting


class _Arcs:
    """Arcs with starts of their own, fitted to the fixes together with what they share; then the effect is put in."""

    def __init__(self, recorded: Recorded, arc_s: float) -> None:
        self.arcs, self.sigma = _arcs(recorded, arc_s), _priors(recorded)
        self.starts, self.shared = np.zeros((len(self.arcs), 9)), np.zeros(SHARED)
        for _ in range(ROUNDS):
            self._improve(*self._linear(recorded))
        self.left, self.slopes = self._linear(recorded)
        self.scale = _robust(np.concatenate(self.left))
        self.cluster = np.concatenate([np.full(len(r), k) for k, r in enumerate(self.left)])

    @property
    def delay_s(self) -> float:
        return float(self.shared[6])

    def _left(self, recorded: Recorded) -> list[np.ndarray]:
        return [
            _left(recorded, arc, np.concatenate([start, self.shared]))
            for arc, start in zip(self.arcs, self.starts, strict=True)
        ]

    def _linear(self, recorded: Recorded):
        """What is left of each arc (fixes, d), and its slopes (fixes, d, 19) a prior sigma, sign of a model."""
        left, slopes = self._left(recorded), []
        for arc, start, r in zip(self.arcs, self.starts, left, strict=True):
            x = np.empty((*r.shape, 9 + SHARED))
            for i in range(9 + SHARED):
                p = np.concatenate([start, self.shared])
                p[i] += STEP * self.sigma[i]
                x[..., i] = (r - _left(recorded, arc, p)) / STEP
            slopes.append(x)
        return left, slopes

    def _improve(self, left, slopes) -> None:
        """One step of Gauss and Newton, the starts eliminated arc by arc."""
        scale, parts = _robust(np.concatenate(left)), []
        h, g = np.eye(SHARED), -self.shared / self.sigma[9:]
        for start, r, x in zip(self.starts, left, slopes, strict=True):
            weight = np.where(np.abs(r) < CLIP * scale, 1.0 / scale, 0.0).ravel()
            x, r = x.reshape(-1, x.shape[-1]) * weight[:, None], r.ravel() * weight
            a, b = x[:, :9], x[:, 9:]
            inner = np.linalg.inv(a.T @ a + np.eye(9))
            z, cross = a.T @ r - start / self.sigma[:9], a.T @ b
            parts.append((inner, cross, z))
            h += b.T @ b - cross.T @ inner @ cross
            g += b.T @ r - cross.T @ inner @ z
        change = np.linalg.solve(h, g)
        self.shared = self.shared + change * self.sigma[9:]
        for k, (inner, cross, z) in enumerate(parts):
            self.starts[k] += (inner @ (z - cross @ change)) * self.sigma[:9]

    def seen(self, after: Recorded) -> Seen | None:
        """With the start of its own arc taken out of everything, so that only what is shared stays."""
        outs = []
        for changed, r, x in zip(self._left(after), self.left, self.slopes, strict=True):
            weight = np.broadcast_to(1.0 / self.scale, r.shape).ravel()[:, None]
            both = np.column_stack([(changed - r).ravel(), x[..., 9:].reshape(-1, SHARED), r.ravel()]) * weight
            a = x[..., :9].reshape(-1, 9) * weight
            both -= a @ np.linalg.solve(a.T @ a + np.eye(9), a.T @ both)
            outs.append((both / weight).reshape(*r.shape, SHARED + 2))
        whole = np.concatenate(outs)
        residual = whole[..., -1]
        return _solved(whole[..., 0], whole[..., 1:-1], residual, _robust(residual), self.cluster)
