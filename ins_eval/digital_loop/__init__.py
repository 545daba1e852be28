"""The digital closed-loop accelerometer of Paper B: its loop, the drift of its gains, their estimation in place.

    parts, parameters   the parts that can drift; TOML tables in which every value has a unit and a source
    model               Loop: the gains (5)-(13) with the drift of each part, its steady output, compensation (22), (30)
    pendulum            eqs. (1)-(3) with their missing 1/J, poles, exact discretisation
    kernel, sampled     the compiled loop: modulation, ADC, demodulation, controller, DAC, torquer, switch M1, stops
    excitation          the method (23), which the paper rejects
    attraction          what the carrier does to the plate: negative stiffness, pull-in
    stability           margins, bandwidth and step response against drift of the forward gain
    observability       which drifts each test sees
    injector            drift put in by a resistor or directly in the gain
    unit                one accelerometer: temperature coefficients and ageing of its parts
    bench               steps 1-5 of the paper's procedure
    population          200 of them
    chamber             the same, calibrated over temperature, and tested after a large change of it

    loop = load("digital-qfa")                              # or "paper-unit", or "my.toml"
    drifted = loop.with_drift("sampling_resistor", -200.0)  # ppm
    done = bench.procedure(population.draw(streams, 7), streams.at("unit", 7))

What the tests of a unit say about its gains is estimated in `calibration.loop_gains`, which knows nothing of this.
"""

from ins_eval.digital_loop.model import Loop, load
from ins_eval.digital_loop.parts import PARTS, Part

__all__ = ["PARTS", "Loop", "Part", "load"]
