"""Cases of the benchmark drawn once more: the same instrument without what it hides, or on another path.

The same seed gives the same draws, so the maker can say what no answer may know: how the very flight would have gone
with nothing hidden, and what the instrument would read in an experiment that is made after the diagnosis.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path
from unittest.mock import patch

import numpy as np
from scipy.ndimage import gaussian_filter1d

from benchmark.worlds import cases, world
from benchmark.worlds.elsewhere import ELSEWHERE
from benchmark.worlds.record import Made
from benchmark.worlds.room import a_chamber
from benchmark.worlds.trajectories import DEG, TRAJECTORIES, Plan, _finish, _place, build

DWELL_S, SLEW_S = 600.0, 4.0  # on each face; half the time of a turn from one to the next
FACES = ((0, 0, 0), (90, 0, 0), (180, 0, 0), (270, 0, 0), (360, 0, 0), (360, 90, 0), (360, 0, 0), (360, -90, 0))
HEADINGS = ((0, 0, 0), (0, 0, 90), (0, 0, 180), (0, 0, 270))
CHAMBER_RAMPS = (0.2, 0.5, 1.0)  # degC/min


def drawn(truth: dict, manifest: dict) -> cases.Case:
    """The case of a truth file, with its instrument and what it hides."""
    for entry in manifest["made"]:
        seed, rate_hz = entry["seed"], entry["rate_hz"]
        if cases.title(entry["set"], seed, truth["kind"], truth["index"]) == truth["case"]:
            mixed = entry.get("mixed_noise", False)
            return cases.draw(entry["set"], seed, truth["kind"], truth["index"], rate_hz, mixed)
    raise ValueError(f"{truth['case']}: no seed of the manifest draws it; expected the manifest of the same set")


def without_effect(truth: dict, manifest: dict) -> cases.Case:
    """The same case with the same draws, but nothing hidden."""
    with_effects = cases.a_recording

    def bare(rng, unit, trajectory, rate_hz, effects=(), *more, **named) -> Made:
        return with_effects(rng, unit, trajectory, rate_hz, (), *more, **named)

    with patch.object(cases, "a_recording", bare):
        return drawn(truth, manifest)


def _on_faces(faces: Sequence[Sequence[float]], dwell_s: float) -> Callable:
    """At rest on each of `faces` (roll, pitch, heading in degrees) in turn."""

    def rest(rng) -> world.Path:
        each = round(dwell_s / world.KNOT_S)
        angles = np.repeat(np.array(faces, dtype=float) * DEG, each, axis=0)
        angles = gaussian_filter1d(angles, SLEW_S / world.KNOT_S, axis=0, mode="nearest")
        angles += [0.0, 0.0, rng.uniform(0.0, 2.0 * np.pi)]
        return world.path(np.tile(_place(rng), (len(angles), 1)), angles, (("parked", 0.0, each * world.KNOT_S),))

    return rest


def _banked(rng) -> world.Path:
    """S-turns, then full circles at 45 and 60 degrees of bank."""
    plan = Plan(rng, rng.uniform(0, 2 * np.pi)).hold("parked", 90).hold("take-off", 60, speed=90)
    plan.hold("climb", 500, climb=4.0, speed=110)
    for k in range(12):
        plan.turn(25 * DEG, (1 if k % 4 in (0, 3) else -1) * 60 * DEG).hold("leg", 30)
    for k in range(8):
        plan.turn((60, 45)[k % 2] * DEG, 360 * DEG).hold("leg", 60)
    return build(_finish(plan, 4200.0), *_place(rng), True, 0.7)


def _dashes(rng) -> world.Path:
    """Fast and slow in turn."""
    plan = Plan(rng, rng.uniform(0, 2 * np.pi)).hold("parked", 90).hold("take-off", 60, speed=90)
    plan.hold("climb", 500, climb=4.0, speed=110)
    for _ in range(6):
        plan.hold("dash", 60, speed=200).hold("leg", 120).hold("brake", 60, speed=90).hold("leg", 120)
    return build(_finish(plan, 4800.0), *_place(rng), True, 0.7)


PATHS = {
    "headings": ("static", _on_faces(HEADINGS, 900.0)),
    "tumble": ("static", _on_faces(FACES, DWELL_S)),
    "oven, upside down": ("oven", _on_faces(((180, 0, 0),), 8100.0)),
    "oven, six faces": ("oven", _on_faces(FACES, 3600.0)),
    "banked turns": ("flight", _banked),
    "dashes": ("flight", _dashes),
}
# how a recommended experiment begins, or what it says, and the path that the maker takes for it; the first that fits
EXPERIMENTS = (
    ("a tumble", "tumble"), ("upside down", "oven, upside down"), ("on six faces", "oven, six faces"),
    ("an oven run", "oven"), ("four headings", "headings"), ("a parked recording", "static"),
    ("banked turns", "banked turns"), ("accelerations and dashes", "dashes"), ("a second drive", "drive"),
    ("a second flight", "climb, cruise, landing"),
)  # fmt: skip


def experiment(truth: dict, manifest: dict, words: str) -> Made | None:
    """The recording that a recommended experiment would give, or None where the maker has no such experiment."""
    case = drawn(truth, manifest)
    spread = int.from_bytes(hashlib.sha256(f"{truth['case']}/{words}".encode()).digest()[:8], "little")
    rng = np.random.default_rng(spread)
    _, is_chamber, _ = words.partition(" in a chamber")
    if is_chamber:
        axis = words.removeprefix("accelerometer ")[0]
        if any("drift" in one.name or not one.name.startswith("accelerometer.") for one in case.hidden):
            return None  # a chamber has one accelerometer, and its runs have no common start
        acting = [one for one in case.hidden if one.axis == axis]
        return a_chamber(rng, case.unit, axis, acting, CHAMBER_RAMPS, name="experiment")
    path = next((path for said, path in EXPERIMENTS if said in words), None)
    if words.startswith(("the same again", "all of it again")) and "another" not in words and len(case.made) == 1:
        path = case.made[0].trajectory
    if path is None or path not in {**TRAJECTORIES, **ELSEWHERE, **PATHS}:
        return None
    with patch.dict(TRAJECTORIES, PATHS):
        rate_hz = truth["recordings"][0]["rate_hz"]
        return cases.a_recording(rng, case.unit, path, max(rate_hz, 20.0), case.hidden, False, (), "experiment")


def save(made: Made, folder: Path) -> Path:
    """Write a recording, unless it is there."""
    if not (folder / "recording.toml").exists():
        made.save(folder)
    return folder
