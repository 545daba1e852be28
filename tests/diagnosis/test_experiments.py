"""What a planned experiment is worth: the formula against Gaussian densities, plans against the mechanization, and
pairs of effects of which it is known what tells them apart.

A parked box sees a constant drive from one side only; what follows the attitude (an Earth rate, gravity along an axis)
parts from what does not as soon as the box is turned, and not by standing longer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from ins_eval.diagnosis.answer import experiments_plans as plans
from ins_eval.diagnosis.answer.experiments import (
    Catalogue,
    expected_log_bayes_factor,
    information,
)
from ins_eval.earth import EARTH_RATE, gravity
from ins_eval.error_model.library import Candidate
from ins_eval.error_model.null import believe, solve
from ins_eval.error_model.observations import nodes, observe, sources
from ins_eval.error_model.propagation import build
from ins_eval.estimation.case import Case, prepare
from ins_eval.estimation.chamber import prepare_chamber
from ins_eval.estimation.evidence import SCALES
from ins_eval.imu import Mission
from ins_eval.policy import Policy
from ins_eval.profile import Place, Profile, SpeedChange, Thermal, load
from ins_eval.recording import Imu, Recording, Start
from ins_eval.recording.belief import AccelerometerBelief, AxisBelief, BiasBelief, EarthBelief, ScaleBelief
from ins_eval.units import DEG, UG
from tests.beliefs import navigation_grade
from tests.ideal import RATE_HZ, ideal

DRAWS = 500
CLOSE_NATS = 0.4  # of the average over draws: its own scatter, and the log of a mean against the mean of logs
UNMOVED = 1.0  # nats that an experiment adds which cannot tell two effects apart
NEXT_TO_NOTHING = 1e-6  # of what the right experiment tells
LEFT_SIGMA = 2.0  # of a measurement, by which a planned recording may leave its own plan
LEFT_OF_BANKS_SIGMA = 20.0  # after turns at 60 degrees of bank, at a few samples a second
LATITUDE = 40.0 * DEG
HEADING = 30.0 * DEG
CHEAP_HZ = 4.0
ROUNDING = 1e-12  # m/s
WALK_UG = 5.0  # a square root of Hz
SIZE = 3.0  # of an effect, in nominal sizes


def densities(x: np.ndarray, y: np.ndarray, model: list[int], centre: np.ndarray) -> float:
    """log of the density of y (n,) under y = X p + n with every combination of prior scales, by its covariance."""
    choices = [SCALES if centre[k] == 0.0 else (1.0,) for k in model]
    each = [
        multivariate_normal.logpdf(
            y, x[:, model] @ centre[model], np.eye(len(y)) + (x[:, model] * np.array(s) ** 2) @ x[:, model].T
        )
        for s in product(*choices)
    ]
    return float(logsumexp(each) - np.log(len(each)))


@pytest.mark.parametrize(
    ("truth", "rival", "centre"),
    [
        ({0: 2.0}, [1], (0.0, 0.0, 0.0)),
        ({0: 2.0, 2: 1.0}, [1, 2], (0.0, 0.0, 0.0)),
        ({0: 4.0}, [1, 2], (4.0, 0.0, 0.0)),
        ({1: 1.5}, [], (0.0, 0.0, 0.0)),
    ],
)
def test_expectation_is_the_average_of_log_bayes_factors(truth, rival, centre):
    rng = np.random.default_rng(1)
    x = rng.normal(size=(8, 3))
    x[:, 1] += x[:, 0]  # alike
    centre = np.array(centre)
    expected = expected_log_bayes_factor(x.T @ x, truth, rival, centre)
    seen = []
    for _ in range(DRAWS):
        y = x[:, list(truth)] @ list(truth.values()) + rng.normal(size=8)
        seen.append(densities(x, y, list(truth), centre) - densities(x, y, rival, centre))
    assert expected == pytest.approx(np.mean(seen), abs=CLOSE_NATS)


def noisy(made: Recording) -> Recording:
    """The same with a velocity random walk, off which the levels of a standstill are read."""
    dt = np.diff(made.imu.time_s, prepend=made.start.time_s)[:, None]
    walk = WALK_UG * UG * np.sqrt(dt) * np.random.default_rng(2).normal(size=made.imu.accelerometer.shape)
    return replace(made, imu=replace(made.imu, accelerometer=made.imu.accelerometer + walk))


@cache
def parked(rotation: bool = True) -> Recording:
    """A box at rest for half an hour, level: increments by hand, in a world with and in one without an Earth rate."""
    time_s = np.arange(1, int(1800.0 * CHEAP_HZ) + 1) / CHEAP_HZ
    c, s = np.cos(HEADING), np.sin(HEADING)
    horizontal, down = EARTH_RATE * np.cos(LATITUDE), -EARTH_RATE * np.sin(LATITUDE)
    gyro = float(rotation) * np.array([c * horizontal, -s * horizontal, down]) / CHEAP_HZ
    force = np.array([0.0, 0.0, -gravity(LATITUDE, 100.0)]) / CHEAP_HZ
    return noisy(
        Recording(
            name="parked",
            kind="static",
            start=Start(
                0.0, LATITUDE, 0.2, 100.0, attitude_rad=(0.0, 0.0, HEADING), attitude_sigma_rad=(5e-5, 5e-5, 1e-3)
            ),
            imu=Imu(time_s, np.tile(gyro, (time_s.size, 1)), np.tile(force, (time_s.size, 1)), "increment"),
            belief=navigation_grade(earth=EarthBelief(rotation=rotation)),
        )
    )


@cache
def oven() -> Recording:
    """The simulator's oven, with its thermometer."""
    run = Mission(load("oven"), CHEAP_HZ)
    made, keep = run.ideal(), run.increments.time_s > 0.5 / CHEAP_HZ
    start = replace(made.start, attitude_sigma_rad=parked().start.attitude_sigma_rad)
    imu = replace(made.imu, temperature_c=run.reading_c[keep])
    return noisy(replace(made, kind="oven", start=start, imu=imu, reference=None))


@cache
def drive() -> Recording:
    """From rest to 15 m/s and straight on for half an hour, by the simulator."""
    place = Place(latitude_deg=40.0, longitude_deg=10.0, height_m=100.0, heading_deg=30.0, stand_s=0.0)
    speed = (SpeedChange(from_s=60.0, to_s=90.0, to_mps=15.0),)
    profile = Profile(name="road", duration_s=1800.0, start=place, speed=speed, thermal=Thermal(self_heating_c=0.0))
    made = Mission(profile, RATE_HZ).ideal()
    start = replace(made.start, attitude_sigma_rad=parked().start.attitude_sigma_rad)
    return replace(made, kind="drive", start=start, reference=None, gps=replace(made.reference, attitude_rad=None))


@cache
def guided() -> Recording:
    """The same drive, known from a better navigator."""
    made = drive()
    return replace(made, gps=None, reference=replace(made.gps, attitude_rad=np.tile([0.0, 0.0, HEADING], (1801, 1))))


@cache
def flight() -> Recording:
    return ideal("climb-cruise-landing")


@cache
def case(made) -> Case:
    return prepare(made())


def effect(of: Case, name: str, axis: str | None = None, other_axis: str | None = None) -> Candidate:
    """The candidate of that name; of several times or widths the middle one."""
    found = [
        one
        for one in of.candidates
        if (one.name, one.axis) == (name, axis) and one.parameters.get("other_axis") in (None, other_axis)
    ]
    return found[len(found) // 2]


def gains(of: Case, truth: Sequence[Candidate], rival: Sequence[Candidate]) -> dict[str, float]:
    """What each experiment of the catalogue adds to the expected log Bayes factor, nats."""
    catalogue, position = Catalogue([of], [np.zeros(len(of.noise.free))], Policy()), np.zeros(len(of.noise.free))
    effects = [*truth, *rival]
    centre = np.array([one.centre for one in effects])
    values = {k: one.centre or SIZE for k, one in enumerate(truth)}
    others = range(len(truth), len(effects))
    at_hand = information(of, [one.column for one in effects], position)
    before = expected_log_bayes_factor(at_hand, values, others, centre)
    out = {}
    for one in catalogue.experiments(sorted({t.axis or "x" for t in truth})):
        total = at_hand + catalogue.information(one, effects, at_hand)
        out[one.name] = expected_log_bayes_factor(total, values, others, centre) - before
    return out


A, G = "accelerometer.", "gyro."
HEADINGS, TUMBLE = "turning the box through four headings while parked", "a tumble: parked on six faces in turn"
AGAIN, LONGER = "the same again", "a parked recording of 2 h"
OVEN = "an oven run with the recording's temperatures"
CHAMBER = "accelerometer z in a chamber, four positions, +-0.2, 0.5 and 1 degC/min"


@pytest.mark.parametrize(
    ("made", "truth", "rival", "separates", "cannot"),
    [
        # level and at rest the specific force along z is 1 g whatever happens, and along x and y it is none
        (parked, [(A + "bias", "z")], [(A + "scale", "z")], [TUMBLE], [AGAIN, LONGER, HEADINGS]),
        (parked, [(A + "scale", "z")], [(A + "quadratic", "z")], [TUMBLE], [AGAIN, LONGER, HEADINGS]),
        (parked, [(A + "bias", "z")], [(A + "quadratic", "z")], [TUMBLE], [AGAIN, LONGER, HEADINGS]),
        (parked, [(G + "bias", "x")], [(G + "g_sensitivity", "x", "z")], [TUMBLE], [AGAIN, LONGER, HEADINGS]),
        # a gyro that is off looks like a heading that is off, which another recording has not got
        (parked, [(G + "bias", "y")], [("alignment.heading",)], [AGAIN, HEADINGS], []),
        (
            oven,
            [(A + "scale_temperature", "z")],
            [(A + "bias_temperature", "z")],
            [f"{OVEN}, the box upside down", "an oven run on six faces in turn, cooled and warmed", CHAMBER],
            [AGAIN, OVEN, "an oven run at three ramp rates", TUMBLE],
        ),
        (
            oven,
            [(A + "bias_drift", "z")],
            [(A + "scale_drift", "z")],
            [f"{OVEN}, the box upside down", TUMBLE, CHAMBER],
            [AGAIN, OVEN, LONGER.replace("2", "3")],
        ),
        # the pendulous axis of x lies along z, where a car feels 1 g all the time
        (drive, [(A + "misalignment", "x", "z")], [(A + "bias", "x")], [TUMBLE], [AGAIN, LONGER, HEADINGS]),
        # at one speed an antenna farther ahead is a stamp that is late
        (
            drive,
            [("gps.lever_arm", "x")],
            [("gps.time_offset",)],
            ["a second drive with S-turns", "a second drive with accelerations and stops"],
            [TUMBLE, HEADINGS, LONGER],
        ),
    ],
)
def test_what_tells_two_effects_apart(made, truth, rival, separates, cannot):
    of = case(made)
    seen = gains(of, [effect(of, *one) for one in truth], [effect(of, *one) for one in rival])
    assert all(seen[name] > Policy.experiment_enough for name in separates), seen
    assert all(abs(seen[name]) < UNMOVED for name in cannot), seen


def without_rotation() -> Recording:
    return parked(rotation=False)


def test_turning_the_box_tells_the_earth_from_gyro_biases_and_standing_longer_does_not():
    """In a belief without Earth rate three constant biases make what is missing, as long as the box lies still."""
    of = case(without_rotation)
    rival = [effect(of, "gyro.bias", axis) for axis in "xyz"]
    seen = gains(of, [effect(of, "earth.rotation")], rival)
    assert max(seen[AGAIN], seen[LONGER]) < NEXT_TO_NOTHING * seen[HEADINGS], seen


def test_an_experiment_adds_as_much_whatever_stands_in_both_models():
    of = case(parked)
    bias, scale, other = effect(of, A + "bias", "z"), effect(of, A + "scale", "z"), effect(of, A + "bias", "x")
    alone = gains(of, [bias], [scale])
    catalogue, at = Catalogue([of], [np.zeros(len(of.noise.free))], Policy()), np.zeros(len(of.noise.free))
    effects = [bias, scale, other]
    at_hand = information(of, [one.column for one in effects], at)
    told = catalogue.recommend(effects, at_hand, {0: SIZE, 2: SIZE}, [[1, 2]])[0]
    assert told.experiment == TUMBLE
    assert told.gain == pytest.approx(alone[TUMBLE], rel=0.05)


def test_the_cheapest_that_is_enough_is_recommended_else_the_best_else_none():
    of = case(oven)
    position = np.zeros(len(of.noise.free))
    catalogue = Catalogue([of], [position], Policy())
    effects = [
        effect(of, A + "bias_temperature_rate", "z"),
        effect(of, A + "scale_temperature_rate", "z"),
        effect(of, A + "bias_step", "z"),
        effect(of, A + "bias_temperature_rate", "z"),  # the same effect: nothing tells it from itself
    ]
    at_hand = information(of, [one.column for one in effects], position)
    turned, again, never = catalogue.recommend(effects, at_hand, {0: SIZE}, [[1], [2], [3]])
    assert turned.experiment == f"{OVEN}, the box upside down" and turned.gain >= Policy.experiment_enough
    assert again.experiment == OVEN and again.gain > Policy.experiment_enough
    assert never is None
    little = catalogue.recommend(effects, at_hand, {0: 0.0}, [[1]])[0]
    assert little is None


def test_only_what_the_instrument_permits_is_in_the_catalogue():
    def names(*cases: Case) -> str:
        belief = navigation_grade(accelerometer=AccelerometerBelief(x=AxisBelief(scale=ScaleBelief(gamma=3e5))))
        catalogue = Catalogue(cases, [np.zeros(len(one.noise.free)) for one in cases], Policy(), belief)
        found = catalogue.experiments("x")
        assert [one.cost for one in found] == sorted(one.cost for one in found)
        return "; ".join(one.name for one in found)

    still, warm, car = names(case(parked)), names(case(oven)), names(case(drive))
    assert "oven" not in still and "chamber" not in still and "second" not in still and "tumble" in still
    assert "oven" in warm and "chamber" in warm and "second" not in warm
    assert "second drive" in car and "oven" not in car and "flight" not in car
    readings = plans.chamber(
        "x", [(g, np.array([0.0, 7200.0, 14400.0]), np.array([20.0, 40.0, 20.0])) for g in (1, -1)]
    )
    bench = prepare_chamber(readings, plans.chamber_belief(navigation_grade(), "x"), "chamber")
    alone = names(bench)
    assert "chamber" in alone and "parked" not in alone and "oven" not in alone


@pytest.mark.parametrize("earth", [EarthBelief(), EarthBelief(rotation=False), EarthBelief(gravity_height=False)])
@pytest.mark.parametrize("made", [parked, drive, guided, flight])
def test_the_mechanization_follows_every_plan(made, earth):
    """What is planned is what the believed equations navigate along: judged by the independent mechanization."""
    like = replace(made(), belief=made().belief.model_copy(update={"earth": earth}))
    catalogue = Catalogue([replace(case(made), believed=believe(like))], [np.zeros(0)], Policy())
    for experiment in catalogue.experiments(()):
        if experiment.plan is None:
            continue
        planned = believe(experiment.plan())
        solution = solve(planned)
        end_s = float(solution[-1].time_s[-1])
        measured = sources(planned, end_s)
        model = build(planned, solution, nodes(planned, measured, end_s))
        seen = observe(planned, model.states, model.arc, measured)
        # the vertical is damped by the planned height
        left = np.abs(seen.residual[:, [0, 1, 3, 4]] / seen.sigma[:, [0, 1, 3, 4]])
        assert np.nanmax(left) < (LEFT_OF_BANKS_SIGMA if made is flight else LEFT_SIGMA), experiment.name
        assert np.isfinite(left).any(axis=0).all()


def test_a_plan_in_pulses_is_the_plan_in_increments():
    """Counts by the believed scale, back by the compensation: increments to rounding."""
    scale = ScaleBelief(gamma=3e5, mu=20.0, beta=0.1, epsilon=50.0, alpha=30.0, eta=-2.0)
    axis = AxisBelief(scale=scale, bias=BiasBelief(k0_ug=300.0, omega_ug_per_c=40.0))
    accelerometer = AccelerometerBelief(x=axis, y=axis, z=axis)
    made = oven()
    inverse = replace(made, belief=navigation_grade(accelerometer=accelerometer))
    inverse = replace(inverse, imu=replace(inverse.imu, accelerometer_form="pulse"))
    motion = plans.parked(made.start, plans.FACES, 60.0)
    celsius = np.linspace(30.0, -10.0, motion.time_s.size - 1)
    pulses = plans.recording("tumble", "oven", motion, celsius, replace(believe(made), recording=inverse))
    plain = plans.recording("tumble", "oven", motion, celsius, believe(made))
    assert pulses.imu.accelerometer_form == "pulse"
    assert np.allclose(believe(pulses).velocity, believe(plain).velocity, rtol=0.0, atol=ROUNDING)


def test_a_chamber_in_more_positions_parts_what_one_position_cannot():
    """At +1 g a scale that follows temperature is a bias that follows it."""
    knots = np.array([0.0, 7200.0, 14400.0]), np.array([50.0, 10.0, 50.0])
    of = prepare_chamber(
        plans.chamber("z", [(1.0, *knots)]), plans.chamber_belief(navigation_grade(), "z"), "one ramp at +1 g"
    )
    truth, rival = effect(of, A + "scale_temperature", "z"), effect(of, A + "bias_temperature", "z")
    position = np.zeros(len(of.noise.free))
    at_hand = information(of, [truth.column, rival.column], position)
    told = Catalogue([of], [position], Policy(), navigation_grade()).recommend(
        [truth, rival], at_hand, {0: SIZE}, [[1]]
    )[0]
    assert told.experiment == CHAMBER and told.gain >= Policy.experiment_enough


def test_what_belongs_to_one_recording_is_in_no_other():
    of = case(parked)
    position = np.zeros(len(of.noise.free))
    effects = [effect(of, G + "bias", "y"), effect(of, "alignment.heading"), effect(of, A + "bias_step", "x")]
    at_hand = information(of, [one.column for one in effects], position)
    catalogue = Catalogue([of], [position], Policy())
    for one in catalogue.experiments(()):
        seen = catalogue.information(one, effects, at_hand)
        assert not seen[1:].any() and not seen[:, 1:].any() and seen[0, 0] > 0.0, one.name
