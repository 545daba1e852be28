"""What recordings hold, before it is judged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np

    from ins_eval.diagnosis.unnamed.disturbance import Suspect
    from ins_eval.diagnosis.unnamed.mismatch import Mismatch, UnnamedDisturbance
    from ins_eval.estimation.case import Case
    from ins_eval.estimation.linearisation import Linearisation
    from ins_eval.estimation.noise_fit import Fitted


@dataclass(frozen=True, eq=False)
class Findings:
    """What recordings of one instrument hold.

    Parameters
    ----------
    null, innovations : noise of each recording under the belief, and its whitened residual (nodes, 9) there
    alone : disturbances without a name that are sure, each at a noise of its own; the one that gains most is last
    linearisation : the best set of effects, and all that can be asked around it
    gain : nats of that set against the null, the noise integrated out of both
    instead, beside : what has no name and gains most instead of the effects and beside them; None where they are not
        worth reporting
    shown : where each effect of the set shows; empty likewise
    suspects : disturbances without a name, None where the effects explain and nothing without a name is near
    places : where each suspect is
    around_belief : every effect as it looks before any is tried further, noise that of the null within its grade
    others : searches at other noise, whose best sets were within `Policy.listed` nats of the best one
    """

    cases: tuple[Case, ...]
    null: tuple[Fitted, ...]
    innovations: tuple[np.ndarray, ...]
    alone: tuple[Suspect, ...]
    linearisation: Linearisation
    gain: float
    instead: UnnamedDisturbance | None = None
    beside: UnnamedDisturbance | None = None
    shown: tuple[Mismatch, ...] = ()
    suspects: tuple[Suspect, ...] | None = None
    places: tuple[Mismatch, ...] = ()
    around_belief: Linearisation | None = None
    others: tuple[Linearisation, ...] = ()

    @property
    def gain_of_form(self) -> float:
        """`gain` as if such sizes were expected, to be held against what has no name."""
        return self.gain + self.linearisation.lost_to_size

    @property
    def statistics(self) -> dict[str, float | str]:
        """The numbers of the search."""
        found: dict[str, float | str] = {
            "largest_log_bayes_factor": self.gain,
            "largest_effect": self.linearisation.name(),
            "cost_of_an_effect": self.linearisation.space.cost,
        }
        if self.instead is not None and self.instead.mismatch is not None:
            found["unnamed_channel"] = self.instead.mismatch.channel
            found["unnamed_below_names"] = self.linearisation.log_posterior_of_names - self.instead.gain
        if self.suspects is not None:
            found["smallest_probability"] = min((one.probability for one in self.suspects), default=1.0)
        return found
