"""Readers of files that others wrote, one file a format; every one gives the same type.

A reader takes a path and what the user assumes, key by key, and says in `notes` what it found and what it took for
what. `FORMATS` names them; `doctor` then examines what any of them read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from ins_eval.errors import UsageError, did_you_mean
from ins_eval.readers import (
    apm_mat,
    apm_text,
    cats,
    csv_table,
    dataflash,
    doctor,
    euroc,
    ins_recording,
    kf_gins,
    mat,
    mems_chamber,
    netcdf,
    novatel,
    psins_mat,
    psins_text,
    rosbag,
    ulog,
)
from ins_eval.readers.attribution import attributed
from ins_eval.recording import Recording


@dataclass(frozen=True)
class Format:
    """A format: its reader, one line that describes it, and the keys that a user may assume."""

    description: str
    read: Callable[[Path, Mapping[str, str]], Recording]
    keys: tuple[str, ...]


def _format(reader, description: str) -> Format:
    return Format(description, reader.read, (*reader.KEYS, *doctor.KEYS))


FORMATS = {
    "psins-text": _format(psins_text, "PSINS text .imu of a parked unit: a header and rows of counts"),
    "psins-mat": _format(psins_mat, "PSINS .mat with mimu and fogavp: a vehicle's IMU and a better navigator"),
    "apm-mat": _format(apm_mat, "ArduPilot log converted to .mat: IMU, GPS, ATT and their labels"),
    "apm-text": _format(apm_text, "ArduPilot log as a .zip of text tables: IMU.txt, GPS.txt, ATT.txt"),
    "csv": _format(csv_table, "any table; FILE.toml says what its columns are (without it, one is printed to fill in)"),
    "mat": _format(mat, "any MATLAB file, versions 4 to 7.3; FILE.toml says what its variables and fields are"),
    "netcdf": _format(netcdf, "any netCDF file; FILE.toml says what its variables are"),
    "ulog": _format(ulog, "PX4 log .ulg, also .gz: sensor_combined, GPS, attitude or local position"),
    "dataflash": _format(dataflash, "ArduPilot log .bin: IMU, GPS, ATT"),
    "kf-gins": _format(kf_gins, "KF-GINS text of an IMU in increments; GPS and reference in files of their own"),
    "novatel": _format(novatel, "NovAtel ASCII log: RAWIMUA or RAWIMUSA, BESTPOSA, BESTVELA, INSPVAA"),
    "euroc": _format(euroc, "EuRoC folder of a drone: imu0/data.csv and the ground truth beside it"),
    "rosbag": _format(rosbag, "ROS 1 or 2 bag: Imu, NavSatFix, TwistStamped, Odometry"),
    "cats": _format(cats, "CATS rocket flight computer, imu.csv: examined and refused with the reason"),
    "mems-chamber": _format(mems_chamber, "MEMS chamber rows without times: examined and refused with the reason"),
    "ins-recording": _format(ins_recording, "our own form, a folder: checked, gaps filled or cut, and written again"),
}

STATED_BY_USER = ("csv", "mat", "netcdf", "ins-recording")  # what is believed, by a mapping or the form


def read(format_name: str, path: str | Path, assumed: Mapping[str, str]) -> Recording:
    """What a file of the named format holds.

    Raises `UsageError` for a format or a key of `assumed` that is not known, and whatever the reader raises.
    """
    known = find(format_name)
    for key in assumed:
        if key not in known.keys:
            raise UsageError(f"--assume {key}: {format_name} does not know it{did_you_mean(key, known.keys)}")
    own_values = None if format_name in STATED_BY_USER else format_name
    return attributed(known.read(Path(path), assumed), own_values, assumed)


def find(format_name: str) -> Format:
    """The format of that name."""
    if format_name not in FORMATS:
        raise UsageError(f"format '{format_name}': is not known{did_you_mean(format_name, FORMATS)}")
    return FORMATS[format_name]
