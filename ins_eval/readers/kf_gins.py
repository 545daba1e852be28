"""Reader of the text of KF-GINS: one line an IMU sample, in increments, forward-right-down.

    IMU          second of the GPS week, angle x y z [rad], velocity x y z [m/s]
    gps.file     second, latitude longitude [deg], height [m], three standard deviations [m] (, velocity)
    reference.file   week, second, latitude longitude [deg], height [m], velocity north east down, roll pitch yaw [deg]

Both further files are named with --assume; gps.file may also be RTKLIB or NMEA. Source: KF-GINS of Wuhan University,
its README.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ins_eval.boundary import content
from ins_eval.errors import DataRefused
from ins_eval.readers import assembly, receivers
from ins_eval.readers.files import text_numbers
from ins_eval.readers.fix_columns import checked_groups
from ins_eval.readers.layout import Layout
from ins_eval.readers.sampling import Readings
from ins_eval.recording import Fixes, Recording
from ins_eval.units import DEG

KEYS = (*assembly.KEYS, "gps.file", "reference.file")
IMU = "second of the week, angle x y z [rad], velocity x y z [m/s]"
GPS = "second, latitude, longitude [deg], height [m], three standard deviations, or with velocity"
REFERENCE = "week, second, latitude, longitude, height, velocity north east down, roll pitch yaw"
WITH_VELOCITY = 10


def read(path: Path, assumed: Mapping[str, str]) -> Recording:
    """The whole file as one drive."""
    rows = text_numbers(str(path), content(path, IMU), 7, IMU)
    gps, gps_notes = _gps(assumed, receivers.span(rows[:, 0]))
    reference = _reference(Path(assumed["reference.file"])) if "reference.file" in assumed else None
    return assembly.recording(
        assembly.Tables(
            name=path.stem,
            kind=assumed.get("kind", "drive"),
            readings=Readings(rows[:, 0], rows[:, 1:4], rows[:, 4:]),
            layout=Layout("rad", "m/s", "FRD"),
            gps=gps,
            reference=reference,
            notes=(
                f"The file {path.name} is the IMU of a KF-GINS data set, {len(rows)} rows; stamps are seconds of the "
                "GPS week.",
                *gps_notes,
            ),
        ),
        str(path),
        assumed,
        "this is the format's convention",
    )


def _gps(assumed: Mapping[str, str], span_s: tuple[float, float]) -> tuple[Fixes | None, list[str]]:
    if "gps.file" not in assumed:
        return None, ["No GPS is given; --assume gps.file=PATH names one."]
    path = Path(assumed["gps.file"])
    raw = content(path, GPS)
    if any(one.begins(raw) for one in receivers.FORMATS):
        return receivers.read(path, span_s)
    width = len(raw.lstrip().split(b"\n", 1)[0].split())
    rows = text_numbers(str(path), raw, width if width == WITH_VELOCITY else 7, GPS)
    velocity_n = rows[:, 7:] if width == WITH_VELOCITY else np.full((len(rows), 3), np.nan)
    valid = np.isfinite(rows[:, 1:4]).all(axis=1)
    with np.errstate(all="ignore"):
        sigma = np.sqrt(np.mean(rows[:, 4:7] ** 2, axis=1))
    fixes = Fixes(rows[:, 0], DEG * rows[:, 1], DEG * rows[:, 2], rows[:, 3], velocity_n, valid, position_sigma_m=sigma)
    return checked_groups(fixes, f"{path}"), [
        f"The file {path.name} holds {len(rows)} fixes{'' if width == WITH_VELOCITY else ' without velocity'}."
    ]


def _reference(path: Path) -> Fixes:
    rows = text_numbers(str(path), content(path, REFERENCE), 11, REFERENCE)
    if not np.isfinite(rows).all():
        raise DataRefused(f"{path}: holds values that are not finite, expected {REFERENCE}; remove these rows")
    valid = np.ones(len(rows), dtype=bool)
    attitude = DEG * np.column_stack([rows[:, 8:10], rows[:, 10] % 360.0])
    fixes = Fixes(rows[:, 1], DEG * rows[:, 2], DEG * rows[:, 3], rows[:, 4], rows[:, 5:8], valid, attitude)
    return checked_groups(fixes, f"{path}")
