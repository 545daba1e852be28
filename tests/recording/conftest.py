"""The real recording, where it lies beside the checkout."""

from __future__ import annotations

from pathlib import Path

import pytest

LASER_GYRO = Path("shared", "recordings", "rlg_static_vehicle", "lasergyro.imu")


@pytest.fixture(scope="session")
def laser_gyro() -> Path:
    """A parked laser-gyro unit, 1847 s at 100 Hz; its documentation is SOURCE.md beside it."""
    path = Path(__file__).resolve().parents[3] / LASER_GYRO
    if not path.exists():
        pytest.skip(f"the real recording ../{LASER_GYRO} is absent here")
    return path
