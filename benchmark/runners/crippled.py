"""A diagnosis whose search is crippled: it does not know the effects of one sensor in what is navigated."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

from benchmark.runners import run

SENSORS = ("accelerometer", "gyro")


@contextmanager
def effects_left_out(sensor: str) -> Iterator[None]:
    """No effect of `sensor` is a candidate. In a chamber, where there is no other sensor, all are as ever."""
    from ins_eval.error_model import library

    possible = library.possible

    def of_others(effect, given) -> bool:
        return not effect.name.startswith(f"{sensor}.") and possible(effect, given)

    with patch.object(library, "possible", of_others):
        yield


def diagnose(sensor: str, folders: list[str], answer: str, limit_s: float = 0.0) -> tuple[int, str, float, float]:
    """As `run.diagnose`, by the crippled search."""
    with effects_left_out(sensor):
        return run.diagnose(folders, answer, limit_s)
