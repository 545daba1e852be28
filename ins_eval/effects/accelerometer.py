"""Effects of an accelerometer: what eq. (1), (4) and (11) of Paper A leave at zero when they are not believed."""

from __future__ import annotations

from functools import partial

from ins_eval.effects.effect import ACCELEROMETER, Effect, Parameter
from ins_eval.units import HOUR, PPM, STANDARD_GRAVITY, UG

_G = 1.0 / STANDARD_GRAVITY
PAPER = "Paper A (Sensors 2021, 21, 294)"
# forms: epoxies creep by several relaxations, and a magnet by a distribution of loops that remembers where it turned
CREEP_TIME = Parameter("time_constant_s", "s", 120.0, 15000.0, 8, form=0.5)
BRANCH_WIDTH = Parameter("branch_width_c", "degC", 0.3, 12.0, 7, form=0.2)
BRANCH_BEGIN = Parameter("branch_begin", "", -1.0, 1.0, 3, even=True)
RATE_FILTER = Parameter("rate_filter_s", "s", 2.0, 180.0, 7, assumed=True)
SUPPLY = "a range is switched, a supply or a loop's current source changes"
AT = Parameter("at_s", "s", None, None, 40)
TEMPERATURES, RATES = "a temperature that changes", "a temperature that changes at several rates"
FORCES = "specific force that changes: turns, climbs, a tumble; gravity alone where it is vertical"

_of = partial(Effect, enters=ACCELEROMETER)

EFFECTS = (
    _of(
        name="accelerometer.bias",
        physics="the output of no specific force, constant; beyond what its stated sigma allows",
        unit="ug", si=UG, nominal=100.0,
        excited_by="time", reference=f"{PAPER}, eq. (1), K0; Table 1, bias repeatability 40 to 60 ug",
    ),
    _of(
        name="accelerometer.bias_temperature",
        physics="glue, quartz and metal expand differently and bend the pendulum",
        unit="ug/degC", si=UG, nominal=4.0, slow="T",
        excited_by=TEMPERATURES, reference=f"{PAPER}, eq. (4), omega; Table 1, 15 to 50 ug/degC before compensation",
    ),
    _of(
        name="accelerometer.bias_temperature_quadratic",
        physics="glue, quartz and metal expand differently: the bias is curved in temperature",
        unit="ug/degC^2", si=UG, nominal=0.1, slow="T^2",
        excited_by="a wide range of temperature", reference=f"{PAPER}, section 3.3, bias that is no straight line",
    ),
    _of(
        name="accelerometer.bias_temperature_rate",
        physics="gradients within the element while its temperature changes",
        unit="ug/(degC/min)", si=UG, nominal=100.0, slow="r", parameters=(RATE_FILTER,),
        excited_by=RATES, reference="IEEE Std 1293-2018, annex on thermal transients",
    ),
    _of(
        name="accelerometer.bias_creep",
        physics="epoxy resin creeps after a change of temperature: viscoelastic memory, tau y' = T - y, y(0) = T(0)",
        unit="ug/degC", si=UG, nominal=4.0, slow="creep", parameters=(CREEP_TIME,), form=0.2,
        excited_by="a change of temperature and hours after it", reference=f"{PAPER}, section 2.2, Tables 2 and 3",
    ),
    _of(
        name="accelerometer.bias_step",
        physics="stress that is let go, a shock, a change of supply: the bias jumps",
        unit="ug", si=UG, nominal=50.0, slow="step", parameters=(AT,), local=True,
        excited_by="time on both sides of the jump", reference="Willsky and Jones, IEEE Trans. AC 21 (1976) 108",
    ),
    _of(
        name="accelerometer.bias_drift",
        physics="the bias moves steadily with time, as after switching on",
        unit="ug/h", si=UG / HOUR, nominal=30.0, slow="t",
        excited_by="hours", reference=f"{PAPER}, Table 5, bias stability 50 ug",
    ),
    _of(
        name="accelerometer.scale",
        physics="constant error of the scale factor, as from the magnet of a force-rebalance loop",
        unit="ppm", si=PPM, nominal=100.0, multipliers=("f",),
        excited_by=FORCES, reference=f"{PAPER}, eq. (11), gamma; Table 1, repeatability 80 ppm",
    ),
    _of(
        name="accelerometer.scale_temperature",
        physics="magnet and coil with temperature",
        unit="ppm/degC", si=PPM, nominal=5.0, multipliers=("f",), slow="T",
        excited_by=f"{TEMPERATURES}, and {FORCES}", reference=f"{PAPER}, eq. (11), mu",
    ),
    _of(
        name="accelerometer.scale_temperature_quadratic",
        physics="magnet and coil with temperature: the scale factor is curved in it",
        unit="ppm/degC^2", si=PPM, nominal=0.1, multipliers=("f",), slow="T^2",
        excited_by=f"a wide range of temperature, and {FORCES}", reference=f"{PAPER}, eq. (11), beta",
    ),
    _of(
        name="accelerometer.scale_temperature_rate",
        physics="the magnet's temperature differs from the reading while it changes",
        unit="ppm/(degC/min)", si=PPM, nominal=100.0, multipliers=("f",), slow="r", parameters=(RATE_FILTER,),
        excited_by=f"{RATES}, and {FORCES}", reference=f"{PAPER}, eq. (11), epsilon; eqs (15) to (17)",
    ),
    _of(
        name="accelerometer.scale_temperature_rate_quadratic",
        physics="the magnet's temperature differs from the reading, alike whichever way it changes",
        unit="ppm/(degC/min)^2", si=PPM, nominal=300.0, multipliers=("f",), slow="r^2",
        excited_by=f"{RATES}, and {FORCES}", reference=f"{PAPER}, eq. (11), alpha; eqs (15) to (17)",
    ),
    _of(
        name="accelerometer.scale_temperature_rate_coupling",
        physics="the influence of the rate depends on the temperature",
        unit="ppm/(degC degC/min)", si=PPM, nominal=5.0, multipliers=("f",), slow="r T",
        excited_by=f"{RATES} at several temperatures, and {FORCES}", reference=f"{PAPER}, eq. (11), eta",
    ),
    _of(
        name="accelerometer.scale_hysteresis",
        physics="the magnet is on another branch when it cools than when it warms, whatever the speed",
        unit="ppm", si=PPM, nominal=30.0, multipliers=("f",), slow="branch", parameters=(BRANCH_WIDTH, BRANCH_BEGIN),
        excited_by=f"a temperature that turns round, and {FORCES}", reference=f"{PAPER}, section 2.1, Fig. 1",
    ),
    _of(
        name="accelerometer.scale_drift",
        physics="the gain of the loop, its current source or the magnet move steadily with time",
        unit="ppm/h", si=PPM / HOUR, nominal=30.0, multipliers=("f",), slow="t",
        excited_by=f"hours, and {FORCES}", reference="Paper B (IEEE Access 2019), eqs (13) and (28)",
    ),
    _of(
        name="accelerometer.scale_step",
        physics=f"{SUPPLY}: the scale factor jumps",
        unit="ppm", si=PPM, nominal=50.0, multipliers=("f",), slow="step", parameters=(AT,), local=True,
        excited_by=f"time on both sides of the jump, and {FORCES}",
        reference="Willsky and Jones, IEEE Trans. AC 21 (1976) 108",
    ),
    _of(
        name="accelerometer.asymmetry",
        physics="specific force one way is measured larger than the other way: an error that follows the magnitude",
        unit="ppm", si=PPM, nominal=50.0, multipliers=("|f|",),
        excited_by="specific force along it in both directions",
        reference="IEEE Std 1293-2018, scale factor asymmetry",
    ),
    _of(
        name="accelerometer.quadratic",
        physics="the output is not straight in specific force",
        unit="ug/g^2", si=UG * _G**2, nominal=20.0, multipliers=("f^2",),
        excited_by=FORCES, reference=f"{PAPER}, eq. (1), K2",
    ),
    _of(
        name="accelerometer.cubic",
        physics="the output is not straight in specific force, and odd in its sign",
        unit="ug/g^3", si=UG * _G**3, nominal=20.0, multipliers=("f^3",),
        excited_by=FORCES, reference=f"{PAPER}, eq. (1), K3",
    ),
    _of(
        name="accelerometer.cross_pendulous",
        physics="the pendulum gives way along itself: input times pendulous axis",
        unit="ug/g^2", si=UG * _G**2, nominal=20.0, multipliers=("f f_pendulous",),
        excited_by="specific force along input and pendulous axis together", reference=f"{PAPER}, eq. (1), Kip",
    ),
    _of(
        name="accelerometer.cross_output",
        physics="the hinge gives way: input times output axis",
        unit="ug/g^2", si=UG * _G**2, nominal=20.0, multipliers=("f f_output",),
        excited_by="specific force along input and output axis together", reference=f"{PAPER}, eq. (1), Kio",
    ),
    _of(
        name="accelerometer.misalignment",
        physics="the input axis leans towards another body axis",
        unit="urad", si=1e-6, nominal=50.0, multipliers=("f_pendulous", "f_output"),
        excited_by="specific force along the other axis", reference=f"{PAPER}, eq. (1), delta_o and delta_p",
    ),
    _of(
        name="accelerometer.vibration_rectification",
        physics="vibration along a crooked characteristic leaves a mean: a bias with the mean square of vibration",
        unit="ug/g^2", si=UG, nominal=100.0, slow="vibration_rms_g^2",
        excited_by="vibration that changes, and its recorded RMS",
        reference="QA3000 data sheet, vibration rectification below 60 ug/g^2; IEEE Std 1293-2018",
    ),
)  # fmt: skip
