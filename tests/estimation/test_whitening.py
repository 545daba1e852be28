"""The filter against the same model written out densely, and means over blocks against single measurements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ins_eval.error_model.columns import Assembled
from ins_eval.error_model.propagation import walks
from ins_eval.estimation import alike, whitening
from ins_eval.estimation import case as cases
from ins_eval.estimation.blocks import EACH, Blocks
from ins_eval.estimation.coarse import coarse, coarse_noise
from ins_eval.estimation.evidence import Gained, log_evidence, mixture, sensitivity
from ins_eval.estimation.kalman import NoiseLevels, filtered, responded
from ins_eval.estimation.slope import Slopes, slopes
from ins_eval.estimation.whitening import gains, known_at, whiten
from ins_eval.units import DEG_PER_H, STANDARD_GRAVITY

NODES, EPOCHS = 16, 15
GYRO_DEG_PER_H, OF_BLOCKS = 0.05, 0.03  # of a chi-square
ROUNDING = 1e-7
STEP, QUOTIENT = 1e-4, 1e-5  # of a central difference
COLUMNS = 3  # beside the residual
LONG = 3000  # epochs
BLOCK = 5  # nodes
SIMPSONS = 0.05  # of a fifth power
LATE = 9  # node at which a column begins
MANY = 300  # columns that two threads share
JUMPS = 5 * EPOCHS
GIVEN = 7  # of them with whitened rows that are known, of two nodes


@pytest.fixture
def problem() -> tuple[Assembled, NoiseLevels]:
    """A small random problem of every part: drives, starts, observation terms, gaps, all kinds of noise."""
    rng = np.random.default_rng(5)
    interval_s = rng.uniform(0.5, 2.0, EPOCHS)
    matrices = 0.1 * rng.standard_normal((EPOCHS, 9, 9))
    residual = rng.standard_normal((NODES, 9))
    residual[rng.random((NODES, 9)) < 0.3] = np.nan
    terms = [(c, target, s, slow) for c in range(COLUMNS + 1) for target, s, slow in ((3, 0, 0), (6, 1, 1), (0, 2, 1))]
    shown = [(0, 0, 0), (2, 1, 1)]
    start = rng.standard_normal((COLUMNS + 1, 9))
    start[0] = 0.0
    observed = rng.standard_normal((NODES, 2, 9))
    observed[:, 0] = np.nan_to_num(residual)
    assembled = Assembled(
        count=COLUMNS + 1,
        still=False,
        acting=np.tile([0, NODES], (COLUMNS + 1, 1)),
        start=start,
        transition=np.eye(9) + matrices,
        half=np.eye(9) + 0.5 * matrices,
        walks=walks(np.eye(9) + matrices, np.eye(9) + 0.4 * matrices, np.tile(np.eye(3), (EPOCHS, 2, 1, 1))),
        spread=np.tile(np.eye(3), (EPOCHS, 2, 1, 1)),
        coupling=0.3 * rng.standard_normal((EPOCHS, 9, 6)),
        interval_s=interval_s,
        sources=rng.standard_normal((EPOCHS, 3, 3)),
        slow_epochs=np.stack([np.ones(EPOCHS), rng.standard_normal(EPOCHS)]),
        drive_terms=np.array(terms, dtype=np.int64),
        drive_weights=rng.standard_normal(len(terms)),
        residual=residual,
        design=rng.standard_normal((NODES, 9, 9)),
        observed=observed,
        slow_nodes=np.stack([np.ones(NODES), rng.standard_normal(NODES)]),
        observation_terms=np.array(shown, dtype=np.int64),
        observation_weights=np.array([1.0, 0.7]),
    )
    levels = NoiseLevels(
        white=rng.uniform(0.5, 2.0, (NODES, 9)),
        force=rng.uniform(0.1, 0.2, EPOCHS),
        rate=rng.uniform(0.1, 0.2, EPOCHS),
        steps=np.einsum("kij,klj->kil", *[0.3 * rng.standard_normal((EPOCHS, 3, 3))] * 2),
        slow_sigma=rng.uniform(0.5, 1.0, 9),
        slow_time_s=rng.uniform(2.0, 20.0, 9),
        jumps=rng.uniform(0.0, 0.4, (EPOCHS, 3)) * (rng.random((EPOCHS, 1)) < 0.3),
        wander_sigma=rng.uniform(0.1, 0.5, 6),
        wander_time_s=np.repeat([15.0, 4.0], 3),
    )
    return assembled, levels


def on_a_bench(problem) -> tuple[Assembled, NoiseLevels]:
    """The same measurements where nothing moves, of columns that are all shown."""
    assembled, levels = problem
    shown = np.array([(0, 0, 0), (1, 1, 0), (2, 1, 1), (3, 0, 1)])
    still = replace(
        assembled,
        still=True,
        transition=np.tile(np.eye(9), (EPOCHS, 1, 1)),
        **{name: np.zeros_like(getattr(assembled, name)) for name in ("half", "coupling", "design", "start")},
        observation_terms=shown,
        observation_weights=np.array([1.0, -0.4, 0.7, 0.3]),
    )
    return still, levels


def dense(c: Assembled, n: NoiseLevels) -> tuple[np.ndarray, np.ndarray]:
    """Columns (rows, 1 + m) without any filter, and the covariance (rows, rows) of the noise, written out."""
    time_s = np.append(0.0, np.cumsum(c.interval_s))
    # responses by plain recursion
    columns = np.zeros((NODES, 9, c.count))
    state = c.start.T.copy()
    responses = [state]
    for e in range(EPOCHS):
        pushed = np.zeros((9, c.count))
        for (column, target, s, slow), weight in zip(c.drive_terms, c.drive_weights, strict=True):
            pushed[target : target + 3, column] += weight * c.slow_epochs[slow, e] * c.sources[e, s]
        state = c.transition[e] @ state + c.half[e] @ pushed
        responses.append(state)
    for k in range(NODES):
        columns[k] = c.design[k] @ responses[k]
        for (column, s, slow), weight in zip(c.observation_terms, c.observation_weights, strict=True):
            columns[k, :, column] += weight * c.slow_nodes[slow, k] * c.observed[k, s]
    # navigation noise: sum over epochs of what each adds, carried on
    to = np.zeros((NODES, NODES, 9, 9))  # to[k, e]: from just after epoch e to node k
    for e in range(1, NODES):
        to[e, e] = np.eye(9)
        for k in range(e + 1, NODES):
            to[k, e] = c.transition[k - 1] @ to[k - 1, e]
    lag = np.abs(time_s[:, None] - time_s)
    start_free = [
        np.exp(-lag / apart) - np.exp(-(time_s[:, None] + time_s) / apart) for apart in n.wander_time_s
    ]  # of each sensor, (nodes, nodes)
    noise = np.zeros((NODES, 9, NODES, 9))
    for k in range(NODES):
        for j in range(NODES):
            cov = np.zeros((9, 9))
            for e in range(1, min(k, j) + 1):
                q = n.force[e - 1] * c.walks[e - 1, 0] + n.rate[e - 1] * c.walks[e - 1, 1]
                q[3:6, 3:6] += n.steps[e - 1]
                cov += to[k, e] @ q @ to[j, e].T
            for e in range(1, k + 1):  # the wander at the beginning of an epoch acts through it
                for f in range(1, j + 1):
                    w = np.diag(n.wander_sigma**2 * [one[e - 1, f - 1] for one in start_free])
                    cov += to[k, e] @ c.coupling[e - 1] @ w @ c.coupling[f - 1].T @ to[j, f].T
            block = c.design[k] @ cov @ c.design[j].T
            block += np.diag(n.slow_sigma**2 * np.exp(-lag[k, j] / n.slow_time_s))
            since = time_s[[k, j]].sum() - 2.0 * time_s[1 : min(k, j) + 1]  # a jump decays as the error does
            for i in range(3):
                block[i, i] += n.jumps[: min(k, j), i] @ np.exp(-since / n.slow_time_s[i])
            if k == j:
                block += np.diag(n.white[k] ** 2)
            noise[k, :, j, :] = block
    here = np.isfinite(c.residual).ravel()
    covariance = noise.reshape(NODES * 9, NODES * 9)[np.ix_(here, here)]
    return columns.reshape(NODES * 9, -1)[here], covariance


@pytest.mark.parametrize("of", [lambda problem: problem, on_a_bench], ids=["moving", "still"])
def test_whitened_sums_are_those_of_the_dense_covariance(problem, of) -> None:
    assembled, levels = of(problem)
    columns, covariance = dense(assembled, levels)
    expected = columns.T @ np.linalg.solve(covariance, columns)
    sums = whiten(assembled, levels)
    np.testing.assert_allclose(sums.normal, expected[1:, 1:], rtol=ROUNDING, atol=ROUNDING)
    np.testing.assert_allclose(sums.projection, expected[1:, 0], rtol=ROUNDING, atol=ROUNDING)
    assert sums.square == pytest.approx(expected[0, 0], rel=ROUNDING)
    assert sums.log_determinant == pytest.approx(np.linalg.slogdet(covariance)[1], rel=ROUNDING)
    assert sums.rows == covariance.shape[0]


def test_columns_that_begin_late_are_those_of_the_dense_covariance(problem, monkeypatch) -> None:
    monkeypatch.setattr(whitening, "_CHUNK", 4)
    assembled, levels = problem
    late = assembled.drive_terms[:, 0] == 1
    start, slow_epochs, slow_nodes = (x.copy() for x in (assembled.start, assembled.slow_epochs, assembled.slow_nodes))
    start[1], slow_epochs[1, : LATE - 1], slow_nodes[1, :LATE] = 0.0, 0.0, 0.0
    terms, acting = assembled.drive_terms.copy(), assembled.acting.copy()
    terms[late, 3], acting[1, 0] = 1, LATE
    changed = {"start": start, "slow_epochs": slow_epochs, "slow_nodes": slow_nodes, "acting": acting}
    assembled = replace(assembled, drive_terms=terms, **changed)
    columns, covariance = dense(assembled, levels)
    expected = columns.T @ np.linalg.solve(covariance, columns)
    sums = whiten(assembled, levels, keep=2)
    np.testing.assert_allclose(sums.normal, expected[1:, 1:], rtol=ROUNDING, atol=ROUNDING)
    np.testing.assert_allclose(sums.projection, expected[1:, 0], rtol=ROUNDING, atol=ROUNDING)
    kept = sums.kept[np.isfinite(assembled.residual)]
    np.testing.assert_allclose(kept.T @ kept, expected[:2, :2], rtol=ROUNDING, atol=ROUNDING)


def _sum_of(problem: tuple[Assembled, NoiseLevels]) -> float:
    """The log evidence of the last column with a mixture, the others with a standard normal prior, written densely."""
    columns, covariance = dense(*problem)
    seen, free = columns[:, 0], columns[:, 1:-1]
    covariance = covariance + free @ free.T
    heights = []
    for scale in (0.3, 4.0):
        wide = covariance + scale**2 * np.outer(columns[:, -1], columns[:, -1])
        heights.append(-0.5 * seen @ np.linalg.solve(wide, seen) - 0.5 * np.linalg.slogdet(wide)[1])
    return float(np.logaddexp(*heights) - np.log(2.0) - 0.5 * seen.size * np.log(2.0 * np.pi))


@pytest.mark.parametrize(
    ("of", "part"),
    [(lambda problem: problem, part) for part in Slopes._fields]
    + [(on_a_bench, part) for part in ("white", "slow_sigma", "slow_time_s", "wander_sigma")],
)
def test_slopes_are_those_of_the_dense_covariance(problem, of, part) -> None:
    assembled, levels = problem = of(problem)
    height, found = slopes(assembled, levels, lambda sums: sensitivity(sums, COLUMNS - 1, _two_sizes))
    assert height == pytest.approx(_sum_of(problem), rel=ROUNDING)
    direction = np.random.default_rng(3).standard_normal(getattr(found, part).shape)

    def moved(step):
        return _sum_of((assembled, levels._replace(**{part: getattr(levels, part) + step * direction})))

    difference = (moved(STEP) - moved(-STEP)) / (2.0 * STEP)
    assert np.vdot(getattr(found, part), direction) == pytest.approx(difference, rel=QUOTIENT)


def test_slopes_stay_exact_where_errors_grow_for_long(problem) -> None:
    """Heights of a free INS grow by exp(t / 570 s); what rounding leaves in the adjoint may not grow with them."""
    assembled, levels = problem
    nodes, epochs = np.arange(LONG + 1) % NODES, np.arange(LONG) % EPOCHS
    by_epoch = ("transition", "half", "walks", "coupling", "interval_s", "sources")
    by_node = ("residual", "design", "observed")
    assembled = replace(
        assembled,
        **{name: getattr(assembled, name)[epochs] for name in by_epoch},
        **{name: getattr(assembled, name)[nodes] for name in by_node},
        slow_epochs=np.ascontiguousarray(assembled.slow_epochs[:, epochs]),
        slow_nodes=np.ascontiguousarray(assembled.slow_nodes[:, nodes]),
    )
    levels = levels._replace(white=levels.white[nodes], force=levels.force[epochs], rate=levels.rate[epochs])
    levels = levels._replace(steps=levels.steps[epochs], jumps=levels.jumps[epochs])
    _, found = slopes(assembled, levels, sensitivity)
    for part in ("slow_sigma", "slow_time_s", "wander_sigma"):
        direction = np.random.default_rng(3).standard_normal(getattr(found, part).shape)
        sides = [levels._replace(**{part: getattr(levels, part) + step * direction}) for step in (STEP, -STEP)]
        above, below = (log_evidence(whiten(assembled, one)) for one in sides)
        assert np.vdot(getattr(found, part), direction) == pytest.approx((above - below) / (2.0 * STEP), rel=1e-3)


def test_blocks_of_which_a_part_is_lost_keep_what_moves(flight) -> None:
    """Exact fixes, one of ten lost, of an INS that moves by metres a second off: what is uncertain anyway tells it all.

    The mean of what is there of a block stands beside its middle.
    """
    lost = np.random.default_rng(4).random(flight.gps.time_s.size) < 0.1
    gyro = flight.imu.gyro + GYRO_DEG_PER_H * DEG_PER_H * np.median(np.diff(flight.imu.time_s))
    fixes = replace(flight.gps, valid=flight.gps.valid & ~lost)
    case = cases.prepare(replace(flight, gps=fixes, imu=replace(flight.imu, gyro=gyro)))
    at = np.zeros(len(case.noise.free))
    left = []
    for blocks in (EACH, Blocks(5)):
        sums = case.whitened([], at, blocks)
        known = np.eye(len(case.nuisances)) + sums.normal
        left.append(sums.square - sums.projection @ np.linalg.solve(known, sums.projection))
    assert left[1] == pytest.approx(left[0], rel=OF_BLOCKS)


def test_jumps_are_where_they_were_on_blocks(flight) -> None:
    case = cases.prepare(flight)
    jumps = np.zeros_like(case.noise.jumps)
    jumps[[1000, 4002]] = [1.0, 2.0, 3.0], [4.0, 5.0, 6.0]
    on_blocks = coarse_noise(replace(case.noise, jumps=jumps), Blocks(5), case.seen.residual)
    epochs = np.flatnonzero(on_blocks.jumps.any(axis=1))
    np.testing.assert_allclose(on_blocks.jumps[epochs], jumps[[1000, 4002]])
    begin_s = np.append(0.0, np.cumsum(on_blocks.interval_s))[epochs]
    jumped_s = np.append(0.0, np.cumsum(case.noise.interval_s))[[1000, 4002]]
    assert ((jumped_s - begin_s >= 0.0) & (jumped_s - begin_s < on_blocks.interval_s[epochs])).all()


def _two_sizes(a: np.ndarray, b: np.ndarray) -> Gained:
    return mixture(a, b, [np.array([[0.3]]), np.array([[4.0]])])


def test_means_over_blocks_keep_what_is_slow(flight) -> None:
    case = cases.prepare(flight)
    fine = case.assembled()
    at = np.zeros(len(case.noise.free))
    single = whiten(fine, case.noise.levels(at)).normal.diagonal()
    five = Blocks(5)
    means = whiten(coarse(fine, five), coarse_noise(case.noise, five, fine.residual).levels(at)).normal.diagonal()
    slow = np.array(["smoothed" not in column.name for column in case.nuisances])  # what smoothing leaves is fast
    np.testing.assert_allclose(means[slow], single[slow], rtol=0.03)


def test_random_walks_move_positions_and_tilts_within_a_block(problem) -> None:
    """On blocks as by single nodes, and q^2 t^3 / 3 of a position, of a velocity that a tilt drives g^2 as much."""
    assembled, levels = problem
    force, rate, nodes = 0.1, 0.2, EPOCHS // BLOCK * BLOCK + 1
    f = np.zeros((9, 9))
    f[:3, 3:6], f[3, 7], f[4, 6] = np.eye(3), STANDARD_GRAVITY, -STANDARD_GRAVITY
    over = lambda t: np.eye(9) + t * f + 0.5 * t**2 * f @ f  # noqa: E731
    still = replace(
        assembled,
        transition=np.tile(over(1.0), (nodes - 1, 1, 1)),
        half=np.tile(over(0.5), (nodes - 1, 1, 1)),
        walks=np.tile(walks(over(1.0)[None], over(0.5)[None], np.tile(np.eye(3), (1, 2, 1, 1))), (nodes - 1, 1, 1, 1)),
        spread=np.tile(np.eye(3), (nodes - 1, 2, 1, 1)),
        coupling=np.zeros((nodes - 1, 9, 6)),
        interval_s=np.ones(nodes - 1),
        residual=np.full((nodes, 9), np.nan),
    )
    of = Blocks(BLOCK)
    quiet = {name: np.zeros_like(getattr(levels, name)) for name in ("slow_sigma", "wander_sigma")}
    for one, middle in ((still, np.arange(nodes)), (coarse(still, of), [0, *range(1 + BLOCK // 2, nodes, BLOCK)])):
        walk = levels._replace(force=force * one.interval_s, rate=rate * one.interval_s)
        walk = walk._replace(steps=np.zeros((one.interval_s.size, 3, 3)))
        found = gains(one, walk._replace(**quiet), adjoint_of=1).tape.covariance
        for k, t in enumerate(middle):
            tilted = rate * STANDARD_GRAVITY**2
            expected = [force * t**3 / 3.0 + tilted * t**5 / 20.0, force * t + tilted * t**3 / 3.0, rate * t]
            np.testing.assert_allclose(np.diag(found[k])[[0, 3, 6]], expected, rtol=SIMPSONS)


def test_the_kernel_is_compiled_once(problem) -> None:
    """Another layout of one array costs a new user a second compilation, as long as the diagnosis of a flight."""
    assembled, levels = problem
    whiten(coarse(assembled, Blocks(5)), levels)
    acting, start = np.resize(assembled.acting, (MANY, 2)), np.resize(assembled.start, (MANY, 9))
    wide = replace(assembled, count=MANY, acting=acting, start=start)
    few, many = whiten(assembled, levels), whiten(wide, levels)
    np.testing.assert_allclose(many.normal[:COLUMNS, :COLUMNS], few.normal, rtol=ROUNDING)
    slopes(assembled, levels, sensitivity)
    assert len(filtered.signatures) == len(responded.signatures) == 1


def test_jumps_and_intervals_that_are_over_are_whitened_together(problem, monkeypatch) -> None:
    assembled, levels = problem
    at, kind = np.divmod(np.arange(JUMPS), 5)  # four kinds of jumps, and an interval, at every node
    elapsed = np.arange(EPOCHS) - np.arange(EPOCHS)[:, None]
    terms = np.column_stack([np.arange(JUMPS), 3 * (kind % 2) + 3, kind % 3, at + EPOCHS * (kind == 4)])
    many = replace(
        assembled,
        count=JUMPS,
        acting=np.column_stack([at + 1, np.where(kind == 4, np.minimum(at + 3, NODES), NODES)]),
        start=np.zeros((JUMPS, 9)),
        slow_epochs=np.vstack([elapsed >= 0, (elapsed >= 0) & (elapsed < 2)]).astype(float),
        drive_terms=terms,
        drive_weights=np.ones(JUMPS),
        observation_terms=np.array([(0, 0, 0), (7, 1, 0)]),
        observation_weights=np.array([1.0, 0.7]),
    )
    monkeypatch.setattr(whitening, "_CHUNK", 3)
    few_are_worth = alike.WORTH
    together = whiten(many, levels, keep=2)
    assert any(alike.Split.of_nodes(many, 2, k, k + 3).drives.size for k in range(0, NODES, 3))
    monkeypatch.setattr(alike, "WORTH", JUMPS)
    apart = whiten(many, levels, keep=2)
    few = replace(
        many,
        count=GIVEN,
        acting=many.acting[:GIVEN],
        start=many.start[:GIVEN],
        drive_terms=terms[:GIVEN],
        drive_weights=np.ones(GIVEN),
        observation_terms=np.array([(0, 0, 0)]),
        observation_weights=np.array([1.0]),
    )
    monkeypatch.setattr(alike, "WORTH", few_are_worth)
    given = whiten(many, levels, keep=2, known=known_at(few, levels))
    monkeypatch.setattr(whitening, "_MOST_KNOWN", 0)
    assert known_at(few, levels).rows.size == 0
    bare = whiten(many, levels, keep=2, known=known_at(few, levels))
    for found in (together, given, bare):
        for one, other in zip(found.__dict__.values(), apart.__dict__.values(), strict=True):
            np.testing.assert_allclose(one, other, rtol=ROUNDING, atol=1e-12 * apart.square)
