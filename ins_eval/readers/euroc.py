"""Reader of an EuRoC recording of a drone: the folder mav0, one above it, or imu0/data.csv in it.

    imu0/data.csv   stamp [ns], rate x y z [rad/s], specific force x y z [m/s^2]
    state_groundtruth_estimate0/data.csv   stamp [ns], position [m], quaternion w x y z, velocity [m/s], ...

The ground truth is of a local frame whose z points up and whose heading nobody measured: it is taken as east-north-up
at the place that is assumed. The IMU is mounted x up, y right, z forward. Source: Burri et al., The EuRoC micro aerial
vehicle datasets, International Journal of Robotics Research 35 (2016), and the sensor.yaml of the data.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ins_eval.errors import DataRefused, UsageError
from ins_eval.readers import assembly, mapped
from ins_eval.readers.delimited import DelimitedTable
from ins_eval.readers.mapping import MappingFile
from ins_eval.readers.options import number
from ins_eval.recording import Recording

KEYS = assembly.KEYS
AXES = "URF"
EXPECTED = "imu0/data.csv of stamp, rates and specific force"
IMU_COLUMNS, TRUTH_COLUMNS = 7, 11


def read(path: Path, assumed: Mapping[str, str]) -> Recording:
    """The whole recording as one flight.

    Raises `UsageError` where the place is not assumed.
    """
    imu = next((one for one in (path / "mav0/imu0/data.csv", path / "imu0/data.csv") if one.is_file()), path)
    for key in ("latitude_deg", "longitude_deg"):
        if key not in assumed:
            raise UsageError(
                f"{path}: an EuRoC recording does not say where it was made, expected the place; --assume "
                "latitude_deg=DEG --assume longitude_deg=DEG --assume height_m=M"
            )
    truth = imu.parent.parent / "state_groundtruth_estimate0" / "data.csv"
    origin = {key: number(assumed, key, 0.0) for key in assembly.PLACE}
    axes = assumed.get("axes", AXES)
    described = {
        "kind": assumed.get("kind", "flight"),
        "name": imu.parent.parent.parent.name or "euroc",
        "axes": AXES,
        **_imu(imu),
        **({"reference": _truth(truth, axes, origin)} if truth.is_file() else {}),
    }
    here = {key: value for key, value in assumed.items() if key not in assembly.PLACE or not truth.is_file()}
    recording = mapped.of_mapping(imu, imu, MappingFile.model_validate(described), here, DelimitedTable)
    found = (
        "Its ground truth is the reference, in a local frame taken as east-north-up at the place that you assume; its "
        "heading is not true north."
        if truth.is_file()
        else f"There is no ground truth: {truth.parent.name}/{truth.name} is not beside it."
    )
    notes = tuple(note for note in recording.notes if "read as data.csv" not in note)
    first = f"The file {imu.parent.name}/{imu.name} is the IMU of an EuRoC recording."
    return replace(recording, notes=(first, found, *(note.replace("the mapping", "the format") for note in notes)))


def _imu(path: Path) -> dict:
    names = _names(path, IMU_COLUMNS, EXPECTED)
    return {
        "time": {"column": names[0], "unit": "ns"},
        "gyro": {"columns": names[1:4], "unit": "rad/s"},
        "accelerometer": {"columns": names[4:7], "unit": "m/s^2"},
    }


def _truth(path: Path, axes: str, origin: dict[str, float]) -> dict:
    names = _names(path, TRUTH_COLUMNS, "stamp, position, quaternion, velocity")
    return {
        "file": str(path.resolve()),
        "time": {"column": names[0], "unit": "ns"},
        "position": {"columns": names[1:4], "frame": "ENU", "origin": origin},
        "attitude": {"columns": names[4:8], "form": "w x y z", "frame": "ENU", "axes": axes},
        "velocity": {"columns": names[8:11], "axes": "ENU"},
    }


def _names(path: Path, count: int, expected: str) -> list[str]:
    names = DelimitedTable(path).names()
    if len(names) < count:
        raise DataRefused(f"{path}: {len(names)} columns, expected {count}: {expected}; copy the file again")
    return names
