"""Where the vehicles of the benchmark go: plans of speed, climb and course, smoothed into truth."""

from __future__ import annotations

import math

import numba
import numpy as np
from scipy.ndimage import gaussian_filter1d

from benchmark.worlds.earth import G0, radii
from benchmark.worlds.world import KNOT_S, Path, path

DEG = math.pi / 180.0


@numba.njit(cache=True)
def _travel(lat, lon, h, vn, ve, vd, step):
    """Geodetic positions by Heun's rule; truth is the spline through them, so its error does not matter."""
    out = np.empty((vn.size, 3))
    for k in range(vn.size):
        out[k, 0], out[k, 1], out[k, 2] = lat, lon, h
        if k + 1 < vn.size:
            m, n = radii(lat)
            a, b = vn[k] / (m + h), ve[k] / ((n + h) * math.cos(lat))
            m, n = radii(lat + a * step)
            h2 = h - vd[k] * step
            a2, b2 = vn[k + 1] / (m + h2), ve[k + 1] / ((n + h2) * math.cos(lat + a * step))
            lat += 0.5 * step * (a + a2)
            lon += 0.5 * step * (b + b2)
            h -= 0.5 * step * (vd[k] + vd[k + 1])
    return out


class Plan:
    """Speed, climb rate and course on the knots, built by commands in the order of time."""

    def __init__(self, rng: np.random.Generator, course: float) -> None:
        self.rng, self.speed, self.climb, self.course = rng, [0.0], [0.0], [course]
        self.phases: list[tuple[str, float, float]] = []

    @property
    def time_s(self) -> float:
        return KNOT_S * (len(self.speed) - 1)

    def hold(self, name: str, seconds: float, speed=None, climb=None, turn=0.0) -> Plan:
        """For `seconds`: speed goes to `speed` at a constant rate, climb is `climb`, the course turns by `turn` rad."""
        n = max(round(seconds / KNOT_S), 1)
        start = self.time_s
        speed = self.speed[-1] if speed is None else speed
        self.speed.extend(np.linspace(self.speed[-1], speed, n + 1)[1:])
        self.course.extend(np.linspace(self.course[-1], self.course[-1] + turn, n + 1)[1:])
        self.climb.extend(np.full(n, climb or 0.0))
        self.phases.append((name, start, self.time_s))
        return self

    def turn(self, bank: float, by: float) -> Plan:
        """A coordinated turn by `by` rad at `bank` rad."""
        rate = G0 * math.tan(bank) / max(self.speed[-1], 1.0)
        return self.hold("turn", abs(by) / rate, turn=by)


def _rough(rng, n, sigma_s, size):
    """Gaussian noise of standard deviation `size`, smooth over `sigma_s`, (n,)."""
    raw = gaussian_filter1d(rng.standard_normal(n), sigma_s / KNOT_S, mode="nearest")
    return size * raw / np.std(raw)


def build(plan: Plan, lat: float, lon: float, h: float, air: bool, rough: float, rock=None, level=(0.0, 0.0)) -> Path:
    """The path of a plan; `rough` scales turbulence or the road, `rock` (start, end, amplitude rad, period s)."""
    rng, n = plan.rng, len(plan.speed)
    time_s = KNOT_S * np.arange(n)
    width = (4.0 if air else 1.5) / KNOT_S
    speed = gaussian_filter1d(np.array(plan.speed), width, mode="nearest")
    climb = gaussian_filter1d(np.array(plan.climb), 2.0 * width, mode="nearest")
    course = gaussian_filter1d(np.array(plan.course), width, mode="nearest")
    speed[:1] = 0.0 if plan.speed[0] == 0.0 else speed[:1]
    # exactly at rest where the plan is, and free of wiggles there
    still = gaussian_filter1d((np.array(plan.speed) < 1e-9).astype(float), width, mode="nearest")
    free = np.clip(1.0 - 1.02 * still, 0.0, 1.0) ** 2
    speed *= np.where(still > 0.98, 0.0, 1.0)
    move = free * np.clip(speed / (60.0 if air else 10.0), 0.0, 1.0)
    wind = [rough * _rough(rng, n, s, a) for s, a in ((5.0, 0.8), (5.0, 0.8), (3.0, 0.5))]
    vn = speed * np.cos(course) + move * wind[0] * (1.0 if air else 0.02)
    ve = speed * np.sin(course) + move * wind[1] * (1.0 if air else 0.02)
    slope = _rough(rng, n, 20.0, 1.5 * DEG) if not air else np.zeros(n)
    vd = -climb - move * wind[2] * (1.0 if air else 0.02) - speed * np.tan(slope) * move
    wiggle = [rough * _rough(rng, n, 1.2, s * DEG) for s in (0.7, 0.4, 0.5)]
    turning = np.gradient(course, KNOT_S)
    roll = (np.arctan(speed * turning / G0) if air else 0.1 * np.arctan(speed * turning / G0)) + move * wiggle[0]
    pitch = np.arctan2(climb + speed * np.tan(slope) * move, np.maximum(speed, 20.0 if air else 5.0))
    pitch = pitch + move * wiggle[1] + (3.0 * DEG * np.clip(speed / 60.0, 0, 1) ** 2 if air else 0.0)
    heading = course + move * (wiggle[2] + (_rough(rng, n, 60.0, 1.5 * DEG) if air else 0.0))
    if rock is not None:
        start, end, amplitude, period = rock
        envelope = gaussian_filter1d(((time_s > start) & (time_s < end)).astype(float), 6.0 / KNOT_S)
        roll = roll + envelope * amplitude * np.sin(2 * np.pi * (time_s - start) / period)
        heading = heading + envelope * 0.15 * amplitude * np.sin(2 * np.pi * (time_s - start) / period + 1.0)
    lla = _travel(lat, lon, h, vn, ve, vd, KNOT_S)
    return path(lla, np.column_stack((roll + level[0], pitch + level[1], heading)), plan.phases)


def _place(rng):
    lat = rng.choice((-1.0, 1.0), p=(0.25, 0.75)) * rng.uniform(8.0, 62.0)
    return lat * DEG, rng.uniform(-180.0, 180.0) * DEG, rng.uniform(5.0, 1200.0)


def _finish(plan, seconds):
    """Land so that the whole lasts `seconds`: cruise on, come down to the height of the start, stop."""
    height = KNOT_S * sum(plan.climb)
    sink = max(height / 900.0, 2.5)
    descent = height / sink
    while plan.time_s < seconds - descent - 700.0:
        left = seconds - descent - 700.0 - plan.time_s
        if plan.rng.random() < 0.6 and left > 200.0:
            plan.turn(plan.rng.uniform(12, 28) * DEG, plan.rng.choice((-1, 1)) * plan.rng.uniform(20, 180) * DEG)
        else:
            plan.hold("cruise", min(plan.rng.uniform(150, 700), max(left, 5.0)))
    half = 0.55 * descent
    plan.hold("descent", half, climb=-sink, speed=0.8 * plan.speed[-1])
    plan.turn(20 * DEG, plan.rng.choice((-1, 1)) * 90 * DEG)
    plan.hold("descent", descent - half, climb=-sink, speed=70.0)
    plan.hold("landing", 60.0, speed=15.0).hold("taxi", 120.0, turn=plan.rng.uniform(-2, 2)).hold("stop", 25.0, speed=0)
    plan.hold("parked", max(seconds - plan.time_s, 10.0))
    return plan


def climb_cruise_landing(rng, seconds=8280.0):
    plan = Plan(rng, rng.uniform(0, 2 * math.pi))
    plan.hold("parked", rng.uniform(120, 400)).hold("taxi", 25, speed=8).hold("taxi", 150, turn=rng.uniform(-2, 2))
    plan.hold("take-off", 40, speed=80)
    top = rng.uniform(3500, 9000)
    rate = rng.uniform(4.0, 8.0)
    plan.hold("climb", 0.5 * top / rate, climb=rate, speed=rng.uniform(110, 150))
    plan.turn(rng.uniform(15, 25) * DEG, rng.choice((-1, 1)) * rng.uniform(40, 120) * DEG)
    plan.hold("climb", 0.5 * top / rate, climb=rate, speed=rng.uniform(150, 210))
    if rng.random() < 0.5:
        plan.hold("cruise", rng.uniform(300, 900)).hold("climb", 200, climb=rng.choice((-1, 1)) * rng.uniform(2, 5))
    return build(_finish(plan, seconds), *_place(rng), True, rng.uniform(0.4, 1.5))


def box(rng, seconds=4200.0):
    plan = Plan(rng, rng.uniform(0, 2 * math.pi)).hold("parked", 90).hold("take-off", 60, speed=90)
    plan.hold("climb", 500, climb=rng.uniform(3, 6), speed=130)
    side, way = rng.uniform(200, 400), rng.choice((-1, 1))
    for _ in range(7):
        plan.hold("leg", side).turn(rng.uniform(15, 30) * DEG, way * 90 * DEG)
    return build(_finish(plan, seconds), *_place(rng), True, rng.uniform(0.3, 1.5))


def straight(rng, seconds=4800.0):
    plan = Plan(rng, rng.uniform(0, 2 * math.pi)).hold("parked", 120).hold("take-off", 60, speed=90)
    climb = rng.uniform(4, 8)
    plan.hold("climb", 700, climb=climb, speed=170).hold("cruise", seconds - 2300)
    sink = 700 * climb / 900
    plan.hold("descent", 900, climb=-sink, speed=75).hold("landing", 80, speed=0)
    plan.hold("parked", max(seconds - plan.time_s, 20))
    return build(plan, *_place(rng), True, rng.uniform(0.2, 1.0))


def wing_rock(rng, seconds=3600.0):
    plan = Plan(rng, rng.uniform(0, 2 * math.pi)).hold("parked", 90).hold("take-off", 60, speed=90)
    plan.hold("climb", 500, climb=6, speed=150)
    rock = (900.0, rng.uniform(1500.0, 2000.0), rng.uniform(8, 20) * DEG, rng.uniform(3.0, 8.0))
    return build(_finish(plan, seconds), *_place(rng), True, rng.uniform(0.4, 1.2), rock)


def drive(rng, seconds=3000.0):
    plan = Plan(rng, rng.uniform(0, 2 * math.pi)).hold("parked", 120)
    while plan.time_s < seconds - 120:
        speed = rng.uniform(6, 22)
        plan.hold("drive", speed / rng.uniform(0.8, 2.0), speed=speed).hold("drive", rng.uniform(10, 90))
        if rng.random() < 0.7:
            plan.hold("turn", rng.uniform(8, 16), speed=7.0, turn=rng.choice((-1, 1)) * rng.uniform(0.5, 1.7))
            plan.hold("drive", 8, speed=speed)
        if rng.random() < 0.6:
            plan.hold("stop", speed / rng.uniform(0.8, 2.0), speed=0.0).hold("stand", rng.uniform(8, 60))
    plan.hold("stop", 15, speed=0.0).hold("parked", max(seconds - plan.time_s, 30))
    return build(plan, *_place(rng), False, rng.uniform(0.4, 1.2))


def parked(rng, seconds=7200.0):
    """At rest, in an attitude within a few degrees of level."""
    n = round(seconds / KNOT_S) + 1
    lat, lon, h = _place(rng)
    euler = np.array((rng.normal(0, 1.5) * DEG, rng.normal(0, 1.5) * DEG, rng.uniform(0, 2 * math.pi)))
    return path(np.tile((lat, lon, h), (n, 1)), np.tile(euler, (n, 1)), (("parked", 0.0, KNOT_S * (n - 1)),))


TRAJECTORIES = {
    "climb, cruise, landing": ("flight", climb_cruise_landing),
    "box": ("flight", box),
    "straight": ("flight", straight),
    "wing rock": ("flight", wing_rock),
    "drive": ("drive", drive),
    "oven": ("oven", parked),
    "static": ("static", parked),
}
