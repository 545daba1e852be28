"""A disturbance of a channel of which nothing is known but that it changes slowly, with time or with temperature.

Its value in each window of `locate` is a Gaussian process with covariance s^2 exp(-|t - t'| / tau), s over `SCALES` of
the channel's size, tau over `TIMES`:

    log B = b'L (I + L'AL)^-1 L'b / 2 - log|I + L'AL| / 2,   K = LL'

and the mean over s and tau. Of a sensor it may also be a curve over its own temperature, straight between `KNOTS`
knots from its lowest to its highest, and then knots stand for windows: what waves within three knots is none. A named
effect that is right spends one number where this spends many, and so is the more probable; where nothing that has a
name fits, this is.

Sources: Alvarez, Luengo and Lawrence, IEEE Trans. Pattern Anal. 35 (2013) 2693 (latent forces); Kennedy and O'Hagan,
J. R. Stat. Soc. B 63 (2001) 425 (a discrepancy as a Gaussian process).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.diagnosis.unnamed import locate
from ins_eval.effects.parts import SENSORS
from ins_eval.estimation.evidence import SCALES, Reduced, mixture

if TYPE_CHECKING:
    from ins_eval.error_model.columns import Column
    from ins_eval.estimation.case import Case

TIMES = (2.0, 8.0, 32.0)  # correlation time, in windows or knots
KNOTS = 12  # of a curve over temperature
LEAST_RANGE_C = 0.5  # of a temperature that has a curve over it


@dataclass(frozen=True, eq=False)
class OpenForm:
    """The best form of one channel: `mean` and `sigma` (windows,) in sizes of the channel."""

    channel: int
    log_bayes_factor: float
    mean: np.ndarray
    sigma: np.ndarray


def open_form(channel: int, a: np.ndarray, b: np.ndarray) -> OpenForm:
    """Evidence of a slow disturbance from the sums a (n, n), b (n,) of the windows of a channel."""
    tried = roots(b.size)
    gained = mixture(a, b, tried)
    best = mixture(a, b, tried[gained.best : gained.best + 1])
    variance = np.diag(best.second) - best.mean**2
    return OpenForm(channel, gained.nats, best.mean, np.sqrt(np.maximum(variance, 0.0)))


def roots(count: int) -> list[np.ndarray]:
    """L of every size and correlation time of a disturbance in `count` windows."""
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    each = [np.linalg.cholesky(np.exp(-apart / time) + 1e-9 * np.eye(count)) for time in TIMES]
    return [scale * root for root in each for scale in SCALES]


def open_forms(reduced: Reduced, channels: int) -> list[OpenForm]:
    """The best open form of every channel, from the sums of the windows of one channel after another."""
    count = reduced.projection.size // channels
    parts = [slice(k * count, (k + 1) * count) for k in range(channels)]
    return [open_form(k, reduced.normal[part, part], reduced.projection[part]) for k, part in enumerate(parts)]


def over_temperature(case: Case) -> dict[locate.Channel, list[Column]]:
    """The columns of a curve over its own temperature of each sensor whose temperature moves; a chamber has none."""
    if case.temperature is None or case.believed is None:
        return {}
    sensors = [one for one in locate.channels(case) if one.name.startswith(SENSORS)]
    return {one: [one.column(name) for name in names] for one in sensors if (names := _knots(case, one.axis))}


def _knots(case: Case, axis: str) -> list[str]:
    """The slow factors of the knots over a temperature: 1 at one, 0 at the others; none where it hardly moves."""
    seen = case.temperature
    of_axis = seen.column("xyz".index(axis))
    reading, smooth_c = seen.at(seen.smooth_c, of_axis), seen.smooth_c[:, of_axis]
    if np.ptp(smooth_c) < LEAST_RANGE_C:
        return []
    knots_c = np.linspace(smooth_c.min(), smooth_c.max(), KNOTS)
    return [
        case.slow.add(f"knot {k} of {of_axis}", lambda t, one=one: np.interp(reading(t), knots_c, one), case.model)
        for k, one in enumerate(np.eye(KNOTS))
    ]
