"""Truth and sensors to a recording: one instrument on one mission."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np

from ins_eval import accelerometer, gps
from ins_eval.accelerometer import Accelerometer, ThermalRun
from ins_eval.gyro import GyroPopulation
from ins_eval.profile import Profile
from ins_eval.random_processes import gauss_markov
from ins_eval.recording import Fixes, Imu, Recording, Start
from ins_eval.recording.belief import NAVIGATION_GRADE
from ins_eval.streams import Streams
from ins_eval.thermal import Temperature, Thermometer, imu_temperature
from ins_eval.trajectory import Increments, Trajectory
from ins_eval.units import STANDARD_GRAVITY, through_degrees


@dataclass(frozen=True)
class InstrumentPopulation:
    """What instruments are drawn from."""

    accelerometers: accelerometer.Population
    gyros: GyroPopulation = GyroPopulation()
    gradient: float = 0.0  # one sigma over instruments of `Instrument.gradient`

    def draw(self, streams: Streams) -> Instrument:
        """One instrument; what its parts are is decided here, what they do in a run is drawn at that run."""
        x, y, z = self.gradient * streams.at("gradient").rng().standard_normal(3) if self.gradient else np.zeros(3)
        accelerometers = self.accelerometers.draw(streams.at("accelerometers"))
        return Instrument(accelerometers, self.gyros, (float(x), float(y), float(z)))


@dataclass(frozen=True)
class Instrument:
    """Three accelerometers along x, y, z and a gyro triad.

    `gradient` (3,): by how much the place of each accelerometer is warmer than that of the thermometer, in parts of
    the excess of the IMU over the air: the heat that flows out is the same for all.
    """

    accelerometers: tuple[Accelerometer, Accelerometer, Accelerometer]
    gyros: GyroPopulation
    gradient: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Mission:
    """A profile at a sample rate: all that is the same whichever instrument records it."""

    def __init__(self, profile: Profile, rate_hz: float):
        self.profile = profile
        self.rate_hz = rate_hz
        self.trajectory = Trajectory(profile)
        self.thermometer = Thermometer()

    def in_oven(self, rate_hz: float) -> Mission:
        """An oven that repeats the temperatures of this mission around a level IMU at the same place."""
        still = {"kind": "static", "speed": (), "height": (), "turn": (), "wing_rock": None}
        oven = Mission(
            self.profile.model_copy(update={**still, "name": f"oven with the temperatures of {self.profile.name}"}),
            rate_hz,
        )
        oven.temperature = self.temperature
        return oven

    @cached_property
    def time_s(self) -> np.ndarray:
        """Ends of the samples."""
        return self.trajectory.samples_s(self.rate_hz)

    @cached_property
    def increments(self) -> Increments:
        """What an ideal IMU feels."""
        return self.trajectory.increments(self.rate_hz)

    @cached_property
    def interval_s(self) -> np.ndarray:
        """Durations of the samples."""
        return np.diff(self.time_s, prepend=self.trajectory.start_s)

    @cached_property
    def force_g(self) -> np.ndarray:
        """Mean specific force of every sample in g, body axes."""
        return self.increments.dv_b / (STANDARD_GRAVITY * self.interval_s[:, None])

    @cached_property
    def temperature(self) -> Temperature:
        """True temperature of the IMU, every second."""
        return imu_temperature(self.trajectory)

    @cached_property
    def run(self) -> ThermalRun:
        """The same as a run of accelerometers that are as warm as the thermometer."""
        return self.run_at(0.0)

    def run_at(self, gradient: float) -> ThermalRun:
        """The run of an accelerometer whose place is warmer by `gradient` times the excess of the IMU over the air."""
        kind: Literal["oven", "flight"] = "oven" if self.profile.kind == "static" else "flight"

        def lived(temperature: Temperature) -> ThermalRun:
            before = None if temperature.before is None else lived(temperature.before)
            surface_c = temperature.temperature_c + gradient * temperature.excess_c
            return ThermalRun(temperature.time_s, surface_c, kind, before=before)

        return lived(self.temperature)

    @cached_property
    def reading_c(self) -> np.ndarray:
        """The thermometer's reading at every sample."""
        reading = self.thermometer.read(self.temperature.time_s, self.temperature.temperature_c)
        latest = np.searchsorted(self.temperature.time_s, self.time_s + 1e-9, side="right") - 1
        return reading[latest]

    @cached_property
    def imu_c(self) -> np.ndarray:
        """True temperature of the IMU at every sample."""
        return np.interp(self.time_s, self.temperature.time_s, self.temperature.temperature_c)

    @cached_property
    def height_m(self) -> np.ndarray:
        """True height at every sample."""
        return self.trajectory.truth(self.time_s).height_m

    def start(self, time_s: float, aligned: bool, still_until_s: float | None = None) -> Start:
        """The true state at `time_s`, with attitude where `aligned`."""
        truth = self.trajectory.truth(np.array([time_s]))
        north, east, down = truth.velocity_n[0].tolist()
        roll, pitch, heading = through_degrees(truth.attitude_rad[0]).tolist()
        return Start(
            time_s=time_s,
            latitude_rad=float(through_degrees(truth.latitude_rad[0])),
            longitude_rad=float(through_degrees(truth.longitude_rad[0])),
            height_m=float(truth.height_m[0]),
            velocity_n=(north, east, down),
            attitude_rad=(roll, pitch, heading) if aligned else None,
            still_until_s=still_until_s,
        )

    def record(self, instrument: Instrument, streams: Streams) -> Recording:
        """What `instrument` records, from switching it on; `streams` are those of this one run."""
        true, (gyro, height_baro_m, fixes) = self.increments, _beside(self, instrument.gyros, streams)
        counts = np.empty_like(true.dv_b)
        for axis, (unit, gradient) in enumerate(zip(instrument.accelerometers, instrument.gradient, strict=True)):
            run = self.run_at(gradient) if gradient else self.run
            slow = unit.slow(run, streams).at(run.time_s, true.time_s)
            counts[:, axis] = unit.counts(self.interval_s, self.force_g, slow, streams)
        return Recording(
            name=self.profile.name,
            kind="oven" if self.profile.kind == "static" else "flight",
            start=self.start(self.trajectory.start_s, aligned=self.profile.kind == "static", still_until_s=0.0),
            imu=Imu(
                time_s=true.time_s,
                gyro=gyro,
                accelerometer=counts,
                accelerometer_form="pulse",
                temperature_c=self.reading_c,
                height_baro_m=height_baro_m,
            ),
            gps=fixes,
            belief=NAVIGATION_GRADE,
        )

    def ideal(self, until_s: float = np.inf) -> Recording:
        """What an IMU without any error records from time 0 on, the true attitude given: for the numeric floor."""
        true = self.trajectory.increments(self.rate_hz, 0.0, until_s)
        return Recording(
            name=f"{self.profile.name}, no errors",
            kind="flight",
            start=self.start(0.0, aligned=True),
            imu=Imu(
                time_s=true.time_s,
                gyro=true.dtheta_b,
                accelerometer=true.dv_b,
                accelerometer_form="increment",
                height_baro_m=self.trajectory.truth(true.time_s).height_m.copy(),
            ),
            reference=self.truth(0.0, until_s=float(true.time_s[-1])),
            belief=NAVIGATION_GRADE,
        )

    def truth(self, from_s: float, period_s: float = 1.0, until_s: float = np.inf) -> Fixes:
        """The true trajectory every `period_s`, in the form of a reference with attitude."""
        true = self.trajectory.truth(np.arange(from_s, min(self.trajectory.end_s, until_s) + 0.5 * period_s, period_s))
        return Fixes(
            true.time_s,
            true.latitude_rad,
            true.longitude_rad,
            true.height_m,
            true.velocity_n,
            np.ones(true.time_s.size, dtype=bool),
            true.attitude_rad,
        )

    def baro(self, streams: Streams) -> np.ndarray:
        """Baro height at every sample: agrees with the true one at the start and then wanders."""
        baro = self.profile.baro
        slow_s = np.arange(self.trajectory.start_s, self.trajectory.end_s + 10.0, 10.0)
        wander = gauss_markov(slow_s, baro.sigma_m, baro.correlation_s, streams.at("baro").rng(), start=0.0)
        return self.height_m + np.interp(self.time_s, slow_s, wander)


@lru_cache(maxsize=4)  # an instrument in an experiment with other accelerometers has the same gyros, baro and receiver
def _beside(mission: Mission, gyros: GyroPopulation, streams: Streams) -> tuple[np.ndarray, np.ndarray, Fixes | None]:
    """What is recorded in a run beside the accelerometers: increments of the gyros, baro height, fixes."""
    start_s, true = mission.trajectory.start_s, mission.increments
    gyro = gyros.increments(true.time_s, start_s, true.dtheta_b, streams.at("gyros"), mission.imu_c)
    flown = mission.profile.kind == "flight"
    return gyro, mission.baro(streams), gps.receive(mission.trajectory, streams.at("gps")) if flown else None
