"""Many instruments on one flight, each with every compensation: paired, in parallel, safe against a crash.

A member of the ensemble is one instrument. It is drawn, calibrated in the chamber, refined in the oven, flown and
navigated once for each compensation, with the same errors in all of them. Its result depends on the plan and its
number alone, so neither the number of workers nor an interruption can change a digit.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import signal
import threading
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import cached_property, lru_cache
from multiprocessing import connection, get_context, parent_process
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from ins_eval import accelerometer, metrics
from ins_eval.compensation import CompensationModel, Samples
from ins_eval.compensation.guard import working_model
from ins_eval.compensation.registry import model_files
from ins_eval.earth import gravity
from ins_eval.errors import InsEvalError, StorageError, UsageError
from ins_eval.evaluate import compensate, evaluate, samples, standstill_to_align_on
from ins_eval.gyro import GyroPopulation
from ins_eval.imu import Instrument, Mission, Population
from ins_eval.laboratory import Chamber
from ins_eval.profile import load
from ins_eval.reference import bridge
from ins_eval.storage import cannot_write, write_whole
from ins_eval.streams import Streams

ARMS = (
    "none",
    "simple",
    "quadratic",
    "hysteresis",
    "simple_refined",
    "hysteresis_refined",
    "hysteresis_scale_only",
    "hysteresis_bias_only",
    "hysteresis_without_rate",
)
RATE_HZ = 10.0
OVEN_RATE_HZ = 1.0
TRACK_PERIOD_S = 60.0
CHECKSUM_BYTES = 32  # SHA-256

# What the contributions of all members come to, by measure.
STATISTICS = {
    **{f"velocity_rms_{axis}": metrics.root_mean_square for axis in metrics.VelocityRms._fields},
    **{f"cep_rate_{key}": definition.statistic for key, definition in metrics.DEFINITIONS.items()},
}

# Sources of the error budget: the effects of the accelerometers that stay on, and whether the gyros err.
SOURCES: dict[str, tuple[tuple[str, ...], bool]] = {
    "accelerometer_bias_thermal": (("thermal_lag", "bias_temperature", "creep"), False),
    "accelerometer_bias_of_the_run": (("turn_on", "in_run", "noise"), False),
    "accelerometer_scale_factor": (
        ("scale_polynomial", "magnet_hysteresis", "scale_repeatability", "nonlinearity"),
        False,
    ),
    "gyro": ((), True),
}


@dataclass(frozen=True)
class Plan:
    """Everything that decides the numbers of an ensemble, but for its size."""

    profile: str = "climb-cruise-landing"
    population: str = "jb-kt8"
    arms: tuple[str, ...] = ARMS
    seed: int = 1
    rate_hz: float = RATE_HZ
    oven_runs: int = 1
    source: str | None = None  # one of SOURCES: all others are switched off

    def key(self) -> str:
        """Name of the results of this plan: changes with the plan, the profile, the models and the code."""
        digest = hashlib.sha256(json.dumps(asdict(self), sort_keys=True).encode())
        profile = load(self.profile)
        for said in (profile, *([load(profile.thermal.same_as)] if profile.thermal.same_as else [])):
            digest.update(said.model_dump_json().encode())
        digest.update(repr(accelerometer.Population.load(self.population)).encode())
        digest.update(np.__version__.encode())
        package = Path(__file__).parent
        ours = sorted(path for path in package.rglob("*") if path.suffix in (".py", ".toml"))
        for path in [*ours, *model_files(self.arms)]:
            digest.update(path.read_bytes())
        return digest.hexdigest()[:16]


class World:
    """What all members of a plan share."""

    def __init__(self, plan: Plan):
        profile = load(plan.profile)
        if profile.kind != "flight":
            raise UsageError(f"profile '{plan.profile}' stands still; expected a flight, kind = 'flight'")
        self.plan = plan
        population = accelerometer.Population.load(plan.population)
        gyros = GyroPopulation()
        if plan.source is not None:
            effects, gyros_err = SOURCES[plan.source]
            population = population.only(*effects, "quantisation")
            gyros = gyros if gyros_err else gyros.perfect()
        self.population = Population(population, gyros)
        self.flight = Mission(profile, plan.rate_hz)
        self.chamber = Chamber()

    @cached_property
    def oven(self) -> Mission:
        """The oven with the temperatures of the flight."""
        return self.flight.in_oven(OVEN_RATE_HZ)

    def instrument(self, index: int) -> Instrument:
        """The instrument with this number."""
        return self.population.draw(self.streams(index))

    def streams(self, index: int) -> Streams:
        """Random streams of the instrument with this number."""
        return Streams(self.plan.seed).at("instrument", index)

    def triads(self, index: int) -> dict[str, list[CompensationModel]]:
        """The compensation models of an instrument, calibrated and refined, one for each accelerometer."""
        instrument, streams = self.instrument(index), self.streams(index)
        chambers = [self.chamber.measure(unit, streams) for unit in instrument.accelerometers]
        ovens = [self._oven_run(instrument, streams.at("oven", run)) for run in range(self.plan.oven_runs)]
        triads: dict[str, list[CompensationModel]] = {}
        for arm in self.plan.arms:
            on = f"instrument {index}"
            triad = [working_model(arm, on).fit(readings) for readings in chambers]
            for axis, model in enumerate(triad):
                if hasattr(model, "refine"):
                    model.refine([(seen[axis], force[axis]) for seen, force in ovens])
            triads[arm] = triad
        return triads

    def _oven_run(self, instrument: Instrument, streams: Streams) -> tuple[tuple[Samples, ...], np.ndarray]:
        """Samples of the three accelerometers in the oven and the specific force they feel there, level and at rest."""
        recording = self.oven.record(instrument, streams)
        return samples(recording), np.array(
            [0.0, 0.0, -gravity(recording.start.latitude_rad, recording.start.height_m)]
        )


def fly(world: World, index: int) -> dict[str, dict[str, np.ndarray]]:
    """One member: for each arm, what its flight contributes to every measure, and its track of position errors."""
    recording = world.flight.record(world.instrument(index), world.streams(index).at("flight"))
    seen, stand = samples(recording), standstill_to_align_on(recording)
    result = {}
    for arm, triad in world.triads(index).items():
        velocity = compensate(seen, triad, recording.start.time_s)
        flown = evaluate(recording, velocity, align_on=stand)
        result[arm] = contributions(flown.errors)
    return result


def contributions(errors) -> dict[str, np.ndarray]:
    """What one flight contributes to the measures of an ensemble."""
    position = np.column_stack([errors.north_m, errors.east_m])[errors.valid]
    time_s = errors.time_s[errors.valid]
    rms = metrics.velocity_rms(errors.velocity_n, errors.valid)
    moving = time_s > 0.0
    bridged = bridge(errors)
    grid = np.searchsorted(bridged.time_s, np.arange(0.0, bridged.time_s[-1] + 0.5, TRACK_PERIOD_S) - 1e-6)
    return {
        **{f"velocity_rms_{axis}": np.asarray(value) for axis, value in rms._asdict().items()},
        **{
            f"cep_rate_{key}": np.asarray(d.per_flight(position[moving], time_s[moving]))
            for key, d in metrics.DEFINITIONS.items()
        },
        "track_s": bridged.time_s[grid],
        "track_m": np.column_stack([bridged.north_m[grid], bridged.east_m[grid]]),
    }


@dataclass(frozen=True)
class Store:
    """Finished members on disk, one file each."""

    folder: Path

    def open(self) -> Store:
        """Make the folder. Raises StorageError where that cannot be done."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise cannot_write(self.folder, error) from None
        return self

    def path(self, index: int) -> Path:
        """Where the member with this number lies."""
        return self.folder / f"{index:05d}.npz"

    def read(self, index: int) -> dict[str, dict[str, np.ndarray]] | None:
        """A finished member, or None where there is none or its file is damaged, so that it is computed again."""
        try:
            content = self.path(index).read_bytes()
        except FileNotFoundError:
            return None
        except OSError as error:
            raise StorageError(
                f"{self.path(index)}: cannot be read ({error.strerror}); remove it or choose another --output"
            ) from None
        arrays, checksum = content[:-CHECKSUM_BYTES], content[-CHECKSUM_BYTES:]
        if hashlib.sha256(arrays).digest() != checksum:
            return None
        result: dict[str, dict[str, np.ndarray]] = {}
        with np.load(io.BytesIO(arrays), allow_pickle=False) as stored:
            for name in stored.files:
                arm, _, key = name.rpartition("|")
                result.setdefault(arm, {})[key] = stored[name]
        return result

    def write(self, index: int, result: Mapping[str, Mapping[str, np.ndarray]]) -> None:
        """Keep a member, its checksum behind it. Raises StorageError, with everything finished before still there."""
        buffer = io.BytesIO()
        np.savez(buffer, **{f"{arm}|{key}": value for arm, values in result.items() for key, value in values.items()})
        write_whole(self.path(index), buffer.getvalue() + hashlib.sha256(buffer.getvalue()).digest())


@lru_cache(maxsize=8)
def _world(plan: Plan) -> World:
    return World(plan)


def _work(plan: Plan, index: int, store: Store) -> int:
    """Compute and keep one member; runs in a worker."""
    with threadpool_limits(1):
        store.write(index, fly(_world(plan), index))
    return index


def run(
    plans: Mapping[str, tuple[Plan, int]], folder: Path, workers: int | None = None, quiet: bool = False
) -> dict[str, list[dict[str, dict[str, np.ndarray]]]]:
    """Compute what is missing of several ensembles and return all their members, in order of their numbers.

    Parameters: ``plans[label]`` is a plan and its size; `folder` keeps the members; `workers` processes (None: all
    cores); a bar with the time to go is shown unless `quiet`.
    Raises: StorageError for a full disk or a folder that cannot be written.
    """
    stores = {label: Store(folder / plan.key()).open() for label, (plan, _) in plans.items()}
    missing = [(label, i) for label, (_, size) in plans.items() for i in range(size) if stores[label].read(i) is None]
    with tqdm(total=len(missing), desc="instruments", unit="", disable=quiet or not missing, mininterval=0.5) as bar:
        for _ in _computed(missing, plans, stores, workers or os.cpu_count() or 1):
            bar.update()
    return {label: [_present(stores[label], i) for i in range(size)] for label, (_, size) in plans.items()}


def _computed(missing, plans, stores, workers: int) -> Iterator[int]:
    if workers == 1 or len(missing) < 2:
        for label, index in missing:
            yield _work(plans[label][0], index, stores[label])
        return
    pool = ProcessPoolExecutor(min(workers, len(missing)), mp_context=get_context("spawn"), initializer=_attend_parent)
    try:
        with _interrupts_ignored():  # what is started here ignores them for good: the parent alone answers
            futures = [pool.submit(_work, plans[label][0], index, stores[label]) for label, index in missing]
        for future in as_completed(futures):
            yield future.result()
    except BrokenProcessPool:
        raise InsEvalError(
            "a worker was ended from outside, perhaps for want of memory; finished instruments are kept, run again, "
            "with fewer --workers if it repeats"
        ) from None
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


@contextmanager
def _interrupts_ignored() -> Iterator[None]:
    """No KeyboardInterrupt here, nor in the processes that are started meanwhile."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _attend_parent() -> None:
    """Let a worker end with its parent, however that ends."""

    def wait() -> None:
        connection.wait([parent_process().sentinel])
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def _present(store: Store, index: int) -> dict[str, dict[str, np.ndarray]]:
    result = store.read(index)
    if result is None:
        raise StorageError(f"{store.path(index)}: was written and cannot be read back; check the disk and run again")
    return result


def stacked(members: list[dict[str, dict[str, np.ndarray]]]) -> dict[str, dict[str, np.ndarray]]:
    """``[arm][key]`` with the members along the first axis."""
    return {arm: {key: np.stack([m[arm][key] for m in members]) for key in members[0][arm]} for arm in members[0]}
