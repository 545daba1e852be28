"""What the static tests can see, from eqs (13) and (24)-(28) for a loop gain k_pre k_fb."""

from __future__ import annotations

from typing import NamedTuple

from ins_eval.studies.paper_b.printed import PRINTED
from ins_eval.units import PPM

HIGH = 1e6  # a loop gain that is "much larger than 1"; with an integrator it is without limit at rest


class Counts(NamedTuple):
    """Output in counts, with k0 a_in = 1 and I_ref k_t = 1 where no part drifts."""

    off: float  # eq. (25)
    on_less_off: float  # eqs (24) and (25)


def counts(loop_gain: float, k_pre: float = 0.0, k_t: float = 0.0, k_vi_da: float = 0.0, k_0: float = 0.0) -> Counts:
    """Eqs (24) and (25) with drifts in ppm of k_pre, k_t, k_VI k_DA and k0."""
    forward, torquer, electronic, pendulosity = (1.0 + x * PPM for x in (k_pre, k_t, k_vi_da, k_0))
    pre = loop_gain * forward
    closed = 1.0 + torquer * electronic * pre
    return Counts(pendulosity * pre / closed, -torquer * pre / closed)


def seen_ppm(loop_gain: float = HIGH, **drift_ppm: float) -> Counts:
    """Change of both in ppm for drifts of the parts."""
    sound, drifted = counts(loop_gain), counts(loop_gain, **drift_ppm)
    return Counts(*((d / s - 1.0) / PPM for d, s in zip(drifted, sound, strict=True)))


def not_seen() -> list[str]:
    """Factors of the feedback gain, eq. (13), that N_on - N_off, eq. (26), does not hold."""
    factors = PRINTED["factors"]
    return [factor for factor in factors["eq13"] if factor not in factors["eq28"]]
