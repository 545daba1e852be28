"""The quartz flexible accelerometer: eq. (1) and (12) of Paper A, one file for each physical effect.

    run.py                  the temperature an accelerometer lives through, with what all units share
    effect.py               what an effect is, and where on the way from force to pulses it may act
    model.py                Population -> draw -> Accelerometer -> slow errors -> pulses
    presets/                parameters of populations, each number with its source
    many.py                 many accelerometers of one axis at once

    thermal_lag             inner elements follow the surface late
    scale_polynomial        scale factor with temperature and its rate, eq. (11)
    magnet_hysteresis       scale factor remembers the way the temperature came
    scale_repeatability     scale factor differs from switch-on to switch-on
    bias_temperature        bias with temperature
    creep                   the adhesive creeps and takes the bias with it
    turn_on                 bias differs from switch-on to switch-on
    in_run                  bias wanders
    nonlinearity            quadratic, cubic, cross-coupling, misalignment
    noise                   white noise
    quantisation            whole pulses
    loop_gain               gains of a digital loop drift with age; absent unless stated
    absent                  an effect that is switched off

A unit is drawn once and keeps its constants; each run (one uninterrupted stay, switched on once) redraws what a
real one redraws. Every effect has random streams of its own: switching one off moves no draw of another::

    population = Population.load()                                # or Population.load("my.toml")
    x, y, z = population.without("creep").draw(streams)           # one instrument
    run = ThermalRun(time_s, surface_temperature_c, "flight")
    slow = x.slow(run, streams.at("flight"))                      # K1 in pulse/(g s), K0 in ug, on run.time_s
    counts = x.pulses(imu_time_s, 0.0, velocity_increment_b, run, slow, streams)
"""

from ins_eval.accelerometer.absent import Absent
from ins_eval.accelerometer.effect import AccelerometerEffect, Contribution
from ins_eval.accelerometer.many import ManyAccelerometers, draw
from ins_eval.accelerometer.model import EFFECTS, Accelerometer, Population, SlowErrors
from ins_eval.accelerometer.run import ThermalRun

__all__ = [
    "EFFECTS",
    "Absent",
    "Accelerometer",
    "AccelerometerEffect",
    "Contribution",
    "ManyAccelerometers",
    "Population",
    "SlowErrors",
    "ThermalRun",
    "draw",
]
