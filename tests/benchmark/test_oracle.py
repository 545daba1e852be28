"""What the oracle knows of rivals: twins by the closed form of two correlated columns, sizes that have one sign."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from benchmark.scores import oracle
from benchmark.scores.oracle import SCALES, TWIN, twins
from benchmark.scores.score import SEPARABLE
from benchmark.worlds.cases import draw

INFORMATION, SIGMAS = 1.0, 30.0
TRUTH, OTHER = ("accelerometer.bias", "z"), ("accelerometer.scale", "z")
RATE_HZ, LONG_LAG = 5.0, 21  # of a case that conceals 125 s


@pytest.mark.parametrize(("more", "is_twin"), [(0.5 * TWIN, True), (2.0 * TWIN, False)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("positive", [True, False])
def test_a_column_is_a_twin_by_its_correlation_with_the_truth(
    more: float, is_twin: bool, sign: float, positive
) -> None:
    """Of an effect of S sigma a column of correlation r leaves S^2 (1 - r^2) more of chi-square."""
    r = sign * np.sqrt(1.0 - more / SIGMAS**2)
    normal = INFORMATION * np.array([[1.0, r], [r, 1.0]])
    free, only_other = np.array([False, False]), np.array([False, True])
    found = twins(normal, normal @ [SIGMAS, 0.0], [TRUTH, OTHER], free, only_other if positive else free)
    assert found == ({OTHER} if is_twin and (sign > 0.0 or not positive) else set())
    assert not twins(normal, normal @ [SIGMAS, 0.0], [TRUTH, OTHER], only_other, free)  # of size 1, not 30


@pytest.mark.parametrize("b", [-6.0, 0.5, 8.0])
def test_a_size_of_one_sign_has_the_evidence_of_the_half_that_is_left(b: float) -> None:
    """Integral over sizes x > 0 of exp(b x - a x^2 / 2) by twice the normal prior, mean over its scales."""
    a = 4.0

    def over_prior(x: float, scale: float) -> float:
        return 2.0 * np.exp(b * x - 0.5 * a * x**2 - 0.5 * (x / scale) ** 2) / (scale * np.sqrt(2.0 * np.pi))

    expected = np.log(np.mean([quad(over_prior, 0.0, 20.0, args=(s,), points=[max(b / a, 0.1)])[0] for s in SCALES]))
    normal, positive = np.diag([a, a]), np.array([True, False])
    found = oracle.evidence(normal, np.array([b, b]), np.zeros(2, dtype=bool), positive)
    assert found[0] == pytest.approx(expected, rel=1e-6)
    of_sets = oracle.evidence_sets(normal, np.array([b, b]), np.array([[0], [1]]), positive)
    np.testing.assert_allclose(of_sets, found)


def test_an_effect_of_a_column_is_no_rival_where_none_is_recorded() -> None:
    """Of parked recordings whose accelerometers have an offset, one has the vibration and one has not."""
    for index, recorded in ((0, True), (13, False)):
        case = draw("sealed", 31, "unidentifiable", index, RATE_HZ, True)
        assert ("vibration_rms_g" in case.made[0].tables["imu"]) == recorded
        twins_of_it = oracle.judge(case)["twins"]
        assert twins_of_it and any("vibration" in one for one in twins_of_it) == recorded


def test_a_long_lag_is_known_by_what_it_does_and_not_by_a_short_one() -> None:
    """A lag of 125 s is no rate term, though to first order it is one: rates lie far below it."""
    found = oracle.judge(draw("sealed", 31, "single", LONG_LAG, RATE_HZ, True))
    assert found["margin"] > SEPARABLE and not found["twins"]
