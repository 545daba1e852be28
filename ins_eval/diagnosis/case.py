"""One recording made ready to be judged: residual, error model, what is uncertain anyway, and the noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from ins_eval.diagnosis import error_model, noise, null, observations
from ins_eval.diagnosis.coarse import block_of, coarse, coarse_noise
from ins_eval.diagnosis.columns import Assembled, Column, Drive, Measured, Slow, assemble
from ins_eval.diagnosis.error_model import ErrorModel
from ins_eval.diagnosis.evidence import log_evidence
from ins_eval.diagnosis.library import Candidate, Parameters, candidates, composed_candidates, member
from ins_eval.diagnosis.noise import Fitted, NoiseModel
from ins_eval.diagnosis.null import Believed
from ins_eval.diagnosis.observations import REFERENCE_POSITION_M, Observations
from ins_eval.diagnosis.thermometer import step_noise
from ins_eval.diagnosis.whitening import Whitened, whiten
from ins_eval.effects.temperature import Temperature, temperature
from ins_eval.recording import Recording
from ins_eval.recording.belief import Belief, EffectBelief
from ins_eval.units import DEG_PER_H, UG

LEAST_VELOCITY_SIGMA_MPS = 1e-3  # of a start that is said to be exact
LEAST_POSITION_SIGMA_M = 0.01
MOUNTING_SIGMA_RAD = 5e-5  # two boxes said to be parallel


@dataclass(frozen=True, eq=False)
class Case:
    """All that is known before a hypothesis is asked about."""

    name: str
    kind: str
    believed: Believed | None  # None where nothing moves: a chamber
    model: ErrorModel
    seen: Observations
    temperature: Temperature | None
    slow: Slow
    nuisances: tuple[Column, ...]
    candidates: tuple[Candidate, ...]
    noise: NoiseModel
    outliers: int
    epochs_s: np.ndarray  # between nodes, for what forgets
    member: Callable[[str, str | None, Parameters], Candidate]  # any one effect, with further parameters of any value
    again: Callable[[Sequence[EffectBelief]], Case]  # the same recording with these effects believed as well

    def assembled(self, columns: Sequence[Column] = ()) -> Assembled:
        """Nuisances first, then `columns`."""
        assembled = assemble(self.model, self.seen, self.slow, [*self.nuisances, *columns])
        return replace(assembled, interval_s=self.epochs_s)

    def whitened(self, columns: Sequence[Column], position: np.ndarray, block: int = 1, keep: int = 1) -> Whitened:
        """One pass with noise at `position`, on means over `block` nodes."""
        assembled = coarse(self.assembled(columns), block)
        return whiten(assembled, coarse_noise(self.noise.levels(position), block), keep)

    def fitted(
        self,
        columns: Sequence[Column] = (),
        start: np.ndarray | None = None,
        gain: Callable[[Whitened], float] = log_evidence,
    ) -> Fitted:
        """Noise fitted with nuisances and `columns`, at the maximum of `gain` of the sums."""
        return noise.fit(self.ready(columns), len(self.noise.free), start, gain)

    def ready(self, columns: Sequence[Column]) -> Callable[[np.ndarray], Whitened]:
        """The pass on means over `block` nodes as a function of the noise's position: what it shares is done once."""
        block = self.block
        assembled = coarse(self.assembled(columns), block)

        def at(position: np.ndarray) -> Whitened:
            return whiten(assembled, coarse_noise(self.noise.levels(position), block))

        return at

    @property
    def block(self) -> int:
        """Nodes that are averaged where nothing fast is asked about."""
        return 1 if self.believed is None else block_of(self.model.interval_s)


def prepare(recording: Recording, folder: str | Path = ".") -> Case:
    """Navigate what is believed and set everything up around it."""
    believed = null.believe(recording, folder)
    solution = null.solve(believed)
    end_s = float(solution.time_s[-1])
    measured = observations.sources(believed, end_s)
    model = error_model.build(believed, solution, observations.nodes(believed, measured, end_s))
    seen, outliers = noise.without_outliers(observations.observe(believed, model, measured))
    told = temperature(believed.recording)
    slow = Slow()
    return Case(
        name=recording.name,
        kind=recording.kind,
        believed=believed,
        model=model,
        seen=seen,
        temperature=told,
        slow=slow,
        nuisances=tuple(nuisances(believed)),
        candidates=(*candidates(believed, model, told, slow), *composed_candidates(believed, model, told, slow)),
        noise=noise.noise_model(recording.belief, model, seen, step_noise(believed, told, model.middle_s)),
        outliers=outliers,
        epochs_s=model.interval_s,
        member=partial(member, believed, model, told, slow),
        again=lambda effects: prepare(replace(recording, belief=with_effects(recording.belief, effects)), folder),
    )


def with_effects(belief: Belief, effects: Sequence[EffectBelief]) -> Belief:
    """A belief in further effects."""
    return belief.model_copy(update={"effects": (*belief.effects, *effects)})


def nuisances(believed: Believed) -> list[Column]:
    """What is uncertain whatever the answer, each column carrying one sigma of the belief."""
    belief, start = believed.recording.belief, believed.start
    out = []
    for axis, name in enumerate("xyz"):
        force = UG * belief.accelerometer.bias_sigma_ug
        rate = DEG_PER_H * belief.gyro.bias_sigma_deg_per_h
        out.append(Column(f"turn-on bias of accelerometer {name}", (Drive("accelerometer", axis, "1", force),)))
        out.append(Column(f"turn-on bias of gyro {name}", (Drive("gyro", axis, "1", rate),)))
    position = max(start.position_sigma_m, LEAST_POSITION_SIGMA_M)
    velocity = max(start.velocity_sigma_mps, LEAST_VELOCITY_SIGMA_MPS)
    sigmas = np.concatenate([[position] * 3, [velocity] * 3, believed.attitude_sigma_n])
    for k, (sigma, what) in enumerate(
        zip(sigmas, (f"{q} {d}" for q in ("position", "velocity", "attitude") for d in "NED"), strict=True)
    ):
        begin = np.zeros(9)
        begin[k] = sigma
        out.append(Column(f"start {what}", start=tuple(begin)))
    reference = believed.recording.reference
    if reference is not None:
        for k, axis in enumerate("NED"):  # of its datum, and of where in its box it navigates
            size = belief.reference.position_sigma_m or REFERENCE_POSITION_M
            out.append(Column(f"position offset of the reference {axis}", (Measured(f"channel_{k}", size),)))
    if reference is not None and reference.attitude_rad is not None:
        for axis in "xyz":
            term = Measured(f"mount_{axis}", MOUNTING_SIGMA_RAD)
            out.append(Column(f"mounting of the reference about {axis}", (term,)))
    return out
