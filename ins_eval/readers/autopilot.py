"""What the logs of autopilots have in common: MEMS units, one clock since boot, an attitude found on board."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator, Mapping

import numpy as np

from ins_eval.errors import UsageError
from ins_eval.readers import assembly
from ins_eval.readers.apm_log import (
    ACCELEROMETER,
    GYRO,
    HEIGHT_SIGMA_M,
    POSITION_SIGMA_M,
    VELOCITY_SIGMA_MPS,
)
from ins_eval.readers.options import number
from ins_eval.recording import Fixes
from ins_eval.recording.belief import Belief, GpsBelief, HeightBelief

KEYS = (*(key for key in assembly.KEYS if not key.endswith(".unit")), "imu.instance")
US = 1e-6


def belief(gps: Fixes | None) -> Belief:
    """What is believed of an autopilot's MEMS unit and of a single-frequency receiver."""
    return Belief(
        gps=GpsBelief(position_sigma_m=POSITION_SIGMA_M, velocity_sigma_mps=VELOCITY_SIGMA_MPS),
        height=HeightBelief(source="none" if gps is None else "gps", sigma_m=HEIGHT_SIGMA_M),
        gyro=GYRO,
        accelerometer=ACCELEROMETER,
    )


def instance(assumed: Mapping[str, str], where: str, known: list[int]) -> int:
    """The number of the IMU to read, the first where none is assumed.

    Raises `UsageError` for one that the log does not have.
    """
    chosen = number(assumed, "imu.instance", known[0])
    if chosen not in known:
        raise UsageError(
            f"--assume imu.instance={assumed['imu.instance']}: {where} has the IMUs {', '.join(map(str, known))}; "
            "choose one of them"
        )
    return int(chosen)


def of_attitude(time_s: np.ndarray, attitude_rad: np.ndarray) -> Fixes | None:
    """A reference of attitude only, without rows that are not finite or not later than those before."""
    keep = np.isfinite(time_s) & np.isfinite(attitude_rad).all(axis=1)
    keep[keep] = later(time_s[keep])
    if not keep.any():
        return None
    return Fixes.of_attitude(time_s[keep], attitude_rad[keep], valid=True)


def later(time_s: np.ndarray) -> np.ndarray:
    """Where a stamp exceeds all before it, (n,) bool."""
    if not len(time_s):
        return np.zeros(0, dtype=bool)
    return np.concatenate([[True], time_s[1:] > np.maximum.accumulate(time_s)[:-1]])


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Keep what a library prints of a damaged file off the screen."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        yield
