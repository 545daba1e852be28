"""A stranger's model at work: whatever goes wrong in it is said to be its own, in one sentence."""

from __future__ import annotations

import numpy as np

from ins_eval.compensation import CompensationModel, Samples
from ins_eval.compensation.registry import describe_error, is_users, load_model
from ins_eval.errors import InsEvalError, UsageError
from ins_eval.recording import ChamberReadings


class Guarded:
    """A user's model whose failures become UsageErrors that name the model and what it was working on."""

    def __init__(self, model: CompensationModel, spec: str, on: str):
        self.model, self.spec, self.on = model, spec, on
        self.name = model.name

    def fit(self, chamber: ChamberReadings) -> Guarded:
        """Fit the model."""
        self._called("fit", chamber)
        return self

    def refine(self, runs) -> Guarded:
        """Refine the model, where it takes a refinement."""
        if hasattr(self.model, "refine"):
            self._called("refine", runs)
        return self

    def specific_force(self, samples: Samples) -> np.ndarray:
        """Specific force along the input axis, (n,) m/s^2, of the right shape and finite."""
        force = np.asarray(self._called("specific_force", samples))
        if force.shape != samples.output.shape:
            raise UsageError(
                f"{self._where('specific_force')} gave shape {force.shape} for samples of shape "
                f"{samples.output.shape}; return one value for each sample"
            )
        if not np.isfinite(force).all():
            raise UsageError(
                f"{self._where('specific_force')} gave values that are not finite, the first at sample "
                f"{int(np.flatnonzero(~np.isfinite(force))[0])}; return numbers only"
            )
        return force

    def _called(self, method: str, argument):
        try:
            return getattr(self.model, method)(argument)
        except InsEvalError:
            raise
        except Exception as error:
            raise UsageError(f"{self._where(method)} {describe_error(error)}; mend the model") from error

    def _where(self, method: str) -> str:
        return f"compensation model '{self.spec}': on {self.on}, {method}"


def working_model(spec: str, on: str) -> CompensationModel:
    """A new model of `spec`; a user's own is guarded, and `on` says what it will be fitted to."""
    model = load_model(spec)
    return Guarded(model, spec, on) if is_users(spec) else model
