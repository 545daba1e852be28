"""The first screen of an evaluation: three numbers, how sure each is, one figure, and what to do next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ins_eval.analysis.evaluation_numbers import LOST_MPS, EvaluationNumbers, FoundStart, SolutionNumbers, StartAttitude
from ins_eval.analysis.schuler import SCHULER_PERIOD_S
from ins_eval.figures.style import label
from ins_eval.grade import Grade, units_of
from ins_eval.report.content import Number, Picture, Section, at_a_glance
from ins_eval.restarts import Restarts
from ins_eval.wording import fixed, in_three, significant

TRUSTED_S = 10.0  # after which the error between fixes is told
ONE_RUN = "one run, no interval"
DEPENDENT = "no interval, too few epochs are independent"
SIGMAS_95 = 1.96


def evaluation_glance(found: EvaluationNumbers) -> Section:
    """What the first screen of a recording says: between fixes first, where navigation was started afresh."""
    run = [*_of_the_run(found), *_of_the_start(found.alignment)]
    rest = _at_rest(found.grade)
    speeds = [one.velocity_rms_mps.get("horizontal", 0.0) for one in found.compensations.values()]
    lost = min(speeds) > LOST_MPS or isinstance(found.alignment, FoundStart) and not found.alignment.heading_known
    numbers = [*_between_fixes(found), *([*rest, *run] if lost else [*run, *rest])]
    return at_a_glance(numbers, _picture(found), *_next_steps(found))


def solution_glance(solution: SolutionNumbers) -> Section:
    """What the first screen says of the solution that an INS put out itself."""
    estimates = {"horizontal velocity RMS": solution.velocity_rms_mps.get("horizontal")}
    estimates |= {f"velocity error {axis}, mean": solution.velocity_mean_mps.get(axis) for axis in ("north", "east")}
    numbers = [
        Number(what, f"{fixed(one.value, 3)} m/s", _interval(one.low, one.high, 3) if one.known else DEPENDENT)
        for what, one in estimates.items()
        if one is not None
    ]
    if rate := solution.radial_error_rate_nmi_per_h.get("final"):
        numbers.append(Number("radial error rate (final)", f"{fixed(rate)} nmi/h", ONE_RUN))
    picture = "solution_north_velocity_error" if solution.velocity_rms_mps else "solution_position_error"
    step = "The fit below says which start and sensor errors would make this curve."
    if solution.span_s < SCHULER_PERIOD_S:
        step += " Record more than a Schuler period (84.4 min) to separate them."
    return at_a_glance(numbers, Picture(picture, "Error of the solution over time, with the fit."), step)


def best_restarts(found: EvaluationNumbers) -> Restarts | None:
    """Those of the compensation that is off least in the end."""
    return min(found.restarts.values(), key=lambda one: one.position_rms_m[-1], default=None)


def _between_fixes(found: EvaluationNumbers) -> list[Number]:
    best = best_restarts(found)
    if best is None:
        return []
    last = len(best.after_s) - 1
    numbers = []
    for k in sorted({int(np.argmin(np.abs(best.after_s - TRUSTED_S))), last}):
        low, high = best.position_interval_m[:, k]
        interval = (
            f"95 %: {in_three(low, 1)} to {in_three(high, 1)}"
            if np.isfinite(low + high)
            else "too few starts for an interval"
        )
        what = f"position error {fixed(best.after_s[k], 0)} s after a fix"
        numbers.append(Number(what, f"{in_three(best.position_rms_m[k], 1)} m", interval))
    return numbers


def _of_the_run(found: EvaluationNumbers) -> list[Number]:
    """Velocity RMS and radial error rate of the best compensation, or its attitude RMS where there is neither."""
    arms = found.compensations
    rms = {name: value for name, one in arms.items() if (value := one.velocity_rms_mps.get("horizontal")) is not None}
    best = min(rms, key=rms.__getitem__, default=next(iter(arms)))
    which = f" ({label(best)})" if len(arms) > 1 else ""
    numbers = [Number(f"horizontal velocity RMS{which}", f"{fixed(rms[best])} m/s", ONE_RUN)] if rms else []
    rate, end_m = arms[best].radial_error_rate_nmi_per_h.get("final"), arms[best].final_radial_error_m
    if rate is not None:
        numbers.append(Number(f"radial error rate (final){which}", f"{fixed(rate)} nmi/h", ONE_RUN))
    elif end_m is not None:
        numbers.append(Number(f"radial error at the end{which}", f"{fixed(end_m, 0)} m", ONE_RUN))
    if not numbers:
        numbers = [
            Number(f"attitude RMS about {axis}{which}", f"{fixed(value)}°", ONE_RUN)
            for axis, value in arms[best].attitude_rms_deg.items()
        ]
    return numbers


def _of_the_start(start: StartAttitude) -> list[Number]:
    if isinstance(start, FoundStart) and not start.heading_known:
        return [Number("heading at the start", "unknown", "nothing in the recording shows north")]
    sigma = start.heading_sigma_deg
    half = "as the recording gives it" if sigma is None else f"± {fixed(SIGMAS_95 * sigma)}° (95 %)"
    return [Number("heading at the start", f"{fixed(start.heading_deg)}°", half)]


def _at_rest(grade: Grade | None) -> list[Number]:
    """The largest white noise of the gyros and of the accelerometers, where stretches at rest show it."""
    numbers = []
    for sensor in ("gyro", "accelerometer"):
        channels = [one for one in (grade.channels if grade else ()) if one.name.startswith(sensor) and one.fit]
        seen = [one for one in channels if one.terms["white"].visible]
        if seen:
            most = max(seen, key=lambda one: one.terms["white"].value)
            white, (unit, _) = most.terms["white"], units_of(most.name)["white"]
            low, high = white.interval95
            value, interval = f"{significant(white.value)} {unit}", f"95 %: {significant(low)} to {significant(high)}"
            above = [one for one in channels if one not in seen and one.terms["white"].interval95[1] > white.value]
            which = "the largest that is seen" if above else "the largest"
            beside = [f"{one.name} below {significant(one.terms['white'].interval95[1])}" for one in above]
            numbers.append(Number(f"white noise of {most.name}, {which}", value, "; ".join([interval, *beside])))
    return numbers


def _picture(found: EvaluationNumbers) -> Picture:
    if found.restarts:
        return Picture("error_growth", "How far the position is off after a start afresh from a fix, RMS.")
    if any(one.final_radial_error_m is not None for one in found.compensations.values()):
        return Picture("position_error", "Horizontal distance from the reference.")
    if any(one.velocity_rms_mps for one in found.compensations.values()):
        return Picture("north_velocity_error", "North velocity error.")
    return Picture("attitude_error", "Attitude error about north, east and down, which is that of heading.")


def _next_steps(found: EvaluationNumbers) -> Sequence[str]:
    name = found.recording.name
    steps = [f"ins-eval diagnose on this recording says what physics is missing from what is believed of {name}."]
    if not found.restarts and found.navigation.duration_s < SCHULER_PERIOD_S:
        steps.append("--restart-every 30 shows how far the instrument can be trusted between fixes.")
    else:
        steps.append("One run has no CEP: evaluate several recordings at once for one.")
    return steps


def _interval(low: float, high: float, digits: int) -> str:
    return f"95 %: {fixed(low, digits)} to {fixed(high, digits)}"
