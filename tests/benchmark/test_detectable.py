"""The sigma of an effect in arcs, as the oracle of real recordings states it, against how its estimates scatter."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from benchmark.scores import detectable

SCATTER_DRAWS, SCATTER_AGREES = 400, 0.045  # 4 sigma of a share of 5 percent


def test_the_oracle_knows_how_its_estimates_scatter_with_few_arcs_and_noise_with_memory() -> None:
    """As many arcs as a drive of 100 s has, an effect that shows in some of them, and noise with a memory of 10 fixes.

    Residuals of the fit, arc by arc, say too little here: a fourth of the estimates lay beyond their 95 percent.
    """
    rng, fixes, arcs, shared = np.random.default_rng(5), 25, 20, 10
    arc = np.repeat(np.arange(arcs), fixes)
    within = np.tile(np.linspace(-1.0, 1.0, fixes), arcs)[:, None]
    effect = rng.standard_normal((arcs, 1))[arc] ** 3 * within
    nuisances = 0.3 * rng.standard_normal((arcs, 1, shared))[arc] * within[..., None]
    beyond = np.empty(SCATTER_DRAWS, bool)
    for i in range(SCATTER_DRAWS):
        memory = lfilter([np.sqrt(1.0 - 0.9**2)], [1.0, -0.9], rng.standard_normal((arcs, 100 + fixes)))[:, -fixes:]
        left = memory.reshape(-1, 1) + nuisances @ rng.standard_normal(shared)
        seen = detectable._solved(effect, nuisances, left, np.ones(1), arc)
        beyond[i] = abs(seen.own) > 1.96 * seen.sigma
    assert beyond.mean() == pytest.approx(0.05, abs=SCATTER_AGREES)
