"""What the tests of the ensemble share."""

from __future__ import annotations

from pathlib import Path

import pytest

PROFILE = """\
name = "hop"
duration_s = 300.0

[start]
latitude_deg = 34.65
longitude_deg = 108.9
height_m = 400.0
heading_deg = 60.0
stand_s = 120.0

[[speed]]
from_s = 0.0
to_s = 60.0
to_mps = 100.0

[[turn]]
at_s = 150.0
by_deg = 60.0
bank_deg = 33.0

[thermal]
self_heating_c = 20.0
time_constant_s = 600.0
"""


@pytest.fixture
def profile(tmp_path: Path) -> Path:
    """A flight of five minutes."""
    path = tmp_path / "hop.toml"
    path.write_text(PROFILE)
    return path
