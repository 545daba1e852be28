"""What must hold of the fixes of any file before anything is computed from them."""

from __future__ import annotations

import numpy as np

from ins_eval.errors import DataRefused
from ins_eval.recording import Fixes
from ins_eval.units import DEG

LARGEST_HEIGHT_M = 1e6
LARGEST_SPEED_MPS = 2e4


def checked(fixes: Fixes, where: str, rows: np.ndarray | None = None) -> Fixes:
    """The fixes as they are; `rows` (m,) are their numbers in the file, where it has rows.

    Raises `DataRefused` for times that are not finite and strictly increasing, no valid epoch at all, and positions
    or velocities of valid ones that no vehicle has.
    """
    time_s, valid = fixes.time_s, fixes.valid
    if not np.isfinite(time_s).all():
        raise DataRefused(f"{where}: {(~np.isfinite(time_s)).sum()} times are not finite; remove these rows")
    back = np.flatnonzero(np.diff(time_s) <= 0.0)
    if back.size:
        k = int(back[0])
        at = f"epoch {k + 2}" if rows is None else f"row {rows[k + 1]}"
        raise DataRefused(
            f"{where}, {at}: time goes from {time_s[k]:.10g} to {time_s[k + 1]:.10g} s, expected strictly "
            "increasing times; sort the rows, drop repeated ones and separate joined logs"
        )
    if not valid.any():
        raise DataRefused(f"{where}: none of {len(valid)} epochs is valid, expected some; there is nothing to judge by")
    latitude = np.abs(fixes.latitude_rad[valid]).max() / DEG
    longitude = np.abs(fixes.longitude_rad[valid]).max() / DEG
    if not (latitude <= 90.0 and longitude <= 360.0):
        raise DataRefused(
            f"{where}: a latitude of {latitude:.6g} and a longitude of {longitude:.6g} degrees, expected at most 90 "
            "and 360; it looks like degrees read as radians or another column, check the unit and the order of the "
            "columns"
        )
    for name, values, limit, unit, small in (
        ("height", fixes.height_m, LARGEST_HEIGHT_M, "m", "mm"),
        ("velocity", fixes.velocity_n, LARGEST_SPEED_MPS, "m/s", "mm/s"),
    ):
        if not np.abs(values[valid]).max() <= limit:  # true also of NaN
            raise DataRefused(
                f"{where}: a {name} of {np.abs(values[valid]).max():.3g} {unit}, expected at most {limit:g}; remove "
                f"that row, or check the columns and their unit, which may be {small}"
            )
    return fixes
