"""Where nothing is wrong and nothing is noisy, nothing is found: what is left is rounding."""

from __future__ import annotations

import pytest

from ins_eval.diagnosis import case as cases
from ins_eval.diagnosis.judge import judge

MOST_LOG_BAYES_FACTOR = 1.0


OTHERS = [pytest.param(name, marks=pytest.mark.slow) for name in ("box", "wing-rock", "straight")]


@pytest.mark.parametrize("name", ["climb-cruise-landing", "oven", *OTHERS])
def test_an_ideal_recording_shows_nothing(ideal_recording, name: str) -> None:
    judgement = judge([cases.prepare(ideal_recording(name))])
    assert judgement.statistics["largest_log_bayes_factor"] < MOST_LOG_BAYES_FACTOR
    assert judgement.statistics["smallest_probability"] == 1.0
    assert judgement.mismatches == ()
