"""From readings in a thermal chamber to the curves of an accelerometer, and how sure they are.

    four_point          readings in four positions -> scale factor and bias against temperature and its rate
    fits, branches      curves through them
    identifiability     which terms of eq. (11) a programme can separate
    uncertainty         95 % intervals of the coefficients, run by run
    prediction          95 % interval of the error of a reading in a new run
    sensitivity         ppm per degC, as in Paper A's Table 4
    labelings           the printed four-point equations with either labels of the positions
    models              all of it at once: calibrate -> Calibration

A curve is any object with ``evaluate(temperature_c, rate_c_per_min) -> (n,)``. Nothing here knows how the readings
came about.
"""

from ins_eval.calibration.models import FITS, CalibratedModel, Calibration, Coefficient, calibrate

__all__ = ["FITS", "CalibratedModel", "Calibration", "Coefficient", "calibrate"]
