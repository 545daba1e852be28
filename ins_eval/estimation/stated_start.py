"""By what the attitude that is stated of a start is turned from the one that rest, motion and fixes show."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ins_eval.effects import turned_start
from ins_eval.effects.start import ROTATIONS
from ins_eval.error_model.geometry import cross_matrices, turn, turned
from ins_eval.error_model.null import begins_as_stated
from ins_eval.estimation.wrong_description import WrongDescription
from ins_eval.recording.belief import EffectBelief
from ins_eval.recording.consistency.alternatives import AXIS_PRIOR, BEYOND_DOUBT
from ins_eval.units import ARCSEC, DEG

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ins_eval.estimation.case import Case
    from ins_eval.recording import Recording

LEAST_SIGMA_RAD = 1e-6  # of an attitude that is said to be exact: a fifth of an arcsecond, by reasoning
ROTATION_NAMES = {k: of for of, k in ROTATIONS.items()}


def wrong_start(recording: Recording, case: Case) -> list[WrongDescription]:
    """What is wrong with the attitude that is stated of a start, one of level and heading each.

    Only where the recording does not begin in it (`begins_as_stated`): it is too far for a linear error model, or gyros
    are coarse. Elsewhere it is an effect among others, or is made good by a late clock as well. With phi from the one
    to the other, C_found = exp(phi x) C_stated, and P its covariance, components k are wrong, the clearest first, where
    the nats

        z^2 / (S_kk + p) / 2,    z = phi_k - P_ko (P_oo + S_oo)^-1 phi_o,    p = P_kk - P_ko (P_oo + S_oo)^-1 P_ok

    are beyond doubt, S the variances that are stated, o the others but for those that are wrong.
    """
    wrong, stated_sigma = _wrong_of_start(recording, case)
    return [_description(ROTATION_NAMES[k], *wrong[k], stated_sigma[k]) for k in wrong]


def log_prior_of_start(recording: Recording, case: Case) -> float:
    """Nats by which an attitude that is stated wrong is less likely than one that is stated rightly.

    Each component is a mistake, and it may then be any angle: one of 2 pi, against a normal density at its middle,
    log(s / sqrt(2 pi)) of the stated sigma s.
    """
    wrong, stated_sigma = _wrong_of_start(recording, case)
    sigma = np.maximum(stated_sigma, LEAST_SIGMA_RAD)
    return sum(AXIS_PRIOR + float(np.log(sigma[k] / np.sqrt(2.0 * np.pi))) for k in wrong)


def _wrong_of_start(recording: Recording, case: Case) -> tuple[dict[int, tuple[float, float, float]], np.ndarray]:
    """z, sqrt(p) and nats of each component that is stated wrong, and the stated sigmas (3,); none where none are."""
    stated, navigated = turned_start(recording.start, recording.belief), case.believed
    if navigated is None or stated.attitude_rad is None or stated.attitude_sigma_rad is None:
        return {}, np.zeros(3)
    stated_sigma = np.asarray(stated.attitude_sigma_rad)
    if begins_as_stated(recording, navigated.start):
        return {}, stated_sigma
    off, covariance = _off(case)
    phi = turn(stated.attitude_rad, turned([navigated.start.attitude_rad], [off])[0])
    response = _of_further_turn(phi)
    return _wrong_components(phi, response @ covariance @ response.T, stated_sigma), stated_sigma


def _description(
    of: tuple[str, str | None], phi: float, sigma: float, nats: float, stated_sigma: float
) -> WrongDescription:
    name, axis = of
    seen = (
        f"start: rest, motion and fixes show an attitude that is turned by {phi / DEG:.3g} deg about {axis or 'down'} "
        f"from the stated one, which is believed to {stated_sigma / DEG:.2g} deg"
    )
    return WrongDescription(EffectBelief(name=name, axis=axis, value=phi / ARCSEC), nats, seen, sigma / ARCSEC)


def _wrong_components(
    phi: np.ndarray, covariance: np.ndarray, stated_sigma: np.ndarray
) -> dict[int, tuple[float, float, float]]:
    """z, sqrt(p) and nats of each component of a turn `phi` that is stated wrong beyond doubt."""
    rightly = [0, 1, 2]
    while True:
        z, sigma = _given(phi, covariance, stated_sigma, rightly)
        nats = 0.5 * z**2 / (stated_sigma**2 + sigma**2)
        doubted = [k for k in rightly if nats[k] > BEYOND_DOUBT]
        if not doubted:
            return {k: (float(z[k]), float(sigma[k]), float(nats[k])) for k in range(3) if k not in rightly}
        rightly.remove(max(doubted, key=nats.__getitem__))


def _given(
    phi: np.ndarray, covariance: np.ndarray, stated_sigma: np.ndarray, rightly: Sequence[int]
) -> tuple[np.ndarray, np.ndarray]:
    """z and sqrt(p) (3,) of each component, where the others of those that are stated `rightly` are known to that."""
    z, sigma = np.empty(3), np.empty(3)
    for k in range(3):
        o = [other for other in rightly if other != k]
        known = covariance[np.ix_(o, o)] + np.diag(stated_sigma[o] ** 2)
        gain = np.linalg.solve(known, covariance[o, k])
        z[k] = phi[k] - gain @ phi[o]
        sigma[k] = np.sqrt(covariance[k, k] - gain @ covariance[o, k])
    return z, sigma


def _off(case: Case) -> tuple[np.ndarray, np.ndarray]:
    """By what the start of a case is still turned about north, east and down, rad (3,), and the covariance of that."""
    of = [k for k, one in enumerate(case.nuisances) if one.name.startswith("start attitude")]
    size = np.abs([case.nuisances[k].start[6:] for k in of]).sum(axis=1)
    whitened = case.whitened([], np.zeros(len(case.noise.free)), case.blocks)
    covariance = np.linalg.inv(np.eye(len(case.nuisances)) + whitened.normal)
    return size * (covariance @ whitened.projection)[of], np.outer(size, size) * covariance[np.ix_(of, of)]


def _of_further_turn(phi: np.ndarray) -> np.ndarray:
    """d phi / d delta (3, 3) of exp(delta x) exp(phi x) at delta 0, with 2 t the angle of phi.

    I - [phi x] / 2 + (1 - t / tan t) [phi x]^2 / (2 t)^2

    Source: Barfoot, State Estimation for Robotics, 2017, 7.1.5 (inverse of the left Jacobian).
    """
    half, (across,) = 0.5 * float(np.linalg.norm(phi)), cross_matrices(phi[None])
    return np.eye(3) - 0.5 * across + (1.0 - half / np.tan(half)) / (2.0 * half) ** 2 * across @ across
