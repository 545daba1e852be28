"""Figures of the solution that an INS put out itself."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ins_eval import figures
from ins_eval.analysis.solution import SolutionEvaluation

WORDS = {"gps": "GPS", "ins": "the better INS", "standstill": "the standstill"}


def solution_figures(found: SolutionEvaluation) -> dict[str, Figure]:
    """Velocity errors with the fit, and the position error; what was not compared is left out."""
    drawn: dict[str, Figure] = {}
    words = WORDS[found.reference]
    if (one := found.velocity) is not None:
        for axis, component in enumerate(("north", "east")):
            errors = {"solution": np.where(one.valid, one.velocity_n[:, axis], np.nan)}
            if (fit := found.schuler) is not None:
                inside = (one.time_s >= fit.time_s[0]) & (one.time_s <= fit.time_s[-1])
                curve = np.interp(one.time_s, fit.time_s, fit.curve[:, axis])
                errors["start and sensor errors"] = np.where(inside, curve, np.nan)
            drawn[f"solution_{component}_velocity_error"] = figures.velocity_error(
                time_s=one.time_s - found.start_s, errors_mps=errors, component=component, reference=words
            )
    if (one := found.position) is not None:
        radius = np.where(one.valid, np.hypot(one.north_m, one.east_m), np.nan)
        drawn["solution_position_error"] = figures.position_error(
            time_s=one.time_s - found.start_s, errors_m={"solution": radius}, reference=words
        )
    return drawn
