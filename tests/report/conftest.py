"""Invented but plausible metrics and series; no number here is a result."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from ins_eval.analysis.evaluation_numbers import (
    ComparedWith,
    EvaluationNumbers,
    NavigatedSpan,
    NumericFloor,
    RecordingFacts,
    StartAttitude,
)
from ins_eval.figures.side_by_side import Value
from ins_eval.navigation import Measures

NAMES = (
    "none",
    "simple",
    "quadratic",
    "hysteresis",
    "simple_refined",
    "hysteresis_refined",
    "hysteresis_scale_only",
    "hysteresis_bias_only",
    "hysteresis_without_rate",
    "mine",
)
LEVEL = dict(zip(NAMES, (14.2, 1.0, 1.05, 0.78, 0.84, 0.8, 0.96, 0.79, 0.781, 0.9), strict=True))
DEFINITIONS = {
    "final": 0.84,
    "rms_08326": 0.90,
    "elliptical": 0.87,
    "circular_05887": 0.88,
    "least_squares": 0.96,
    "radial_error_rate_rms": 1.26,
    "trms": 1.12,
}

TAUS_S = 0.1 * 2.0 ** np.arange(10)


def statistic(value: float, spread: float = 0.07) -> dict:
    return {"value": value, "interval95": [value * (1 - spread), value * (1 + spread)]}


def ratio(value: float, low: float, high: float) -> dict:
    return {"ratio": value, "interval95": [low, high]}


def pair(velocity: dict, cep: dict) -> dict:
    return {
        **{f"velocity_rms_{c}": velocity for c in ("north", "east", "horizontal")},
        **{f"cep_rate_{d}": cep for d in DEFINITIONS},
        "fraction_improved": {
            "velocity_rms_horizontal": {"value": 0.74, "interval95": [0.68, 0.80]},
            "cep_rate_final": {"value": 0.68, "interval95": [0.61, 0.74]},
        },
    }


def make_flight_metrics() -> dict:
    def arm(name: str) -> dict:
        level = LEVEL[name]
        return {
            "velocity_rms_mps": {
                c: statistic(v * level)
                for c, v in (("north", 1.38), ("east", 1.26), ("down", 0.21), ("horizontal", 1.87))
            },
            "cep_rate_nmi_per_h": {d: statistic(v * (0.5 + 0.5 * level)) for d, v in DEFINITIONS.items()},
            "cep_nmi_at_s": {"1800": statistic(0.3 * level), "8400": statistic(1.9 * level)},
        }

    sources = {"all": 1.0, "accelerometer_bias_thermal": 0.66, "accelerometer_scale_factor": 0.14, "gyro": 0.56}
    return {
        "format": "ins-eval-metrics/1",
        "profile": "climb-cruise-landing",
        "seed": 2021,
        "t0_s": 0.0,
        "duration_s": 8400.0,
        "definitions": {
            "velocity_rms": {
                "words": "root mean square of the velocity error over the epochs with GPS",
                "formula": "√mean(ΔV²)",
                "window": "0 to 8400 s, outage epochs excluded",
                "source": "Paper A, Table 7",
            },
            "final": {
                "words": "median over flights of the radial error at the end divided by the time",
                "formula": "median_i r_i(T)/T",
                "window": "at T = 8400 s",
                "source": "default here",
            },
            "least_squares": {
                "words": "median over flights of the slope through the origin",
                "formula": "Σ r t / Σ t²",
                "window": "0 to 8400 s",
                "source": "Grewal & Andrews 2014, chapter 10",
            },
        },
        "floor": {
            "horizontal_m": 2.9e-4,
            "velocity_mps": 3.1e-7,
            "rate_hz": 100,
            "ensemble": {"rate_hz": 10, "horizontal_m": 0.41},
        },
        "ensemble": {
            "size": 200,
            "rate_hz": 10,
            **{name: arm(name) for name in NAMES},
            "improvement": {
                "hysteresis_refined/simple": pair(ratio(0.80, 0.76, 0.86), ratio(0.88, 0.82, 0.97)),
                "hysteresis/simple": pair(ratio(0.78, 0.73, 0.84), ratio(0.89, 0.83, 0.98)),
                "hysteresis_refined/simple_refined": pair(ratio(0.95, 0.91, 0.99), ratio(0.985, 0.93, 1.04)),
                "simple_refined/simple": pair(ratio(0.84, 0.79, 0.88), ratio(0.9, 0.84, 0.97)),
                "hysteresis/hysteresis_without_rate": pair(ratio(0.9991, 0.996, 1.003), ratio(1.0, 0.99, 1.01)),
                "hysteresis_scale_only/simple": pair(ratio(0.96, 0.93, 1.01), ratio(1.0, 0.97, 1.02)),
                "mine/simple": pair(ratio(0.9, 0.87, 0.94), ratio(0.95, 0.9, 1.01)),
                "mine/hysteresis": pair(ratio(0.98, 0.94, 1.03), ratio(1.02, 0.9, 1.1)),
            },
        },
        "flight": {
            name: {
                "velocity_rms_mps": {
                    "north": 1.1 * LEVEL[name],
                    "east": 0.9 * LEVEL[name],
                    "horizontal": 1.42 * LEVEL[name],
                },
                "radial_error_rate_nmi_per_h": {
                    "final": 0.7 * LEVEL[name],
                    "least_squares": 0.8 * LEVEL[name],
                    "radial_error_rate_rms": 1.1 * LEVEL[name],
                },
            }
            for name in ("simple", "hysteresis", "simple_refined", "hysteresis_refined")
        },
        "gps": {"fixes": 8112, "outages": 8, "outage_s": 289.0, "longest_s": 41.0},
        "alignment": {"heading_error_deg": 0.0713, "roll_error_deg": 0.0021, "duration_s": 900.0},
        "budget": {
            "size": 200,
            **{
                source: {
                    name: {
                        "velocity_rms_horizontal": statistic(1.87 * part * (LEVEL[name] if source != "gyro" else 1.0)),
                        "cep_rate_final": statistic(0.84 * (0.82 if source == "gyro" else part * LEVEL[name] * 0.7)),
                    }
                    for name in ("simple", "simple_refined", "hysteresis_refined")
                }
                for source, part in sources.items()
            },
        },
        "paper": {
            "table7": {"simple": {"east": 1.36, "north": 1.40}, "hysteresis": {"east": 1.09, "north": 1.19}},
            "cep": {"simple": 1.54, "hysteresis": 1.29},
            "percentile_of_paper": {
                "simple": {
                    "final": {"value": 83.0, "interval95": [77.0, 88.0]},
                    "radial_error_rate_rms": {"value": 69.0, "interval95": [62.0, 75.0]},
                },
                "hysteresis": {
                    "final": {"value": 81.0, "interval95": [75.0, 86.0]},
                    "radial_error_rate_rms": {"value": 70.0, "interval95": [63.0, 76.0]},
                },
            },
        },
    }


def make_evaluation_numbers() -> EvaluationNumbers:
    notes = ("the file states no date", "12 samples were repeated and dropped")
    return EvaluationNumbers(
        recording=RecordingFacts("rlg_static_vehicle", "static", 3600.0, notes, 200.0, 0),
        belief=(),
        grade=None,
        alignment=StartAttitude(
            roll_deg=-0.41,
            pitch_deg=1.07,
            heading_deg=218.43,
            heading_sigma_deg=0.12,
            stretch_s=(30.0, 630.0),
            documented_heading_deg=218.6,
        ),
        navigation=NavigatedSpan(630.0, 3600.0, "damped by the known height"),
        compensations={
            "none": Measures(
                {"east": 0.21, "north": 0.33, "horizontal": 0.39, "down": 0.02},
                {"final": 0.51, "least_squares": 0.47, "radial_error_rate_rms": 0.62},
                final_radial_error_m=779.0,
            )
        },
        floor=NumericFloor(200.0, "standstill", 6e-5, 1e-7),
        reference=ComparedWith("standstill", 2970, 0, 0, 0.0, 1.0, 2970.0),
    )


def make_series() -> dict:
    """Series of one invented flight, 1 Hz, and of 200 invented instruments."""
    rng = np.random.default_rng(5)
    time = np.arange(0.0, 8401.0)
    schuler = 2.0 * np.pi / 5064.0
    outages = [(1900.0 + 900.0 * k, 1936.0 + 900.0 * k) for k in range(6)]
    bridged = np.zeros(time.size, dtype=bool)
    for start, end in outages:
        bridged |= (time > start) & (time < end)

    def velocity(scale: float, phase: float) -> np.ndarray:
        smooth = scale * (1.6 * np.sin(schuler * time + phase) + 0.3 * time / 8400.0)
        return np.where(bridged, smooth, smooth + 0.05 * rng.standard_normal(time.size))

    east = {
        name: velocity(LEVEL[name], 0.1 * k)
        for k, name in enumerate(("simple", "hysteresis_refined", "simple_refined"))
    }
    raw = {name: v + np.where(bridged, 20.0 * np.sin(np.pi * (time % 36.0) / 36.0), 0.0) for name, v in east.items()}
    radial = {name: 400.0 * LEVEL[name] * np.abs(time / 900.0 + np.sin(schuler * time)) for name in east}
    east_m, north_m = np.cumsum(np.full(time.size, 180.0)), np.zeros(time.size)
    half = time.size // 2
    east_m[half:] = east_m[half] - 180.0 * np.arange(time.size - half)
    north_m[half:] = 15000.0
    temperature = (
        12.0 + 2.0 * np.sin(time / 700.0) * np.exp(-time / 2000.0) - 23.0 * np.clip(time - 1500, 0, 5700) / 5700
    )
    instruments = np.sqrt(rng.chisquare(2, (2, 200)))
    return {
        "time_s": time,
        "outages": outages,
        "bridged": bridged,
        "east": east,
        "raw": raw,
        "radial": radial,
        "latitude_deg": 34.65 + north_m / 111e3,
        "longitude_deg": 108.0 + east_m / 91e3,
        "height_m": 400.0 + 9600.0 * np.clip(time / 1800.0, 0, 1) - 9600.0 * np.clip((time - 7200.0) / 1200.0, 0, 1),
        "temperature_c": temperature,
        "reading_c": np.round(temperature / 0.0625) * 0.0625,
        "rate_c_per_min": 60.0 * np.gradient(temperature),
        "ratios": {
            m: np.exp(rng.normal(-0.2, 0.5, 200)) for m in ("velocity_rms_horizontal", "radial_error_rate_final")
        },
        "rates": {
            d: {"simple": k * 0.8 * instruments[0], "hysteresis_refined": k * 0.7 * instruments[1]}
            for d, k in (("final", 1.0), ("least_squares", 1.1), ("radial_error_rate_rms", 1.4))
        },
    }


@pytest.fixture(scope="session")
def _flight_metrics() -> dict:
    return make_flight_metrics()


@pytest.fixture
def flight_metrics(_flight_metrics) -> dict:
    return copy.deepcopy(_flight_metrics)


@pytest.fixture
def evaluation_numbers() -> EvaluationNumbers:
    return make_evaluation_numbers()


@pytest.fixture(scope="session")
def series() -> dict:
    return make_series()


def make_figures(s: dict, metrics: dict) -> dict:
    """Every figure function called once, by the names that the reports use."""
    from ins_eval import figures

    traces = {"time_s": s["time_s"], "bridged": s["bridged"], "outages": s["outages"]}
    t = s["time_s"][::60]
    cep = {n: 0.8 * s["radial"][n][::60] for n in ("simple", "hysteresis_refined")}
    phases = [("start-up and climb", 0.0, 1800.0), ("cruise", 1800.0, 7200.0), ("landing", 7200.0, 8400.0)]
    quiet = np.exp(np.random.default_rng(1).normal(-5.0, 0.4, 3600)) * np.where(np.arange(3600) < 30, 30.0, 1.0)
    t_window, rng = np.arange(1.0, 901.0), np.random.default_rng(2)
    felt, rest = rng.standard_normal((900, 6)).cumsum(axis=0) / 20.0, 0.01 * rng.standard_normal((900, 6))
    sensors = {"units": ("°/s", "m/s²"), "window_s": 1.0}
    return {
        "flight_path": figures.flight_path(
            time_s=s["time_s"],
            latitude_deg=s["latitude_deg"],
            outages=s["outages"],
            longitude_deg=s["longitude_deg"],
            height_m=s["height_m"],
        ),
        "temperature_and_rate": figures.temperature_and_rate(
            time_s=s["time_s"],
            temperature_c=s["temperature_c"],
            reading_c=s["reading_c"],
            rate_c_per_min=s["rate_c_per_min"],
            phases=phases,
        ),
        "allan_deviation": figures.allan_deviation(
            channels=[
                {
                    "name": f"{sensor} {axis}",
                    "unit": "deg/h",
                    "tau_s": TAUS_S,
                    "deviation": 3.0 / np.sqrt(TAUS_S),
                    "fit": None if axis == "x" else 2.9 / np.sqrt(TAUS_S),
                    "terms": {"white": 2.9 / np.sqrt(TAUS_S)},
                    "words": "N = 2.9 [2.8, 3.0]",
                }
                for sensor in ("gyro", "accelerometer")
                for axis in "xyz"
            ],
            rest_s=300.0,
        ),
        "temperature_laws": figures.temperature_laws(
            channels=[
                {
                    "name": f"{sensor} {axis}",
                    "unit": "deg/h",
                    "temperature_c": np.linspace(10.0, 15.0, 40),
                    "change": np.sin(np.arange(40.0)),
                    "line_c": np.array([10.0, 15.0]),
                    "line": np.array([-1.0, 1.0]),
                    "words": "0.4 [0.3, 0.5] deg/h/degC",
                }
                for sensor in ("gyro", "accelerometer")
                for axis in "xyz"
            ]
        ),
        "east_velocity_error": figures.velocity_error(
            errors_mps=s["east"], component="east", raw_mps=s["raw"], rms_mps={n: 1.2 for n in s["east"]}, **traces
        ),
        "north_velocity_error": figures.velocity_error(errors_mps=s["east"], component="north", **traces),
        "latitude_error": figures.angle_error(
            errors_arcmin={n: r / 1852.0 for n, r in s["radial"].items()},
            component="latitude",
            metres_per_arcmin=1848.0,
            **traces,
        ),
        "longitude_error": figures.angle_error(
            errors_arcmin={n: -r / 1520.0 for n, r in s["radial"].items()},
            component="longitude",
            metres_per_arcmin=1520.0,
            **traces,
        ),
        "position_error": figures.position_error(errors_m=s["radial"], floor_m=2.9e-4, **traces),
        "ground_track": figures.ground_track(
            time_s=s["time_s"],
            reference_m=np.column_stack([30.0 * s["time_s"], 20.0 * s["time_s"]]),
            errors_m={n: np.column_stack([r, -r]) for n, r in s["radial"].items()},
        ),
        "error_growth": figures.error_growth(
            after_s=np.arange(1.0, 31.0),
            position_m={"none": np.arange(1.0, 31.0) ** 2},
            band_m={"none": np.outer([0.8, 1.2], np.arange(1.0, 31.0) ** 2)},
            count=12,
        ),
        "cep_over_time": figures.cep_over_time(
            time_s=t, cep_m=cep, size=200, band_m={n: np.column_stack([0.9 * v, 1.12 * v]) for n, v in cep.items()}
        ),
        "missions_by_temperature": figures.missions_by_temperature(
            warmer_c=np.linspace(-25.0, 30.0, 50),
            ratios={"hysteresis": s["ratios"]["velocity_rms_horizontal"][:50]},
            turns=np.arange(50) % 12,
        ),
        "improvement_per_instrument": figures.improvement_per_instrument(
            ratios={"hysteresis_refined/simple": s["ratios"]},
            fraction_improved={
                "hysteresis_refined/simple": {"velocity_rms_horizontal": {"value": 0.66, "interval95": [0.59, 0.72]}}
            },
        ),
        "error_budget": figures.error_budget(budget=metrics["budget"], size=200),
        "velocity_rms_by_compensation": figures.velocity_rms_by_compensation(
            rms_mps={n: metrics["ensemble"][n]["velocity_rms_mps"] for n in NAMES if n != "none"},
            size=200,
            paper_mps=metrics["paper"]["table7"],
        ),
        "single_flight_rates": figures.single_flight_rates(
            rates_nmi_per_h=s["rates"], paper_nmi_per_h=metrics["paper"]["cep"]
        ),
        "activity": figures.activity(
            time_s=np.arange(3600.0),
            force_mps2=quiet,
            rate_deg_per_s=10 * quiet,
            stretch_s=(30.0, 630.0),
            navigation_s=(630.0, 3600.0),
        ),
        "attitude_error": figures.attitude_error(
            time_s=np.arange(3000.0), errors_deg={"none": 1e-5 * np.outer(np.arange(3000.0), [1.0, -1.0, 3.0])}
        ),
        "attitude": figures.attitude(
            time_s=np.arange(3000.0),
            roll_deg=np.full(3000, -0.41),
            pitch_deg=np.full(3000, 1.07),
            heading_deg=218.43 + 1e-5 * np.arange(3000.0),
        ),
        "side_by_side": figures.side_by_side(
            values=[Value(f"{name}, {unit}", x, 0.8 * x, 1.2 * x) for name, x in LEVEL.items() for unit in ("a", "b")],
            title="Side by side",
            rows="compensation",
            note="Medians over the instruments.",
            axis="value [m/s]",
        ),
        "sensor_signals": figures.sensor_signals(
            time_s=t_window[:300], recorded=felt[:300] + rest[:300], implied=felt[:300], **sensors
        ),
        "sensor_residuals": figures.sensor_residuals(time_s=t_window, before=rest + 0.1, after=rest, **sensors),
        "sensor_scatter": figures.sensor_scatter(
            implied=felt, difference=rest + 0.1, fitted=[(0.1, 0.0)] * 4 + [None] * 2, **sensors
        ),
    }


@pytest.fixture(scope="session")
def drawn(series, _flight_metrics) -> dict:
    return make_figures(series, _flight_metrics)
