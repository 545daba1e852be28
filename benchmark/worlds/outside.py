"""Effects that are not in the vocabulary: nature does what it likes.

Each is drawn as a function that adds itself to the departures of a recording, with a record for the truth. Where a
driving sensor exists, `driver` names its column; whether the recording shows that column is drawn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from benchmark.worlds.noise import log_uniform


def _second(felt, values):
    """From one value a second to the samples."""
    return np.interp(felt.time_s, np.arange(len(values), dtype=float), values)


def _centred(column):
    return column - column[0]


def _telegraph(felt, p):
    rng = np.random.default_rng(p["sequence"])
    n = int(felt.time_s[-1]) + 3
    flips = rng.random(n) < 1.0 / p["dwell_s"]
    return _second(felt, (np.cumsum(flips) % 2).astype(float))


def _bump(felt, p):
    u = (felt.time_s - p["from_s"]) / p["length_s"]
    return np.where((u > 0) & (u < 1), np.sin(np.pi * np.clip(u, 0, 1)) ** 2, 0.0)


def _second_derivative(felt, i):
    n = int(felt.time_s[-1]) + 2
    one = np.interp(np.arange(n), felt.time_s, felt.temperature[:, i])
    curve = np.gradient(np.gradient(gaussian_filter1d(one, 20.0, mode="nearest"))) * 3600.0  # degC/min^2
    return _second(felt, gaussian_filter1d(curve, 20.0, mode="nearest"))


def _heading(felt):
    second = np.minimum(np.arange(int(felt.time_s[-1]) + 2.0), felt.truth.duration_s)
    return _second(felt, felt.truth.state(second)[2][:, 2])


def _turning(felt, at):
    return np.gradient(felt.truth.state(at)[2][:, 2], at)


def _height(felt, at):
    lla = felt.truth.state(at)[0]
    return lla[:, 2] - lla[0, 2]


# name: (words, target, nominal, unit, drawn parameters, driver, signal(felt, axis, parameters), recordings)
MOVING, ALL, HOT = ("flight", "drive"), ("flight", "oven", "static"), ("flight", "oven")
FORMS = {
    "pressure bias": ("bias in proportion to static pressure", "accel_ug", 0.4, "ug/hPa", {}, "static_pressure_hpa",
                      lambda f, i, p: _centred(f.extra["static_pressure_hpa"]), ("flight",)),
    "pressure scale": ("scale factor in proportion to static pressure", "accel_ppm", 0.5, "ppm/hPa", {},
                       "static_pressure_hpa", lambda f, i, p: _centred(f.extra["static_pressure_hpa"]), ("flight",)),
    "supply bias": ("bias in proportion to supply voltage", "accel_ug", 60.0, "ug/V", {}, "supply_v",
                    lambda f, i, p: _centred(f.extra["supply_v"]), ALL),
    "supply gyro": ("gyro bias in proportion to supply voltage", "gyro_deg_per_h", 0.04, "(deg/h)/V", {}, "supply_v",
                    lambda f, i, p: _centred(f.extra["supply_v"]), ALL),
    "fan gyro": ("gyro bias in proportion to the fan's speed", "gyro_deg_per_h", 0.0025, "(deg/h)/Hz", {},
                 "fan_speed_hz", lambda f, i, p: _centred(f.extra["fan_speed_hz"]), ALL),
    "vibration gyro": ("gyro bias in proportion to vibration, not to its square", "gyro_deg_per_h", 0.3, "(deg/h)/g",
                       {}, "vibration_rms_g", lambda f, i, p: f.extra["vibration_rms_g"], ("flight",)),
    "threshold": ("bias that clicks in below a temperature", "accel_ug", 80.0, "ug", {"quantile": (0.25, 0.7)}, None,
                  lambda f, i, p: (f.temperature[:, i] < np.quantile(f.temperature[:, i], p["quantile"])).astype(float),
                  HOT),
    "fringe": ("bias as a sine of temperature", "accel_ug", 60.0, "ug", {"period_c": (1.5, 6.0)}, None,
               lambda f, i, p: np.sin(2 * np.pi * f.temperature[:, i] / p["period_c"]), HOT),
    "heading gyro": ("gyro bias as a sine of heading", "gyro_deg_per_h", 0.06, "deg/h", {"phase_rad": (0.0, 6.28)},
                     None, lambda f, i, p: np.sin(_heading(f) + p["phase_rad"]), MOVING),
    "heading accelerometer": ("bias as a sine of twice the heading", "accel_ug", 80.0, "ug",
                              {"phase_rad": (0.0, 6.28)}, None,
                              lambda f, i, p: np.sin(2 * _heading(f) + p["phase_rad"]), MOVING),
    "bump": ("bias in a bump of about 20 minutes", "accel_ug", 80.0, "ug",
             {"length_s": (900.0, 1500.0), "from_share": (0.1, 0.6)}, None, lambda f, i, p: _bump(f, p), ALL),
    "gyro bump": ("gyro bias in a bump of about 20 minutes", "gyro_deg_per_h", 0.06, "deg/h",
                  {"length_s": (900.0, 1500.0), "from_share": (0.1, 0.6)}, None, lambda f, i, p: _bump(f, p), ALL),
    "second derivative": ("bias against the second derivative of temperature", "accel_ug", 2500.0, "ug/(degC/min^2)",
                          {}, None, lambda f, i, p: _second_derivative(f, i), HOT),
    "telegraph": ("bias that jumps between two values at random", "accel_ug", 60.0, "ug", {"dwell_s": (200.0, 900.0)},
                  None, lambda f, i, p: _telegraph(f, p), ALL),
    "gyro telegraph": ("gyro bias that jumps between two values at random", "gyro_deg_per_h", 0.05, "deg/h",
                       {"dwell_s": (300.0, 1200.0)}, None, lambda f, i, p: _telegraph(f, p), ALL),
    "swing": ("bias with a period of its own", "accel_ug", 60.0, "ug",
              {"period_s": (400.0, 1500.0), "phase_rad": (0.0, 6.28)}, None,
              lambda f, i, p: np.sin(2 * np.pi * f.time_s / p["period_s"] + p["phase_rad"]), ALL),
    "dead zone": ("output that sticks towards zero at small input", "accel_ug", 250.0, "ug", {"width_g": (0.01, 0.05)},
                  None, lambda f, i, p: -f.force_g[:, i] / (np.abs(f.force_g[:, i]) + p["width_g"]), MOVING),
    "turn velocity": ("GPS velocity wrong while turning", "gps_velocity", 2.0, "m/s per rad/s", {}, None, None, MOVING),
    "height velocity": ("GPS height in error in proportion to height", "gps_position", 0.004, "m/m", {}, None, None,
                        ("flight",)),
}  # fmt: skip


@dataclass(frozen=True)
class Outside:
    """An effect outside the vocabulary."""

    name: str
    axis: str | None
    value: float
    parameters: dict
    shown: bool

    def __call__(self, felt, departures) -> None:
        _, target, _, _, _, _, signal, _ = FORMS[self.name]
        if target == "gps_velocity":
            k = "ned".index(self.axis)
            departures.gps_velocity = lambda felt, at: np.outer(self.value * _turning(felt, at), np.eye(3)[k])
        elif target == "gps_position":
            departures.gps_position = lambda felt, at: np.outer(self.value * _height(felt, at), np.eye(3)[2])
        else:
            i = "xyz".index(self.axis)
            parameters = dict(self.parameters)
            if "from_share" in parameters:
                parameters["from_s"] = parameters["from_share"] * felt.truth.duration_s
            total = np.zeros((felt.time_s.size, 3)) + getattr(departures, target)
            total[:, i] += self.value * signal(felt, i, parameters)
            setattr(departures, target, total)

    @property
    def channel(self) -> str:
        target = FORMS[self.name][1]
        if target.startswith("gps"):
            return target.replace("_", ".")
        return ("gyro." if target.startswith("gyro") else "accelerometer.") + self.axis

    def interval(self, seconds: float) -> list[float] | None:
        if "from_share" not in self.parameters:
            return None
        begin = self.parameters["from_share"] * seconds
        return [begin, begin + self.parameters["length_s"]]

    def record(self) -> dict:
        words, _, _, unit, _, driver, _, _ = FORMS[self.name]
        return {"name": f"outside.{self.name.replace(' ', '_')}", "words": words, "axis": self.axis,
                "value": self.value, "unit": unit, "driver": driver if self.shown else None,
                "driver_hidden": bool(driver and not self.shown), **self.parameters}  # fmt: skip


def an_outside(rng, name: str, spread=(0.4, 4.0)) -> Outside:
    """An effect of `FORMS` with its size drawn log-uniformly."""
    _, target, nominal, _, ranges, driver, _, _ = FORMS[name]
    axis = str(rng.choice(list("ned" if target == "gps_velocity" else "xyz")))
    axis = "d" if target == "gps_position" else axis
    parameters = {key: float(np.round(rng.uniform(*bounds), 4)) for key, bounds in ranges.items()}
    if "dwell_s" in parameters:
        parameters["sequence"] = int(rng.integers(2**31))
    value = float(f"{rng.choice((-1.0, 1.0)) * nominal * log_uniform(rng, *spread):.5g}")
    return Outside(name, axis, value, parameters, bool(driver and rng.random() < 0.7))


@dataclass(frozen=True)
class Window:
    """A disturbance of one channel for a time, with edges of some seconds."""

    channel: str
    axis: str
    value: float
    from_share: float
    length_s: float
    edge_s: float = 10.0

    def _shape(self, at, seconds):
        begin, end = self.interval(seconds)
        return np.clip(np.minimum(at - begin, end - at) / self.edge_s + 0.5, 0.0, 1.0)

    def __call__(self, felt, departures) -> None:
        seconds = felt.truth.duration_s
        if self.channel.startswith("gps"):
            k = "ned".index(self.axis)
            add = lambda felt, at: np.outer(self.value * self._shape(at, seconds), np.eye(3)[k])  # noqa: E731
            setattr(departures, self.channel.replace(".", "_"), add)
            return
        target = "gyro_deg_per_h" if self.channel.startswith("gyro") else "accel_ug"
        total = np.zeros((felt.time_s.size, 3)) + getattr(departures, target)
        total[:, "xyz".index(self.axis)] += self.value * self._shape(felt.time_s, seconds)
        setattr(departures, target, total)

    def interval(self, seconds: float) -> list[float]:
        return [self.from_share * seconds, self.from_share * seconds + self.length_s]

    def record(self) -> dict:
        unit = {"a": "ug", "gy": "deg/h", "gps.v": "m/s", "gps.p": "m"}
        return {"name": "outside.window", "words": f"{self.channel} disturbed for a time", "axis": self.axis,
                "value": self.value, "unit": next(u for start, u in unit.items() if self.channel.startswith(start)),
                "driver": None}  # fmt: skip


def a_window(rng, spread) -> Window:
    group = str(rng.choice(("accelerometer", "gyro", "gps.velocity"), p=(0.45, 0.35, 0.2)))
    nominal = {"accelerometer": 60.0, "gyro": 0.06, "gps.velocity": 0.06}[group]
    axis = str(rng.choice(list("ned" if group.startswith("gps") else "xyz")))
    value = float(f"{rng.choice((-1.0, 1.0)) * nominal * log_uniform(rng, *spread):.5g}")
    channel = group if group.startswith("gps") else f"{group}.{axis}"
    return Window(channel, axis, value, float(np.round(rng.uniform(0.08, 0.6), 3)),
                  float(np.round(log_uniform(rng, 400, 2500), 0)))  # fmt: skip
