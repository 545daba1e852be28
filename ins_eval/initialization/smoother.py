"""Kalman filter and fixed-point smoother of the errors, and one pass of it over a window."""

from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np

from ins_eval.initialization.model import dynamics, matrices, measured, moved, navigated, specific_force
from ins_eval.initialization.state import GATE, HEADING_SIGMA_RAD, STATES, Initialization, Window, corrected
from ins_eval.recording.stillness import Stretch

SETTLED = 0.02  # of the sigmas: a change of the start that ends the passes
LARGEST = 1e5  # of any error in its unit, beyond which a guess is given up
MEDIAN_OF_SQUARE = 0.4549  # of a standard normal variable
MEDIAN_SPREAD = 2.34  # sigma of the median of n such squares, relative to it, times sqrt(n)
BEYOND_CHANCE = 3.0  # sigmas by which scatter or memory of the fixes must exceed chance to count; at 2 the four of
# them widen one sound start in eleven


@numba.njit(cache=True)
def _changing(transition):
    """How many rows of a transition (n, n) come before those that are rows of the identity to the end."""
    c = transition.shape[0]
    while c > 0:
        for j in range(transition.shape[0]):
            if transition[c - 1, j] != (1.0 if j == c - 1 else 0.0):
                return c
        c -= 1
    return c


@numba.njit(cache=True, fastmath={"reassoc", "contract"})
def filtered(transition, noise, row, z, h, variance, mean, covariance, gate):
    """Smoothed means of all rows (n, 21), mean and covariance of the last, log-likelihood, innovations (k, 3).

    `noise` (steps, n) are the variances that a step adds. Innovations are in sigmas, NaN where nothing was measured;
    one beyond `gate` is left out. The smoother is that of Bryson and Frazier: going back, lambda <- (I - K h')' lambda
    - h e / S at a measurement, F' lambda over a step, and the smoothed mean is x - P lambda. States that only stay as
    they are, the last rows of a transition, and zeros of it and of designs cost nothing.
    """
    n, rows = mean.shape[0], transition.shape[0] + 1
    x, p = mean.copy(), covariance.copy()
    means, covariances = np.empty((rows, n)), np.empty((rows, n, n))
    innovations = np.full((row.shape[0], 3), np.nan)
    gains, weighted = np.zeros((row.shape[0], 3, n)), np.zeros((row.shape[0], 3))
    fp, ph, root = np.empty((n, n)), np.empty(n), np.empty(n)
    logs = 0.0
    m = 0
    for k in range(rows):
        if k > 0:
            f = transition[k - 1]
            c = _changing(f)
            x[:c] = f[:c] @ x
            for a in range(c):  # F P of the rows that change
                fp[a] = 0.0
                for j in range(n):
                    if f[a, j] != 0.0:
                        for b in range(n):
                            fp[a, b] += f[a, j] * p[j, b]
            for a in range(c):  # F P F'
                for b in range(c, n):
                    p[a, b] = p[b, a] = fp[a, b]
                for b in range(a + 1):
                    total = 0.0
                    for j in range(n):
                        total += fp[a, j] * f[b, j]
                    p[a, b] = p[b, a] = total
            for a in range(n):
                p[a, a] += noise[k - 1, a]
        while m < row.shape[0] and row[m] <= k:
            for i in range(3):
                if variance[m, i] <= 0.0:
                    continue
                ph[:] = 0.0
                s, e = variance[m, i], z[m, i]
                for j in range(n):
                    if h[m, i, j] != 0.0:
                        e -= h[m, i, j] * x[j]
                        for b in range(n):
                            ph[b] += h[m, i, j] * p[j, b]
                for j in range(n):
                    s += h[m, i, j] * ph[j]
                innovations[m, i] = e / np.sqrt(s)
                if abs(innovations[m, i]) > gate:
                    logs -= 0.5 * (gate * gate + np.log(s))
                    continue
                logs -= 0.5 * (e * e / s + np.log(s))
                weighted[m, i] = e / s
                for a in range(n):
                    gains[m, i, a] = ph[a] / s
                    x[a] += gains[m, i, a] * e
                    root[a] = ph[a] / np.sqrt(s)
                for a in range(n):
                    for b in range(n):
                        p[a, b] -= root[a] * root[b]
            m += 1
        means[k] = x
        covariances[k] = p
    smoothed = means.copy()
    back = np.zeros(n)
    for k in range(rows - 1, -1, -1):
        smoothed[k] -= covariances[k] @ back
        while m > 0 and row[m - 1] >= k:
            m -= 1
            for i in range(2, -1, -1):
                if weighted[m, i] != 0.0 or gains[m, i].any():
                    back -= h[m, i] * (gains[m, i] @ back + weighted[m, i])
        if k > 0:
            c = _changing(transition[k - 1])
            head = back[:c].copy()
            back[:c] = 0.0
            back += head @ transition[k - 1, :c]
    return smoothed, x, p, logs, innovations


def one_pass(window: Window, begin: Initialization, prior: np.ndarray, gate: float) -> Initialization:
    """Navigate the window from `begin` and filter what was measured; `prior` is about `begin` less what was taken."""
    solution, force_b, rate_b = navigated(window, begin)
    if not np.isfinite(solution.velocity_n).all() or np.abs(solution.velocity_n).max() > LARGEST:
        return replace(begin, log_likelihood=-np.inf, first_error=np.zeros(STATES))
    mat_nb = matrices(solution.quaternion_nb)
    about = begin.about or (mat_nb, np.einsum("nij,nj->ni", 0.5 * (mat_nb[:-1] + mat_nb[1:]), force_b))
    row, _, z, h, variance = measured(window, begin, solution, mat_nb, about[0], rate_b)
    transition, noise = dynamics(window, solution, about, force_b, rate_b)
    smoothed, mean, covariance, log_likelihood, _ = filtered(
        transition, noise, row, z, h, variance, -begin.taken, np.ascontiguousarray(prior), gate
    )
    last = len(solution.time_s) - 1
    path = moved(solution, mat_nb, smoothed)
    end = replace(
        begin,
        start=replace(
            begin.start,
            time_s=float(solution.time_s[last]),
            latitude_rad=float(solution.latitude_rad[last]),
            longitude_rad=float(solution.longitude_rad[last]),
            height_m=float(solution.height_m[last]),
            velocity_n=tuple(float(v) for v in solution.velocity_n[last]),
            attitude_rad=tuple(float(a) for a in solution.attitude_rad[last]),
        ),
        covariance=covariance,
        window=Stretch(begin.window.start_s, float(solution.time_s[last])),
        first_error=smoothed[0],
        path=path,
        walks=(window.angle_walk, window.velocity_walk),
        about=(matrices(path.quaternion_nb), specific_force(solution, path.velocity_n)),
        log_likelihood=float(log_likelihood),
    )
    return corrected(end, mean)


def settle(window: Window, guess: Initialization, prior: np.ndarray, passes: int) -> Initialization:
    """The guess of the window's first state, corrected until it changes no more."""
    guess = replace(guess, about=None)
    best = guess
    for k in range(passes):
        done = one_pass(window, guess, prior, GATE if k > 2 else np.inf)
        correction = done.first_error
        if not np.isfinite(done.log_likelihood) or np.abs(correction).max() > LARGEST:
            return replace(guess, log_likelihood=-np.inf)  # so far off that its linear model says nothing
        guess = corrected(guess, correction)
        taken = guess.taken + correction
        if prior[8, 8] >= HEADING_SIGMA_RAD**2:
            taken[8] = 0.0  # the prior of any heading is flat
        guess = replace(guess, log_likelihood=done.log_likelihood, about=done.about, taken=taken)
        best = guess
        if k > 0 and (np.abs(correction) < SETTLED * done.sigmas).all():
            break
    return best


def scatter(window: Window, first: Initialization, prior: np.ndarray) -> tuple[float, float]:
    """By how much positions and velocities scatter beyond their sigmas, at least 1; their memory counts as scatter."""
    solution, force_b, rate_b = navigated(window, first)
    c = matrices(solution.quaternion_nb)
    row, kind, z, h, variance = measured(window, first, solution, c, first.about[0], rate_b)
    transition, noise = dynamics(window, solution, first.about, force_b, rate_b)
    *_, innovations = filtered(
        transition, noise, row, z, h, variance, -first.taken, np.ascontiguousarray(prior), np.inf
    )
    out = []
    for of in (0, 1):
        mine = innovations[kind == of]
        mine = mine[np.isfinite(mine).all(axis=1)]
        if len(mine) < 8:
            out.append(1.0)
            continue
        mine = mine[len(mine) // 4 :]  # the first ones find the state
        size = float(np.median(mine**2)) / MEDIAN_OF_SQUARE
        bounded = np.clip(mine, -GATE * np.sqrt(size), GATE * np.sqrt(size))
        memory = float((bounded[1:] * bounded[:-1]).sum() / np.maximum((bounded**2).sum(), 1e-300))
        # what chance alone shows of either would widen every sigma a little, since nothing makes them narrower
        chance = BEYOND_CHANCE / np.sqrt(mine.size)
        memory = float(np.clip(memory, 0.0, 0.95)) if memory > chance else 0.0
        size = size if size > 1.0 + MEDIAN_SPREAD * chance else 1.0
        out.append(float(np.sqrt(size * (1.0 + memory) / (1.0 - memory))))
    return out[0], out[1]
