"""Ways that are none of an aeroplane or a car on a road: a ship, a helicopter, an aerobatic flight, a train."""

from __future__ import annotations

import math

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.special import expit

from benchmark.worlds.trajectories import DEG, Plan, _finish, _place, _travel, build
from benchmark.worlds.world import KNOT_S, Path, path


def _waves(rng: np.random.Generator, n: int, period_s: float, sigma: float) -> np.ndarray:
    """A swell of waves whose periods scatter by 15 %, (n,)."""
    time_s, out = KNOT_S * np.arange(n), np.zeros(n)
    for _ in range(12):
        rate = 2.0 * math.pi / period_s * math.exp(rng.normal(0.0, 0.15))
        out += np.sin(rate * time_s + rng.uniform(0.0, 2.0 * math.pi))
    return sigma * out / np.std(out)


def ship(rng, seconds=7200.0) -> Path:
    """Moored in small waves, out to sea at 8 m/s in larger ones with slow turns, and at rest again."""
    n = round(seconds / KNOT_S) + 1
    time_s = KNOT_S * np.arange(n)
    speed = np.interp(time_s, [600.0, 900.0, seconds - 600.0, seconds - 200.0], [0.0, 8.0, 8.0, 0.0])
    speed = gaussian_filter1d(speed, 20.0 / KNOT_S)
    course = np.full(n, rng.uniform(0.0, 2.0 * math.pi))
    at_s = 1500.0
    while at_s < seconds - 900.0:
        course += rng.uniform(-1.2, 1.2) * expit((time_s - at_s) / 25.0)
        at_s += rng.uniform(500.0, 1500.0)
    sea = 0.3 + 0.7 * expit((time_s - 1200.0) / 100.0)
    roll, pitch, yaw = (sea * _waves(rng, n, of, sigma * DEG) for of, sigma in ((10.0, 4.0), (7.0, 1.5), (12.0, 1.0)))
    heave, sway = (sea * _waves(rng, n, of, sigma) for of, sigma in ((8.0, 0.4), (9.0, 0.2)))
    vn, ve = speed * np.cos(course) - sway * np.sin(course), speed * np.sin(course) + sway * np.cos(course)
    lat, lon, _ = _place(rng)
    lla = _travel(lat, lon, 10.0, vn, ve, heave - heave.mean(), KNOT_S)
    return path(lla, np.column_stack((roll, pitch, course + yaw)), (("moored", 0.0, 600.0), ("sea", 600.0, seconds)))


def helicopter(rng, seconds=3600.0) -> Path:
    """Legs with hovers between them, at 0.3 m/s and sometimes with a whole turn."""
    plan = Plan(rng, rng.uniform(0.0, 2.0 * math.pi)).hold("parked", 180).hold("lift-off", 20, climb=2.0)
    while plan.time_s < seconds - 300.0:
        plan.hold("leg", 25, speed=rng.uniform(30, 60)).hold("leg", rng.uniform(60, 300), climb=rng.uniform(-1.0, 1.5))
        if rng.random() < 0.6:
            plan.turn(25 * DEG, rng.choice((-1, 1)) * rng.uniform(0.5, 2.0))
        plan.hold("stop", 25, speed=0.3)
        plan.hold("hover", rng.uniform(60, 200), turn=float(rng.choice((0.0, 0.0, 2.0, -2.0))) * math.pi)
    height = max(KNOT_S * sum(plan.climb), 5.0)
    plan.hold("descent", 0.5 * height, climb=-2.0).hold("stop", 5, speed=0.0).hold("parked", 60)
    return build(plan, *_place(rng), True, rng.uniform(0.8, 1.5))


def rolls(rng, seconds=2400.0) -> Path:
    """Steep turns, and between them whole rolls about the way."""
    plan = Plan(rng, rng.uniform(0.0, 2.0 * math.pi)).hold("parked", 120).hold("take-off", 30, speed=60)
    plan.hold("climb", 200, climb=5, speed=80)
    rolls_s = []
    while plan.time_s < seconds - 500.0:
        plan.hold("leg", 30)
        rolls_s.append(plan.time_s + 8.0)
        plan.hold("roll", 20)
        plan.turn(rng.uniform(40, 65) * DEG, rng.choice((-1, 1)) * rng.uniform(1.0, 3.1))
    flown = build(_finish(plan, seconds), *_place(rng), True, rng.uniform(0.5, 1.2))
    time_s = KNOT_S * np.arange(len(plan.speed))
    lla, _, euler, _ = flown.state(time_s)
    for at_s in rolls_s:
        euler[:, 0] += rng.choice((-1, 1)) * 2.0 * math.pi * expit((time_s - at_s) / 0.8)
    return path(lla, euler, plan.phases)


def train(rng, seconds=6000.0) -> Path:
    """Station after station, fast and smooth between them."""
    plan = Plan(rng, rng.uniform(0.0, 2.0 * math.pi)).hold("station", 150)
    while plan.time_s < seconds - 600.0:
        speed = rng.uniform(30, 70)
        plan.hold("run", speed / 0.5, speed=speed)
        for _ in range(rng.integers(1, 4)):
            plan.hold("run", rng.uniform(60, 300)).hold("curve", rng.uniform(30, 80), turn=rng.uniform(-0.6, 0.6))
        plan.hold("brake", speed / 0.6, speed=0.0).hold("station", rng.uniform(40, 150))
    plan.hold("parked", max(seconds - plan.time_s, 30.0))
    return build(plan, *_place(rng), False, 0.3)


ELSEWHERE = {
    "ship": ("drive", ship),
    "helicopter": ("flight", helicopter),
    "rolls": ("flight", rolls),
    "train": ("drive", train),
}
