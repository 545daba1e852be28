"""A parked unit of a few seconds, and files that are not what they seem."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np

from ins_eval.earth import EARTH_RATE, gravity
from ins_eval.recording import Fixes, Imu, Recording, Start, form

LATITUDE_RAD, LONGITUDE_RAD, HEIGHT_M, RATE_HZ = 0.6, 1.9, 400.0, 10.0
STAND_S = 80.0


def parked(folder: Path, name: str = "unit", lasts_s: float = 120.0, seed: int = 1) -> Path:
    """A recording at rest, level and heading north, with fixes each second; written in the form."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(1, round(lasts_s * RATE_HZ) + 1) / RATE_HZ
    rate = EARTH_RATE * np.array([np.cos(LATITUDE_RAD), 0.0, -np.sin(LATITUDE_RAD)])
    force = np.array([0.0, 0.0, -float(gravity(LATITUDE_RAD, HEIGHT_M))])
    imu = Imu(
        time_s=time_s,
        gyro=rate / RATE_HZ + 1e-7 * rng.standard_normal((time_s.size, 3)),
        accelerometer=force / RATE_HZ + 1e-5 * rng.standard_normal((time_s.size, 3)),
        accelerometer_form="increment",
        temperature_c=20.0 + 0.01 * time_s,
    )
    start = Start(0.0, LATITUDE_RAD, LONGITUDE_RAD, HEIGHT_M, attitude_rad=(0.0, 0.0, 0.0), still_until_s=STAND_S)
    form.write(Recording(name, "static", start, imu, gps=_fixes(lasts_s, rng)), folder)
    return folder


def _fixes(lasts_s: float, rng: np.random.Generator) -> Fixes:
    time_s = np.arange(1.0, lasts_s)
    of_each = np.ones(time_s.size)
    return Fixes(
        time_s=time_s,
        latitude_rad=LATITUDE_RAD + 1e-7 * rng.standard_normal(time_s.size),
        longitude_rad=LONGITUDE_RAD + 1e-7 * rng.standard_normal(time_s.size),
        height_m=HEIGHT_M + rng.standard_normal(time_s.size),
        velocity_n=0.02 * rng.standard_normal((time_s.size, 3)),
        valid=of_each.astype(bool),
    )


def rewritten(folder: Path, old: str, new: str) -> Path:
    """The recording with a part of its description replaced, which must stand there."""
    file = folder / "recording.toml"
    text = file.read_text()
    assert old in text, old
    file.write_text(text.replace(old, new))
    return folder


def gzip_bomb(unpacked_bytes: int) -> bytes:
    """A gzip file of that many zeros, a thousandth of it long."""
    packer, step = zlib.compressobj(9, wbits=31), b"\0" * (1 << 24)
    parts = [packer.compress(step) for _ in range(unpacked_bytes // len(step) + 1)]
    return b"".join([*parts, packer.flush()])


def matlab_bomb(unpacked_bytes: int, elements: int) -> bytes:
    """A MATLAB 5 file with compressed elements that unpack to zeros."""
    packer, step = zlib.compressobj(9), b"\0" * (1 << 24)
    head = (14).to_bytes(4, "little") + min(unpacked_bytes, 2**32 - 1).to_bytes(4, "little")
    parts = [packer.compress(head), *(packer.compress(step) for _ in range(unpacked_bytes // len(step) + 1))]
    packed = b"".join([*parts, packer.flush()])
    element = (15).to_bytes(4, "little") + len(packed).to_bytes(4, "little") + packed
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + element * elements
