"""Figures of accelerometers that were calibrated in a chamber."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.figure import Figure

from ins_eval.analysis.calibrate import WANTED, ChamberCalibration
from ins_eval.calibration import Calibration
from ins_eval.figures import calibration as figures

POINTS = ("temperature_c", "rate_c_per_min", "ramp_c_per_min", "elapsed_s", "scale", "bias_ug")
DRAWN = ("none", "simple", "quadratic", "hysteresis")


def calibration_figures(calibration: ChamberCalibration) -> dict[str, Figure]:
    """Every figure by its name, the axis before it where there are three."""
    drawn: dict[str, Figure] = {}
    for one in calibration.accelerometers:
        ahead = f"{one.readings.axis}_" if len(calibration.accelerometers) > 1 else ""
        drawn |= {ahead + name: figure for name, figure in _figures_of(one.calibration).items()}
    return drawn


def _figures_of(calibration: Calibration) -> Mapping[str, Figure]:
    points = {name: getattr(calibration.points, name) for name in POINTS}
    at = points["temperature_c"], points["rate_c_per_min"]
    models = {name: model for name, model in calibration.models.items() if name in DRAWN and not model.reason}
    scale = {name: model.scale.evaluate(*at) for name, model in models.items()}
    bias_ug = {name: model.bias_ug.evaluate(*at) for name, model in models.items()}
    left_ppm = {name: 1e6 * (points["scale"] / curve - 1.0) for name, curve in scale.items()}
    left_ug = {name: points["bias_ug"] - curve for name, curve in bias_ug.items()}
    compared = [name for name in ("simple", WANTED) if name in models]
    return {
        "scale_against_temperature": figures.scale_against_temperature(points=points, fitted=scale),
        "bias_against_temperature": figures.bias_against_temperature(points=points, fitted=bias_ug),
        "scale_residual": figures.residual_against_temperature(
            points=points, residual=left_ppm, quantity=figures.SCALE, title="Scale factor: what each model leaves"
        ),
        "bias_residual": figures.residual_against_temperature(
            points=points, residual=left_ug, quantity=figures.BIAS, title="Bias: what each model leaves"
        ),
        "residual_against_time": figures.residual_against_time(
            points=points,
            scale_ppm={name: left_ppm[name] for name in compared},
            bias_ug={name: left_ug[name] for name in compared},
        ),
    }
