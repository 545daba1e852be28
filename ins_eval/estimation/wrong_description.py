"""What the description of a recording has wrong."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ins_eval.recording.belief import EffectBelief


@dataclass(frozen=True)
class WrongDescription:
    """A wrong description as a belief states it, its log odds, finite also beyond all doubt, and what was seen.

    `sigma` is that of its value; 0 where that is one of a few alternatives.
    """

    effect: EffectBelief
    log_odds: float
    seen: str
    sigma: float = 0.0
