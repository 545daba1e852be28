"""Effects of a gyro."""

from __future__ import annotations

from functools import partial

from ins_eval.effects.accelerometer import AT, RATE_FILTER, RATES, SUPPLY, TEMPERATURES
from ins_eval.effects.effect import GYRO, Effect
from ins_eval.units import DEG_PER_H, HOUR, PPM, STANDARD_GRAVITY

PAPER = "Paper A (Sensors 2021, 21, 294), Table 5"
TEXTBOOK = "Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed., chapter 4"
TURNS = "turns about it"

_of = partial(Effect, enters=GYRO)

EFFECTS = (
    _of(
        name="gyro.bias",
        physics="the output of no rotation, constant; beyond what its stated sigma allows",
        unit="deg/h", si=DEG_PER_H, nominal=0.05,
        excited_by="time", reference=f"{PAPER}, 0.01 deg/h",
    ),
    _of(
        name="gyro.bias_temperature",
        physics="the bias follows the temperature",
        unit="(deg/h)/degC", si=DEG_PER_H, nominal=1e-3, slow="T",
        excited_by=TEMPERATURES, reference=TEXTBOOK,
    ),
    _of(
        name="gyro.bias_temperature_rate",
        physics="gradients in the coil or cavity while the temperature changes (Shupe effect)",
        unit="(deg/h)/(degC/min)", si=DEG_PER_H, nominal=0.05, slow="r", parameters=(RATE_FILTER,),
        excited_by=RATES, reference="Shupe, Appl. Opt. 19 (1980) 654",
    ),
    _of(
        name="gyro.bias_step",
        physics="the bias jumps",
        unit="deg/h", si=DEG_PER_H, nominal=0.02, slow="step", parameters=(AT,), local=True,
        excited_by="time on both sides of the jump", reference="Willsky and Jones, IEEE Trans. AC 21 (1976) 108",
    ),
    _of(
        name="gyro.bias_drift",
        physics="the bias moves steadily with time",
        unit="(deg/h)/h", si=DEG_PER_H / HOUR, nominal=0.01, slow="t",
        excited_by="hours", reference=f"{PAPER}, stability 0.01 deg/h",
    ),
    _of(
        name="gyro.scale",
        physics="the angle is measured too large by a constant part",
        unit="ppm", si=PPM, nominal=50.0, multipliers=("w",),
        excited_by=TURNS, reference=f"{PAPER}, 20 ppm",
    ),
    _of(
        name="gyro.scale_step",
        physics=f"{SUPPLY}: the scale factor jumps",
        unit="ppm", si=PPM, nominal=50.0, multipliers=("w",), slow="step", parameters=(AT,), local=True,
        excited_by=f"{TURNS} on both sides of the jump", reference="Willsky and Jones, IEEE Trans. AC 21 (1976) 108",
    ),
    _of(
        name="gyro.asymmetry",
        physics="turns one way are measured larger than turns the other way: an error that follows the magnitude",
        unit="ppm", si=PPM, nominal=50.0, multipliers=("|w|",),
        excited_by=f"{TURNS}, both ways", reference="IEEE Std 1431-2004, scale factor asymmetry",
    ),
    _of(
        name="gyro.misalignment",
        physics="the input axis leans towards another body axis",
        unit="urad", si=1e-6, nominal=50.0, multipliers=("w_next", "w_last"),
        excited_by="turns about the other axis", reference=TEXTBOOK,
    ),
    _of(
        name="gyro.g_sensitivity",
        physics="specific force along its own axis or another bends what senses the rotation",
        unit="(deg/h)/g", si=DEG_PER_H / STANDARD_GRAVITY, nominal=0.02, multipliers=("f", "f_next", "f_last"),
        excited_by="specific force that changes along that axis", reference=TEXTBOOK,
    ),
)  # fmt: skip
