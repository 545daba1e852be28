"""Eqs (3), (4), (13) and (14) of Paper A with either way to label the angles of the index head.

The paper prints two pairs of four-point equations in terms of the angles 0, 90, 180 and 270 degrees. With the angles
of its Fig. 4 (0 degrees: +1 g) eqs (3), (4) and (13) do not give K1 and K0; with the head turned by a quarter (90
degrees: +1 g) eqs (13) and (14) do. Hence `four_point` goes by specific force and never by an angle.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

# specific force in g along the input axis at 0, 90, 180 and 270 degrees
FIGURE_4 = (1.0, 0.0, -1.0, 0.0)
TURNED = (0.0, 1.0, 0.0, -1.0)


class Printed(NamedTuple):
    """What the printed equations yield: scale factors in the unit of the output per g, biases in g."""

    eq3_scale: float  # (A90 - A0) / 2
    eq4_bias: float  # (A180 + A270) / (2 K1)
    eq13_scale: float  # (A90 - A270) / 2
    eq14_bias: float  # (A0 + A180) / (2 K1)


def labelings(plus: float, minus: float, level: Sequence[float]) -> dict[str, Printed]:
    """The printed equations on readings at +1 g, -1 g and the two at 0 g, with the labels of "Fig. 4" and "turned".

    K1 in eqs (4) and (14) is the one by specific force, (plus - minus) / 2, so that each equation is judged alone.
    """
    first, second = level
    scale = (plus - minus) / 2.0
    return {
        "Fig. 4": printed_equations((plus, first, minus, second), scale),
        "turned": printed_equations((first, plus, second, minus), scale),
    }


def printed_equations(output: Sequence[float], scale: float) -> Printed:
    """Eqs (3), (4), (13), (14) on the outputs at 0, 90, 180 and 270 degrees, K1 = `scale` in eqs (4) and (14)."""
    at_0, at_90, at_180, at_270 = output
    return Printed(
        (at_90 - at_0) / 2.0, (at_180 + at_270) / (2.0 * scale), (at_90 - at_270) / 2.0, (at_0 + at_180) / (2.0 * scale)
    )
