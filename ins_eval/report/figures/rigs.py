"""Block diagrams of the three rigs of Paper A, as they are modelled here (its Fig. 2, 4 and 8)."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

from ins_eval.report.style import INK, QUIET, sheet, styled

HEIGHT_IN = 2.7
BOX, ENCLOSURE = "#f2f2f2", "#fbf6ea"
POSITIONS = ("0°: +1 g", "90°: 0 g", "180°: −1 g", "270°: 0 g")


@styled
def creep_rig(*, title: str = "Creep rig (Fig. 2)") -> Figure:
    """A block of resin in an oven, watched by a camera."""
    ax = _canvas(title, "Three blocks alike, one an oven. The tables give every size a minus sign, shrinking or not.")
    _enclosure(ax, 3.2, 0.3, 3.4, 3.2, "oven at −55, 30 or 85 °C")
    _box(ax, 3.8, 1.0, 2.2, 1.3, "block of epoxy resin\nsteps in temperature,\nthen 300 min at rest")
    _box(ax, 0.2, 1.0, 2.0, 1.3, "temperature\ncontroller")
    _box(ax, 7.6, 1.0, 2.2, 1.3, "high-resolution camera\nΔLc: thermal step\nΔLv: creep after it")
    _arrow(ax, (2.2, 1.65), (3.2, 1.65))
    _arrow(ax, (6.0, 1.65), (7.6, 1.65))
    return ax.figure


@styled
def chamber_rig(*, title: str = "Index head in the thermal chamber (Fig. 4)") -> Figure:
    """An accelerometer on an index head in a chamber, turned to four positions."""
    ax = _canvas(
        title,
        "Angles and inputs as printed under Fig. 4; the paper's equations use other ones, so here a position is told "
        "by its specific force.",
    )
    _enclosure(ax, 2.6, 0.15, 5.0, 3.5, "chamber, −60 to +70 °C at 0.3, 0.5, 0.7, 0.9 °C/min")
    _box(ax, 2.9, 1.75, 1.9, 1.15, "accelerometer\nJB-KT8")
    _box(ax, 2.9, 0.35, 1.9, 0.95, "index head")
    _arrow(ax, (3.85, 1.3), (3.85, 1.75))
    _box(ax, 5.35, 1.75, 2.0, 1.15, "DS18B20\non its surface\n0.0625 °C a step")
    _arrow(ax, (4.8, 2.32), (5.35, 2.32))
    for k, text in enumerate(POSITIONS):
        ax.text(5.45 + 1.0 * (k // 2), 0.98 - 0.4 * (k % 2), text, fontsize=8.5, va="center", color=INK)
    _box(ax, 0.1, 1.0, 1.9, 1.3, "programme:\nsoak, falling,\nrising, falling")
    _arrow(ax, (2.0, 1.65), (2.6, 1.65))
    _box(ax, 8.2, 1.0, 1.7, 1.3, "means of\n60 s of pulses,\nK1 and K0")
    _arrow(ax, (7.6, 1.65), (8.2, 1.65))
    return ax.figure


@styled
def oven_rig(*, title: str = "IMU in the oven (Fig. 8)") -> Figure:
    """An IMU at rest with the temperatures of the flight, navigated twice from the same pulses."""
    ax = _canvas(title, "The same recording goes through both compensations and the same pure-inertial navigation.")
    _enclosure(ax, 2.3, 0.3, 2.6, 3.2, "oven, at rest")
    _box(ax, 2.6, 0.8, 2.0, 1.7, "IMU\n3 accelerometers,\n3 gyros,\n1 thermometer")
    _box(ax, 0.1, 1.0, 1.7, 1.3, "temperature\nof the flight")
    _arrow(ax, (1.8, 1.65), (2.3, 1.65))
    _box(ax, 5.5, 2.1, 2.0, 1.1, "simple\ncompensation")
    _box(ax, 5.5, 0.5, 2.0, 1.1, "hysteresis\ncompensation")
    _box(ax, 8.1, 1.0, 1.8, 1.3, "pure-inertial\nnavigation,\nerrors against\nstandstill")
    for y in (2.65, 1.05):
        _arrow(ax, (4.6, 1.65), (5.5, y))
        _arrow(ax, (7.5, y), (8.1, 1.65))
    return ax.figure


def _canvas(title: str, note: str) -> Axes:
    ax = sheet(HEIGHT_IN, title, note)[1]
    ax.set(xlim=(0.0, 10.0), ylim=(0.0, 3.75))
    ax.axis("off")
    return ax


def _box(ax: Axes, x: float, y: float, width: float, height: float, text: str) -> None:
    shape = FancyBboxPatch((x, y), width, height, boxstyle="round,pad=0,rounding_size=0.08")
    shape.set(facecolor=BOX, edgecolor=QUIET, linewidth=0.8, zorder=2)
    ax.add_patch(shape)
    ax.text(x + width / 2, y + height / 2, text, ha="center", va="center", fontsize=8.5, zorder=3, linespacing=1.3)


def _enclosure(ax: Axes, x: float, y: float, width: float, height: float, text: str) -> None:
    shape = FancyBboxPatch((x, y), width, height, boxstyle="square,pad=0")
    shape.set(facecolor=ENCLOSURE, edgecolor=INK, linewidth=1.2, zorder=1)
    ax.add_patch(shape)
    ax.text(x + 0.1, y + height - 0.12, text, ha="left", va="top", fontsize=8.5, color=QUIET, zorder=3)


def _arrow(ax: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    ax.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 1.0}, zorder=4)
