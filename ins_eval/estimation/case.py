"""One recording made ready to be judged: residual, error model, what is uncertain anyway, and the noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ins_eval.effects.temperature import SmoothedTemperature, temperature
from ins_eval.error_model import null
from ins_eval.error_model.columns import Assembled, Column, Drive, Measured, SlowFactor, assemble, observed_of
from ins_eval.error_model.geometry import apart
from ins_eval.error_model.library import Candidate, Parameters, candidates, composed_candidates, member
from ins_eval.error_model.observations import REFERENCE_POSITION_M, Observations
from ins_eval.error_model.thermometer import left_open
from ins_eval.errors import DataRefused
from ins_eval.estimation import arcs, noise
from ins_eval.estimation.blocks import EACH, Blocks, few_blocks, short_blocks
from ins_eval.estimation.coarse import coarse, coarse_noise
from ins_eval.estimation.loudness import loudness
from ins_eval.estimation.missing import filled_in
from ins_eval.estimation.noise_fit import Ready, fit
from ins_eval.estimation.whitening import Known, Whitened, known_at, whiten, with_more
from ins_eval.recording import PARKED
from ins_eval.recording.stuck import unmeasured
from ins_eval.units import DEG_PER_H, UG

if TYPE_CHECKING:
    from ins_eval.error_model.null import Believed
    from ins_eval.error_model.propagation import ErrorModel
    from ins_eval.estimation.evidence import Gain
    from ins_eval.estimation.noise import NoiseModel
    from ins_eval.estimation.noise_fit import Fitted
    from ins_eval.initialization import Initialization
    from ins_eval.recording import Recording
    from ins_eval.recording.belief import Belief, EffectBelief

LEAST_VELOCITY_SIGMA_MPS = 1e-3  # of a start that is said to be exact
LEAST_POSITION_SIGMA_M = 0.01
MOUNTING_SIGMA_RAD = 5e-5  # two boxes said to be parallel
LAG_S = 0.05  # of positions against velocities of one receiver: real ones of two autopilots are 15 and 90 ms younger
SMOOTHING = 0.5  # share of what a receiver that means over three seconds leaves out, 2 / 3: by reasoning
LAG = "positions of GPS older than its velocities"
SMOOTHED = {
    what: tuple(f"{what} of GPS smoothed {over}" for over in ("over 1 s", "over 3 s", "to one side"))
    for what in ("velocities", "positions")
}
REFERENCE_ARM_M = 0.3  # between the points at which two boxes navigate, beyond what is stated


class Again(Protocol):
    def __call__(self, effects: Sequence[EffectBelief], near: Case | None = None, /) -> Case:
        """The same recording with these effects believed as well; its arcs begin at the states of `near`, if given."""


@dataclass(frozen=True, eq=False)
class Case:
    """What the evaluation of any hypothesis in one recording needs."""

    name: str
    kind: str
    believed: Believed | None  # None where nothing moves: a chamber
    model: ErrorModel
    seen: Observations
    inertial: Callable[[], np.ndarray]  # (nodes, 9) by which the belief as it stands misses; only answers ask for it
    temperature: SmoothedTemperature | None
    slow: SlowFactor
    nuisances: tuple[Column, ...]
    taken: np.ndarray  # coefficients of the nuisances that were taken off before it was navigated
    candidates: tuple[Candidate, ...]
    noise: NoiseModel
    outliers: int
    epochs_s: np.ndarray  # between nodes, for what forgets
    member: Callable[[str, str | None, Parameters], Candidate]  # any one effect, with further parameters of any value
    again: Again
    settled: arcs.Settled | None = None  # how it is navigated in arcs, without its increments
    unmeasured: Callable[[], dict[str, float]] = dict  # shares in which sensors do not measure; only answers ask
    _known: dict[tuple, Known] = field(default_factory=dict, init=False, repr=False)  # of the last noise
    _anyway: dict[Blocks, Assembled] = field(default_factory=dict, init=False, repr=False)  # nuisances on blocks

    @cached_property
    def _observed(self) -> np.ndarray:
        return observed_of(self.model, self.seen)

    def assembled(self, columns: Sequence[Column] = ()) -> Assembled:
        """Nuisances first, then `columns`."""
        taken = tuple(zip(self.nuisances, self.taken, strict=True))
        columns = [*self.nuisances, *columns]
        assembled = assemble(self.model, self.seen, self.slow, columns, taken, self._observed)
        return replace(assembled, interval_s=self.epochs_s)

    def on_blocks(self, columns: Sequence[Column], blocks: Blocks) -> Assembled:
        """The same on `blocks`; the nuisances are averaged once."""
        if blocks.nodes == 1:
            return self.assembled(columns)
        if blocks not in self._anyway:
            self._anyway[blocks] = coarse(self.assembled(), blocks)
        if not columns:
            return self._anyway[blocks]
        return coarse(self.assembled(columns), blocks, self._anyway[blocks])

    def whitened(
        self,
        columns: Sequence[Column],
        noise_point: np.ndarray,
        blocks: Blocks = EACH,
        keep: int = 1,
        lasting: int = 0,
    ) -> Whitened:
        """One pass with noise at `noise_point`, on `blocks`.

        Of the first `lasting` columns what is whitened is kept until another noise, or other lasting ones, are asked
        about.
        """
        levels = coarse_noise(self.noise, blocks, self.seen.residual).levels(noise_point)
        at, first = (blocks, noise_point.tobytes()), tuple(columns[:lasting])
        if (*at, first) not in self._known:
            bare = self._known.get((*at, ())) or known_at(self.on_blocks((), blocks), levels)
            self._known.clear()
            self._known[*at, ()] = bare
            self._known[*at, first] = with_more(bare, self.on_blocks(first, blocks), levels) if lasting else bare
        return whiten(self.on_blocks(columns, blocks), levels, keep, self._known[*at, first])

    def fitted(
        self,
        columns: Sequence[Column] = (),
        start: Fitted | None = None,
        gain: Gain | None = None,
        hills: bool = False,
        close: bool = False,
    ) -> Fitted:
        """Noise fitted with nuisances and `columns`, of which `gain` tells what they gain; else as nuisances."""
        return fit(self.ready(columns), len(self.nuisances), gain, start, hills, close)

    def ready(self, columns: Sequence[Column]) -> Ready:
        """The pass on `blocks` as a function of the noise point: what it shares is done once."""
        blocks = self.blocks
        return Ready(self.on_blocks(columns, blocks), coarse_noise(self.noise, blocks, self.seen.residual))

    @property
    def blocks(self) -> Blocks:
        """What is taken together where nothing fast is asked about."""
        if self.believed is None or self.kind in PARKED:
            return EACH
        if self.believed.arcs:
            return few_blocks(self.model.nodes_s.size)
        walk = self.noise.priors["velocity_random_walk"].centre
        return short_blocks(self.model.interval_s, float(np.median(self.noise.white[:, :3])), walk)


def prepare(recording: Recording, folder: str | Path = ".", planned: bool = False) -> Case:
    """Navigate what is believed and set everything up around it.

    Where its errors would not stay small it is navigated in arcs (`arcs`); not so where it is `planned` and free of
    errors. A parked unit is: in hours its solution is kilometres off, while the standstill is known to a millimetre.
    """
    if recording.kind in PARKED:
        return _in_arcs(recording, folder, (arcs.planned if planned else _settled)(recording, folder))
    duration_s = float(recording.imu.time_s[-1]) - recording.start.time_s
    if not planned and not null.stays_small(recording.belief, 0.0, duration_s):  # however well its attitude is known
        return _in_arcs(recording, folder, _settled(recording, folder))
    believed = null.believe(recording, folder)
    if not planned and not (believed.time_s.size and _stays_small(believed)):  # arcs need no stretch to align on
        return _in_arcs(recording, folder, _settled(recording, folder, believed.found))
    try:
        case = _around(recording, believed, nuisances(believed), folder)
    except arcs.Diverged:  # farther than lost: a belief that leaves the Earth out does in hours
        case = None
    if case is None or arcs.lost(case.seen):
        return _in_arcs(recording, folder, _settled(recording, folder, believed.found))
    return case


def _stays_small(believed: Believed) -> bool:
    duration_s = float(believed.time_s[-1]) - believed.start.time_s
    return null.stays_small(believed.recording.belief, float(np.max(believed.attitude_sigma_n)), duration_s)


def _settled(recording: Recording, folder: str | Path, shown: Initialization | None = None) -> arcs.Settled:
    try:
        return arcs.settle(recording, folder, shown=shown)
    except arcs.Diverged as error:
        raise DataRefused(
            f"{error}, expected a path that comes near what was measured; look at units, axes and times, and at what "
            "is believed of the sensors"
        ) from None


def _in_arcs(recording: Recording, folder: str | Path, settled: arcs.Settled) -> Case:
    """The case around arcs; start and biases are put back linearly."""
    navigated = settled.navigated
    uncertain = nuisances(navigated)
    case = _around(recording, navigated, uncertain, folder)
    (of_start,) = apart([settled.stated], case.model.states, [0])
    taken = np.zeros(len(uncertain))
    for k, column in enumerate(uncertain):
        if column.start:
            taken[k] = of_start @ column.start / np.square(column.start).sum()
        for term in column.terms:
            if isinstance(term, Drive):
                biases = navigated.gyro_bias if term.sensor == "gyro" else navigated.force_bias
                taken[k] = biases[term.axis] / term.weight
    taken = np.append(taken, np.zeros(len(case.nuisances) - taken.size))

    light = replace(settled, navigated=case.believed)  # what a later case begins from

    def again(effects: Sequence[EffectBelief], near: Case | None = None) -> Case:
        believing = replace(recording, belief=with_effects(recording.belief, effects))
        return _in_arcs(believing, folder, arcs.settle(believing, folder, (near and near.settled) or light))

    def inertial() -> np.ndarray:
        begun = null.begun_at(recording, light.stated, folder)
        return arcs.inertial(replace(begun, start=light.stated), case.model.nodes_s)

    return replace(case, inertial=inertial, taken=taken, again=again, settled=light)


def _around(recording: Recording, navigated: Believed, uncertain: Sequence[Column], folder: str | Path) -> Case:
    """A case around the solution of what is `navigated` of a recording; it keeps no increments, which are large."""
    model, seen = arcs.observed(navigated)
    model = replace(model, loudness=loudness(navigated, model.nodes_s))
    seen, outliers = noise.without_outliers(seen)
    slow = SlowFactor()
    agitation, filled = noise.agitation(navigated, model.nodes_s), filled_in(navigated, model.nodes_s)
    open_temperature = left_open(navigated, model, slow)
    uncertain = [*uncertain, *places(navigated, model, slow), *open_temperature.columns]
    navigated = navigated.without_increments(recording)
    given = temperature(navigated.recording)
    return Case(
        name=recording.name,
        kind=recording.kind,
        believed=navigated,
        model=model,
        seen=seen,
        inertial=lambda: seen.residual,
        temperature=given,
        slow=slow,
        nuisances=tuple(uncertain),
        taken=np.zeros(len(uncertain)),
        candidates=(*candidates(navigated, model, given, slow), *composed_candidates(navigated, model, given, slow)),
        noise=noise.noise_model(navigated.recording.belief, model, seen, open_temperature.density, agitation, filled),
        outliers=outliers,
        epochs_s=model.interval_s,
        unmeasured=cache(partial(unmeasured, recording)),
        member=partial(member, navigated, model, given, slow),
        again=lambda effects, _near=None: prepare(
            replace(recording, belief=with_effects(recording.belief, effects)), folder
        ),
    )


def with_effects(belief: Belief, effects: Sequence[EffectBelief]) -> Belief:
    """A belief in further effects."""
    return belief.model_copy(update={"effects": (*belief.effects, *effects)})


def without_roots(belief: Belief) -> Belief:
    """A belief whose effects are exact: what is found beside them says how far they are not."""
    exact = tuple(one.model_copy(update={"root": None}) for one in belief.effects)
    return belief.model_copy(update={"effects": exact})


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
    fixes = believed.recording.gps
    if fixes is not None and null.is_coarse(belief) and np.isfinite(fixes.velocity_n).any():
        out.append(Column(LAG, (Measured("lag", LAG_S),)))
    if fixes is not None and believed.recording.kind not in PARKED:
        measured = {"velocities": fixes.velocity_n, "positions": fixes.latitude_rad}
        for k, (what, name) in enumerate((what, name) for what, names in SMOOTHED.items() for name in names):
            if np.isfinite(measured[what]).any():
                out.append(Column(name, (Measured(f"smoothing_{k}", SMOOTHING),)))
    reference = believed.recording.reference
    if reference is not None:
        for k, axis in enumerate("NED"):  # of its datum, and of where in its box it navigates
            size = belief.reference.position_sigma_m or REFERENCE_POSITION_M
            out.append(Column(f"position offset of the reference {axis}", (Measured(f"channel_{k}", size),)))
        for axis in "xyz":
            out.append(Column(f"lever arm of the reference {axis}", (Measured(f"arm_{axis}", REFERENCE_ARM_M),)))
    if reference is not None and reference.attitude_rad is not None:
        for axis in "xyz":
            term = Measured(f"mount_{axis}", MOUNTING_SIGMA_RAD)
            out.append(Column(f"mounting of the reference about {axis}", (term,)))
    return out


def places(navigated: Believed, model: ErrorModel, slow: SlowFactor) -> list[Column]:
    """Where and how a unit in arcs stands each time, which nobody measured; each column carries one sigma."""
    out = []
    for count, stand in enumerate(navigated.stands if navigated.arcs else (), start=1):
        window = slow.add_window(stand.start_s - 0.5, stand.end_s + 0.5, model)
        for k, sigma in enumerate(arcs.PLACE_SIGMAS.tolist()):
            what, channel = ("position", k) if k < 3 else ("attitude", k + 3)
            term = Measured(f"channel_{channel}", sigma, window)
            out.append(Column(f"{what} of stand {count} {'NED'[k % 3]}", (term,)))
    return out
