"""One sensor that is slowly disturbed, while the others are not.

A wander that is the same for three sensors takes up what one of them does. So two other forms of it are held against
it: a curve that is constant within windows (`open_form`), and a wander of one sensor that is louder than that of the
others by a factor. Windows show what lasts, and where it is; a wave within a window or two shows by its level alone.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.diagnosis.unnamed import locate
from ins_eval.diagnosis.unnamed.disturbance import (
    OF_SENSORS,
    Suspect,
    of_windows,
    windows_of,
    with_quiet_sensors,
)
from ins_eval.diagnosis.unnamed.mismatch import deviate
from ins_eval.diagnosis.unnamed.open_form import open_forms, roots
from ins_eval.effects.effect import AXES
from ins_eval.effects.parts import SENSORS
from ins_eval.estimation.evidence import log_evidence, log_evidence_of, mixture, reduce
from ins_eval.estimation.noise import ALONE_SPREAD
from ins_eval.estimation.noise_fit import WIDEST, Fitted
from ins_eval.recording import PARKED

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ins_eval.diagnosis.unnamed.locate import Interval
    from ins_eval.estimation.case import Case
    from ins_eval.policy import Policy

# of `ALONE_SPREAD`, by which one sensor wanders more than is expected of it where a fit begins: chosen on waves in
# simulated recordings; only the begin of the climb depends on it
LOUDER = 2.0


def one_sensor(case: Case, r: int, base: Fitted, policy: Policy) -> Suspect | None:
    """The slow disturbance of one sensor that gains most over a wander of all; None where there is one sensor only."""
    found = [look(case, r, base, policy) for look in (_in_windows, _by_its_level)]
    return max((one for one in found if one is not None), key=lambda one: one.gain, default=None)


def _in_windows(case: Case, r: int, base: Fitted, policy: Policy) -> Suspect | None:
    """A slow disturbance that is constant within windows, sought where sensors wander little; None of one sensor."""
    over, edges_s, windows = windows_of(case, sensors=True)
    if len(over) == 1:
        return None
    known = slice(0, len(case.nuisances))
    quiet = with_quiet_sensors(case, base.noise_point)
    whitened = case.ready(windows)(quiet)
    reduced = reduce(whitened, known.stop)
    form = max(open_forms(reduced, len(over)), key=lambda one: one.log_bayes_factor)
    start = log_evidence_of(whitened, known) - 0.5 * float(quiet @ quiet) + form.log_bayes_factor
    channel, found = over[form.channel], locate.scan(reduced, over, edges_s)
    if not found:
        return None
    interval = max(found, key=lambda one: one.channel is channel)
    if start < base.log_evidence - policy.hopeless:
        return _suspect(r, interval, start - base.log_evidence, base, len(over), policy)
    columns = list(locate.windows(channel, edges_s, case.slow, case.model))
    forms = roots(len(columns))
    fitted = case.fitted(columns, replace(base, noise_point=quiet), lambda a, b: mixture(a, b, forms))
    left = reduce(fitted.whitened, known.stop)
    interval = next(iter(locate.scan(left, [channel], edges_s)), interval)
    return _suspect(r, interval, fitted.log_evidence - base.log_evidence, fitted, len(over), policy)


def _by_its_level(case: Case, r: int, base: Fitted, policy: Policy) -> Suspect | None:
    """The sensor that wanders by a factor more than the others, or None.

    A fit begins at the best of `_starts`. Of a parked unit each of its three accelerometers is fitted: what a stand
    leans and its gyros wander take up what one of them does, and until they follow no start looks better.
    """
    alone = {k: replace(case, noise=case.noise.with_one_alone(k)) for k in _may_be_alone(case)}
    starts = {
        k: max((_at(one, point) for point in _starts(case, base, OF_SENSORS[k // 3])), key=_height)
        for k, one in alone.items()
    }
    if case.kind not in PARKED:
        least = base.log_evidence - policy.hopeless
        starts = dict(sorted(starts.items(), key=lambda one: _height(one[1]))[-1:])
        starts = {k: one for k, one in starts.items() if one.log_evidence >= least}
    found = [(k, alone[k].fitted((), one)) for k, one in starts.items()]
    found = [(k, one) for k, one in found if one.noise_point[-1] > 0.0]  # else the others wander more
    if not found:
        return None
    k, fitted = max(found, key=lambda one: _height(one[1]))
    like_others = _at(case, fitted.noise_point[:-1])
    over, edges_s, whitened = of_windows(case, with_quiet_sensors(case, like_others.noise_point), sensors=True)
    located = locate.scan(reduce(whitened, len(case.nuisances)), over, edges_s)
    sensor = f"{SENSORS[k // 3]}.{AXES[k % 3]}"
    interval = next((one for one in located if one.channel.name == sensor), None)
    if interval is None:
        return None
    return _suspect(r, interval, fitted.log_evidence - base.log_evidence, like_others, len(over), policy)


def _height(fitted: Fitted) -> float:
    return fitted.log_evidence


def _starts(case: Case, base: Fitted, level: str) -> Iterator[np.ndarray]:
    """Points at which one sensor of the kind `level` wanders more than the others.

    The others by `ALONE_SPREAD` less than all seemed, and it as before; or the others as is expected, and it by two
    spreads more, beside other noise as it seemed, or as is expected at the most: it has made random walks look large.
    """
    free = np.array(case.noise.free)
    of_kind, expected = free == level, np.isin(free, (level, "wander_time"))
    others = np.isin(free, (*OF_SENSORS, "velocity_random_walk", "angle_random_walk"))
    less = np.where(of_kind, ALONE_SPREAD / case.noise.priors[level].spread, 0.0)
    yield np.append(np.maximum(base.noise_point - less, -WIDEST), 1.0)
    centred = np.where(expected, 0.0, base.noise_point)
    yield np.append(centred, LOUDER)
    yield np.append(np.where(others, np.minimum(centred, 0.0), centred), LOUDER)


def _may_be_alone(case: Case) -> range:
    """Sensors, of six, whose wander nothing else feigns: a stand that turns feigns that of the gyros of a parked unit.

    A stand that leans is felt by its gyros too, so that no accelerometer is left with it.
    """
    if case.believed is None:
        return range(0)
    return range(3 if case.kind in PARKED else 6)


def _at(case: Case, noise_point: np.ndarray) -> Fitted:
    """What a fit would be that ends here."""
    whitened = case.ready(())(noise_point)
    return Fitted(noise_point, log_evidence(whitened) - 0.5 * float(noise_point @ noise_point), whitened)


def _suspect(r: int, interval: Interval, gained: float, fitted: Fitted, sensors: int, policy: Policy) -> Suspect:
    """The suspect that gained so many nats, less what the choice of one of the `sensors` costs."""
    gain = gained - float(np.log(sensors / policy.odds)) - policy.alone
    return Suspect(r, interval, gain, 0.0 if gain > 0.0 else 1.0, deviate(gain), fitted)
