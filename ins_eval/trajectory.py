"""Flight plan to truth: closed-form motion and the exact increments that an ideal IMU would feel.

Ground speed, vertical speed and heading are sums of smooth pulses whose integrals and derivatives are closed
forms, so velocity, attitude, height, body rate and specific force are closed forms too; horizontal position is
their quadrature. Increments are Gauss-Legendre quadratures of body rate and specific force over each sample.
Nothing here is taken from the mechanization, nor inverts it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil, tan

import numba
import numpy as np

from ins_eval.earth import EARTH_RATE, gravity, radii
from ins_eval.errors import UsageError
from ins_eval.profile import Profile
from ins_eval.units import DEG, STANDARD_GRAVITY

MIN_RATE_HZ, MAX_RATE_HZ = 1.0, 400.0
_POSITION_STEP_S = 0.25  # of the quadrature of latitude and longitude


@dataclass(frozen=True)
class Truth:
    """The true state at `time_s` (n,).

    Position in rad and m, velocity (n, 3) NED in m/s, attitude (n, 3) roll, pitch, heading in rad.
    """

    time_s: np.ndarray
    latitude_rad: np.ndarray
    longitude_rad: np.ndarray
    height_m: np.ndarray
    velocity_n: np.ndarray
    attitude_rad: np.ndarray


@dataclass(frozen=True)
class Increments:
    """What an ideal IMU feels over the samples that end at `time_s` (n,).

    `dtheta_b` (n, 3) in rad and `dv_b` (n, 3) in m/s, body axes.
    """

    time_s: np.ndarray
    dtheta_b: np.ndarray
    dv_b: np.ndarray


@numba.njit(cache=True)
def _fade(u):
    """Smooth step from 0 to 1 over 0..1 with three zero derivatives at both ends: value, slope, integral from 0."""
    if u <= 0.0:
        return 0.0, 0.0, 0.0
    if u >= 1.0:
        return 1.0, 0.0, 0.5 + (u - 1.0)
    u3 = u * u * u
    value = u3 * u * (35.0 + u * (-84.0 + u * (70.0 - 20.0 * u)))
    left = 1.0 - u
    slope = 140.0 * u3 * (left * left * left)
    integral = u3 * u * u * (7.0 + u * (-14.0 + u * (10.0 - 2.5 * u)))
    return value, slope, integral


@numba.njit(cache=True)
def _pulses(table, t):
    """Integral, value and slope at t of the pulses of `table` (k, 4): each fades in, holds a level, fades out."""
    integral = value = slope = 0.0
    for k in range(table.shape[0]):
        start, end, edge, level = table[k, 0], table[k, 1], table[k, 2], table[k, 3]
        if t <= start:
            continue
        if t >= end:
            integral += level * (end - start - edge)
            continue
        v0, s0, i0 = _fade((t - start) / edge)
        v1, s1, i1 = _fade((t - end + edge) / edge)
        integral += level * edge * (i0 - i1)
        value += level * (v0 - v1)
        slope += level * (s0 - s1) / edge
    return integral, value, slope


@numba.njit(cache=True)
def _motion(plan, t):
    """Speed, its rate; heading, its rate and second rate; height and its two rates; roll, its rate; pitch, its rate."""
    speed_table, height_table, turn_table, rock, height0, heading0 = plan
    speed, acceleration, _ = _pulses(speed_table, t)
    climbed, climb, climb_rate = _pulses(height_table, t)
    turned, turn, turn_rate = _pulses(turn_table, t)

    tangent = speed * turn / STANDARD_GRAVITY  # coordinated: tan(roll) = V psi' / g
    roll = np.arctan(tangent)
    roll_rate = (acceleration * turn + speed * turn_rate) / STANDARD_GRAVITY / (1.0 + tangent * tangent)
    amplitude, frequency, rock_from, rock_to, rock_edge = rock
    if amplitude != 0.0 and rock_from < t < rock_to:
        v0, s0, _ = _fade((t - rock_from) / rock_edge)
        v1, s1, _ = _fade((t - rock_to + rock_edge) / rock_edge)
        w = 2.0 * np.pi * frequency
        sine, cosine = np.sin(w * (t - rock_from)), np.cos(w * (t - rock_from))
        roll += amplitude * (v0 - v1) * sine
        roll_rate += amplitude * ((s0 - s1) / rock_edge * sine + (v0 - v1) * w * cosine)

    pitch = pitch_rate = 0.0  # along the path: tan(pitch) = h' / V
    if climb != 0.0 or climb_rate != 0.0:
        pitch = np.arctan2(climb, speed)
        pitch_rate = (climb_rate * speed - climb * acceleration) / (speed * speed + climb * climb)
    return (
        speed,
        acceleration,
        heading0 + turned,
        turn,
        height0 + climbed,
        climb,
        climb_rate,
        roll,
        roll_rate,
        pitch,
        pitch_rate,
    )


@numba.njit(cache=True)
def _course(plan, t):
    """Velocity north and east, and height: the part of `_motion` that moves a position."""
    speed_table, height_table, turn_table, _, height0, heading0 = plan
    speed, heading = _pulses(speed_table, t)[0], heading0 + _pulses(turn_table, t)[0]
    return speed * np.cos(heading), speed * np.sin(heading), height0 + _pulses(height_table, t)[0]


@numba.njit(cache=True)
def _position_rates(course, latitude):
    north, east, height = course
    meridian, transverse = radii(latitude)
    return north / (meridian + height), east / ((transverse + height) * np.cos(latitude))


@numba.njit(cache=True)
def _positions(plan, start_s, step_s, count, latitude0, longitude0):
    """Classical Runge-Kutta quadrature of latitude and longitude, with their rates for interpolation: (count, 4)."""
    out = np.empty((count, 4))
    latitude, longitude = latitude0, longitude0
    begin = _course(plan, start_s)
    for k in range(count):
        t = start_s + k * step_s
        middle, end = _course(plan, t + 0.5 * step_s), _course(plan, start_s + (k + 1) * step_s)
        a1, b1 = _position_rates(begin, latitude)
        out[k] = latitude, longitude, a1, b1
        a2, b2 = _position_rates(middle, latitude + 0.5 * step_s * a1)
        a3, b3 = _position_rates(middle, latitude + 0.5 * step_s * a2)
        a4, b4 = _position_rates(end, latitude + step_s * a3)
        latitude += step_s * (a1 + 2.0 * (a2 + a3) + a4) / 6.0
        longitude += step_s * (b1 + 2.0 * (b2 + b3) + b4) / 6.0
        begin = end
    return out


@numba.njit(cache=True)
def _hermite(grid, start_s, step_s, t, column):
    """Cubic between the knots of `grid`, from values in `column` and rates two columns on."""
    k = min(max(int((t - start_s) / step_s), 0), grid.shape[0] - 2)
    u = (t - start_s) / step_s - k
    y0, y1 = grid[k, column], grid[k + 1, column]
    d0, d1 = step_s * grid[k, column + 2], step_s * grid[k + 1, column + 2]
    return y0 + u * (d0 + u * (3.0 * (y1 - y0) - 2.0 * d0 - d1 + u * (2.0 * (y0 - y1) + d0 + d1)))


@numba.njit(cache=True)
def _felt(plan, grid, start_s, t):
    """Body rate against inertial space (rad/s) and specific force (m/s^2), body axes."""
    speed, acceleration, psi, turn, height, climb, climb_rate, roll, roll_rate, pitch, pitch_rate = _motion(plan, t)
    latitude = _hermite(grid, start_s, _POSITION_STEP_S, t, 0)
    sp, cp = np.sin(psi), np.cos(psi)
    st, ct = np.sin(pitch), np.cos(pitch)
    sr, cr = np.sin(roll), np.cos(roll)
    vn, ve, vd = speed * cp, speed * sp, -climb
    meridian, transverse = radii(latitude)
    ien, ied = EARTH_RATE * np.cos(latitude), -EARTH_RATE * np.sin(latitude)
    enn, ene = ve / (transverse + height), -vn / (meridian + height)
    end = -enn * np.tan(latitude)
    # specific force: f = v' + (2 w_ie + w_en) x v - g, north-east-down
    wn, we, wd = 2.0 * ien + enn, ene, 2.0 * ied + end
    fn = acceleration * cp - speed * turn * sp + we * vd - wd * ve
    fe = acceleration * sp + speed * turn * cp + wd * vn - wn * vd
    fd = -climb_rate + wn * ve - we * vn - gravity(latitude, height)
    wn, wd = ien + enn, ied + end
    # rows of the matrix that takes n to b
    xn, xe, xd = ct * cp, ct * sp, -st
    yn, ye, yd = sr * st * cp - cr * sp, sr * st * sp + cr * cp, sr * ct
    zn, ze, zd = cr * st * cp + sr * sp, cr * st * sp - sr * cp, cr * ct
    return (
        roll_rate - turn * st + xn * wn + xe * we + xd * wd,
        pitch_rate * cr + turn * sr * ct + yn * wn + ye * we + yd * wd,
        -pitch_rate * sr + turn * cr * ct + zn * wn + ze * we + zd * wd,
        xn * fn + xe * fe + xd * fd,
        yn * fn + ye * fe + yd * fd,
        zn * fn + ze * fe + zd * fd,
    )


@numba.njit(cache=True)
def _quadrature(plan, grid, start_s, first, last, step_s, nodes, weights):
    """Integral of `_felt` over the samples from `first` to before `last`: angles (n, 3), velocities (n, 3)."""
    angle, velocity = np.zeros((last - first, 3)), np.zeros((last - first, 3))
    for k in range(first, last):
        t0 = start_s + k * step_s
        for i in range(nodes.size):
            felt = _felt(plan, grid, start_s, t0 + step_s * nodes[i])
            for j in range(3):
                angle[k - first, j] += step_s * weights[i] * felt[j]
                velocity[k - first, j] += step_s * weights[i] * felt[3 + j]
    return angle, velocity


@numba.njit(cache=True)
def _forces(plan, grid, start_s, time_s):
    out = np.empty((time_s.size, 3))
    for k in range(time_s.size):
        out[k] = _felt(plan, grid, start_s, time_s[k])[3:]
    return out


@numba.njit(cache=True)
def _states(plan, grid, start_s, time_s):
    out = np.empty((time_s.size, 9))
    for k in range(time_s.size):
        t = time_s[k]
        speed, _, heading, _, height, climb, _, roll, _, pitch, _ = _motion(plan, t)
        out[k, 0] = _hermite(grid, start_s, _POSITION_STEP_S, t, 0)
        out[k, 1] = _hermite(grid, start_s, _POSITION_STEP_S, t, 1)
        out[k, 2] = height
        out[k, 3], out[k, 4], out[k, 5] = speed * np.cos(heading), speed * np.sin(heading), -climb
        out[k, 6], out[k, 7] = roll, pitch
        out[k, 8] = (heading + np.pi) % (2.0 * np.pi) - np.pi
    return out


class Trajectory:
    """The truth that a `Profile` describes, from ``-start.stand_s`` to ``duration_s``."""

    def __init__(self, profile: Profile):
        self.profile = profile
        self.start_s = -profile.start.stand_s
        self.end_s = profile.duration_s
        speed = _changes([(c.from_s, c.to_s, c.edge_s, c.to_mps) for c in profile.speed], 0.0)
        height = _changes([(c.from_s, c.to_s, c.edge_s, c.to_m) for c in profile.height], profile.start.height_m)
        rock = profile.wing_rock
        self._plan = (
            speed,
            height,
            _turn_table(profile, speed),
            (rock.amplitude_deg * DEG, rock.frequency_hz, rock.from_s, rock.to_s, 10.0 / rock.frequency_hz)
            if rock
            else (0.0, 1.0, 0.0, 1.0, 1.0),
            profile.start.height_m,
            profile.start.heading_deg * DEG,
        )

    @property
    def turns_s(self) -> np.ndarray:
        """Begin and end of each turn of the profile, from level to level, (k, 2)."""
        return self._plan[2][:, :2]

    @cached_property
    def _grid(self) -> np.ndarray:
        place = self.profile.start
        count = ceil((self.end_s - self.start_s) / _POSITION_STEP_S) + 2
        return _positions(
            self._plan, self.start_s, _POSITION_STEP_S, count, place.latitude_deg * DEG, place.longitude_deg * DEG
        )

    def truth(self, time_s: np.ndarray) -> Truth:
        """The true state at `time_s` (n,), anywhere between `start_s` and `end_s`."""
        time_s = np.ascontiguousarray(time_s, dtype=float)
        s = _states(self._plan, self._grid, self.start_s, time_s)
        return Truth(time_s, s[:, 0], s[:, 1], s[:, 2], s[:, 3:6], s[:, 6:9])

    def specific_force(self, time_s: np.ndarray) -> np.ndarray:
        """Specific force (n, 3) in m/s^2, body axes, at `time_s` (n,), anywhere between `start_s` and `end_s`."""
        return _forces(self._plan, self._grid, self.start_s, np.ascontiguousarray(time_s, dtype=float))

    def samples_s(self, rate_hz: float) -> np.ndarray:
        """Ends of all samples at a rate from 1 to 400 Hz, (end_s - start_s) rate_hz of them."""
        if not MIN_RATE_HZ <= rate_hz <= MAX_RATE_HZ:
            raise ValueError(f"rate_hz is {rate_hz:g}, expected {MIN_RATE_HZ:g} to {MAX_RATE_HZ:g}")
        count = int(round((self.end_s - self.start_s) * rate_hz))
        return self.start_s + np.arange(1, count + 1) / rate_hz

    def increments(self, rate_hz: float, from_s: float = -np.inf, until_s: float = np.inf) -> Increments:
        """Exact increments over the samples of `samples_s`, or over those in a part of it.

        Three-node Gauss-Legendre quadrature of the closed forms, error of order (w / rate)^6 at frequency w.
        """
        time_s = self.samples_s(rate_hz)
        nodes, weights = np.polynomial.legendre.leggauss(3)
        half_s = 0.5 / rate_hz
        first, last = (int(row) for row in np.searchsorted(time_s, [from_s + half_s, until_s + half_s]))
        angle, velocity = _quadrature(
            self._plan, self._grid, self.start_s, first, last, 1.0 / rate_hz, 0.5 * (nodes + 1.0), 0.5 * weights
        )
        return Increments(time_s[first:last].copy(), angle, velocity)


def _changes(rows: list[tuple[float, float, float, float]], start: float) -> np.ndarray:
    """Pulse table of a quantity that goes from `start` to the level of each row in turn."""
    table = np.zeros((len(rows), 4))
    for k, (begin, end, edge, to) in enumerate(rows):
        table[k] = begin, end, edge, (to - start) / (end - begin - edge)
        start = to
    return table


def _turn_table(profile: Profile, speed: np.ndarray) -> np.ndarray:
    """Pulse table of the turn rate: psi' = g tan(bank) / V, held as long as the angle asks for."""
    table = np.zeros((len(profile.turn), 4))
    for k, turn in enumerate(profile.turn):
        v = _pulses(speed, turn.at_s)[0]
        if v < 1.0:
            raise UsageError(
                f"{profile.name}: turn[{k}] at {turn.at_s:g} s is at {v:g} m/s; a coordinated turn needs speed, move it"
            )
        angle = abs(turn.by_deg) * DEG
        rate = STANDARD_GRAVITY * tan(turn.bank_deg * DEG) / v
        hold = max(angle / rate, turn.edge_s)  # a small angle is flown at less bank, over the two edges alone
        end = turn.at_s + hold + turn.edge_s
        if end > profile.duration_s:
            raise UsageError(
                f"{profile.name}: turn[{k}] at {turn.at_s:g} s lasts until {end:.1f} s, after duration_s = "
                f"{profile.duration_s:g} s; start it earlier or bank more"
            )
        table[k] = turn.at_s, end, turn.edge_s, np.sign(turn.by_deg) * angle / hold
    return table
