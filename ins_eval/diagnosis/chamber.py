"""One accelerometer in a chamber, as a case: nothing moves, so the residual is the output less what is believed of it.

    y = g0 (E - K1(T, r) (K0(T) 1e-6 + a)) / gamma     m/s^2, one channel

Each run has a constant of its own (how it was put into its position, and the shift from run to run), white noise, and
a slow error that is new in every run. A candidate is a regressor of the smoothed temperature; where the temperature of
the chamber's air was recorded, the smooth reading is that of a body that follows it with a lag.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.signal import savgol_filter

from ins_eval.compensation import Samples
from ins_eval.compensation.file import believed_model
from ins_eval.diagnosis.case import Case
from ins_eval.diagnosis.columns import Column, Measured, Slow
from ins_eval.diagnosis.drives import SOURCES
from ins_eval.diagnosis.error_model import STATES, ErrorModel
from ins_eval.diagnosis.library import CREEP_TIMES_S, HYSTERESIS_WIDTHS_C, ROWS, Candidate, branch
from ins_eval.diagnosis.noise import NoiseModel, Prior, white, without_outliers
from ins_eval.diagnosis.observations import CHANNELS, Observations, Source
from ins_eval.diagnosis.temperature import Temperature
from ins_eval.recording import ChamberReadings
from ins_eval.recording.belief import Belief, GpsBelief
from ins_eval.thermal import filtered_rate, lagged
from ins_eval.units import PPM, STANDARD_GRAVITY, UG

WHITE_UG = 5.0  # where nothing is known; read off the readings themselves
RUN_SIGMA_UG = 1000.0  # of the constant of a run: at 0 g a milliradian of tilt
LAGS_S = np.concatenate([[0.0], np.geomspace(10.0, 3600.0, 25)])
FEW_READINGS = 9  # that are smoothed together where the air was not recorded
GOOD_FIT_STEPS = 2.0
_ONE = "channel_0"


def prepare_chamber(readings: ChamberReadings, belief: Belief, name: str, folder: str | Path = ".") -> Case:
    """Everything about a chamber recording before a hypothesis is asked about."""
    axis = readings.axis or "x"
    model = believed_model(belief, axis, folder)
    runs = [np.flatnonzero(readings.run == run) for run in dict.fromkeys(readings.run.tolist())]
    filter_s = belief.accelerometer.rate_filter_s
    rate = np.zeros(readings.time_s.size)
    smooth, smooth_rate = np.zeros_like(rate), np.zeros_like(rate)
    for rows in runs:
        time_s = readings.time_s[rows]
        rate[rows] = filtered_rate(time_s, readings.temperature_c[rows], filter_s)
        smooth[rows] = _smooth(readings, rows)
        smooth_rate[rows] = filtered_rate(time_s, smooth[rows], filter_s)
    told = model.specific_force(Samples(readings.time_s, readings.output, readings.temperature_c, rate))
    seen = _observations(readings, told - STANDARD_GRAVITY * readings.input_g)
    seen, outliers = without_outliers(seen)
    nodes_s, epochs = readings.time_s, readings.time_s.size - 1
    still = ErrorModel(
        nodes_s=nodes_s,
        states=None,
        transition=np.broadcast_to(np.eye(STATES), (epochs, STATES, STATES)).copy(),
        half=np.zeros((epochs, STATES, STATES)),
        integrals=np.zeros((epochs, SOURCES, 3)),
        missing=np.zeros((epochs, 5, 6)),
        feedback=np.zeros((epochs, 2)),
    )
    temperature = Temperature(
        nodes_s, np.repeat(smooth[:, None], 3, 1), np.repeat(smooth_rate[:, None], 3, 1),
        belief.accelerometer.reference_temperature_c,
    )  # fmt: skip
    slow = Slow()
    apart_s = float(np.max(np.diff(nodes_s))) * 1e3
    interval_s = np.where(np.diff(readings.run) != 0, apart_s, np.diff(nodes_s))
    return Case(
        name=name,
        kind="chamber",
        believed=None,
        model=still,
        seen=seen,
        temperature=temperature,
        slow=slow,
        nuisances=tuple(_of_runs(runs, slow, nodes_s)),
        candidates=tuple(_candidates(readings, runs, temperature, axis, slow)),
        noise=_noise(seen, interval_s),
        outliers=outliers,
        epochs_s=interval_s,
    )


def _observations(readings: ChamberReadings, residual: np.ndarray) -> Observations:
    count = readings.time_s.size
    y = np.full((count, CHANNELS), np.nan)
    y[:, 0] = residual
    source = Source("chamber", None, GpsBelief(), readings.time_s)
    return Observations(
        (source,),
        residual=y,
        sigma=np.full((count, CHANNELS), WHITE_UG * UG),
        design=np.zeros((count, CHANNELS, STATES)),
        of_arm=np.zeros((count, 3, CHANNELS)),
        of_delay=np.zeros((count, CHANNELS)),
    )


def _noise(seen: Observations, interval_s: np.ndarray) -> NoiseModel:
    level, _ = white(seen)
    slow = Prior(2.0 * UG, 1.2)
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
        interval_s=interval_s,
    )


def _at(slow: Slow, name: str, values: np.ndarray) -> str:
    slow.epochs[name], slow.nodes[name] = np.zeros(values.size - 1), values
    return name


def _of_runs(runs: list[np.ndarray], slow: Slow, nodes_s: np.ndarray) -> Iterator[Column]:
    for k, rows in enumerate(runs):
        inside = np.zeros(nodes_s.size)
        inside[rows] = 1.0
        yield Column(f"run {k}", (Measured(_ONE, RUN_SIGMA_UG * UG, _at(slow, f"run {k}", inside)),))


def _candidates(
    readings: ChamberReadings, runs: list[np.ndarray], seen: Temperature, axis: str, slow: Slow
) -> Iterator[Candidate]:
    force = STANDARD_GRAVITY * readings.input_g
    t, r = seen.smooth_c[:, 0] - seen.reference_c, seen.rate_c_per_min[:, 0]
    since = readings.time_s - readings.time_s[0]
    factors = {"1": 1.0, "t": since, "T": t, "T^2": t**2, "r": r, "r^2": r**2, "r T": r * t}
    multipliers = {"1": np.ones(force.size), "f": force, "f^2": force**2, "f^3": force**3}
    for row in ROWS:
        if row.sensor == "accelerometer" and row.multiplier in multipliers and (row.multiplier, row.slow) != ("1", "1"):
            name = _at(slow, f"{row.multiplier} {row.slow}", multipliers[row.multiplier] * factors[row.slow])
            column = Column("", (Measured(_ONE, row.si * row.nominal, name),))
            yield Candidate(row.name, axis, row.unit, row.nominal, column)
    for tau in CREEP_TIMES_S:
        memory = np.zeros(force.size)
        for rows in runs:
            of_run = lagged(readings.time_s[rows], seen.smooth_c[rows, 0], tau)
            memory[rows] = of_run - of_run[0]
        column = Column("", (Measured(_ONE, 4.0 * UG, _at(slow, f"creep {tau:g}", memory)),))
        yield Candidate("accelerometer.bias_creep", axis, "ug/degC", 4.0, column, {"time_constant_s": tau})
    for width in HYSTERESIS_WIDTHS_C:
        side = np.zeros(force.size)
        for rows in runs:
            side[rows] = branch(seen.smooth_c[rows, 0], width)
        column = Column("", (Measured(_ONE, 30.0 * PPM, _at(slow, f"branch {width:g}", side * force)),))
        yield Candidate("accelerometer.scale_hysteresis", axis, "ppm", 30.0, column, {"branch_width_c": width})


def _smooth(readings: ChamberReadings, rows: np.ndarray) -> np.ndarray:
    """The reading of one run without its steps and noise, (n,) degC."""
    time_s, told = readings.time_s[rows], readings.temperature_c[rows]
    air = readings.further.get("chamber_c")
    if air is not None:
        fits = [lagged(time_s, air[rows], lag) if lag else np.array(air[rows]) for lag in LAGS_S]
        fits = [fit + np.mean(told - fit) for fit in fits]
        best = min(fits, key=lambda fit: float(np.std(told - fit)))
        changes = np.abs(np.diff(told))
        step = float(changes[changes > 1e-9].min(initial=np.inf))
        if np.std(told - best) < GOOD_FIT_STEPS * max(step, 0.01):
            return best
    window = min(FEW_READINGS, (rows.size - 1) // 2 * 2 + 1)
    return savgol_filter(told, window, 2) if window > 3 else told
