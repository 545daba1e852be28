"""Block diagrams of the three rigs of Paper A, as they are modelled here (its Fig. 2, 4 and 8)."""

from __future__ import annotations

from matplotlib.figure import Figure

from ins_eval.figures.style import INK, styled
from ins_eval.studies.diagrams import arrow, box, canvas, enclosure

POSITIONS = ("0°: +1 g", "90°: 0 g", "180°: −1 g", "270°: 0 g")


@styled
def creep_rig() -> Figure:
    """A block of resin in an oven, watched by a camera."""
    ax = canvas(
        "Creep rig (Fig. 2)",
        "Three blocks alike, one an oven. The tables give every size a minus sign, shrinking or not.",
    )
    enclosure(ax, 3.2, 0.3, 3.4, 3.2, "oven at −55, 30 or 85 °C")
    box(ax, 3.8, 1.0, 2.2, 1.3, "block of epoxy resin\nsteps in temperature,\nthen 300 min at rest")
    box(ax, 0.2, 1.0, 2.0, 1.3, "temperature\ncontroller")
    box(ax, 7.6, 1.0, 2.2, 1.3, "high-resolution camera\nΔLc: thermal step\nΔLv: creep after it")
    arrow(ax, (2.2, 1.65), (3.2, 1.65))
    arrow(ax, (6.0, 1.65), (7.6, 1.65))
    return ax.figure


@styled
def chamber_rig() -> Figure:
    """An accelerometer on an index head in a chamber, turned to four positions."""
    ax = canvas(
        "Index head in the thermal chamber (Fig. 4)",
        "Angles and inputs as printed under Fig. 4; the paper's equations use other ones, so here a position is told "
        "by its specific force.",
    )
    enclosure(ax, 2.6, 0.15, 5.0, 3.5, "chamber, −60 to +70 °C at 0.3, 0.5, 0.7, 0.9 °C/min")
    box(ax, 2.9, 1.75, 1.9, 1.15, "accelerometer\nJB-KT8")
    box(ax, 2.9, 0.35, 1.9, 0.95, "index head")
    arrow(ax, (3.85, 1.3), (3.85, 1.75))
    box(ax, 5.35, 1.75, 2.0, 1.15, "DS18B20\non its surface\n0.0625 °C a step")
    arrow(ax, (4.8, 2.32), (5.35, 2.32))
    for k, text in enumerate(POSITIONS):
        ax.text(5.45 + 1.0 * (k // 2), 0.98 - 0.4 * (k % 2), text, fontsize=8.5, va="center", color=INK)
    box(ax, 0.1, 1.0, 1.9, 1.3, "programme:\nsoak, falling,\nrising, falling")
    arrow(ax, (2.0, 1.65), (2.6, 1.65))
    box(ax, 8.2, 1.0, 1.7, 1.3, "means of\n60 s of pulses,\nK1 and K0")
    arrow(ax, (7.6, 1.65), (8.2, 1.65))
    return ax.figure


@styled
def oven_rig() -> Figure:
    """An IMU at rest with the temperatures of the flight, navigated twice from the same pulses."""
    ax = canvas(
        "IMU in the oven (Fig. 8)",
        "The same recording goes through both compensations and the same pure-inertial navigation.",
    )
    enclosure(ax, 2.3, 0.3, 2.6, 3.2, "oven, at rest")
    box(ax, 2.6, 0.8, 2.0, 1.7, "IMU\n3 accelerometers,\n3 gyros,\n1 thermometer")
    box(ax, 0.1, 1.0, 1.7, 1.3, "temperature\nof the flight")
    arrow(ax, (1.8, 1.65), (2.3, 1.65))
    box(ax, 5.5, 2.1, 2.0, 1.1, "simple\ncompensation")
    box(ax, 5.5, 0.5, 2.0, 1.1, "hysteresis\ncompensation")
    box(ax, 8.1, 1.0, 1.8, 1.3, "pure-inertial\nnavigation,\nerrors against\nstandstill")
    for y in (2.65, 1.05):
        arrow(ax, (4.6, 1.65), (5.5, y))
        arrow(ax, (7.5, y), (8.1, 1.65))
    return ax.figure
