"""The covariance of a coefficient that differs from stretch to stretch, against how estimates of it scatter."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ins_eval.error_model.columns import Column
from ins_eval.estimation.scatter import STRETCHES, scattered
from ins_eval.estimation.study import Hypothesis

DRAWS, NODES, CHANNELS = 1000, 400, 9
DIFFERS = 0.1  # one sigma from stretch to stretch, ten times what white noise makes of the whole
AGREES = 0.15  # three sigmas of a variance of so many draws
MODEL = [Hypothesis(None, (Column("", ()),))]


def estimate(rng: np.random.Generator, differs: float, kind: str = "flight") -> tuple[float, float]:
    """A coefficient that is 1 on average by least squares, and its variance by its scatter."""
    z, nuisance = rng.standard_normal((2, NODES, CHANNELS))
    each = 1.0 + differs * rng.standard_normal(STRETCHES)
    e = z * np.repeat(each, NODES // STRETCHES)[:, None] + 3.0 * nuisance + rng.standard_normal(z.shape)
    rows = np.stack([nuisance, z], axis=-1)
    normal = np.einsum("kci,kcj->ij", rows, rows)
    whitened = SimpleNamespace(
        kept=np.concatenate([e[..., None], rows], axis=-1), normal=normal, projection=np.einsum("kci,kc->i", rows, e)
    )
    case = SimpleNamespace(
        believed=SimpleNamespace(arcs=(0,)), kind=kind, nuisances=(None,), whitened=lambda *_, keep: whitened
    )
    covariance = np.linalg.inv(normal)
    value = float((covariance @ whitened.projection)[1])
    return value, float(scattered([case], MODEL, [None], np.array([value]), covariance[1:, 1:])[0])


@pytest.mark.parametrize("differs", [0.0, DIFFERS])
def test_the_variance_is_that_of_estimates_whatever_the_noise_model_says(differs: float) -> None:
    rng = np.random.default_rng(3)
    found, told = np.transpose([estimate(rng, differs) for _ in range(DRAWS)])
    assert np.mean(told) == pytest.approx(np.var(found), rel=AGREES)


def test_a_parked_unit_has_the_variance_of_its_noise_model() -> None:
    assert estimate(np.random.default_rng(3), DIFFERS, "static")[1] == 0.0
