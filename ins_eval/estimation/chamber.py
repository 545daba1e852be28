"""One accelerometer in a chamber, as a case: nothing moves, so the residual is the output less what is believed of it.

    y = g0 (E - K1(T, r) (K0(T) 1e-6 + a)) / gamma     m/s^2, one channel

Each run has a constant of its own (how it was put into its position, and the shift from run to run), white noise, and
a slow error that is new in every run. A candidate is a regressor of the smoothed temperature; where the temperature of
the chamber's air was recorded, the smooth reading is that of a body that follows it with a lag.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.compensation import Samples
from ins_eval.compensation.file import believed_model
from ins_eval.effects.apply import OF_INPUT, chamber_error
from ins_eval.effects.effect import ACCELEROMETER, AXES, multiplied
from ins_eval.effects.parts import chamber_conditions, parts, possible
from ins_eval.effects.temperature import chamber_temperature
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.error_model.columns import Column, Measured, SlowFactor
from ins_eval.error_model.drives import SOURCES
from ins_eval.error_model.library import Candidate, Parameters, sized, tried
from ins_eval.error_model.observations import CHANNELS, SMOOTHINGS, MeasurementSource, Observations
from ins_eval.error_model.propagation import STATES, ErrorModel
from ins_eval.error_model.thermometer import WARMER_C
from ins_eval.errors import DataRefused
from ins_eval.estimation.case import Case, with_effects
from ins_eval.estimation.noise import NoiseModel, Prior, white, without_outliers
from ins_eval.recording.belief import Belief, GpsBelief
from ins_eval.recording.mending import mended_chamber
from ins_eval.thermal import filtered_rate, thermometer_step
from ins_eval.units import STANDARD_GRAVITY, UG

if TYPE_CHECKING:
    from ins_eval.effects.slow import Conditions
    from ins_eval.effects.temperature import SmoothedTemperature
    from ins_eval.recording import ChamberReadings

WHITE_UG = 5.0  # where nothing is known; read off the readings themselves
RUN_SIGMA_UG = 1000.0  # of the constant of a run: at 0 g a milliradian of tilt
LEAST_CONSTANT = 10.0  # times the white noise of a reading: no constant is known better than that of a unit so noisy
STILL = 0.25  # of a step of the output: less scatter does not carry it across
FEWEST_READINGS = 2
_ONE = "channel_0"


def prepare_chamber(
    readings: ChamberReadings,
    belief: Belief,
    name: str,
    folder: str | Path = ".",
    temperature: SmoothedTemperature | None = None,
) -> Case:
    """Everything about a chamber recording before a hypothesis is asked about. Raises DataRefused for one reading.

    `temperature` is that of its readings, where it is known already.
    """
    if readings.time_s.size < FEWEST_READINGS:
        raise DataRefused(
            f"{name}: holds {readings.time_s.size} reading, expected at least {FEWEST_READINGS} to judge by; record "
            "longer"
        )
    read, stated = readings, belief
    readings, belief = mended_chamber(readings, belief, name)
    runs = _runs(readings)
    temperature = temperature or chamber_temperature(readings, belief.accelerometer)
    given = indicated(readings, belief, folder)
    one_more = indicated(replace(readings, output=readings.output + 1.0), belief, folder)
    size = float(np.median(one_more - given))  # of 1 pulse/s
    warmer = indicated(replace(readings, temperature_c=readings.temperature_c + WARMER_C), belief, folder) - given
    if belief.effects:
        given = given - chamber_error(readings, belief, name, folder, temperature)
    seen = _observations(readings, given - STANDARD_GRAVITY * readings.input_g)
    seen, outliers = without_outliers(seen, longest=1)  # several readings in a row may be a run of their own
    nodes_s, epochs = readings.time_s, readings.time_s.size - 1
    still = ErrorModel(
        nodes_s=nodes_s,
        states=None,
        transition=np.broadcast_to(np.eye(STATES), (epochs, STATES, STATES)).copy(),
        half=np.zeros((epochs, STATES, STATES)),
        integrals=np.zeros((epochs, SOURCES, 3)),
        missing=np.zeros((epochs, 5, 6)),
        known=np.zeros((epochs, 9)),
        arc=np.zeros(epochs + 1, dtype=int),
        elapsed=np.zeros((epochs, 3, 3)),
    )
    slow = SlowFactor()
    coarse_ug = LEAST_CONSTANT * float(np.median(white(seen)[0][:, 0])) / UG
    constant_ug = max(belief.accelerometer.bias_sigma_ug, coarse_ug)  # and all errors of its grade are as large
    conditions = chamber_conditions(readings, belief, folder, temperature)
    bench = ChamberCandidates(readings, replace(conditions, bias_sigma={ACCELEROMETER: constant_ug}), slow)
    apart_s = float(np.max(np.diff(nodes_s))) * 1e3
    interval_s = np.where(np.diff(readings.run) != 0, apart_s, np.diff(nodes_s))
    of_runs = tuple(_of_runs(runs, slow, nodes_s, max(RUN_SIGMA_UG, constant_ug)))
    return Case(
        name=name,
        kind="chamber",
        believed=None,
        model=still,
        seen=seen,
        inertial=lambda: seen.residual,
        temperature=temperature,
        slow=slow,
        nuisances=of_runs,
        taken=np.zeros(len(of_runs)),
        candidates=tuple(bench.candidates()),
        noise=_noise(
            seen,
            interval_s,
            np.hypot(_counted(readings, given, size, runs), _read_off(readings, warmer / WARMER_C, runs)),
        ),
        outliers=outliers,
        epochs_s=interval_s,
        member=bench.member,
        again=lambda effects, _near=None: prepare_chamber(
            read, with_effects(stated, effects), name, folder, temperature
        ),
    )


def indicated(readings: ChamberReadings, belief: Belief, folder: str | Path = ".") -> np.ndarray:
    """Specific force (n,) in m/s^2 that the believed compensation makes of the output."""
    model = believed_model(belief, readings.axis or "x", folder)
    rate = np.zeros(readings.time_s.size)
    for rows in _runs(readings):
        rate[rows] = filtered_rate(
            readings.time_s[rows], readings.temperature_c[rows], belief.accelerometer.rate_filter_s
        )
    return model.specific_force(Samples(readings.time_s, readings.output, readings.temperature_c, rate))


def _runs(readings: ChamberReadings) -> list[np.ndarray]:
    """Rows of each uninterrupted stay."""
    return [np.flatnonzero(readings.run == run) for run in dict.fromkeys(readings.run.tolist())]


def _observations(readings: ChamberReadings, residual: np.ndarray) -> Observations:
    count = readings.time_s.size
    y = np.full((count, CHANNELS), np.nan)
    y[:, 0] = residual
    source = MeasurementSource("chamber", None, GpsBelief(), readings.time_s)
    return Observations(
        (source,),
        residual=y,
        sigma=np.full((count, CHANNELS), WHITE_UG * UG),
        design=np.zeros((count, CHANNELS, STATES)),
        of_arm=np.zeros((count, 3, CHANNELS)),
        of_delay=np.zeros((count, CHANNELS)),
        of_smoothing=np.zeros((count, 2 * SMOOTHINGS, CHANNELS)),
        arc=np.zeros(count, dtype=int),
    )


def _noise(seen: Observations, interval_s: np.ndarray, counted: np.ndarray) -> NoiseModel:
    level, _ = white(seen)
    slow = Prior(max(2.0 * UG, 0.1 * float(np.median(level[:, 0]))), 1.2)
    level[:, 0] = np.maximum(level[:, 0], counted)
    fixed = {
        name: Prior(0.0, 0.0)
        for name in ("slow_velocity", "slow_attitude", "velocity_random_walk", "angle_random_walk",
                     "accelerometer_wander", "gyro_wander")
    }  # fmt: skip
    times = {f"slow_{of}_time": Prior(1.0, 0.0) for of in ("velocity", "attitude")}
    return NoiseModel(
        priors={"slow_position": slow, "slow_position_time": Prior(1800.0, 1.0), **fixed, **times},
        white=level,
        down=np.ones(CHANNELS),
        steps=np.zeros((interval_s.size, 3, 3)),
        jumps=np.zeros((interval_s.size, 3)),
        agitation=np.zeros((interval_s.size, 2)),
        filled=np.zeros((interval_s.size, 2)),
        later=np.zeros_like(level),
        interval_s=interval_s,
    )


def _counted(readings: ChamberReadings, given: np.ndarray, size: float, runs: list[np.ndarray]) -> np.ndarray:
    """One sigma (n,) in m/s^2 of what the resolution of the output hides; `size` is that of 1 pulse/s in m/s^2.

    Where noise carries the output across its steps they average out. A run whose readings scatter by less than a step
    tells the same again and again, so all its readings together are worth one.
    """
    changes = np.abs(np.diff(readings.output))
    changes = changes[changes > 1e-9]
    step = size * float(changes.min(initial=np.inf))
    out = np.zeros(given.size)
    if not np.isfinite(step):
        return out
    for rows in runs:
        scatter = float(np.std(np.diff(given[rows]))) / np.sqrt(2.0) if rows.size > 2 else np.inf
        if scatter < STILL * step:
            out[rows] = step / np.sqrt(12.0) * np.sqrt(rows.size * len(runs))
    return out


def _read_off(readings: ChamberReadings, slope: np.ndarray, runs: list[np.ndarray]) -> np.ndarray:
    """One sigma (n,) in m/s^2 of what the steps of the thermometer hide; `slope` (n,) in m/s^2 per degC of the belief.

    A reading that stays the same, or moves by as many steps each time, is off by the same, so all in a row that do are
    worth one. By a single step each time also exact readings move.
    """
    step_c = thermometer_step(readings.temperature_c)
    out = np.zeros(slope.size)
    for rows in runs:
        moves = np.rint(
            np.diff(readings.temperature_c[rows], prepend=readings.temperature_c[rows[0]]) / (step_c or 1.0)
        )
        stays = np.cumsum((np.diff(moves, prepend=moves[0]) != 0.0) | (np.abs(moves) == 1.0))
        out[rows] = step_c / np.sqrt(12.0) * np.abs(slope[rows]) * np.sqrt(np.bincount(stays)[stays])
    return out


def _at(slow: SlowFactor, name: str, values: np.ndarray) -> str:
    slow.epochs[name], slow.nodes[name] = np.zeros(values.size - 1), values
    return name


def _of_runs(runs: list[np.ndarray], slow: SlowFactor, nodes_s: np.ndarray, sigma_ug: float) -> Iterator[Column]:
    for k, rows in enumerate(runs):
        inside = np.zeros(nodes_s.size)
        inside[rows] = 1.0
        yield Column(f"run {k}", (Measured(_ONE, sigma_ug * UG, _at(slow, f"run {k}", inside)),))


@dataclass(frozen=True, eq=False)
class ChamberCandidates:
    """What candidates of a chamber recording are made of; `slow` is added to."""

    readings: ChamberReadings
    given: Conditions
    slow: SlowFactor

    def candidates(self) -> Iterator[Candidate]:
        """Every effect that the recording could show: of the accelerometer in the chamber, along its input."""
        for effect in VOCABULARY.values():
            if effect.enters not in (ACCELEROMETER, "temperature") or not possible(effect, self.given):
                continue
            constant = effect.multipliers == ("1",) and effect.slow == "1"  # as the constant of a run is
            if effect.enters == ACCELEROMETER and (constant or effect.multipliers[0] not in OF_INPUT):
                continue
            axis = None if effect.enters == "temperature" else self.given.axes[0]
            for parameters in tried(effect, axis, self.given):
                yield self.member(effect.name, axis, parameters)

    def member(self, name: str, axis: str | None, parameters: Parameters) -> Candidate:
        """One effect with further parameters of any value; see `library.member`."""
        effect = VOCABULARY[name]
        of_parts = parts(effect, axis, parameters, self.given)
        time_s = self.readings.time_s
        unit, nominal, centre = sized(effect, parameters, of_parts, time_s, self.given)
        force = np.zeros((time_s.size, 3))
        force[:, AXES.index(self.given.axes[0])] = STANDARD_GRAVITY * self.readings.input_g
        terms = []
        for part in of_parts:
            values = part.slow(time_s) * multiplied(part.sensor, part.multiplier, part.axis, force, force)
            key = _at(self.slow, f"{part.multiplier}: {part.key}", values)
            terms.append(Measured(_ONE, nominal * part.weight, key))
        in_one_position = float(np.ptp(self.readings.input_g)) == 0.0
        repeats = in_one_position and all(part.multiplier != "1" for part in of_parts)
        return Candidate(effect.name, axis, unit, nominal, Column("", tuple(terms)), dict(parameters), centre, repeats)
