"""The chamber experiment of Paper A (section 3.1, Table 4), with its three accelerometers drawn again and again.

A member is one draw of all that is left to chance in JB-KT8 #1, #2 and #3: each is put through the chamber and
calibrated. It shows what Table 4 would be, with the printed coefficients and with the slopes rescaled to the printed
sensitivities, and whether the intervals of the calibration are worth their 95 %:

* of coefficients, with nature reduced to what the curves can describe (eq. 11, a bias linear in temperature) plus
  noise, pulses and the steps of the thermometer, without and with shifts from run to run. The thermometer reads
  without lag, since eq. (11) has no place for one; what should lie inside are then the constants of the unit. The
  self-heating differs from unit to unit, as it does in the paper, so that each meets the steps of the thermometer in
  a phase of its own.
* of the error of a compensated reading, with all of nature, on another day, at a ramp that was not calibrated at.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ins_eval.accelerometer import Accelerometer, Population
from ins_eval.calibration import FITS
from ins_eval.calibration.branches import branches
from ins_eval.calibration.fits import REFERENCE_C, line, polynomial
from ins_eval.calibration.four_point import FourPoint, four_point
from ins_eval.calibration.prediction import errors_of_runs, predict
from ins_eval.calibration.sensitivity import sensitivity_ppm_per_c
from ins_eval.calibration.uncertainty import uncertainty
from ins_eval.ensemble.plan import Plan
from ins_eval.ensemble.world import World
from ins_eval.laboratory import Chamber, draw_printed_units
from ins_eval.laboratory.magnet import opening
from ins_eval.metrics import Estimate, central
from ins_eval.recording import ChamberReadings
from ins_eval.streams import Streams

PLAN = Plan(experiment="chamber")
SIZE = 100  # draws of the three accelerometers
SCALED = "table4-scaled"
TABLE_4 = ("none", "simple", "quadratic", "hysteresis")
NEW_DAY_C_PER_MIN = (0.6,)
SELF_HEATING_C = (6.0, 11.0)  # Paper A, section 3.1: surface -54 to 81 degC in air from -60 to 70 degC
AT_C = REFERENCE_C  # where the loop of the scale factor is opened

WITHIN = ("scale_polynomial", "bias_temperature", "noise", "quantisation")  # what the curves can describe, and noise
SHIFTS = ("turn_on", "scale_repeatability")  # from run to run
CURVES = {  # those that describe the reduced nature: what they are drawn through, and by what
    "scale": ("scale", polynomial),
    "bias_branches": ("bias_ug", branches),
    "bias_line": ("bias_ug", line),
}

Member = dict[str, dict[str, np.ndarray]]


def member(world: World, index: int) -> Member:
    """One draw of the printed accelerometers.

    ``table4/<unit>`` and ``table4_scaled/<unit>``: sensitivity of K1 in ppm/degC and RMS of its residuals in ppm, of
    each model. ``<unit>``: share of the magnet in the opening of its loop; of the coefficients of each curve, how
    many lie in their intervals and how many there are (``reduced/<curve>``, ``shifted/<curve>``); of the readings of
    each new run, the share within the predicted interval (``predicted``, by position).
    """
    streams = world.streams(index)
    result: Member = {}
    populations = {"table4": world.population.accelerometers, "table4_scaled": Population.load(SCALED)}
    for table, population in populations.items():
        for name, unit in draw_printed_units(streams, population).items():
            node = streams.at(name)
            readings = world.chamber.measure(unit, node)
            result[f"{table}/{name}"] = _table_4(four_point(readings))
            if table == "table4":
                opened = opening(unit, world.chamber, AT_C)
                result[name] = {
                    "magnet_share": np.asarray(opened.magnet_ppm.sum() / opened.total_ppm.sum()),
                    "predicted": predicted(world.chamber, unit, readings, node.at("another day")),
                }
    for case, effects in (("reduced", WITHIN), ("shifted", WITHIN + SHIFTS)):
        reduced = reduced_to(world.population.accelerometers, effects)
        for name, unit in draw_printed_units(streams, reduced).items():
            node = streams.at(name, case)
            heating_c = node.at("self_heating").rng().uniform(*SELF_HEATING_C)
            of_unit = covered(replace(world.chamber, self_heating_c=float(heating_c)), unit, node)
            result[name] |= {f"{case}/{curve}": np.array((hit.sum(), hit.size)) for curve, hit in of_unit.items()}
    return result


def reduced_to(population: Population, effects: Sequence[str]) -> Population:
    """The population with these effects only and a bias that is linear in temperature."""
    bias = population["bias_temperature"]
    linear = bias.model_copy(update={"omega2_sigma_ug_per_c2": 0.0, "omega3_sigma_ug_per_c3": 0.0})
    return population.replacing(linear).only(*effects)


def covered(chamber: Chamber, unit: Accelerometer, streams: Streams) -> dict[str, np.ndarray]:
    """Of each coefficient of each of `CURVES`, whether its 95 % interval holds the truth: bool (p,).

    The `unit` is of a population that is `reduced_to` what the curves can describe.
    """
    prompt = replace(chamber, thermometer=replace(chamber.thermometer, lag_s=0.0))
    points = four_point(prompt.measure(unit, streams))
    scale, slope_ug_per_c = unit.units["scale_polynomial"], unit.units["bias_temperature"][0]
    hits = {}
    for name, (column, fit) in CURVES.items():
        values = getattr(points, column)
        curve = fit(points.temperature_c, points.rate_c_per_min, values)
        if name == "scale":
            truth = scale
        elif name == "bias_line":
            truth = np.array([slope_ug_per_c, 0.0])
        else:
            truth = slope_ug_per_c * (np.tile(curve.knots_c, 2) - REFERENCE_C)
        hits[name] = np.abs(curve.values - truth) <= uncertainty(fit, curve, points, values).half_width95
    return hits


def predicted(chamber: Chamber, unit: Accelerometer, readings: ChamberReadings, streams: Streams) -> np.ndarray:
    """Of the readings of each run of another day, the share within the interval that `readings` let expect.

    (runs,) in the order of positions +1, 0, -1, 0 g, compensated by the hysteresis model.
    """
    points = four_point(readings)
    scale, bias_ug = (
        fit(points.temperature_c, points.rate_c_per_min, values)
        for fit, values in zip(FITS["hysteresis"], (points.scale, points.bias_ug), strict=True)
    )
    prediction = predict(errors_of_runs(readings, scale, bias_ug))
    later = replace(chamber, rates_c_per_min=NEW_DAY_C_PER_MIN).measure(unit, streams)
    shares = []
    for run in errors_of_runs(later, scale, bias_ug):
        low, high = prediction.interval95_ug(run.position, run.temperature_c, run.rate_c_per_min)
        shares.append(np.mean((low <= run.error_ug) & (run.error_ug <= high)))
    return np.array(shares)


def _table_4(points: FourPoint) -> dict[str, np.ndarray]:
    columns = points.temperature_c, points.rate_c_per_min
    found = {}
    for name in TABLE_4:
        ratio = points.scale / FITS[name][0](*columns, points.scale).evaluate(*columns)
        found[f"sensitivity_{name}"] = np.asarray(sensitivity_ppm_per_c(*columns, ratio))
        found[f"residual_rms_{name}"] = np.asarray(1e6 * np.sqrt(np.mean((ratio - 1.0) ** 2)))
    return found


# ------------------------------------------------------------------------------------------------ the whole ensemble


def summary(members: Sequence[Member], seed: int) -> dict[str, Any]:
    """What the members of a chamber plan come to; an estimate is ``{"value", "interval95"}``.

    table4, table4_scaled   sensitivity in ppm/degC by unit and model: median of the draws and their central 95 %
    residual_rms_ppm        RMS of measured less model K1, likewise, of the printed coefficients
    magnet_share            share of the opening of the loop at 22 degC, likewise
    coverage                shares with an interval that counts units, not coefficients or readings: coefficients (of
                            the reduced nature), coefficients_shifted (with shifts from run to run), both by_curve,
                            predictive and by position; units: how many
    """
    groups = {name: {key: np.stack([m[name][key] for m in members]) for key in members[0][name]} for name in members[0]}
    units = [name for name in groups if "/" not in name]

    def table(kind: str, key: str) -> dict[str, Any]:
        return {u: {name: central(groups[f"{kind}/{u}"][f"{key}_{name}"]).as_tree() for name in TABLE_4} for u in units}

    def shares(key: str) -> np.ndarray:  # (units of all members, ...)
        return np.concatenate([groups[u][key] for u in units])

    node = Streams(seed).at("chamber", "bootstrap")
    coverage: dict[str, Any] = {"units": len(members) * len(units), "by_curve": {}}
    for label, case in (("coefficients", "reduced"), ("coefficients_shifted", "shifted")):
        of_curve = {curve: shares(f"{case}/{curve}") for curve in CURVES}  # (units, 2): how many, of how many
        pooled = np.sum(list(of_curve.values()), axis=0)
        coverage["by_curve"][label] = {
            c: mean_of_units(hit[:, 0] / hit[:, 1], node.at(case, c)) for c, hit in of_curve.items()
        }
        coverage[label] = mean_of_units(pooled[:, 0] / pooled[:, 1], node.at(case))
    runs = shares("predicted")
    coverage["predictive"] = mean_of_units(runs.mean(axis=1), node.at("predicted"))
    coverage["predictive_by_position"] = {
        position: mean_of_units(runs[:, columns].mean(axis=1), node.at("predicted", position))
        for position, columns in (("+1 g", [0]), ("0 g", [1, 3]), ("-1 g", [2]))
    }
    return {
        "draws": len(members),
        "table4": table("table4", "sensitivity"),
        "table4_scaled": table("table4_scaled", "sensitivity"),
        "residual_rms_ppm": table("table4", "residual_rms"),
        "magnet_share": {u: central(groups[u]["magnet_share"]).as_tree() for u in units},
        "coverage": coverage,
    }


def mean_of_units(shares: np.ndarray, streams: Streams, draws: int = 2000) -> dict[str, Any]:
    """Mean over units (n,) with the bootstrap interval that has units as clusters."""
    chosen = streams.rng().integers(shares.size, size=(draws, shares.size))
    low, high = np.quantile(shares[chosen].mean(axis=1), (0.025, 0.975))
    return Estimate(shares.mean(), low, high).as_tree()
