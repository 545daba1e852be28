"""Effects of the vocabulary as columns: what each drives in this recording, and how large it usually is.

The physics, units, sizes and further parameters are those of `ins_eval.effects`; here each effect becomes a column of
the regression, once for each axis and each value of its further parameters that is worth a try.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from ins_eval.effects import composed, lag
from ins_eval.effects.description import FAMILY
from ins_eval.effects.effect import AXES, Effect
from ins_eval.effects.parts import SENSORS, TEMPERATURE_COLUMN, EffectPart, conditions, parts, possible
from ins_eval.effects.slow import slow_factor
from ins_eval.effects.start import ROTATIONS
from ins_eval.effects.vocabulary import VOCABULARY
from ins_eval.error_model.columns import Column, Drive, Elapsed, Measured, Missing, SlowFactor
from ins_eval.error_model.drives import source
from ins_eval.error_model.observations import CHANNELS, stands_in_arcs
from ins_eval.error_model.propagation import STATES, ErrorModel
from ins_eval.recording.consistency.clocks import WIDEST_S
from ins_eval.recording.mending import MAGNETIC
from ins_eval.units import DEG, PPM

if TYPE_CHECKING:
    from ins_eval.effects.slow import Conditions
    from ins_eval.effects.temperature import SmoothedTemperature
    from ins_eval.error_model.null import Believed

Parameters = Mapping[str, float | str]
# arguments of the shapes that are tried of a recorded column: s, and of a branch in ranges of the column
COMPOSED = {
    "change": (None,),
    "square": (None,),
    "rate": (180.0,),
    "lag": (150.0, 600.0, 2400.0, 9600.0),
    "branch": (0.03, 0.1, 0.3),
}
UNNAMED = {"change": ("gyro scale",)}  # laws of the temperature that an instrument has and the vocabulary does not
# of what is felt, on any axis: consumer MEMS are sold with 1 to 3 % uncalibrated, and nothing that is sold has 10 %
COARSEST_PPM = 1e4
# nor do zero offsets of consumer MEMS exceed 0.25 g and 20 deg/s (data sheets of ADXL345 and MPU-6050); nor are
# they more crooked than 2 % of a full scale of 2 g: 10 mg/g^2, and 20 mg/g^3 about the best straight line, by reasoning
LARGEST_OF = {"ppm": 1e5, "urad": 1e5, "ug/g^2": 2e4, "ug/g^3": 2e4, "ug": 2.5e5, "deg/h": 7.2e4}
HARDLY = 0.01  # of a sum of squares, a tenth in size: by reasoning
CLOCKS = ("time_offset", "clock_step")
LARGEST = 400.0  # usual sizes that no instrument of its grade exceeds: consumer sheets over those of navigation grade
PROPORTIONAL = ("ppm", "urad")
SHORT = 5.0  # times of the filter: in less, its rate is hardly another thing than the temperature


@dataclass(frozen=True)
class Candidate:
    """One column with what it stands for; its coefficient times `nominal` is the value in `unit`."""

    name: str
    axis: str | None
    unit: str
    nominal: float
    column: Column
    parameters: dict[str, float | str] = field(default_factory=dict)
    centre: float = 0.0  # other than 0: what physics fixes the coefficient to, in nominal sizes
    repeats: bool = False  # a simpler error would show alike in this recording

    @property
    def largest(self) -> float:
        """The coefficient that no such sensor exceeds, inf where there is none; beyond it something else is wrong."""
        effect = VOCABULARY[self.name]
        if effect.name.endswith(CLOCKS):
            return WIDEST_S / self.nominal
        if effect.enters not in SENSORS:
            return np.inf
        of_grade = np.inf if effect.multipliers == ("1",) else LARGEST  # an offset has any size where nobody stated it
        return min(of_grade, LARGEST_OF.get(effect.unit, np.inf) / self.nominal)

    @property
    def key(self) -> tuple[str, str | None, str | None]:
        """The family: what differs in a time, a width, a lag or an argument only has the same."""
        other = self.parameters.get("other_axis")
        if self.name == composed.NAME:
            other = str(self.parameters["form"]).partition(" = ")[0] + f" by {self.parameters['driver']}"
        return self.name, self.axis, other

    @property
    def channel(self) -> str:
        """The channel in which it lives."""
        return channel_of(self.name, self.axis, self.parameters)

    @property
    def local(self) -> bool:
        """Whether it belongs to one recording only."""
        return VOCABULARY[self.name].local

    @property
    def lawful(self) -> bool:
        """Whether it is an error of a sensor that changes by a law, other than with what is measured."""
        effect = VOCABULARY[self.name]
        return effect.enters in (*SENSORS, "any") and effect.slow != "1"


def channel_of(name: str, axis: str | None, parameters: Parameters) -> str:
    """The channel in which an effect of this name lives."""
    sensor = name.partition(".")[0]
    if name == composed.NAME:
        return f"{str(parameters['form']).partition(' ')[0]}.{axis}"
    if sensor in SENSORS:
        return f"{sensor}.{axis}"
    if sensor == "recording":
        return "clock" if "clock" in name else sensor
    if sensor in ("alignment", "earth"):
        return "navigation"
    if sensor == "reference":
        return "reference.attitude"
    return {"gps.lever_arm": "gps.position", lag.NAME: "temperature"}.get(name, "gps.velocity")


def candidates(
    believed: Believed, model: ErrorModel, seen: SmoothedTemperature | None, slow: SlowFactor
) -> list[Candidate]:
    """Every effect that this recording could show."""
    given = conditions(believed.recording, believed.folder, seen)
    return [
        _member(believed, model, slow, given, effect, axis, one)
        for effect in VOCABULARY.values()
        if possible(effect, given) or _elsewhere(effect, believed)
        for axis in effect.axes
        for one in tried(effect, axis, given)
    ]


def member(
    believed: Believed,
    model: ErrorModel,
    seen: SmoothedTemperature | None,
    slow: SlowFactor,
    name: str,
    axis: str | None,
    parameters: Parameters,
) -> Candidate:
    """One effect with further parameters of any value: `time_constant_s`, `branch_width_c`, `at_s`, `lag_s`.

    And with what says which effect it is: `other_axis`, or `driver` and `form`. `slow` is added to.
    """
    given = conditions(believed.recording, believed.folder, seen)
    return _member(believed, model, slow, given, VOCABULARY[name], axis, parameters)


def composed_candidates(
    believed: Believed, model: ErrorModel, seen: SmoothedTemperature | None, slow: SlowFactor
) -> list[Candidate]:
    """What could be composed of the columns that were recorded: every target, axis and shape of each further one.

    Of the temperature what has no name (`UNNAMED`).
    """
    given = conditions(believed.recording, believed.folder, seen)
    found = []
    for driver, values in given.columns.items():
        spread = float(np.ptp(values))
        if not spread > 0.0:
            continue
        for shape, arguments in COMPOSED.items():
            scale = spread if shape == "branch" else 1.0
            targets = UNNAMED.get(shape, ()) if driver == TEMPERATURE_COLUMN else composed.TARGETS
            for argument in arguments:
                for target in targets:
                    form = composed.form(target, shape, driver, None if argument is None else scale * argument)
                    which = {"driver": driver, "form": form}
                    found += [
                        _member(believed, model, slow, given, VOCABULARY[composed.NAME], axis, which) for axis in AXES
                    ]
    return found


def tried(effect: Effect, axis: str | None, given: Conditions) -> Iterator[dict[str, float | str]]:
    """The further parameters that are worth a try, each value of each with every other axis."""
    for other in effect.others(axis) if axis in AXES else (None,):
        which = {} if other is None else {"other_axis": other}
        which |= {"frame_found": MAGNETIC} if effect.name == "recording.reference_frame" else {}
        asked = [one for one in effect.parameters if not one.assumed or _short(given)]
        grids = [parameter.grid(given.start_s, given.end_s) for parameter in asked]
        for values in product(*grids):
            yield {**which, **{one.name: float(value) for one, value in zip(asked, values, strict=True)}}


def _short(given: Conditions) -> bool:
    """Whether no stretch lasts for as many times of the filter that defines a rate as make it one."""
    seen = given.temperature
    return seen is not None and all(np.ptp(seen.time_s[rows]) < SHORT * seen.filter_s for rows in seen.runs)


def sized(
    effect: Effect, parameters: Parameters, of_parts: list[EffectPart], time_s: np.ndarray, given: Conditions
) -> tuple[str, float, float]:
    """Unit, nominal size, and the centre of the prior in nominal sizes.

    Of a unit whose stated bias is larger than the usual one, all errors are as many times larger, but none in
    proportion to what is felt is larger than those of the coarsest units.
    """
    if effect.enters == "temperature":
        return effect.unit, lag.SPREAD * float(parameters["lag_s"]), 1.0 / lag.SPREAD
    if effect.name == composed.NAME:
        target, *_ = composed.parse_form(str(parameters["form"]))
        spread = max(float(np.std(of_parts[0].slow(time_s))), 1e-12)
        size = coarseness(target.sensor, target.multiplier != "1", given) * target.size
        return f"{target.unit} per unit of {parameters['driver']}", size / spread, 0.0
    coarse = 1.0
    if effect.enters in SENSORS:
        of_input = effect.multipliers != ("1",) and effect.unit.startswith((*PROPORTIONAL, "ug"))
        coarse = coarseness(effect.enters, of_input, given)
    return effect.unit, coarse * effect.nominal, effect.centre / effect.nominal


def coarseness(sensor: str, of_input: bool, given: Conditions) -> float:
    """How many times larger than usual the errors of a unit with its stated bias are, or in proportion to its input."""
    coarse = max(1.0, given.bias_sigma[sensor] / VOCABULARY[f"{sensor}.bias"].nominal)
    return min(coarse, COARSEST_PPM / VOCABULARY[f"{sensor}.scale"].nominal) if of_input else coarse


def _member(
    believed: Believed,
    model: ErrorModel,
    slow: SlowFactor,
    given: Conditions,
    effect: Effect,
    axis: str | None,
    parameters: Parameters,
) -> Candidate:
    of_parts: list[EffectPart] = []
    if effect.enters in (*SENSORS, "temperature", "any"):
        of_parts = parts(effect, axis, parameters, given)
    unit, nominal, centre = sized(effect, parameters, of_parts, model.nodes_s, given)
    if of_parts:
        names = [_slow(part, effect, parameters, slow, model) for part in of_parts]
        drives = [
            Drive(part.sensor, AXES.index(part.axis), part.multiplier, nominal * part.weight, name)
            for part, name in zip(of_parts, names, strict=True)
        ]
        column = Column("", tuple(drives))
    elif effect.enters == FAMILY:
        column = _of_description(effect, nominal, parameters, (model, slow, given))
    else:
        column = _not_of_a_sensor(effect, axis, nominal * effect.si)
    repeats = _repeats(effect, of_parts, parameters, believed, model)
    return Candidate(effect.name, axis, unit, nominal, column, dict(parameters), centre, repeats)


def _repeats(
    effect: Effect, of_parts: list[EffectPart], parameters: Parameters, believed: Believed, model: ErrorModel
) -> bool:
    """Whether a simpler error would show alike in this recording.

    An offset, of what follows an input that never changes; a scale factor, of what follows the magnitude of an input
    that keeps its sign; an error from the start on, of a jump before which hardly anything was there that it acts on:
    a clock acts on what moves, a scale factor on what is measured.
    """

    def of(part: EffectPart, multiplier: str) -> int:
        return source(part.sensor, AXES.index(part.axis), multiplier)

    multipliers = {part.multiplier for part in of_parts}
    if multipliers and "1" not in multipliers and len(believed.stands) == 1:
        return True
    if multipliers and multipliers <= {"|f|", "|w|"}:
        pairs = [[model.integrals[:, of(part, one)] for one in (part.multiplier, part.multiplier.strip("|"))]
                 for part in of_parts]  # fmt: skip
        return all(min(np.square(a - b).sum(), np.square(a + b).sum()) < HARDLY * np.square(a).sum() for a, b in pairs)
    if "at_s" not in parameters:
        return False
    if effect.enters == FAMILY:
        acts = np.square(model.states.velocity_n[1:]).sum(axis=1)
    else:
        acts = model.driven[:, [of(part, part.multiplier) for part in of_parts]].sum(axis=1)
    before = np.searchsorted(model.nodes_s[1:], float(parameters["at_s"]), side="right")
    return float(acts[:before].sum()) < HARDLY * float(acts.sum())


def _slow(part: EffectPart, effect: Effect, parameters: Parameters, slow: SlowFactor, model: ErrorModel) -> str:
    """The name of a part's slow factor; an epoch across a step counts by the part that is behind it."""
    if effect.slow == "step":
        return slow.add_window(float(parameters["at_s"]), float(model.nodes_s[-1]) + 1.0, model)
    return "1" if part.key == "1" else slow.add(part.key, part.slow, model)


def _not_of_a_sensor(effect: Effect, axis: str | None, size: float) -> Column:
    what = effect.name.partition(".")[2]
    if effect.enters == "start":
        start = np.zeros(STATES)
        start[6 + ROTATIONS[effect.name, axis]] = size
        return Column("", start=tuple(start))
    if effect.enters == "earth":
        return Column("", (Missing(what, size),))
    response = {"lever_arm": f"arm_{axis}", "misalignment": f"mount_{axis}", "time_offset": "delay"}[what]
    return Column("", (Measured(response, size),))


def _of_description(
    effect: Effect, size: float, parameters: Parameters, of: tuple[ErrorModel, SlowFactor, Conditions]
) -> Column:
    """A clock of the IMU that is late or fast is a delay of the stamps of the fixes, the other way; see `mending`."""
    model, slow, given = of
    what = effect.name.partition(".")[2]
    if what == "clock_step":
        name = slow.add_window(float(parameters["at_s"]), float(model.nodes_s[-1]) + 1.0, model)
        return Column("", (Measured("delay", -size, name),))
    if what == "clock_drift":
        since = slow.add("t", slow_factor("t", given, 0, {}), model)
        return Column("", (Measured("delay", -PPM * size, since), Elapsed(PPM * size)))
    return Column("", (Measured(f"channel_{CHANNELS - 1}", DEG * size),))


def _elsewhere(effect: Effect, believed: Believed) -> bool:
    """Whether a recording could show an effect that is not of a sensor; of the Earth, where its flag is false."""
    recording = believed.recording
    gps, reference = (None, None) if stands_in_arcs(believed) else (recording.gps, recording.reference)
    if effect.name.startswith("recording.clock"):
        return gps is not None or reference is not None
    if effect.enters == FAMILY:  # the others are tried on the recording itself, see `consistency`
        return (
            effect.name == "recording.reference_frame" and reference is not None and reference.attitude_rad is not None
        )
    if effect.enters == "earth":
        return not getattr(recording.belief.earth, effect.name.partition(".")[2])
    if effect.name == "reference.misalignment":
        return reference is not None and reference.attitude_rad is not None
    if effect.name == "gps.time_offset":  # stamps of the source that has the last word
        return gps is not None and reference is None
    if effect.enters in ("gps", "reference"):
        return {"gps": gps, "reference": reference}[effect.enters] is not None
    return effect.enters == "start"
