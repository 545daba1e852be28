"""Stamps that jitter, and stamps between which a sample is missing."""

from __future__ import annotations

import numpy as np
import pytest

from ins_eval.recording.stamps import BESIDE, LONGEST_STEP, gaps

STEP_S, SAMPLES, MISSING = 0.02, 20_000, 12_345


def jittered(sigma: float, missing: bool) -> np.ndarray:
    """Stamps at 50 Hz with white jitter of `sigma` samples, in order; one sample is `missing` or none."""
    at = np.arange(float(SAMPLES))
    at = np.delete(at, MISSING) if missing else at
    return STEP_S * np.sort(at + sigma * np.random.default_rng(4).standard_normal(at.size))


@pytest.mark.parametrize("sigma", [0.0, 0.1, 0.2])
def test_jitter_is_no_gap_and_a_missing_sample_is_one(sigma: float) -> None:
    stamps = jittered(sigma, missing=False)
    assert sigma < 0.2 or (np.diff(stamps) > LONGEST_STEP * STEP_S).sum() > 100  # it has steps as long as a gap
    assert gaps(stamps, least=1.0).size == 0
    found = gaps(jittered(sigma, missing=True), least=1.0)
    apart = abs(found - (MISSING - 1))  # steps that are long by jitter, so near that medians see the gap, count as well
    assert apart.min() <= 2 and apart.max() < BESIDE
