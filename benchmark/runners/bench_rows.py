"""What is timed: one function a group, in `GROUPS`; its first contender is what the others are held against.

A contender is called many times, in turn with those beside it, and its processor time, children included, is taken.
To add one, add a callable to its group; to add a group, add a function to `GROUPS`.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import count
from pathlib import Path

import numpy as np
import pandas as pd
import pyins.strapdown
import pyins.util

from ins_eval import coning_sculling, ensemble, strapdown
from ins_eval.analysis.both_ways import TOO_LARGE
from ins_eval.analysis.flight import BUDGET_ARMS
from ins_eval.analysis.missions import POPULATION
from ins_eval.ensemble import Plan, World
from ins_eval.profile import load
from ins_eval.recording import Start
from ins_eval.trajectory import Trajectory

SOURCE = Path(__file__).parents[1] / "speed" / "mechanization.c"
SAMPLES = 828_000  # 2.3 h at 100 Hz
PYINS_SAMPLES = 40_000
LANES = 8
IMPORTED = "numpy, scipy.stats, numba, matplotlib.figure"
DIAGNOSED = {"null": ("null", 1), "with an effect": ("single", 0)}  # kind and number of a flight of 2.3 h, of seed 77
TEN_MINUTES = """\
name = "ten minutes"
duration_s = 600.0
start = {latitude_deg = 45.0, longitude_deg = 10.0, height_m = 500.0, heading_deg = 30.0, stand_s = 120.0}
speed = [{from_s = 10.0, to_s = 60.0, to_mps = 80.0}]
turn = [{at_s = 80.0, by_deg = 45.0, bank_deg = 20.0}, {at_s = 300.0, by_deg = -90.0, bank_deg = 20.0}]
thermal = {self_heating_c = 1.0}
"""


@dataclass(frozen=True)
class Group:
    """Contenders by name, how much each does in a call, and why others are missing."""

    title: str
    unit: str
    contenders: Mapping[str, Callable[[], object]]
    amounts: Mapping[str, float] = field(default_factory=dict)
    missing: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Flight:
    """Contiguous increments and heights (n, ...) of a flight without errors, and its start."""

    time_s: np.ndarray
    dtheta_b: np.ndarray
    dv_b: np.ndarray
    height_m: np.ndarray
    start: Start

    def cut(self, count: int) -> Flight:
        return Flight(*(each[:count] for each in (self.time_s, self.dtheta_b, self.dv_b, self.height_m)), self.start)

    def navigated(self, **options) -> strapdown.Solution:
        return strapdown.navigate(
            self.time_s, self.dtheta_b, self.dv_b, self.start, height_aid_m=self.height_m, **options
        )


@cache
def flight(name: str = "climb-cruise-landing", rate_hz: float = 100.0) -> Flight:
    """A shipped profile; increments are sums of such at 100 Hz, whose quadrature is good enough."""
    trajectory = Trajectory(load(name))
    fine, count = trajectory.increments(100.0), round(100.0 / rate_hz)
    angle, velocity = (each.reshape(-1, count, 3).sum(axis=1) for each in (fine.dtheta_b, fine.dv_b))
    time_s = fine.time_s[count - 1 :: count].copy()
    at = trajectory.truth(np.array([trajectory.start_s]))
    place = (float(each[0]) for each in (at.latitude_rad, at.longitude_rad, at.height_m))
    start = Start(trajectory.start_s, *place, tuple(at.velocity_n[0]), tuple(at.attitude_rad[0]))
    return Flight(time_s, angle, velocity, trajectory.truth(time_s).height_m.copy(), start)


def kernel() -> Group:
    """Navigation of one flight: the compiled loop and the public call beside C and python-ins."""
    one = flight().cut(SAMPLES)
    contenders: dict[str, Callable[[], object]] = {}
    missing, amounts = {}, {}
    for name, lanes, flags in (
        ("scalar C, -O3", 1, ()),
        ("scalar C, -O3 -march=native", 1, ("-march=native",)),
        (f"C, {LANES} flights at once, -O3 -march=native", LANES, ("-march=native",)),
    ):
        try:
            contenders[name], amounts[name] = _c(one, lanes, flags), float(SAMPLES * lanes)
        except (OSError, subprocess.CalledProcessError) as reason:
            missing[name] = f"it cannot be compiled here: {reason}"
    arguments = _kernel_arguments(one)
    contenders["kernel"] = lambda: strapdown._navigate(*arguments)
    contenders["public call"] = one.navigated
    contenders["python-ins"] = _python_ins(one.cut(PYINS_SAMPLES))
    amounts |= {"kernel": SAMPLES, "public call": SAMPLES, "python-ins": PYINS_SAMPLES}
    return Group("Navigation of one flight", "ns a sample", contenders, amounts, missing)


def _kernel_arguments(one: Flight) -> tuple:
    """What `navigate` hands to the compiled loop, caught from it."""
    caught: list[tuple] = []
    loop = strapdown._navigate
    try:
        strapdown._navigate = lambda *arguments: caught.append(arguments) or loop(*arguments)
        one.navigated()
    finally:
        strapdown._navigate = loop
    return caught[0]


def _c(one: Flight, lanes: int, flags: tuple[str, ...]) -> Callable[[], np.ndarray]:
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if compiler is None:
        raise OSError("no C compiler")
    library = Path(tempfile.mkdtemp()) / "mechanization.so"
    command = [compiler, "-O3", *flags, "-fPIC", "-shared", f"-DLANES={lanes}", str(SOURCE), "-o", str(library), "-lm"]
    subprocess.run(command, check=True, capture_output=True)
    loop = ctypes.CDLL(str(library)).navigate
    shutil.rmtree(library.parent)
    loop.restype = None
    time_s, _, _, height, start, attitude, _, gains, _, every = _kernel_arguments(one)
    begin = np.array([*start[1:], *attitude])
    weights = np.array([coning_sculling._VALUE, coning_sculling._SLOPE, coning_sculling._CURVATURE])
    angle, velocity = (_lanes(np.pad(each, ((2, 2), (0, 0)), mode="edge"), lanes) for each in (one.dtheta_b, one.dv_b))
    aid, limits = _lanes(height[:, None], lanes), np.array(gains)
    count = time_s.size

    def run() -> np.ndarray:
        rows = np.empty((count // coning_sculling.SAMPLES_PER_STEP + 1, 11, lanes))
        given = (time_s, angle, velocity, aid, begin, weights, limits)
        arrays = [each.ctypes.data_as(ctypes.c_void_p) for each in given]
        loop(
            ctypes.c_long(count), ctypes.c_double(one.start.time_s), *arrays, ctypes.c_long(every),
            rows.ctypes.data_as(ctypes.c_void_p),
        )  # fmt: skip
        return rows

    return run


def _lanes(rows: np.ndarray, lanes: int) -> np.ndarray:
    return np.ascontiguousarray(np.repeat(rows[:, :, None], lanes, axis=2))


def _python_ins(one: Flight) -> Callable[[], object]:
    names = pyins.util.GYRO_COLS + pyins.util.ACCEL_COLS
    rows = np.hstack([one.dtheta_b, one.dv_b])
    times = np.concatenate([[one.start.time_s], one.time_s])
    imu = pd.DataFrame(np.vstack([rows[:1], rows]), index=times, columns=names)
    start = one.start
    state = [np.rad2deg(start.latitude_rad), np.rad2deg(start.longitude_rad), start.height_m, *start.velocity_n]
    begin = pd.Series([*state, *np.rad2deg(start.attitude_rad)], index=pyins.util.TRAJECTORY_COLS, dtype=float)
    increments = pyins.strapdown.compute_increments_from_imu(imu, "increment")
    return lambda: pyins.strapdown.Integrator(begin).integrate(increments)


def lengths() -> Group:
    """The public call on parts of the flight: time is to be linear in samples."""
    sizes = [SAMPLES // 8, SAMPLES // 4, SAMPLES // 2, SAMPLES]
    parts = {f"{size} samples": flight().cut(size) for size in sizes}
    contenders = {name: part.navigated for name, part in parts.items()}
    return Group("Cost against length", "ns a sample", contenders, dict(zip(parts, map(float, sizes), strict=True)))


def rates() -> Group:
    """The public call on the whole flight at rates from 10 to 100 Hz."""
    flown = {f"{rate_hz:g} Hz": flight(rate_hz=rate_hz) for rate_hz in (100.0, 50.0, 20.0, 10.0)}
    amounts = {name: float(one.time_s.size) for name, one in flown.items()}
    return Group("Cost against rate", "ns a sample", {name: one.navigated for name, one in flown.items()}, amounts)


def start_up() -> Group:
    """Processes of their own, with nothing but the named work; the first is what others' packages take to import."""
    folder = Path(tempfile.mkdtemp())
    (folder / "short.toml").write_text(TEN_MINUTES)
    recordings = {
        "box": ["oven", "--rate", "10"],
        "flight": ["flight", "--profile", str(folder / "short.toml"), "--rate", "100"],
    }
    for name, words in recordings.items():
        subprocess.run([*_VERB, "simulate", *words, "-o", str(folder / name), "--quiet"], check=True)
    evaluate = [*_VERB, "evaluate", "--output", str(folder / "page"), "--quiet"]
    made = {
        "import of numpy, scipy, numba, matplotlib": [sys.executable, "-c", f"import {IMPORTED}"],
        "import ins_eval": [sys.executable, "-c", "import ins_eval"],
        "import of navigate": [sys.executable, "-c", "from ins_eval import navigate"],
        "ins-eval --help": [*_VERB, "--help"],
        "ins-eval presets": [*_VERB, "presets"],
        "ins-eval evaluate": [*evaluate, str(folder / "box")],
        "ins-eval evaluate, a flight of 10 min at 100 Hz": [*evaluate, str(folder / "flight")],
        **{f"diagnose, {name}": _diagnosis(folder / kind, kind, first) for name, (kind, first) in DIAGNOSED.items()},
    }

    def process(command: list[str]) -> Callable[[], object]:
        return lambda: subprocess.run(command, check=True, capture_output=True)

    contenders = {name: process(command) for name, command in made.items()}
    return Group("Start-up", "s", contenders, dict.fromkeys(made, 1.0))


def _diagnosis(folder: Path, kind: str, first: int) -> list[str]:
    """The command that diagnoses a flight of 2.3 h at 100 Hz, which is made here, and writes its answer as JSON."""
    draw = [sys.executable, "-m", "benchmark.runners.make", "--seed", "77", "--rate", "100", "--no-oracle"]
    which = ["--kind", kind, "--first", str(first), "--count", "1", "-o", str(folder)]
    subprocess.run([*draw, *which], check=True, capture_output=True)
    (recording,) = (folder / "recordings").iterdir()
    return [*_VERB, "diagnose", "--json", str(folder / "answer.json"), "--quiet", str(recording)]


def members() -> Group:
    """One instrument of the flight report, and a block of instruments to first order, beside one navigation."""
    in_full = Plan("climb-cruise-landing", "jb-kt8", seed=1)
    budget = replace(in_full, arms=BUDGET_ARMS, source="gyro")
    linear = replace(in_full, experiment="linear", arms=("simple", "hysteresis_refined"))
    mission = replace(linear, missions=POPULATION, arms=tuple(arm for arm in in_full.arms if arm not in TOO_LARGE))
    worlds = {plan: World(plan) for plan in (in_full, budget, linear, mission)}
    numbers = count()  # an instrument is drawn once, and what it shares with its twins is kept

    def fly(plan: Plan, member: Callable[[World, int], object]) -> Callable[[], object]:
        return lambda: member(worlds[plan], next(numbers))

    contenders = {
        "navigation of one flight at 10 Hz": flight(rate_hz=10.0).navigated,
        f"member, {len(in_full.arms)} arms": fly(in_full, ensemble.flight.member),
        f"member, {len(budget.arms)} arms, gyros alone": fly(budget, ensemble.flight.member),
        f"{linear.together} instruments to first order, 2 arms": fly(linear, ensemble.linear.member),
        f"mission of its own to first order, {len(mission.arms)} arms": fly(mission, ensemble.linear.member),
    }
    return Group("Members of an ensemble", "s", contenders, dict.fromkeys(contenders, 1.0))


_VERB = [sys.executable, "-m", "ins_eval.cli"]
GROUPS: Mapping[str, Callable[[], Group]] = {
    "kernel": kernel,
    "length": lengths,
    "rate": rates,
    "start-up": start_up,
    "members": members,
}
