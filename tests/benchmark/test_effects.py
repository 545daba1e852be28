"""Effects have the stated sign, unit and shape; the oracle's linear dynamics agree with full navigation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from benchmark.scores import oracle, whitened
from benchmark.worlds import check, earth
from benchmark.worlds.cases import Case, a_unit, draw
from benchmark.worlds.effects import ARCSEC, DESCRIPTION, VOCABULARY, Effect, an_effect, creep, hysteresis
from benchmark.worlds.heat import filtered_rate
from benchmark.worlds.instruments import UG, Departures, accelerometer_output, compensated
from benchmark.worlds.outside import FORMS, an_outside
from benchmark.worlds.record import _rotation, feel, measure

RATE = 20.0
PLAIN_FLIGHTS = (0, 1, 2, 3, 5, 7, 11, 12, 20, 21, 22, 24, 27, 28)  # of seed 6, without a reference


@pytest.fixture(scope="module")
def unit():
    return a_unit(np.random.default_rng(4), "zero", pulses=True)


@pytest.fixture(scope="module")
def drive():
    return feel(np.random.default_rng(9), "drive", RATE, False)


def indicated(felt, unit, effect) -> np.ndarray:
    """What the belief reads more than is there, (n, 3) ug, when `effect` acts."""
    departures = Departures()
    effect(felt, departures)
    counts, _ = accelerometer_output(felt, departures, unit.belief, unit.sheet, unit.noise, np.random.default_rng(0))
    velocity = compensated(counts, unit.belief, felt.temperature, felt.dt)
    return (velocity - felt.velocity) / (UG * felt.dt)


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("accelerometer.bias", 300.0, lambda f: 300.0 + 0.0 * f.time_s),
        ("accelerometer.scale", 400.0, lambda f: 400.0 * f.force_g[:, 2]),
        ("accelerometer.bias_drift", 120.0, lambda f: 120.0 * f.time_s / 3600.0),
        ("accelerometer.bias_temperature", 20.0, lambda f: 20.0 * (f.temperature[:, 2] - 22.0)),
        ("accelerometer.scale_temperature_rate", 900.0, lambda f: 900.0 * f.rate[:, 2] * f.force_g[:, 2]),
        ("accelerometer.quadratic", 500.0, lambda f: 500.0 * f.force_g[:, 2] ** 2),
    ],
)
def test_an_accelerometer_reads_high_by_what_the_table_says(drive, unit, name, value, expected):
    """Mean over blocks of 100 s; a pulse more or less in a block is 0.03 ug. Products of belief and effect: 0.5 %."""
    got = indicated(drive, unit, Effect(name, "z", value, {}))
    block = round(100 * RATE)
    n = len(got) // block * block
    mean = lambda a: a[:n].reshape(-1, block).mean(axis=1)  # noqa: E731
    want = expected(drive)
    assert mean(got[:, 2]) == pytest.approx(mean(want), abs=0.005 * np.abs(want).max() + 0.1)
    assert np.abs(mean(got[:, 0])).max() < 0.1


def test_pendulous_and_output_axes_are_those_of_the_form(drive):
    """x: (x, z, y); y: (y, z, x); z: (z, x, y) as input, pendulous, output."""
    for axis, pendulous, output in ("xzy", "yzx", "zxy"):
        i, p, o = ("xyz".index(one) for one in (axis, pendulous, output))
        f = drive.force_g
        for name, other in (("cross_pendulous", p), ("cross_output", o)):
            signal = VOCABULARY[f"accelerometer.{name}"].signal(drive, i, {})
            assert np.array_equal(signal, f[:, i] * f[:, other])


def test_hysteresis_has_branches_of_unit_height_whatever_the_speed():
    up = np.linspace(0.0, 80.0, 8001)
    there = np.concatenate((up, up[::-1][1:], up[1:]))
    h = hysteresis(there, 4.0)
    assert h[8000] == pytest.approx(-1.0, abs=1e-6)
    assert h[16000] == pytest.approx(1.0, abs=1e-6)
    after = 8000 + 400  # 4 degC past the reversal: 63 % of the way to the other branch
    assert (h[after] + 1.0) / 2.0 == pytest.approx(1.0 - math.exp(-1.0), abs=0.01)
    assert hysteresis(there[::5], 4.0)[-1] == pytest.approx(h[-1], abs=1e-9)


def test_creep_follows_with_its_time_constant_and_starts_from_zero():
    """A step of temperature after the first sample: 1 - exp(-t / tau)."""
    dt, tau = 0.5, 600.0
    temperature = np.full(8000, 30.0)
    temperature[:2] = 20.0
    y = creep(temperature, dt, tau, "one")
    t = dt * np.arange(8000)
    assert y[0] == 0.0
    assert y[3000] == pytest.approx(10.0 * (1.0 - math.exp(-(t[3000] - 1.0) / tau)), abs=0.02)
    for law in ("several", "power"):
        other = creep(temperature, dt, tau, law)
        assert other[200] > y[200]  # quicker at first
        assert other[-1] < 10.0 and np.all(np.diff(other) >= 0.0)


def test_the_rate_of_a_ramp_is_the_ramp():
    """tau = 180 s: r(t) = 0.5 (1 - exp(-t / tau)) degC/min for a ramp of 0.5 degC/min."""
    t = np.arange(0.0, 2000.0, 10.0)
    assert filtered_rate(20.0 + 0.5 * t / 60.0, 10.0, 180.0) == pytest.approx(0.5 * (1 - np.exp(-t / 180.0)), abs=1e-12)


def test_a_flag_of_the_earth_changes_the_belief_and_no_data(unit):
    felt = feel(np.random.default_rng(2), "drive", RATE, False)
    one, two = Departures(), Departures()
    Effect("earth.coriolis", None, 1.0, {})(felt, two)
    first, second = (measure(np.random.default_rng(8), felt, unit, d, "drive", "drive") for d in (one, two))
    assert first.head["earth"]["coriolis"] and not second.head["earth"]["coriolis"]
    assert sum(second.head["earth"].values()) == 4
    for name, columns in first.tables.items():
        for key, values in columns.items():
            assert np.array_equal(values, second.tables[name][key], equal_nan=True)


def test_true_alignment_is_believed_alignment_turned_by_the_value(unit, drive):
    """Heading 900 arcsec: the true heading is larger than the believed one by that."""
    departures = Departures()
    Effect("alignment.heading", None, 900.0, {})(drive, departures)
    head = measure(np.random.default_rng(8), drive, unit, departures, "drive", "drive").head
    true = math.degrees(drive.truth.state([0.0])[2][0, 2])
    believed = head["start"]["attitude_deg"][2]
    assert (true - believed + 180.0) % 360.0 - 180.0 == pytest.approx(900.0 / 3600.0, abs=1e-6)


def test_the_antenna_and_the_stamps_are_off_by_the_value(unit, drive):
    plain, moved = Departures(), Departures()
    Effect("gps.time_offset", None, 0.25, {})(drive, moved)
    first, second = (measure(np.random.default_rng(8), drive, unit, d, "drive", "drive") for d in (plain, moved))
    a, b = first.tables["gps"], second.tables["gps"]
    k = int(np.argmax(np.abs(np.diff(a["velocity_n_mps"]))))
    i = int(np.flatnonzero(b["time_s"] == a["time_s"][k])[0])
    at = a["time_s"][k] - unit.offset_s - 0.25
    lever = np.array(unit.lever_m)
    _, speed, euler, turn = drive.truth.state([at])
    want = speed[0] + earth.from_euler(*euler[0]) @ np.cross(turn[0], lever)
    assert b["velocity_n_mps"][i] == pytest.approx(want[0], abs=1e-9)
    assert a["velocity_n_mps"][k] != pytest.approx(want[0], abs=1e-3)


@pytest.fixture(scope="module")
def parked(unit):
    """A parked recording without noise, seen by the oracle's linear dynamics."""
    felt = feel(np.random.default_rng(7), "static", RATE, False)
    made = measure(np.random.default_rng(8), felt, unit, Departures(), "static", "static")
    true = unit.noise | {"thermometer": {"step_c": 0.0, "noise_c": 0.0, "lag_s": 0.0, "period_s": 1.0}, "arw": 1e-6}
    return whitened.Moving(made, unit.sheet, true | {"vrw": 1e-6})


def response(system, effect) -> tuple[np.ndarray, np.ndarray]:
    """Velocity NED and position NED each second, of the linear dynamics without observations."""
    departures = Departures()
    effect(system.felt, departures)
    return free(system, *system.inputs(departures)[:2])


def free(system, u, x0):
    spin = np.array(((0, -earth.W, 0), (earth.W, 0, 0), (0, 0, 0)))
    radius = np.linalg.norm(earth.ecef(*system.lla[0]))
    x, out = x0.copy(), []
    for k in range(system.seconds):
        f = np.zeros((9, 9))
        f[:3, :3], f[3:6, 3:6], f[6:, 3:6] = -spin, -2 * spin, np.eye(3)
        w = system.force[k]
        f[3:6, :3] = np.array(((0, -w[2], w[1]), (w[2], 0, -w[0]), (-w[1], w[0], 0)))
        up = system.up[k]
        # as the judge's navigation has it: no gravity gradient upwards, its height is aided
        f[3:6, 6:] = -earth.G0 / radius * (np.eye(3) - np.outer(up, up))
        x = x + (f + f @ f / 2 + f @ f @ f / 6) @ x + (np.eye(9) + f / 2 + f @ f / 6)[:, :6] @ u[k]
        out.append(x)
    x = np.array(out)
    to_ned = system.ned.transpose(0, 2, 1)
    return np.einsum("nij,nj->ni", to_ned, x[:, 3:6]), np.einsum("nij,nj->ni", to_ned, x[:, 6:])


def test_a_level_error_swings_with_schulers_period(parked):
    """Level error a about east: velocity north = sqrt(g R) a sin(w t), the Earth's turning apart, while w t < 1.5.

    The true attitude is the believed one turned about east by a, so the force that holds the unit seems to lean north.
    """
    velocity, _ = response(parked, Effect("alignment.level", "east", 60.0, {}))
    g, r = earth.G0, 6.37e6
    t = np.arange(1, 1201)
    want = math.sqrt(g * r) * 60.0 * ARCSEC * np.sin(math.sqrt(g / r) * t)
    assert velocity[:1200, 0] == pytest.approx(want, abs=0.02 * want.max())


def test_a_gyro_bias_about_the_horizontal_makes_the_position_run_away(parked):
    """Velocity = R b (1 - cos w t), a right angle to the right of a bias b about a horizontal axis, for 900 s."""
    velocity, _ = response(parked, Effect("gyro.bias", "x", 0.1, {}))
    b, r = 0.1 * ARCSEC, 6.37e6
    t = np.arange(1, 901)
    want = r * b * (1.0 - np.cos(math.sqrt(earth.G0 / r) * t))
    heading = parked.truth.state([0.0])[2][0, 2]
    assert velocity[:900, 0] == pytest.approx(-want * math.sin(heading), abs=0.07 * want.max())
    assert velocity[:900, 1] == pytest.approx(want * math.cos(heading), abs=0.07 * want.max())


@pytest.mark.parametrize(
    ("name", "axis", "value", "parameters"),
    [
        ("gyro.bias", "y", 0.05, {}),
        ("accelerometer.bias", "x", 60.0, {}),
        ("accelerometer.misalignment", "x", 100.0, {"other_axis": "y"}),
        ("gyro.scale", "z", 80.0, {}),
        ("alignment.heading", None, 200.0, {}),
    ],
)
def test_linear_dynamics_agree_with_navigation_with_and_without_the_effect(drive, unit, name, axis, value, parameters):
    effect = Effect(name, axis, value, parameters)
    departures = Departures()
    effect(drive, departures)
    made = measure(np.random.default_rng(8), drive, unit, Departures(), "drive", "drive")
    system = whitened.Moving(made, unit.sheet, unit.noise)
    _, position = response(system, effect)
    gyro = drive.angle + np.broadcast_to(departures.gyro_deg_per_h, drive.angle.shape) * ARCSEC * drive.dt
    accel = drive.velocity + np.broadcast_to(departures.accel_ug, drive.angle.shape) * UG * drive.dt
    lla, speed, euler, _ = drive.truth.state([0.0])
    start = _rotation(-departures.attitude_rad) @ earth.from_euler(*euler[0])
    height = lambda t: drive.truth.state(t)[0][:, 2]  # noqa: E731
    got, _, _ = check.navigate(gyro, accel, RATE, lla[0], speed[0], start, height, 1)
    off = (got - earth.ecef(*drive.truth.state(drive.time_s)[0].T))[round(RATE) - 1 :: round(RATE)]
    n = min(len(off), len(position), 1500)
    east = np.einsum("nij,nj->ni", system.ned.transpose(0, 2, 1)[:n], off[:n])
    scale = np.abs(east[:, :2]).max()
    assert np.abs(position[:n, :2] - east[:, :2]).max() < 0.02 * scale


@pytest.mark.parametrize("name", [name for name, row in VOCABULARY.items() if row.target != DESCRIPTION])
def test_every_name_of_the_vocabulary_departs_from_the_belief(drive, name):
    departures = Departures()
    effect = an_effect(np.random.default_rng(3), name)
    effect.settle(2000.0)
    effect(drive, departures)
    assert effect.record()["unit"] == VOCABULARY[name].unit
    touched = [
        np.any(departures.accel_ug), np.any(departures.accel_ppm), np.any(departures.gyro_deg_per_h),
        departures.element_lag_s.any(), departures.attitude_rad.any(), departures.lever_m.any(),
        bool(departures.gps_offset_s), bool(departures.reference_offset_s), departures.reference_rad.any(),
        bool(departures.earth),
    ]  # fmt: skip
    assert sum(bool(one) for one in touched) == 1


@pytest.mark.parametrize("name", FORMS)
def test_every_form_outside_the_vocabulary_departs_from_the_belief(drive, name):
    departures = Departures()
    an_outside(np.random.default_rng(3), name)(drive, departures)
    functions = (departures.gps_velocity, departures.gps_position)
    arrays = (departures.accel_ug, departures.accel_ppm, departures.gyro_deg_per_h)
    assert sum(np.ndim(one) > 0 and np.any(one) for one in arrays) + sum(one is not None for one in functions) == 1


def test_the_oracle_sees_nothing_in_a_null_and_the_truth_in_a_clear_case(drive):
    unit = a_unit(np.random.default_rng(4), "plain", pulses=True)
    offset = Effect("gps.time_offset", None, 0.05, {})
    for hidden in ((), (offset,)):
        departures = Departures()
        for effect in hidden:
            effect(drive, departures)
        made = measure(np.random.default_rng(8), drive, unit, departures, "drive", "drive")
        found = oracle.judge(Case("case", "single", [made], {}, list(hidden)))
        if hidden:
            assert found["log_bayes_factor"] > 16.0 and found["margin"] > 5.0
        else:
            assert -found["margin"] < 4.0


@pytest.mark.slow
def test_each_of_several_effects_is_as_clear_as_a_regression_with_the_others_says():
    """sigma is |size| over its standard error of least squares; a rival is weighed by the evidence of its set."""
    rng = np.random.default_rng(4)
    names = (("gyro.scale", "x", {}), ("gyro.bias", "y", {}), ("gyro.asymmetry", "x", {}), ("gyro.bias", "z", {}))
    every = [Effect(name, axis, 2.0 * VOCABULARY[name].nominal, parameters) for name, axis, parameters in names]
    x = 3.0 * rng.standard_normal((40, 4)) @ (np.eye(4) + 0.3 * rng.standard_normal((4, 4)))
    a, b = x.T @ x, x.T @ (x[:, :2] @ [2.0, 2.0] + rng.standard_normal(40))
    positive = np.zeros(5, dtype=bool)
    found = oracle.beside(a, b, every[:2], [oracle.family(one) for one in every[2:]], positive)
    for k, one in enumerate(found):
        other = x[:, [1 - k]]
        own = x[:, k] - (other @ np.linalg.lstsq(other, x[:, [k]])[0])[:, 0]
        assert one["sigma"] == pytest.approx(2.0 * np.linalg.norm(own))
    two, scales = [2, 1], np.array(oracle.SCALES)  # log N(b; 0, A + A A s^2) - log N(b; 0, A) of a pair
    by_scale = [
        multivariate_normal.logpdf(b[two], cov=(of := a[np.ix_(two, two)]) + s**2 * of @ of)
        - multivariate_normal.logpdf(b[two], cov=of)
        for s in scales
    ]
    found = oracle.evidence_sets(a, b, np.array([two]), positive)
    assert found[0] == pytest.approx(logsumexp(by_scale) - np.log(len(scales)))
    single = oracle.evidence(a, b, positive[:4], positive[:4])
    np.testing.assert_allclose(oracle.evidence_sets(a, b, np.arange(4)[:, None], positive), single)
    alike = np.r_[np.c_[a, a[:, 0]], [np.r_[a[0], a[0, 0]]]]
    families = [oracle.family(one) for one in (*every[2:], every[2])]
    twin = oracle.beside(alike, np.append(b, b[0]), every[:2], families, positive)
    assert [one["rivals"] for one in twin] == [[{"rival": "gyro.asymmetry x", "margin": pytest.approx(0.0)}], []]


def test_the_oracle_knows_its_noise():
    """Whitened data of plain flights have unit variance, and what was drawn at the start is estimated as sure as said.

    14 flights of more than 15 000 values each: chi2 / n within 4 %; 9 x 14 standardised errors: spread 0.8 to 1.2
    (4 sigma of their number is 0.25).
    """
    errors = []
    for index in PLAIN_FLIGHTS:
        made = draw("development", 6, "null", index, 0.5 * RATE).made[0]
        assert made.kind == "flight" and "reference" not in made.tables
        system, sheet = whitened.Moving(made, made.unit.sheet, made.unit.noise), made.unit.sheet
        data, _, nuisances = system.whitened([])
        spread = np.linalg.inv(nuisances.T @ nuisances + np.eye(9))
        estimate = spread @ nuisances.T @ data
        assert np.mean((data - nuisances @ estimate) ** 2) == pytest.approx(1.0, abs=0.04)
        drawn = made.drawn
        start = np.array(drawn["start_rad"]) / np.radians(sheet["attitude_deg"])
        gyro = np.array(drawn["gyro_turn_on_deg_per_h"]) / sheet["gyro_bias_deg_per_h"]
        accel = np.array(drawn["accel_turn_on_ug"]) / sheet["accel_bias_ug"]
        true = np.concatenate((start, np.column_stack((gyro, accel)).ravel()))
        errors.append((estimate - true) / np.sqrt(np.diag(spread)))
    assert 0.8 < np.std(errors) < 1.2


def test_the_oracle_knows_that_a_bench_does_not_turn():
    """Drift of a level accelerometer: its own white noise q alone limits it, sigma^2 = 12 q^2 / T^3, no gyro bias does.

    In navigation its velocity is that of a gyro bias; a least-squares line with a free constant, through 2 hours, is
    the bound. The wander that a plain unit has is taken out; 3 % for the seconds at the ends.
    """
    unit = a_unit(np.random.default_rng(4), "plain", pulses=False)
    true = unit.noise | {"accel_wander_ug": 0.0, "gyro_wander_deg_per_h": 0.0, "vrw": 30.0}
    felt = feel(np.random.default_rng(7), "static", RATE, False)
    made = measure(np.random.default_rng(8), felt, unit, Departures(), "static", "static")
    drift = Effect("accelerometer.bias_drift", "x", 100.0, {})
    a, _, _ = oracle.reduced(*whitened.Moving(made, unit.sheet, true).whitened([drift]))
    noise_ug = true["vrw"] * unit.sheet["vrw_ug_per_sqrt_hz"]
    sigma = noise_ug * math.sqrt(12.0 / felt.time_s[-1] ** 3) * 3600.0
    assert a[0, 0] == pytest.approx((100.0 / sigma) ** 2, rel=0.03)


def test_what_is_counted_with_its_remainder_carried_is_no_random_walk():
    """Pulses of 8e-6 rad: what the oracle whitens of a bench has unit variance.

    To 6 %, since the rounding of an even turn is not white.
    """
    unit = a_unit(np.random.default_rng(4), "plain", pulses=False)
    unit.noise["gyro_quantum_rad"] = 8e-6
    felt = feel(np.random.default_rng(7), "static", RATE, False)
    made = measure(np.random.default_rng(8), felt, unit, Departures(), "static", "static")
    data, _, nuisances = whitened.Moving(made, unit.sheet, unit.noise).whitened([])
    left = data - nuisances @ np.linalg.solve(nuisances.T @ nuisances + np.eye(9), nuisances.T @ data)
    attitude = left.reshape(-1, 9)[:, 6:]
    assert np.mean(attitude**2) == pytest.approx(1.0, abs=0.06)


def test_there_is_more_outside_the_vocabulary_than_a_dozen():
    assert len(FORMS) >= 12
    assert not set(FORMS) & set(VOCABULARY)
