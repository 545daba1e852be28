"""What each assumption is worth: one is changed at a time, with the same instruments and the same draws as the base.

The base is the plan of the flight report. A case may change the path, the sensors, the temperatures, how the attitude
is known, or how often the oven was used; `CASES` lists them, with the value of the base beside the changed one.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ins_eval import metrics
from ins_eval.ensemble.changes import Change
from ins_eval.ensemble.flight import STATISTICS
from ins_eval.ensemble.plan import Plan
from ins_eval.streams import Streams

SIMPLE, HYSTERESIS = "simple", "hysteresis_refined"  # as Paper A compares them
ARMS = (SIMPLE, HYSTERESIS)
BASE = "base"
SIZE = 20  # instruments in each case
AXES = ("east", "north", "horizontal")


@dataclass(frozen=True)
class SensitivityCase:
    """One assumption, in words; what differs from the base: fields of `Plan`, among them its `changes`."""

    words: str
    fields: Mapping[str, Any] = field(default_factory=dict)


def _changed(words: str, *changes: Change) -> SensitivityCase:
    return SensitivityCase(words, {"changes": changes})


CASES: dict[str, SensitivityCase] = {
    BASE: SensitivityCase("the flight report: out and back, sensors of the population JB-KT8, aligned on the stand"),
    "path/straight": SensitivityCase("straight ahead instead of out and back", {"profile": "straight"}),
    "path/box": SensitivityCase("a box, 90 degrees every 1000 s, instead of out and back", {"profile": "box"}),
    "path/bank": _changed("banks of 25 degrees (33 to 35), so that GPS is never lost", ("turn.bank_deg", 25.0)),
    "alignment/given": _changed("true attitude given instead of found on the stand", ("alignment", "given")),
    "gyro/0": _changed("constant gyro bias 0 (0.014 deg/h)", ("gyro.bias_deg_per_h", 0.0)),
    "gyro/0.005": _changed("constant gyro bias 0.005 deg/h (0.014)", ("gyro.bias_deg_per_h", 0.005)),
    "gyro/0.01": _changed("constant gyro bias 0.01 deg/h (0.014)", ("gyro.bias_deg_per_h", 0.01)),
    "gyro/0.02": _changed("constant gyro bias 0.02 deg/h (0.014)", ("gyro.bias_deg_per_h", 0.02)),
    "omega1/5": _changed("thermal bias 5 ug/degC (50)", ("bias_temperature.omega1_ug_per_c", 5.0)),
    "omega1/20": _changed("thermal bias 20 ug/degC (50)", ("bias_temperature.omega1_ug_per_c", 20.0)),
    "omega1/35": _changed("thermal bias 35 ug/degC (50)", ("bias_temperature.omega1_ug_per_c", 35.0)),
    "omega2 and omega3": _changed(
        "curved thermal bias: 0.1 ug/degC^2 (0.03) and 1e-3 ug/degC^3 (2e-4)",
        ("bias_temperature.omega2_sigma_ug_per_c2", 0.1),
        ("bias_temperature.omega3_sigma_ug_per_c3", 1e-3),
    ),
    "turn-on/20": _changed("turn-on bias 20 ug (50)", ("turn_on.sigma_ug", 20.0)),
    "in-run/15": _changed("in-run instability 15 ug (25)", ("in_run.sigma_ug", 15.0)),
    "in-run/50": _changed("in-run instability 50 ug (25)", ("in_run.sigma_ug", 50.0)),
    "creep/0": _changed("no creep", ("creep.weights", (0.0, 0.0, 0.0))),
    "creep/3": _changed("three times the creep", ("creep.weights", (0.9, 1.05, 1.05))),
    "creep scatter/0.5": _changed("creep scatters by 50 % from run to run (25 %)", ("creep.scatter", 0.5)),
    "lag/0.3": _changed("elements follow the surface after 0.3 min (3)", ("thermal_lag.lag_s", 18.0)),
    "lag/8": _changed("elements follow the surface after 8 min (3)", ("thermal_lag.lag_s", 480.0)),
    "thermal time constant/35": _changed(
        "the IMU follows the air with 35 min (75)", ("thermal.time_constant_s", 2100.0)
    ),
    "ground/25": _changed("25 degC on the ground (8)", ("thermal.ground_c", 25.0)),
    "magnet/60": _changed("magnet loop 60 ppm (200)", ("magnet_hysteresis.half_opening_ppm", 60.0)),
    "rate sign/printed": _changed(
        "printed signs of the rate terms (as in the text)", ("scale_polynomial.rate_sign", "printed")
    ),
    "oven runs/3": SensitivityCase("refined with three oven runs (one)", {"oven_runs": 3}),
}


def plans(seed: int = 1, size: int = SIZE) -> dict[str, tuple[Plan, int]]:
    """The plans of all cases for `ensemble.run`, by the names of the cases."""
    base = Plan(arms=ARMS, seed=seed)
    return {name: (replace(base, **case.fields), size) for name, case in CASES.items()}


def summary(members: Mapping[str, Sequence[dict[str, dict[str, np.ndarray]]]], seed: int) -> dict[str, Any]:
    """What the members of all cases come to; an estimate is ``{"value", "interval95"}``.

    Of each case: its `words`; the velocity RMS in m/s of each arm, by axis; `ratio`, the horizontal velocity RMS of
    `HYSTERESIS` over that of `SIMPLE`; `against_base`, the horizontal velocity RMS of each arm over that of the same
    arm in the base. Instruments are resampled alike in all cases, so the ratios are paired.
    """
    arms = {
        f"{case}|{arm}": {a: np.stack([m[arm][f"velocity_rms_{a}"] for m in of_case]) for a in AXES}
        for case, of_case in members.items()
        for arm in ARMS
    }
    pairs = [(f"{case}|{HYSTERESIS}", f"{case}|{SIMPLE}") for case in members]
    pairs += [(f"{case}|{arm}", f"{BASE}|{arm}") for case in members for arm in ARMS]
    statistics = {a: STATISTICS[f"velocity_rms_{a}"] for a in AXES}
    compared = metrics.paired_bootstrap(arms, statistics, pairs, Streams(seed).at("sensitivity", "bootstrap").rng())

    def ratio(first: str, second: str) -> dict[str, Any]:
        found = compared.ratios[f"{first}/{second}"]["horizontal"]
        return metrics.Estimate(found.ratio, found.low, found.high).as_tree()

    return {
        case: {
            "words": CASES[case].words,
            **{arm: {a: compared.arms[f"{case}|{arm}"][a].as_tree() for a in AXES} for arm in ARMS},
            "ratio": ratio(f"{case}|{HYSTERESIS}", f"{case}|{SIMPLE}"),
            "against_base": {arm: ratio(f"{case}|{arm}", f"{BASE}|{arm}") for arm in ARMS},
        }
        for case in members
    }
