"""The output test, 193 and 24 ug, and eq. (31), computed again. In ug at 1 g, where 1 ppm of gain is 1 ug."""

from __future__ import annotations

from ins_eval.studies.paper_b.audit import estimation
from ins_eval.studies.paper_b.printed import PRINTED

OF = PRINTED["output"]


def residual_percent() -> tuple[float, float]:
    """Eq. (31) as printed, (N' - N0)/(N1 - N0), and its inverse, in %."""
    before, after = OF["uncompensated_ug"], OF["compensated_ug"]
    return 100.0 * before / after, 100.0 * after / before


def feedback_residual_ug() -> float:
    """What the error of the feedback estimate alone would leave at 1 g."""
    return OF["acceleration_g"] * estimation.shift("table4").mean_ppm


def expected_change_ug() -> float:
    """Size of the output's change at 1 g that the injected feedback drift makes."""
    return OF["acceleration_g"] * abs(estimation.expected_by_26_ppm())


def missing_ppm() -> float:
    """Drift of the torquer that turns the expected change into the printed one; it acts as the injected one does."""
    return OF["uncompensated_ug"] / OF["acceleration_g"] - expected_change_ug()


def closure_ug() -> tuple[float, float]:
    """Output after compensation, as true change plus applied correction, and the printed one less that.

    -193 ug of output and a correction by the estimated 218 ppm.
    """
    left = -OF["uncompensated_ug"] + OF["acceleration_g"] * PRINTED["table4"]["mean"]["drift_ppm"]
    return left, OF["compensated_ug"] - left


def magnet_and_current_ppm() -> float:
    """drift(I_ref) + drift(B) between the two states that the closure asks for.

    The estimate is the gain's drift less that of I_ref, the output's change is minus the gain's drift less that of B.
    """
    return OF["uncompensated_ug"] / OF["acceleration_g"] - PRINTED["table4"]["mean"]["drift_ppm"]
