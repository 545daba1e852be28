"""Realised errors of a recording and every candidate through one linear error model, whitened with the true noise."""

from __future__ import annotations

import math

import numpy as np

from benchmark.scores import linear
from benchmark.worlds.earth import G0, W, gravity, radii
from benchmark.worlds.effects import AXES
from benchmark.worlds.instruments import DEG_PER_H, UG, Departures, Felt, compensated, element_temperature, scale_factor
from benchmark.worlds.record import Made

DEG = math.pi / 180.0
HELD_RAD = 1e-7  # each second, of the attitude of what rests: below the random walk of a gyro in a second


def coarse(felt: Felt) -> tuple[Felt, int]:
    """The same recording at 5 to 12.5 Hz, and how many samples went into one."""
    rate = round(1.0 / felt.dt)
    many = next(n for n in range(2, 21) if rate % n == 0 and rate // n <= 12)
    n = len(felt.time_s) // many * many
    add = lambda a: a[:n].reshape(-1, many, 3).sum(axis=1)  # noqa: E731
    last = slice(many - 1, n, many)
    extra = {name: one[last] for name, one in felt.extra.items()}
    return Felt(felt.kind, felt.truth, felt.time_s[last], felt.dt * many, add(felt.angle), add(felt.velocity),
                felt.temperature[last], felt.rate[last], felt.phases, extra), many  # fmt: skip


def late(felt: Felt, belief: dict, lag_s: np.ndarray) -> np.ndarray:
    """What the belief makes of elements that follow late, (n, 3) ug."""
    departures = Departures(element_lag_s=lag_s)
    temperature, rate = element_temperature(felt, departures, 180.0)
    out = np.zeros(temperature.shape)
    for i, axis in enumerate(AXES):
        if axis not in belief or "scale" not in belief[axis]:
            continue
        one = belief[axis]
        true = scale_factor(one["scale"], temperature[:, i] - 22.0, rate[:, i])
        read = scale_factor(one["scale"], felt.temperature[:, i] - 22.0, felt.rate[:, i])
        omega = one["bias"]["omega_ug_per_c"]
        out[:, i] = (true / read - 1.0) * felt.force_g[:, i] * 1e6 + omega * (temperature - felt.temperature)[:, i]
    return out


class Moving:
    """The linear system of a recording that is navigated: flight, drive, oven or static."""

    def __init__(self, made: Made, sheet: dict, true: dict) -> None:
        self.made, self.sheet, self.true = made, sheet, true
        self.felt, self.many = coarse(made.felt)
        self.truth, self.seconds = made.felt.truth, int(made.felt.time_s[-1])
        middle = self.felt.time_s - 0.5 * self.felt.dt
        lla, _, euler, _ = self.truth.state(middle)
        self.block_c = linear.attitudes(lla, euler)[0]
        self.block_second = middle.astype(np.int64)
        self.lla, self.velocity, self.c, self.ned, self.up = linear.seconds_of(self.truth, self.seconds)
        self.force = np.zeros((self.seconds, 3))
        linear.by_second(self.block_c, self.block_second, self.felt.velocity, self.seconds, self.force, 1.0)
        self.belief = {axis: made.head["accelerometer"].get(axis, {}) for axis in AXES}
        self._observations()

    def _observations(self) -> None:
        errors = self.made.errors.get("gps") or self.made.errors.get("reference")
        self.rests, self.referenced = errors is None, errors is not None and "attitude" in errors
        if self.rests:
            at, d = np.arange(1.0, self.seconds), 9
            self.ep = self.ev = np.zeros((len(at), 3))
            held = HELD_RAD**2 + self.true["gyro_quantum_rad"] ** 2 / 12.0
            self.r = np.array((0.05**2,) * 3 + (0.01**2,) * 3 + (held,) * 3)
        else:
            use = errors["valid"] & (np.abs(errors["at"] - np.rint(errors["at"])) <= 0.5)
            if self.referenced:
                use &= np.arange(len(use)) % 10 == 0
            else:
                size = np.maximum(np.abs(errors["position"] / self.sheet["position_m"]).max(axis=1),
                                  np.abs(errors["velocity"] / self.sheet["velocity_mps"]).max(axis=1))  # fmt: skip
                use &= size < 6.0 * max(self.true["gps_white"], 1.0) + 4.0
            at, self.ep, self.ev = errors["at"][use], errors["position"][use], errors["velocity"][use]
            d = 9 if self.referenced else 6
            wp, wv = (self.true["gps_white"] * self.sheet[key] for key in ("position_m", "velocity_mps"))
            self.r = np.array((wp**2,) * 3 + (wv**2,) * 3)
            if self.referenced:
                self.r = np.array((0.05**2,) * 3 + (0.003**2,) * 3 + ((0.001 * DEG) ** 2,) * 3)
            self.tilt = errors["attitude"][use] if self.referenced else None
        second = np.rint(at).astype(np.int64)
        good = (second >= 0) & (second <= self.seconds)
        _, first = np.unique(second[good], return_index=True)
        pick = np.flatnonzero(good)[first]
        self.at, self.d, self.pick = at[pick], d, pick
        self.row_of = np.full(self.seconds + 1, -1)
        self.row_of[second[pick]] = np.arange(len(pick))
        lla, velocity, euler, turn = self.truth.state(self.at)
        self.obs_c, self.obs_ned = linear.attitudes(lla, euler)
        self.obs_v, self.obs_turn = np.einsum("nij,nj->ni", self.obs_ned, velocity), turn
        eps = 0.05
        later, earlier = (self.truth.state(np.clip(self.at + s, 0, self.truth.duration_s)) for s in (eps, -eps))
        acceleration = (later[1] - earlier[1]) / (2 * eps)
        self.obs_a = np.einsum("nij,nj->ni", self.obs_ned, acceleration)

    def inputs(self, departures: Departures):
        """Inputs (s, 6), start (9,) and direct observations (rows, d) of what departs from the belief."""
        u, x0, felt = np.zeros((self.seconds, 6)), np.zeros(9), self.felt
        if np.ndim(departures.gyro_deg_per_h):
            values = departures.gyro_deg_per_h * (DEG_PER_H * felt.dt)
            linear.by_second(self.block_c, self.block_second, values, self.seconds, u[:, :3], -1.0)
        ug = departures.accel_ug * UG * felt.dt if np.ndim(departures.accel_ug) else 0.0
        if np.ndim(departures.accel_ppm):
            ug = ug + 1e-6 * departures.accel_ppm * felt.velocity
        if departures.element_lag_s.any():
            ug = ug + late(felt, self.belief, departures.element_lag_s) * UG * felt.dt
        if np.ndim(ug):
            linear.by_second(self.block_c, self.block_second, ug, self.seconds, u[:, 3:], 1.0)
        self.navigation(departures.earth, u)
        x0[:3] = self.ned[0] @ departures.attitude_rad
        y = self.direct(departures)
        for k, function in enumerate((departures.gps_position, departures.gps_velocity)):
            if function is not None:
                y[:, 3 * k : 3 * k + 3] -= np.einsum("nij,nj->ni", self.obs_ned, function(felt, self.at))
        return u, x0, self.since_start(x0, y)

    def since_start(self, x0: np.ndarray, y: np.ndarray) -> np.ndarray:
        """The observations: of what rests the attitude is not known, but that it stays what it was at the start."""
        if self.rests:
            y[:, 6:] -= x0[:3]
        return y

    def direct(self, departures: Departures) -> np.ndarray:
        """What departs in the observations themselves: antenna, clocks, axes of the reference."""
        y = np.zeros((len(self.at), self.d))
        lever = departures.lever_m
        if lever.any():
            y[:, :3] -= self.obs_c @ lever
            y[:, 3:6] -= np.einsum("nij,nj->ni", self.obs_c, np.cross(self.obs_turn, lever))
        offset = departures.reference_offset_s if self.referenced else departures.gps_offset_s
        if offset:
            y[:, :3] += offset * self.obs_v
            y[:, 3:6] += offset * self.obs_a
            if self.referenced:
                y[:, 6:] -= offset * np.einsum("nij,nj->ni", self.obs_c, self.obs_turn)
        if self.referenced and departures.reference_rad.any():
            y[:, 6:] += self.obs_c @ departures.reference_rad
        return y

    def navigation(self, missing, u) -> None:
        """Navigation equations that leave something out, as inputs."""
        v = np.einsum("nij,nj->ni", self.ned, self.velocity)
        spin = np.array((0.0, 0.0, W))
        if "rotation" in missing:
            u[:, :3] -= spin
        if "rotation" in missing or "coriolis" in missing:
            u[:, 3:] += 2.0 * np.cross(spin, v)
        lat, h = self.lla[:, 0], self.lla[:, 2]
        if "transport_rate" in missing:
            m, n = np.array([radii(one) for one in lat]).T
            vn, ve = self.velocity[:, 0], self.velocity[:, 1]
            carry = np.column_stack((ve / (n + h), -vn / (m + h), -ve * np.tan(lat) / (n + h)))
            carry = np.einsum("nij,nj->ni", self.ned, carry)
            u[:, :3] -= carry
            u[:, 3:] += np.cross(carry, v)
        for flag, fake in (("gravity_height", lambda a, b: gravity(a, 0.0)),
                           ("gravity_latitude", lambda a, b: gravity(math.pi / 4.0, b))):  # fmt: skip
            if flag in missing:
                error = np.array([fake(a, b) - gravity(a, b) for a, b in zip(lat, h, strict=True)])
                u[:, 3:] -= self.up * error[:, None]

    def realised(self):
        """The inputs that the recording really holds: indicated less ideal."""
        made, felt = self.made, self.made.felt
        reading = made.errors["reading"]
        pulses = made.head["imu"]["accelerometer"] == "pulse"
        accel = compensated(made.errors["accel"], self.belief, reading, felt.dt) if pulses else made.errors["accel"]
        n = len(self.block_second) * self.many
        add = lambda a: a[:n].reshape(-1, self.many, 3).sum(axis=1)  # noqa: E731
        u, x0, y = np.zeros((self.seconds, 6)), np.zeros(9), self.direct(made.departures)
        self.navigation(made.departures.earth, u)
        turned, pushed = add(made.errors["gyro"] - felt.angle), add(accel - felt.velocity)
        # the increments of a block are added in the axes of its middle; what is lost is of second order
        linear.by_second(self.block_c, self.block_second, turned, self.seconds, u[:, :3], -1.0)
        linear.by_second(self.block_c, self.block_second, pushed, self.seconds, u[:, 3:], 1.0)
        x0[:3] = self.ned[0] @ made.errors["start_rad"]
        y[:, :3] -= np.einsum("nij,nj->ni", self.obs_ned, self.ep[self.pick])
        y[:, 3:6] -= np.einsum("nij,nj->ni", self.obs_ned, self.ev[self.pick])
        if self.referenced:
            y[:, 6:] += np.einsum("nij,nj->ni", self.obs_ned, self.tilt[self.pick])
        return u, x0, self.since_start(x0, y)

    def nuisances(self):
        """Start attitude and turn-on biases, one sigma each."""
        out = []
        for i in range(3):
            d = Departures()
            d.attitude_rad[i] = max(self.true["attitude"], 0.1) * self.sheet["attitude_deg"][i] * DEG
            out.append(d)
        one = np.zeros((len(self.felt.time_s), 3))
        for i in range(3):
            gyro, accel = one.copy(), one.copy()
            gyro[:, i] = max(self.true["gyro_bias"], 0.1) * self.sheet["gyro_bias_deg_per_h"]
            accel[:, i] = max(self.true["accel_bias"], 0.1) * self.sheet["accel_bias_ug"]
            out += [Departures(gyro_deg_per_h=gyro), Departures(accel_ug=accel)]
        return [self.inputs(one) for one in out]

    def noise(self):
        """White variances a second (body) and the slow processes."""
        sheet, true = self.sheet, self.true
        arw = true["arw"] * sheet["arw_deg_per_sqrt_h"] * DEG / 60.0
        q_gyro = np.full(3, arw**2)  # a quantum whose remainder is carried is no random walk
        vrw = true["vrw"] * sheet["vrw_ug_per_sqrt_hz"] * UG
        meter = true["thermometer"]
        reading = meter["step_c"] ** 2 / 12.0 + meter["noise_c"] ** 2
        force = self.felt.force_g
        q_accel = np.empty(3)
        for i, axis in enumerate(AXES):
            slope = 0.0
            if "scale" in self.belief[axis]:
                s, f = self.belief[axis]["scale"], np.sqrt(np.mean(force[:, i] ** 2))
                slope = abs(s["mu"]) / s["gamma"] * 1e6 * f + abs(self.belief[axis]["bias"]["omega_ug_per_c"])
                slope += 0.33 * abs(s.get("epsilon", 0.0)) / s["gamma"] * 1e6 * f
            q_accel[i] = vrw**2 + 2.0 * (slope * UG) ** 2 * reading * (60.0 if meter["step_c"] > 0.02 else 20.0)
        hour = 3600.0
        gyro = sum(true[f"gyro_{form}_deg_per_h"] ** 2 for form in ("wander", "flicker", "walk"))
        accel = sum(true[f"accel_{form}_ug"] ** 2 for form in ("wander", "flicker", "walk"))
        mixed = true["gps_flicker"] * sheet["position_m"], 0.5 * true["gps_flicker"] * sheet["velocity_mps"]
        position = true["gps_position_markov_m"] ** 2 + true["gps_jumps_m"] ** 2 + mixed[0] ** 2
        velocity = true["gps_velocity_markov_mps"] ** 2 + mixed[1] ** 2
        sigma = np.sqrt((gyro * DEG_PER_H**2, accel * UG**2, position, velocity, 0.0))
        tau = np.array((
            hour if true["gyro_walk_deg_per_h"] else true["gyro_wander_tau_s"],
            hour if true["accel_walk_ug"] else true["accel_wander_tau_s"],
            300.0 if true["gps_jumps_m"] else true["gps_position_tau_s"], true["gps_velocity_tau_s"], 300.0,
        ))  # fmt: skip
        if self.rests:
            sigma[2:] = 0.0
        if self.referenced:
            sigma[2:], tau[2:] = (0.3, 0.004, 0.002 * DEG), (400.0, 100.0, 300.0)
        return q_gyro, q_accel, tau, sigma

    def velocities(self, candidates):
        """Velocity errors (seconds, 3, m) that candidates cause in inertial navigation with its height held."""
        inputs = []
        for one in candidates:
            departures = Departures()
            one(self.felt, departures)
            inputs.append(self.inputs(departures)[0])
        u = np.ascontiguousarray(np.stack(inputs, axis=-1))
        g = G0 / linear.mean_radius(self.lla)
        return linear.inertial(np.ascontiguousarray(self.c), self.force, self.up, g, u)

    def whitened(self, candidates):
        """Whitened data (n,), candidates (n, m) and nuisances (n, k)."""
        columns = [self.realised()]
        for one in candidates:
            departures = Departures()
            one(self.felt, departures)
            columns.append(self.inputs(departures))
        columns += self.nuisances()
        u = np.ascontiguousarray(np.stack([one[0] for one in columns], axis=-1))
        x0 = np.ascontiguousarray(np.stack([one[1] for one in columns], axis=-1))
        y = np.ascontiguousarray(np.stack([one[2] for one in columns], axis=-1))
        q_gyro, q_accel, tau, sigma = self.noise()
        g = G0 / linear.mean_radius(self.lla)
        w = linear.whiten(np.ascontiguousarray(self.c), self.force, self.up, g, u, x0, self.row_of, y, self.r,
                          q_gyro, q_accel, tau, sigma)  # fmt: skip
        m = len(candidates)
        return w[:, 0], w[:, 1 : m + 1], w[:, m + 1 :]


def chamber_whitened(made: Made, sheet: dict, true: dict, candidates):
    """As `Moving.whitened`, of a chamber recording."""
    axis, i = made.errors["axis"], AXES.index(made.errors["axis"])
    belief = made.head["accelerometer"][axis]
    table, data, columns = made.tables["chamber"], [], []
    felts, meter = made.errors["felts"], true["thermometer"]
    slope = abs(belief["scale"]["mu"]) / belief["scale"]["gamma"] * 1e6 + abs(belief["bias"]["omega_ug_per_c"])
    slope += 0.33 * abs(belief["scale"].get("epsilon", 0.0)) / belief["scale"]["gamma"] * 1e6
    reading_var = (meter["step_c"] ** 2 / 12.0 + meter["noise_c"] ** 2) * slope**2
    white = math.sqrt(made.errors["white_ug"] ** 2 + (1e6 / belief["scale"]["gamma"]) ** 2 / 12.0 + reading_var)
    for k, felt in enumerate(felts):
        rows = table["run"] == k
        counts = np.zeros((rows.sum(), 3))
        counts[:, i] = table["output"][rows] * felt.dt
        reading = np.repeat(table["temperature_c"][rows][:, None], 3, axis=1)
        got = compensated(counts, {a: belief for a in AXES}, reading, felt.dt)[:, i] / felt.dt / G0
        block = np.zeros((rows.sum(), len(candidates) + 2))
        block[:, 0] = (got - felt.force_g[:, i]) * 1e6
        for j, one in enumerate(candidates):
            if one.name.startswith("accelerometer.vibration"):
                continue
            departures = Departures()
            if one.name.split(".")[0] in ("accelerometer", "temperature"):
                one(felt, departures)
            total = np.zeros((rows.sum(), 3)) + departures.accel_ug + departures.accel_ppm * felt.force_g
            if departures.element_lag_s.any():
                total = total + late(felt, {axis: belief}, departures.element_lag_s)
            block[:, 1 + j] = total[:, i]
        block[:, -1] = max(true["accel_bias"], 0.1) * sheet["accel_bias_ug"]
        # white noise and one constant a run
        n, shift = rows.sum(), made.errors["shift_ug"]
        share = 1.0 - 1.0 / math.sqrt(1.0 + n * shift**2 / white**2)
        data.append((block - share * block.mean(axis=0)) / white)
    whole = np.vstack(data)
    columns = whole[:, 1:-1]
    return whole[:, 0], columns, whole[:, -1:]
