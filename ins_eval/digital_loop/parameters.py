"""Parameters of a digital loop: TOML tables in which every value stands with its unit and its source.

    [pendulum]
    mass = { value = 0.7e-3, unit = "kg", source = "assumed" }

A file may begin with ``extends = "NAME"`` of a preset: it then states only what differs.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, Field, create_model, model_validator

from ins_eval.digital_loop.parts import PARTS
from ins_eval.errors import UsageError, did_you_mean
from ins_eval.tables import Strict, parse, read_extending

PRESETS = Path(__file__).parent / "presets"
DEFAULT = "digital-qfa"
ADC_USED = 0.98  # of its range at the end of the scan: noise and drift need the rest


class Quantity(Strict):
    """A value with its unit and where it comes from."""

    value: float
    unit: str
    source: Annotated[str, Field(min_length=1)]


def _in(unit: str, low: float = 0.0, high: float = float("inf"), whole: bool = False, open_low: bool = True) -> Any:
    """That a quantity comes in `unit` and lies between `low` and `high`."""

    def check(quantity: Quantity) -> Quantity:
        if quantity.unit != unit:
            raise ValueError(f"the unit is '{quantity.unit}', expected '{unit}'; convert the value")
        if quantity.value < low or quantity.value > high or (open_low and quantity.value == low):
            raise ValueError(
                f"{quantity.value:g} {unit} cannot be; expected a value {'above' if open_low else 'from'} {low:g}"
                + (f" up to {high:g}" if high < float("inf") else "")
            )
        if whole and quantity.value != round(quantity.value):
            raise ValueError(f"{quantity.value:g} {unit} cannot be; expected a whole number")
        return quantity

    return AfterValidator(check)


def _bits() -> Any:
    return _in("bit", 8, 32, whole=True, open_low=False)


def _not_negative(unit: str) -> Any:
    return _in(unit, open_low=False)


class Pendulum(Strict):
    """J theta'' + C theta' + D theta = M, with pendulosity k0 = m L."""

    mass: Annotated[Quantity, _in("kg")]
    arm: Annotated[Quantity, _in("m")]
    inertia: Annotated[Quantity, _in("kg m^2")]
    damping: Annotated[Quantity, _in("N m s/rad")]
    stiffness: Annotated[Quantity, _in("N m/rad")]

    @model_validator(mode="after")
    def _overdamped(self) -> Pendulum:
        c, d, j = self.damping.value, self.stiffness.value, self.inertia.value
        if c * c <= 4.0 * d * j:
            raise ValueError(
                f"damping C = {c:g} N m s/rad does not give two real poles; expected C^2 above 4 D J = {4.0 * d * j:g}"
            )
        return self


class Pickoff(Strict):
    """Differential capacitor C1, C2 = C0 / (1 -+ u) with u = l theta / d: k1 = 2 C0 l / d."""

    capacitance: Annotated[Quantity, _in("F")]
    arm: Annotated[Quantity, _in("m")]
    gap: Annotated[Quantity, _in("m")]


class Carrier(Strict):
    """Modulation: V_IN = N_FPGA V_DA1ref / 2^(bits - 1) k_tz."""

    amplitude: Annotated[Quantity, _in("count", whole=True)]
    bits: Annotated[Quantity, _bits()]
    reference: Annotated[Quantity, _in("V")]
    gain: Annotated[Quantity, _in("V/V")]
    samples_per_period: Annotated[Quantity, _in("1", 8, 256, whole=True, open_low=False)]


class Bridge(Strict):
    """AC bridge with its reference capacitors and the instrumentation amplifier."""

    capacitor_1: Annotated[Quantity, _in("F")]
    capacitor_2: Annotated[Quantity, _in("F")]
    gain: Annotated[Quantity, _in("V/V", 1.0)]

    @model_validator(mode="after")
    def _balances(self) -> Bridge:
        if not 1.0 / 3.0 < self.capacitor_1.value / self.capacitor_2.value < 3.0:
            raise ValueError(
                f"capacitor_1 is {self.capacitor_1.value:g} F and capacitor_2 {self.capacitor_2.value:g} F, with which "
                "the bridge cannot balance before the plate is on its stop; expected about the same"
            )
        return self


class Adc(Strict):
    """ADC of the bridge voltage; its noise dithers it."""

    bits: Annotated[Quantity, _bits()]
    reference: Annotated[Quantity, _in("V")]
    noise: Annotated[Quantity, _not_negative("count")]


class Demodulator(Strict):
    """Synchronous demodulation in the FPGA."""

    gain: Annotated[Quantity, _in("1")]


class Controller(Strict):
    """D(z): proportional, integral and derivative action on k(D(z)) times the demodulated value."""

    rate: Annotated[Quantity, _in("Hz", 1e3, 1e6, open_low=False)]
    gain: Annotated[Quantity, _in("1")]
    proportional: Annotated[Quantity, _in("count/count")]
    integral: Annotated[Quantity, _not_negative("1/s")]
    derivative: Annotated[Quantity, _not_negative("s")]


class Feedback(Strict):
    """DA0 makes the reference voltage of DA2, eq. (30); DA2 and a resistor make the current, eqs. (9), (10)."""

    reference_bits: Annotated[Quantity, _bits()]
    full_scale: Annotated[Quantity, _in("V")]
    reference_code: Annotated[Quantity, _in("count", whole=True)]
    bits: Annotated[Quantity, _bits()]
    resistor: Annotated[Quantity, _in("ohm")]

    @model_validator(mode="after")
    def _within(self) -> Feedback:
        if self.reference_code.value >= 2.0**self.reference_bits.value:
            raise ValueError(
                f"reference_code {self.reference_code.value:g} does not fit into {self.reference_bits.value:g} bits"
            )
        return self


class Torquer(Strict):
    """Torque k_t = B L_coil L per ampere."""

    induction: Annotated[Quantity, _in("T")]
    coil_length: Annotated[Quantity, _in("m")]
    arm: Annotated[Quantity, _in("m")]


class CurrentSource(Strict):
    """The constant current I_ref behind the switch M1."""

    current: Annotated[Quantity, _in("A")]


class Scan(Strict):
    """Open-loop scan of N_FPGA: amplitude + i step, i = 0 ... steps, eq. (17)."""

    step: Annotated[Quantity, _in("count", whole=True)]
    steps: Annotated[Quantity, _in("1", 2, 200, whole=True, open_low=False)]
    periods: Annotated[Quantity, _in("1", 1, 1e5, whole=True, open_low=False)]


class BenchParameters(Strict):
    """The static test bench: how long is measured, what the room does, and what the accelerometer's bias does."""

    settling: Annotated[Quantity, _in("s", 1e-3, 100.0, open_low=False)]
    current_test: Annotated[Quantity, _in("s", 0.01, 100.0, open_low=False)]
    static_test: Annotated[Quantity, _in("s", 0.01, 100.0, open_low=False)]
    repetitions: Annotated[Quantity, _in("1", 2, 100, whole=True, open_low=False)]
    temperature: Annotated[Quantity, _in("degC", -100.0, 150.0)]
    warm_up: Annotated[Quantity, _in("degC", -50.0, 50.0)]
    warm_up_sigma: Annotated[Quantity, _not_negative("degC")]
    room_sigma: Annotated[Quantity, _not_negative("degC")]
    bias_sigma: Annotated[Quantity, _not_negative("ug")]


class ChamberParameters(Strict):
    """Where a unit is calibrated over temperature, and the large change of a test made far from its reference."""

    lowest: Annotated[Quantity, _in("degC", -100.0, 150.0)]
    highest: Annotated[Quantity, _in("degC", -100.0, 150.0)]
    temperatures: Annotated[Quantity, _in("1", 3, 100, whole=True, open_low=False)]
    thermometer_sigma: Annotated[Quantity, _not_negative("degC")]
    large_change: Annotated[Quantity, _in("degC", -200.0, 200.0)]

    @model_validator(mode="after")
    def _spans(self) -> ChamberParameters:
        if self.lowest.value >= self.highest.value:
            raise ValueError(
                f"lowest is {self.lowest.value:g} degC and highest {self.highest.value:g} degC; expected a higher one"
            )
        return self


def _of_parts(name: str, kind: Any, words: str) -> Any:
    quantities: dict[str, Any] = {part: (Annotated[Quantity, kind], ...) for part in PARTS}
    table = create_model(name, __base__=Strict, **quantities)
    table.__doc__ = words
    return table


if TYPE_CHECKING:

    class TemperatureCoefficient(Strict): ...

    class TemperatureCoefficientSigma(Strict): ...

    class AgeingSigma(Strict): ...

else:
    SIGMA = "Standard deviation over the population, by part."
    TemperatureCoefficient = _of_parts(
        "TemperatureCoefficient", _in("ppm/degC", -1e4, 1e4), "Mean over the population, by part."
    )
    TemperatureCoefficientSigma = _of_parts("TemperatureCoefficientSigma", _not_negative("ppm/degC"), SIGMA)
    AgeingSigma = _of_parts("AgeingSigma", _not_negative("ppm/year"), SIGMA)


class Parameters(Strict):
    """Everything that makes a digital loop, its bench and the population it is drawn from."""

    pendulum: Pendulum
    pickoff: Pickoff
    carrier: Carrier
    bridge: Bridge
    adc: Adc
    demodulator: Demodulator
    controller: Controller
    feedback: Feedback
    torquer: Torquer
    current_source: CurrentSource
    scan: Scan
    bench: BenchParameters
    chamber: ChamberParameters
    temperature_coefficient: TemperatureCoefficient
    temperature_coefficient_sigma: TemperatureCoefficientSigma
    ageing_sigma: AgeingSigma

    @model_validator(mode="after")
    def _scan_fits(self) -> Parameters:
        top = self.carrier.amplitude.value + self.scan.step.value * self.scan.steps.value
        volts = top / 2.0 ** (self.carrier.bits.value - 1) * self.carrier.reference.value * self.carrier.gain.value
        if top >= 2.0 ** (self.carrier.bits.value - 1):
            raise ValueError(f"the scan goes up to N_FPGA = {top:g}, which does not fit into DA1; take smaller steps")
        seen = 0.5 * volts * self.bridge.gain.value
        if seen > ADC_USED * self.adc.reference.value:
            raise ValueError(
                f"at N_FPGA = {top:g} the bridge gives {seen:.2f} V with the plate on its stop, above "
                f"{ADC_USED:.0%} of the {self.adc.reference.value:g} V of the ADC; take smaller steps or less gain"
            )
        return self


def read(preset_or_path: str | Path = DEFAULT) -> Parameters:
    """The parameters of a shipped preset by name, or of a TOML file.

    Raises UsageError: no such file or preset, not TOML, a key that is unknown or missing, a unit other than expected,
    a value that cannot be.
    """
    path = find(preset_or_path)
    return parse(Parameters, read_extending(path, find), str(path))


def find(preset_or_path: str | Path) -> Path:
    """The file of a preset, or the path of a TOML file as it is given."""
    path = Path(preset_or_path)
    if path.suffix == ".toml":
        return path
    if (PRESETS / f"{preset_or_path}.toml").is_file():
        return PRESETS / f"{preset_or_path}.toml"
    known = [preset.stem for preset in PRESETS.glob("*.toml")]
    raise UsageError(f"no digital loop '{preset_or_path}'{did_you_mean(str(preset_or_path), known)}")
