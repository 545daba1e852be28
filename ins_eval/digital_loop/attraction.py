"""Electrostatic attraction: what the carrier does to the plate.

The carrier of amplitude V lies across C1 and C2 in series, and the plate, their middle, is the pick-off. A capacitance
C_s loads the plate to the middle of the bridge: 0 leaves the plate free, as eq. (4) has it, infinity holds it at the
middle, as a charge amplifier would. With u = l theta / d in (-1, 1), s = C_s / C0 and C1, C2 = C0 / (1 -+ u), each gap
of width g carries v = v1 or v2 and draws with C0 d v^2 / (2 g^2), the derivative of C v^2 / 2, so that together

    F = C0 V^2 / (4 d) S(u),    S(u) = s (2 + s) u / (2 + s (1 - u^2))^2,    V^2 / 2 the mean square of the carrier

towards the nearer side. A free plate is not drawn at all, s = 0: the charge on both capacitors is the same, and C1 and
C2 in series are C0 / 2 wherever the plate is. A held one is attracted most, S = u / (1 - u^2)^2. (A bridge that is not
symmetric, its load to one electrode, can reach the single-sided S below, with twice the stiffness.) At rest

    u = u_free + load S(u),    load = l^2 C0 V^2 / (4 d^2 D)

u_free the deflection without attraction. load S'(0) is the negative stiffness over the stiffness D of the hinge. Where
the line u - u_free only touches load S(u), the plate is pulled in.

Source: derived here; S. D. Senturia, Microsystem Design (2001), section 6.4, for pull-in of the single-sided plate,
S = 1 / (1 - u)^2, at a third of the gap.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize_scalar

from ins_eval.digital_loop.model import Loop
from ins_eval.errors import UsageError

FREE, HELD = 0.0, float("inf")  # C_s / C0
VACUUM_F_PER_M = 8.8541878128e-12
ITERATIONS, CLOSE = 50, 1e-13  # of Newton's method, in u
STEP = 1e-6  # of a derivative in u
Shape = Callable[[np.ndarray | float], np.ndarray | float]


def bridge(loading: float) -> Shape:
    """S(u) of the bridge with the plate loaded by `loading` = C_s / C0."""
    if np.isinf(loading):
        return lambda u: u / (1.0 - u * u) ** 2
    return lambda u: loading * (2.0 + loading) * u / (2.0 + loading * (1.0 - u * u)) ** 2


def null_capacitance(loop: Loop) -> float:
    """C0 in F, of either side with the plate in the middle."""
    return 0.5 * loop.capacitance_gain * loop.stop_rad


def area_m2(loop: Loop) -> float:
    """Area of a plate, C0 d / eps0."""
    return null_capacitance(loop) * loop["plate_spacing"] / VACUUM_F_PER_M


def carrier_volts(loop: Loop) -> float:
    """Amplitude V_IN of the carrier of the working loop."""
    return loop.volts_per_count * loop.parameters.carrier.amplitude.value


def unit_force(loop: Loop, volts: float) -> float:
    """C0 V^2 / (4 d) in N: the force where S = 1."""
    return null_capacitance(loop) * volts**2 / (4.0 * loop["plate_spacing"])


def load(loop: Loop, volts: float | None = None) -> float:
    """l^2 C0 V^2 / (4 d^2 D): torque where S = 1, over the torque that bends the hinge to the stop.

    `volts` is the amplitude of the carrier, by default that of the working loop.
    """
    volts = carrier_volts(loop) if volts is None else volts
    return unit_force(loop, volts) * loop.parameters.pickoff.arm.value / (loop["bending_stiffness"] * loop.stop_rad)


def volts_of(loop: Loop, wanted: float) -> float:
    """Amplitude of the carrier in V that makes the load `wanted`."""
    return carrier_volts(loop) * float(np.sqrt(wanted / load(loop)))


def softening(shape: Shape, u: float = 0.0) -> float:
    """S'(u); times the load it is the negative stiffness over D."""
    return float(shape(u + STEP) - shape(u - STEP)) / (2.0 * STEP)


def pull_in(shape: Shape, free: float = 0.0) -> tuple[float, float]:
    """The load from which the plate is pulled in, and the u at which it then is; `free` is u without attraction.

    load = max over u of (u - u_free) / S(u): beyond it no u is at rest. With u_free = 0 between two sides that draw
    alike the plate leaves the middle, load = 1 / S'(0).
    """
    found = minimize_scalar(
        lambda u: -(u - free) / shape(u), bounds=(free + 1e-6, 1.0 - 1e-9), method="bounded", options={"xatol": 1e-9}
    )
    return -float(found.fun), float(found.x)


def at_rest(shape: Shape, amount: float, free: np.ndarray) -> np.ndarray:
    """u at rest under the load `amount`, from `free` without attraction; NaN where the plate is pulled in.

    Newton's steps from u_free rise to the first root, since S grows and is convex away from the middle.
    """
    u = np.asarray(free, dtype=float).copy()
    if amount == 0.0:
        return u
    with np.errstate(all="ignore"):
        for _ in range(ITERATIONS):
            slope = 1.0 - amount * (shape(u + STEP) - shape(u - STEP)) / (2.0 * STEP)
            change = np.where(slope > 0.0, (free + amount * shape(u) - u) / slope, np.nan)
            u = np.where(np.abs(u + change) < 1.0, u + change, np.nan)
            if not np.any(np.abs(change) > CLOSE):
                break
    return u


def attracted(loop: Loop, free: np.ndarray, loading: float, volts: float | None = None) -> np.ndarray:
    """u of the plate at rest with attraction, where it would be at `free` (n,) without.

    Raises UsageError where the plate is pulled in.
    """
    if loading == FREE:
        return free
    u = at_rest(bridge(loading), load(loop, volts), free)
    if np.isnan(u).any():
        raise UsageError("the carrier pulls the plate onto its stop; give the carrier a smaller amplitude")
    return u


def latching_gap_m(loop: Loop, volts: float | None = None) -> float:
    """What gap in m has to be left at the stop for the hinge to tear off a plate that is held at the middle, at 0 g.

    C0 d (V / 2)^2 / (4 g^2) l = D d / l. A smaller gap keeps the plate; a loaded plate is drawn less.
    """
    volts = carrier_volts(loop) if volts is None else volts
    pull = null_capacitance(loop) * loop["plate_spacing"] * (0.5 * volts) ** 2 / 4.0
    return float(np.sqrt(pull * loop.parameters.pickoff.arm.value / (loop["bending_stiffness"] * loop.stop_rad)))
