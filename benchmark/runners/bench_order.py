"""Order of convergence of the mechanization: errors against the sample, of motions whose truth is known."""

from __future__ import annotations

import numpy as np
import pymap3d
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter
from scipy.spatial.transform import Rotation

from benchmark.runners.bench_rows import flight
from ins_eval.figures.style import sheet, styled
from ins_eval.profile import load
from ins_eval.recording import Start
from ins_eval.recording.belief import EarthBelief
from ins_eval.strapdown import navigate
from ins_eval.trajectory import Trajectory

FLOWN = {"calm flight": "climb-cruise-landing", "wing rock, 2° at 0.5 Hz": "wing-rock"}
RATES_HZ = (5.0, 10.0, 20.0, 25.0, 50.0, 100.0)
CONE_RAD, CONE_HZ, CONE_S = np.pi / 180.0, 2.0, 20.0
CONE_RATES_HZ = (12.5, 25.0, 50.0, 100.0, 200.0)
CAPTION = (
    "Largest horizontal error over 8400 s without sensor errors, and largest attitude error over 20 s of coning (1° at "
    "2 Hz), against the sample rate, with lines of fourth and sixth order. At 100 Hz and more rounding is met."
)


def errors() -> dict[str, dict[str, float]]:
    """By motion and rate: m, of coning rad."""
    found = {motion: {f"{rate_hz:g}": _flown(name, rate_hz) for rate_hz in RATES_HZ} for motion, name in FLOWN.items()}
    found["coning"] = {f"{rate_hz:g}": _coning(rate_hz) for rate_hz in CONE_RATES_HZ}
    return found


def _flown(name: str, rate_hz: float) -> float:
    solution = flight(name, rate_hz).navigated()
    truth = Trajectory(load(name)).truth(solution.time_s)
    east, north, _ = pymap3d.geodetic2enu(
        solution.latitude_rad, solution.longitude_rad, solution.height_m,
        truth.latitude_rad, truth.longitude_rad, truth.height_m, deg=False,
    )  # fmt: skip
    return float(np.hypot(east, north).max())


def _coning(rate_hz: float) -> float:
    """Rotation vector a [0, cos wt, sin wt]; body rate w [cos a - 1, -sin a sin wt, sin a cos wt], no force."""
    w, a = 2.0 * np.pi * CONE_HZ, CONE_RAD
    edges = np.arange(round(CONE_S * rate_hz) + 1) / rate_hz
    angle = np.stack(
        [w * (np.cos(a) - 1.0) * np.diff(edges), np.sin(a) * np.diff(np.cos(w * edges)),
         np.sin(a) * np.diff(np.sin(w * edges))], axis=1,
    )  # fmt: skip

    def attitude(time_s: np.ndarray) -> Rotation:
        return Rotation.from_rotvec(a * np.stack([0.0 * time_s, np.cos(w * time_s), np.sin(w * time_s)], axis=-1))

    start = Start(0.0, 0.5, 0.0, 0.0, attitude_rad=tuple(attitude(np.zeros(1)).as_euler("ZYX")[0, ::-1]))
    flat = EarthBelief(rotation=False, coriolis=False, transport_rate=False)
    solution = navigate(edges[1:], angle, np.zeros_like(angle), start, vertical="frozen", earth=flat)
    off = attitude(solution.time_s).inv() * Rotation.from_quat(solution.quaternion_nb, scalar_first=True)
    return float(off.magnitude().max())


@styled
def figure(found: dict[str, dict[str, float]]) -> Figure:
    """Errors against rate, both logarithmic."""
    drawn, (left, right) = sheet(
        3.6, "Order of convergence", "largest error of the navigation without sensor errors", columns=2
    )
    for motion, rows in found.items():
        axes = right if motion == "coning" else left
        rates = sorted(rows, key=float)
        axes.loglog([float(rate) for rate in rates], [rows[rate] for rate in rates], "o-", label=motion)
    for axes, order, rows in ((left, 4, next(iter(found.values()))), (right, 6, found["coning"])):
        rates = np.sort([float(rate) for rate in rows])[:4]
        top = max(rows.values())
        axes.loglog(rates, top * (rates[0] / rates) ** order, ":", color="0.5", label=f"order {order}")
        axes.set_xlabel("rate [Hz]")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
    left.set_ylabel("error [m]")
    right.set_ylabel("error [rad]")
    left.legend()
    right.legend()
    return drawn
