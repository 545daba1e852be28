"""A recording whose errors would not stay small is navigated in arcs, each from a state of its own.

The states are those of a path that the measurements allow: found by `initialization`, then corrected by a smoother over
the whole recording that knows the linear error model, biases of the sensors, of clock and antenna, and no more,

    x = [dp, dv, phi, b_a, b_g, delay, arm],   x_k+1 = F_k x_k + u_k + w,   y_k = H_k x_k + v,

u what the begin of an arc is known to change, until the path stays. It is only what errors are linear about: what an
arc changes where it begins is known and is taken off the residual again (`propagation`), so that an error of a sensor
acts through all arcs as through one.

Where a unit stands, place and attitude of each stand are states as well. A tilt and a bias of an accelerometer then
look alike and would go anywhere with wide biases: these have the sigmas of the belief, or are as large as they were
found. Those of gyros are wide at first, for an Earth that is not believed to turn is one, and then as large as they
were found so far: what they share with the heading is left to it, which costs less.

Source: multiple shooting, Bock and Plitt, IFAC Proc. 17 (1984) 1603; iterated smoother, Bell, SIAM J. Optim. 4 (1994)
626.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.error_model import null, observations, propagation
from ins_eval.error_model.geometry import along, apart, moved, turn, turned
from ins_eval.errors import DataRefused
from ins_eval.estimation.noise import white, without_outliers
from ins_eval.initialization import (
    ACCELEROMETER_BIAS,
    GYRO_BIAS,
    HEADING_SIGMA_RAD,
    TILT_SIGMA_RAD,
    WIDE_ACCELEROMETER_BIAS_MPS2,
    WIDE_GYRO_BIAS_RADPS,
    filtered,
)
from ins_eval.limits import limits_of
from ins_eval.strapdown import SAMPLES_PER_STEP
from ins_eval.units import DEG, DEG_PER_H, UG

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ins_eval.error_model.null import Believed
    from ins_eval.error_model.observations import Observations
    from ins_eval.error_model.propagation import ErrorModel
    from ins_eval.initialization import Initialization
    from ins_eval.recording import Recording, Start
    from ins_eval.recording.stillness import Stretch

STATES, STATES_OF_STANDS = 20, 26
STATE, BIAS, DELAY, ARM, KNOWN = slice(0, 9), slice(9, 15), 15, slice(16, 19), 19  # KNOWN is 1
PLACE = slice(20, 26)  # position and attitude of what stands, so far
PLACED = [0, 1, 2, 6, 7, 8]  # channels that measure them
PLACE_SIGMA_M = 3.0  # of a unit that is carried from one stand to the next: by reasoning
PLACE_SIGMAS = np.array([*[PLACE_SIGMA_M] * 3, TILT_SIGMA_RAD, TILT_SIGMA_RAD, HEADING_SIGMA_RAD])
DELAY_SIGMA_S, ARM_SIGMA_M = 0.3, 1.0  # of stamps and of an antenna that nobody measured
LARGEST_VELOCITY_MPS = 17.0  # what that tilt makes in ten seconds
FASTEST_MPS = limits_of("velocity_mps")[1]
SMALL_RAD = 0.5 * DEG  # to which a bias may turn an arc
SHORTEST_S, LONGEST_S = 2.0, 60.0
ROUNDS, ROUNDS_AGAIN = 6, 2  # from a first guess, and from the states of the same recording with other effects
CLOCK_S = 1e-3  # by which a node at an end of a stand may lie beyond it: far less than an epoch
# sigmas that the begins of arcs moved last: in real logs the next round moved them by a tenth of it, or, in one, by the
# half sigma around which they swung in every round
STEADY = 1.0
SHOWN = 3.0  # of its sigmas, from which a bias is found to be there: by reasoning
BEGIN = ("time_s", "latitude_rad", "longitude_rad", "height_m", "velocity_n", "attitude_rad")
WALK_SHARE = 0.01  # of its wide sigma that a bias wanders in a minute
WALK_SHARE_STANDING = 0.05  # of what is believed or found of it: a fifth that lasts for half an hour, as in `noise`


class Diverged(ArithmeticError):
    """No path of a recording, as it is believed, comes near what was measured."""


@dataclass(frozen=True, eq=False)
class Settled:
    """A recording in arcs as it is `navigated`, without the biases that were found.

    `stated` is the start around which the priors of its errors lie: what is believed of it, or, where that was a first
    guess, what the measurements made of it; only effects of alignment move it when it is navigated again. `walks` is
    the white noise that the increments show, rad/sqrt(s) and m/s/sqrt(s), `fix_scale` by how much positions and
    velocities scatter beyond their sigmas, `bias_sigma` (6,) how large biases of accelerometers and gyros may be, and
    `bias_walk` (6,) by what they may wander in a minute, m/s^2 and rad/s.
    """

    stated: Start
    navigated: Believed
    walks: tuple[float, float]
    fix_scale: tuple[float, float]
    bias_sigma: np.ndarray
    bias_walk: np.ndarray


def lost(seen: Observations) -> bool:
    """Whether a solution in one arc went so far off that small errors do not describe it, whatever was stated."""
    velocity = np.abs(seen.residual[:, 3:6])
    return bool((velocity[np.isfinite(velocity)] > LARGEST_VELOCITY_MPS).any())


def settle(
    recording: Recording,
    folder: str | Path = ".",
    before: Settled | None = None,
    shown: Initialization | None = None,
) -> Settled:
    """The recording in arcs along a path that the measurements allow; `before`: that of the same with other effects.

    `shown` is what rest, motion and fixes are known to show of its start.
    """
    if before is None:
        believed, found, path = null.begin_afresh(recording, folder, shown)
        begins = _begins(believed, _largest_gyro_bias(believed, found))
        states = [believed.start, *null.starts_at(path, begins)]
        navigated = replace(
            believed,
            force_bias=found.accelerometer_bias_mps2,
            gyro_bias=found.gyro_bias_radps,
            stands=observations.stands(believed),
        )
        biases = _biases(navigated, found, standing=bool(navigated.stands and begins.size))
        here = Settled(believed.start, navigated, found.walks, found.fix_scale, *biases)
    else:
        known = before.navigated
        believed = null.begun_at(recording, known.start, folder)
        stated, start = before.stated, known.start
        if null.begins_as_stated(recording, known.start):  # effects that turn it are among what is believed now
            stated = believed.start
            by = turn(before.stated.attitude_rad, stated.attitude_rad)
            start = replace(start, attitude_rad=turned([start.attitude_rad], [by])[0])
        states = [start, *_on_steps(known.arcs, believed.time_s)]
        believed = replace(believed, force_bias=known.force_bias, gyro_bias=known.gyro_bias, stands=known.stands)
        here = replace(before, navigated=believed, stated=stated)
    here = _begun(here, states)
    for _ in range(ROUNDS if before is None else ROUNDS_AGAIN):
        begins, mean, sigma = _errors(here)
        known = here.navigated
        starts = [known.start, *known.arcs]
        attitudes = turned([one.attitude_rad for one in starts], begins[:, 6:])
        states = [
            replace(moved(one, -error[:3], -error[3:6]), attitude_rad=attitude)
            for one, error, attitude in zip(starts, begins, attitudes, strict=True)
        ]
        biases = {"force_bias": known.force_bias + mean[:3], "gyro_bias": known.gyro_bias + mean[3:]}
        here = _begun(replace(here, navigated=replace(known, **biases)), states)
        if _stands(known):
            here = replace(here, bias_sigma=np.append(here.bias_sigma[:3], _as_found(here.navigated)[3:]))
        else:
            here = replace(here, bias_sigma=_as_found(here.navigated, sigma[BIAS]))
        if (np.abs(begins) < STEADY * sigma[STATE]).all():
            break
    if before is None and not null.begins_as_stated(recording, null.start_at(path, recording.start.time_s)):
        return replace(here, stated=here.navigated.start)  # how far a first guess was off costs nothing
    return here


def planned(recording: Recording, folder: str | Path = ".") -> Settled:
    """A recording that is free of errors, in arcs along the path that is believed of it.

    Raises DataRefused where its heading is to be found and nothing is left once it is.
    """
    believed = null.believe(recording, folder)
    if not believed.time_s.size:
        whole_s = recording.interval_s.sum()
        raise DataRefused(f"{recording.name}: its {whole_s:.0f} s are all needed to find its heading")
    (path,) = null.solve(believed)
    begins = _begins(believed, recording.belief.gyro.bias_sigma_deg_per_h * DEG_PER_H)
    states = [believed.start, *null.starts_at(path, begins)]
    navigated = replace(believed, stands=observations.stands(believed))
    none = np.zeros(6)
    return _begun(Settled(believed.start, navigated, (0.0, 0.0), (1.0, 1.0), bias_sigma=none, bias_walk=none), states)


def _stands(navigated: Believed) -> bool:
    """Whether places of stands are free: a recording too short for arcs is measured against its start."""
    return bool(navigated.stands and navigated.arcs)


def _biases(navigated: Believed, found: Initialization, standing: bool) -> tuple[np.ndarray, np.ndarray]:
    """How large biases of accelerometers and gyros may be, and how far they may wander in a minute (6,)."""
    wide = np.repeat([WIDE_ACCELEROMETER_BIAS_MPS2, WIDE_GYRO_BIAS_RADPS], 3)
    if not standing:
        sigma = np.concatenate([found.sigmas[ACCELEROMETER_BIAS], found.sigmas[GYRO_BIAS]])
        return _as_found(navigated, sigma), WALK_SHARE * wide
    sigma = _as_found(navigated)
    return np.concatenate([sigma[:3], wide[3:]]), WALK_SHARE_STANDING * sigma


def _as_found(navigated: Believed, sigma: np.ndarray | float = 0.0) -> np.ndarray:
    """Sigmas (6,) of biases: as believed, or as large as they were found where the `sigma` of the fit shows them."""
    belief = navigated.recording.belief
    stated = np.repeat([UG * belief.accelerometer.bias_sigma_ug, DEG_PER_H * belief.gyro.bias_sigma_deg_per_h], 3)
    found = np.abs(np.concatenate([navigated.force_bias, navigated.gyro_bias]))
    return np.where(found > SHOWN * sigma, np.maximum(stated, found), stated)


def _largest_gyro_bias(believed: Believed, found: Initialization) -> float:
    """What a gyro may be off after its bias was found, rad/s."""
    return max(
        believed.recording.belief.gyro.bias_sigma_deg_per_h * DEG_PER_H,
        float(np.abs(found.gyro_bias_radps).max()),
        float(found.sigmas[GYRO_BIAS].max()),
    )


def _begins(believed: Believed, gyro: float) -> np.ndarray:
    """Instants (s) at which arcs begin after the first: the ends of steps, as far apart as a `gyro` bias allows."""
    length_s = float(np.clip(SMALL_RAD / gyro, SHORTEST_S, LONGEST_S))
    step_s = SAMPLES_PER_STEP * float(np.median(np.diff(believed.time_s)))
    rows = SAMPLES_PER_STEP * max(1, round(length_s / step_s))
    return believed.time_s[rows - 1 : -rows // 2 : rows]


def _on_steps(arcs: Sequence[Start], time_s: np.ndarray) -> list[Start]:
    """The same states at the ends of steps of samples at `time_s` (n,): another clock puts those elsewhere.

    By it a recording may end before its last arcs begin; these are gone.
    """
    ends_s = time_s[SAMPLES_PER_STEP - 1 :: SAMPLES_PER_STEP]
    nearest = np.searchsorted(0.5 * (ends_s[1:] + ends_s[:-1]), [one.time_s for one in arcs])
    inside = {int(k): one for one, k in zip(arcs, nearest, strict=True) if k < ends_s.size - 1}
    return [replace(one, time_s=float(ends_s[k])) for k, one in inside.items()]


def _begun(here: Settled, states: list[Start]) -> Settled:
    """The same begun at `states`."""
    start = replace(here.navigated.start, **{name: getattr(states[0], name) for name in BEGIN})
    return replace(here, navigated=replace(here.navigated, start=start, arcs=tuple(states[1:])))


def observed(navigated: Believed) -> tuple[ErrorModel, Observations]:
    """The error model along the solution of what is `navigated`, and what was measured at its nodes.

    Raises Diverged where that solution is faster than anything that carries an INS.
    """
    solution = null.solve(navigated)
    end_s = float(solution[-1].time_s[-1])
    measured = observations.sources(navigated, end_s)
    nodes_s = observations.nodes(navigated, measured, end_s)
    if not all((np.abs(one.velocity_n) < FASTEST_MPS).all() for one in solution):
        raise Diverged(f"{navigated.recording.name}: as it is believed its errors grow beyond all bounds")
    model = propagation.build(navigated, solution, nodes_s)
    return model, observations.observe(navigated, model.states, model.arc, measured)


def inertial(navigated: Believed, nodes_s: np.ndarray) -> np.ndarray:
    """Residual (nodes, 9) at `nodes_s` of the pure-inertial solution: in one arc, no bias that was found taken off."""
    none = np.zeros(3)
    whole = replace(navigated, arcs=(), gyro_bias=none, force_bias=none)
    solution = null.solve(whole)
    states = along(solution, whole.gyro, none, nodes_s)
    measured = observations.sources(whole, float(solution[-1].time_s[-1]))
    return observations.observe(whole, states, np.zeros(nodes_s.size, dtype=int), measured).residual


def _errors(here: Settled) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Smoothed errors at the begins of arcs (arcs, 9), of the biases on average (6,), and a sigma of each (15,)."""
    navigated = here.navigated
    model, seen = observed(navigated)
    smoothed, sigma = _smoothed(here, model, without_outliers(seen)[0])
    if not np.isfinite(smoothed).all():
        raise Diverged(f"{navigated.recording.name}: as it is believed nothing measured corrects its errors")
    rows = np.searchsorted(model.nodes_s, [one.time_s - 1e-6 for one in (navigated.start, *navigated.arcs)])
    begins = smoothed[rows, STATE].copy()
    begins[1:] += apart(navigated.arcs, model.states, rows[1:])
    return begins, smoothed[:, BIAS].mean(axis=0), sigma


def _smoothed(here: Settled, model: ErrorModel, seen: Observations) -> tuple[np.ndarray, np.ndarray]:
    """Errors (nodes, 20 or, of what stands, 26) that the residual tells, and one sigma (15,) of the last state."""
    navigated, nodes = here.navigated, model.nodes_s.size
    states = STATES_OF_STANDS if _stands(navigated) else STATES
    f = np.tile(np.eye(states), (nodes - 1, 1, 1))
    f[:, STATE, STATE], f[:, STATE, BIAS] = model.transition, model.coupling
    walk = np.zeros(states)
    walk[3:6], walk[6:9], walk[BIAS] = here.walks[1], here.walks[0], here.bias_walk / np.sqrt(60.0)
    noise = walk**2 * model.interval_s[:, None]
    # what is known to have been done to the solution: carried open loop it would grow for hours as heights do
    f[:, STATE, KNOWN] = np.einsum("kij,kj->ki", model.half, model.known)
    h = np.zeros((nodes, 9, states))
    h[:, :, STATE], h[:, :, DELAY], h[:, :, ARM] = seen.design, seen.of_delay, np.swapaxes(seen.of_arm, 1, 2)
    start = navigated.start
    sigma = np.concatenate([
        np.full(3, start.position_sigma_m), np.full(3, start.velocity_sigma_mps), navigated.attitude_sigma_n,
        here.bias_sigma, [DELAY_SIGMA_S], np.full(3, ARM_SIGMA_M), [0.0], PLACE_SIGMAS,
    ])[:states]  # fmt: skip
    begin = np.eye(states)[KNOWN]
    # what is believed of start and biases, less what was taken off already
    begin[STATE] = -apart([here.stated], model.states, [0])[0]
    begin[BIAS] = -np.concatenate([navigated.force_bias, navigated.gyro_bias])
    if _stands(navigated):
        _place(navigated.stands, model.nodes_s, f, noise, h)
    scale = np.repeat([*here.fix_scale, 1.0], 3)
    level = np.maximum(white(seen)[0], scale * seen.sigma)
    known = np.isfinite(seen.residual)
    mean, _, covariance, _, _ = filtered(
        f,
        noise,
        np.repeat(np.arange(nodes), 3),
        np.where(known, seen.residual, 0.0).reshape(-1, 3),
        h.reshape(-1, 3, states),
        np.where(known, level**2, 0.0).reshape(-1, 3),
        begin,
        np.diag(sigma**2),
        np.inf,
    )
    return mean, np.sqrt(np.diag(covariance)[:DELAY])


def _place(stands: Sequence[Stretch], nodes_s: np.ndarray, f: np.ndarray, noise: np.ndarray, h: np.ndarray) -> None:
    """Let each stand show its own place: what is stated of it errs with it, and at the next one by anything again."""
    for stand in stands:
        inside = np.flatnonzero((nodes_s > stand.start_s - CLOCK_S) & (nodes_s < stand.end_s + CLOCK_S))
        if inside.size == 0:
            continue
        h[inside, :, PLACE] = np.eye(9)[:, PLACED]
        entered = inside[0] - 1
        if entered >= 0:
            f[entered, PLACE, PLACE] = 0.0
            noise[entered, PLACE] = PLACE_SIGMAS**2
