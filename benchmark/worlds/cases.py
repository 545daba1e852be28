"""What the cases of each kind hold: drawn by a fixed rule from a seed."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field

import numpy as np

from benchmark.worlds import noise
from benchmark.worlds.description import misdescribe
from benchmark.worlds.effects import DESCRIPTION, VOCABULARY, Effect, an_effect
from benchmark.worlds.elsewhere import ELSEWHERE
from benchmark.worlds.instruments import Departures, believe
from benchmark.worlds.outside import FORMS, a_window, an_outside
from benchmark.worlds.record import Made, Unit, feel, measure
from benchmark.worlds.room import a_chamber
from benchmark.worlds.trajectories import TRAJECTORIES

SETS = {"development": 11, "sealed": 97, "quick": 53}  # the last is as the sealed one, of shorter flights
RATES = (20.0, 25.0, 40.0, 50.0, 100.0)
ALWAYS = ("vibration_rms_g", "supply_v", "static_pressure_hpa", "fan_speed_hz")

# what was added later is concealed only where it is asked for, so that the cases of a seed stay what they were
LATER = ("accelerometer.scale_step", "accelerometer.asymmetry", "gyro.scale_step", "gyro.asymmetry")
DRAWN = tuple(name for name in VOCABULARY if name not in LATER)


@dataclass
class Case:
    """A case: its recordings and its truth."""

    name: str
    kind: str
    made: list[Made]
    truth: dict = field(default_factory=dict)
    hidden: list = field(default_factory=list)  # the effects themselves

    @property
    def unit(self):
        return self.made[0].unit


def generator(which: str, seed: int, kind: str, index: int) -> np.random.Generator:
    word = int.from_bytes(hashlib.sha256(kind.encode()).digest()[:4], "little")
    return np.random.default_rng(np.random.SeedSequence([SETS[which], seed, word, index]))


def title(which: str, seed: int, kind: str, index: int) -> str:
    """A name that says nothing of the case."""
    return "case-" + hashlib.sha256(f"{which}/{seed}/{kind}/{index}".encode()).hexdigest()[:8]


def a_unit(rng, form: str, pulses: bool = False) -> Unit:
    """An instrument; `form` is zero, plain or adversarial. A few give increments, unless it must be `pulses`."""
    pulses = bool(rng.random() < 0.92) or pulses
    sheet, true = noise.draw(rng, form)
    lever = np.round(rng.uniform(-2.0, 2.0, 3), 2).tolist() if rng.random() < 0.6 else [0.0, 0.0, 0.0]
    offset = float(np.round(rng.uniform(-0.2, 0.2), 3)) if rng.random() < 0.3 else 0.0
    belief = believe(rng, sheet, plain_model=rng.random() < 0.3)
    return Unit(belief, sheet, true, lever, offset, pulses, bool(rng.random() < 0.25))


def a_rate(rng, options) -> float:
    drawn = float(rng.choice((20.0, 20.0, 20.0, 20.0, 20.0, 25.0, 50.0, 100.0)))
    return options.rate or drawn


def a_trajectory(rng, options) -> str:
    """Of a recording; the sets differ in how often they take which."""
    shares = {
        "development": (0.46, 0.12, 0.07, 0.09, 0.10, 0.10, 0.06), "sealed": (0.40, 0.15, 0.10, 0.10, 0.08, 0.10, 0.07),
        "quick": (0.10, 0.25, 0.20, 0.20, 0.08, 0.10, 0.07),
    }  # fmt: skip
    return str(rng.choice(list(TRAJECTORIES), p=shares[options.which]))


def shown_columns(rng) -> tuple[str, ...]:
    """Further sensors are there or not whatever the case hides."""
    return tuple(name for name in ALWAYS if rng.random() < 0.25)


def a_recording(rng, unit, trajectory, rate_hz, effects=(), reference=None, columns=None, name=None) -> Made:
    """A recording in which `effects`, functions of (felt, departures), act."""
    felt = feel(rng, trajectory, rate_hz, unit.apart)
    departures = Departures()
    for effect in effects:
        if isinstance(effect, Effect):
            effect.settle(felt.truth.duration_s)
        effect(felt, departures)
    moving = felt.kind in ("flight", "drive")
    reference = bool(rng.random() < 0.08) if reference is None else reference
    columns = shown_columns(rng) if columns is None else columns
    made = measure(rng, felt, unit, departures, trajectory, name or trajectory, reference and moving, columns)
    for effect in effects:
        if isinstance(effect, Effect) and VOCABULARY[effect.name].target == DESCRIPTION:
            misdescribe(made.tables, effect.name, effect.axis, effect.value, effect.parameters)
    if rng.random() < 0.2:
        made.shift_s = float(rng.integers(10, 80000))
        made.head["start"]["time_s"] = made.shift_s
    return made


def zero(rng, index, options):
    """No noise and no effect, each trajectory at each rate: rounding is all there is; every eighth is a chamber."""
    unit = a_unit(rng, "zero")
    if index % 8 == 7:
        return [a_chamber(rng, unit, str(rng.choice(list("xyz"))))], {}
    position = index - index // 8
    trajectory = list(TRAJECTORIES)[position % len(TRAJECTORIES)]
    rate = options.rate or RATES[position // len(TRAJECTORIES) % len(RATES)]
    return [a_recording(rng, unit, trajectory, rate, reference=position % 3 == 2)], {}


def null(rng, index, options, form="plain"):
    """The belief holds and the sheet is right."""
    unit = a_unit(rng, form)
    if rng.random() < 0.07:
        return [a_chamber(rng, unit, str(rng.choice(list("xyz"))))], {}
    trajectory = a_trajectory(rng, options)
    # a flag that the recording cannot show is no mismatch
    blind = (blind_flag,) if trajectory == "static" and rng.random() < 0.3 else ()
    return [a_recording(rng, unit, trajectory, a_rate(rng, options), blind)], {}


def blind_flag(felt, departures):
    departures.earth = ("coriolis",)


def adversarial(rng, index, options):
    """The belief holds, but noise is other than the sheet says."""
    return null(rng, index, options, "adversarial")


def a_place(rng, name: str, options) -> str:
    """A trajectory on which an effect can be."""
    kinds = VOCABULARY[name].kinds if name in VOCABULARY else FORMS[name][-1]
    while True:
        trajectory = a_trajectory(rng, options)
        if TRAJECTORIES[trajectory][0] in kinds and not (name.startswith("earth.") and trajectory == "oven"):
            return trajectory


def columns_for(rng, names) -> tuple[str, ...]:
    """Further sensors: as always, and the one that an effect of the vocabulary is defined by."""
    shown = set(shown_columns(rng))
    if any(name == "accelerometer.vibration_rectification" for name in names):
        shown.add("vibration_rms_g")
    return tuple(name for name in ALWAYS if name in shown)


def single(rng, index, options, chamber=True):
    """One effect of the vocabulary; each name in its turn."""
    names = [name for name in DRAWN if VOCABULARY[name].target != DESCRIPTION]
    name = names[index % len(names)]
    unit = a_unit(rng, options.form, pulses=name == "temperature.lag")
    row = VOCABULARY[name]
    if chamber and "oven" in row.kinds and name.startswith(("accelerometer", "temperature")) and rng.random() < 0.15:
        effect = an_effect(rng, name, (0.005, 0.5))
        if "at_share" not in effect.parameters and "drift" not in name and name != "accelerometer.bias":
            return [a_chamber(rng, unit, effect.axis or str(rng.choice(list("xyz"))), (effect,))], known([effect])
    trajectory = a_place(rng, name, options)
    effect = an_effect(rng, name, options.spread)
    reference = {"reference": True, "gps": False}.get(name.split(".")[0])  # otherwise drawn, as without an effect
    made = a_recording(rng, unit, trajectory, a_rate(rng, options), (effect,), reference, columns_for(rng, [name]))
    return [made], known([effect], made)


def elsewhere(rng, index, options):
    """One effect on a way that none of the other kinds goes, each way in its turn."""
    trajectory = list(ELSEWHERE)[index % len(ELSEWHERE)]
    kind, apart = ELSEWHERE[trajectory][0], ("reference.", "recording.")
    name = str(rng.choice([one for one in DRAWN if kind in VOCABULARY[one].kinds and not one.startswith(apart)]))
    unit = a_unit(rng, options.form, pulses=name == "temperature.lag")
    effect = an_effect(rng, name, options.spread)
    made = a_recording(rng, unit, trajectory, a_rate(rng, options), (effect,), False, columns_for(rng, [name]))
    return [made], known([effect], made)


def known(effects, made: Made | None = None) -> dict:
    """The truth of effects of the vocabulary."""
    truth = {"effects": [one.record() for one in effects], "hidden": effects}
    if len(effects) == 1:
        truth["channel"] = effects[0].channel
        if made is not None and "at_s" in effects[0].parameters:
            truth["interval_s"] = [effects[0].parameters["at_s"], made.felt.truth.duration_s]
    return truth


def pair(rng, index, options):
    """Two effects of the vocabulary with different names, large enough that both should show."""
    return _together(rng, options, 2)


def triple(rng, index, options):
    """Three of them."""
    return _together(rng, options, 3)


def four(rng, index, options):
    """Four of them."""
    return _together(rng, options, 4)


def _together(rng, options, count: int):
    other = ("reference.", "recording.")
    names = [name for name in DRAWN if "flight" in VOCABULARY[name].kinds and not name.startswith(other)]
    chosen = [names[k] for k in rng.choice(len(names), count, replace=False)]
    low, high = options.spread
    effects = [an_effect(rng, name, (2.5 * low, high)) for name in chosen]
    trajectory = "climb, cruise, landing" if rng.random() < options.long_pairs else "box"
    made = a_recording(rng, a_unit(rng, options.form, pulses=True), trajectory, a_rate(rng, options), effects, False,
                       columns_for(rng, chosen))  # fmt: skip
    return [made], known(effects)


def limited(rng, index, options):
    """Something in one axis, or for a time, or in turns only."""
    unit, form = a_unit(rng, options.form), index % 3
    if form == 0:  # a step stays
        name = str(rng.choice(("accelerometer.bias_step", "gyro.bias_step")))
    elif form == 1:
        name = "window"
    else:
        name = str(rng.choice(("gyro.scale", "gyro.misalignment", "accelerometer.misalignment",
                               "accelerometer.bias_temperature", "accelerometer.bias_temperature_rate")))  # fmt: skip
    trajectory = str(rng.choice(("climb, cruise, landing", "box", "wing rock"), p=options.flights))
    if name == "window":
        effect = a_window(rng, options.spread)
        made = a_recording(rng, unit, trajectory, a_rate(rng, options), (effect,), False)
        return [made], {"effects": [effect.record()], "hidden": [effect], "channel": effect.channel, "outside": True,
                        "interval_s": effect.interval(made.felt.truth.duration_s)}  # fmt: skip
    effect = an_effect(rng, name, options.spread)
    made = a_recording(rng, unit, trajectory, a_rate(rng, options), (effect,), False)
    return [made], known([effect], made)


def outside(rng, index, options):
    """Something that is not in the vocabulary; each form in its turn."""
    names = list(FORMS)
    effect = an_outside(rng, names[index % len(names)])
    trajectory = a_place(rng, effect.name, options)
    columns = set(shown_columns(rng))
    driver = FORMS[effect.name][5]
    if driver:
        columns = columns | {driver} if effect.shown else columns - {driver}
    made = a_recording(rng, a_unit(rng, options.form), trajectory, a_rate(rng, options), (effect,), False,
                       tuple(name for name in ALWAYS if name in columns))  # fmt: skip
    return [made], {"effects": [effect.record()], "hidden": [effect], "channel": effect.channel, "outside": True,
                    "interval_s": effect.interval(made.felt.truth.duration_s)}  # fmt: skip


# truth, rivals that this recording cannot tell from it (name, axis, other_axis), trajectory, sizes; by construction
ALIKE = (
    ("accelerometer.bias", "z", {}, (("accelerometer.scale", "z"), ("accelerometer.quadratic", "z"),
                                     ("accelerometer.cubic", "z")), "static", (1.0, 4.0)),
    ("accelerometer.bias_temperature", "z", {}, (("accelerometer.scale_temperature", "z"),), "oven", (0.3, 4.0)),
    ("accelerometer.scale_temperature", "z", {}, (("accelerometer.bias_temperature", "z"),), "oven", (0.3, 4.0)),
    ("accelerometer.bias_temperature_rate", "z", {}, (("accelerometer.scale_temperature_rate", "z"),), "oven",
     (0.3, 4.0)),
    ("accelerometer.scale_temperature_quadratic", "z", {}, (("accelerometer.bias_temperature_quadratic", "z"),), "oven",
     (0.3, 4.0)),
    ("accelerometer.scale_drift", "z", {}, (("accelerometer.bias_drift", "z"),), "static", (1.0, 5.0)),
    ("gyro.bias", "x", {}, (("gyro.g_sensitivity", "x"),), "static", (0.6, 4.0)),
    ("gyro.bias", "y", {}, (("gyro.g_sensitivity", "y"),), "oven", (0.6, 4.0)),
    ("accelerometer.misalignment", "x", {"other_axis": "z"}, (("accelerometer.bias", "x"),), "drive", (2.0, 6.0)),
    ("accelerometer.cross_pendulous", "z", {}, (("accelerometer.misalignment", "z"),), "box", (1.0, 5.0)),
    ("accelerometer.cross_pendulous", "x", {}, (("accelerometer.scale", "x"),), "box", (3.0, 8.0)),
    ("accelerometer.scale", "z", {}, (("accelerometer.quadratic", "z"), ("accelerometer.cubic", "z")), "straight",
     (1.0, 4.0)),
)  # fmt: skip


def unidentifiable(rng, index, options):
    """One recording cannot tell the truth from another explanation; one kind is a chamber with one position."""
    unit, choice = a_unit(rng, options.form, pulses=True), index % (len(ALIKE) + 1)
    if choice == len(ALIKE):
        term = str(rng.choice(("temperature", "temperature_quadratic", "temperature_rate")))
        first, second = rng.permutation(("bias", "scale"))
        axis = str(rng.choice(list("xyz")))
        effect = an_effect(rng, f"accelerometer.{first}_{term}", (0.05, 0.5), axis)
        made = a_chamber(rng, unit, axis, (effect,), positions=(float(rng.choice((-1.0, 1.0))),))
        return [made], known([effect]) | {"alike": [{"name": f"accelerometer.{second}_{term}", "axis": axis}]}
    name, axis, parameters, rivals, trajectory, spread = ALIKE[choice]
    effect = an_effect(rng, name, spread, axis)
    effect.parameters.update(parameters)
    made = a_recording(rng, unit, trajectory, a_rate(rng, options), (effect,), False)
    return [made], known([effect]) | {"alike": [{"name": one, "axis": other} for one, other in rivals]}


def multi(rng, index, options):
    """One effect in several recordings of an instrument: flight and flight, chamber or oven."""
    names = [
        name
        for name in DRAWN
        if "oven" in VOCABULARY[name].kinds
        and not name.endswith("step")
        and not name.startswith(("earth", "alignment"))
    ]
    name = names[int(rng.integers(len(names)))]
    unit = a_unit(rng, options.form, pulses=True)
    effect = an_effect(rng, name, options.spread)
    second = ("flight", "chamber", "oven")[index % 3]
    if second == "chamber" and ("drift" in name or not name.startswith(("accelerometer", "temperature"))):
        second = "flight"
    made = [a_recording(rng, unit, options.first, a_rate(rng, options), (effect,), False, name="first")]
    if second == "chamber":
        made.append(a_chamber(rng, unit, effect.axis or "z", (effect,), name="chamber"))
    else:
        trajectory = "oven" if second == "oven" else a_place(rng, "accelerometer.scale", options)
        made.append(a_recording(rng, unit, trajectory, a_rate(rng, options), (effect,), False, name="second"))
    return made, known([effect])


KINDS = {
    "zero": zero, "null": null, "adversarial": adversarial, "single": single, "limited": limited, "pair": pair,
    "triple": triple, "four": four, "outside": outside, "unidentifiable": unidentifiable, "multi": multi,
    "elsewhere": elsewhere,
}  # fmt: skip


NOISE_OF = {"zero": "zero", "null": "plain", "adversarial": "adversarial"}  # of what hides nothing


@dataclass(frozen=True)
class Options:
    """What differs between the sets, a rate that is asked for, and the noise of a case that hides something."""

    which: str
    rate: float | None = None
    form: str = "plain"

    @property
    def spread(self) -> tuple[float, float]:
        return (0.2, 5.0) if self.which == "development" else (0.15, 6.0)

    @property
    def flights(self) -> tuple[float, float, float]:
        """Shares of the long flight, of the box and of wing rock among flights in which something is limited."""
        return (0.2, 0.4, 0.4) if self.which == "quick" else (0.7, 0.15, 0.15)

    @property
    def long_pairs(self) -> float:
        """Share of the long flight where several effects act."""
        return 0.2 if self.which == "quick" else 0.8

    @property
    def first(self) -> str:
        """The first of several recordings."""
        return "box" if self.which == "quick" else "climb, cruise, landing"


def draw(
    which: str, seed: int, kind: str, index: int, forced_rate: float | None = None, mixed_noise: bool = False
) -> Case:
    """Case `index` of a kind; the same arguments give the same case.

    With `mixed_noise` half of the cases that hide something have adversarial noise, else none.
    """
    rng = generator(which, seed, kind, index)
    other = mixed_noise and generator(which, seed, f"noise of {kind}", index).random() < 0.5
    options = Options(which, forced_rate, "adversarial" if other else "plain")
    made, truth = KINDS[kind](rng, index, options)
    hidden = truth.pop("hidden", [])
    name = title(which, seed, kind, index)
    base = {
        "case": name, "kind": kind, "set": which, "index": index,
        "recordings": [
            {"path": name if len(made) == 1 else f"{name}/{one.name}", "name": one.name, "kind": one.kind,
             "trajectory": one.trajectory, "rate_hz": one.rate_hz, "drawn": one.drawn}
            for one in made
        ],
        "sheet": made[0].unit.sheet, "noise": made[0].unit.noise,
        "noise_form": NOISE_OF.get(kind, options.form),
        "effects": [], "interval_s": None, "channel": None, "outside": False, "oracle": None,
    }  # fmt: skip
    truth = base | truth
    shift = made[0].shift_s if len(made) == 1 else 0.0
    if truth["interval_s"]:
        truth["interval_s"] = [one + shift for one in truth["interval_s"]]
    for one in truth["effects"]:
        for key in ("at_s", "from_s"):
            if key in one:
                one[key] += shift
    return Case(name, kind, made, truth, hidden)


def plain(value):
    """Numbers and lists that JSON knows."""
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(one) for one in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value
