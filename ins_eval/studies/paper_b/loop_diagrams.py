"""Block diagrams of the digital loop as it is modelled here: Figs 2 to 9 of Paper B."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ins_eval.figures.style import ACCENT, INK, QUIET, styled
from ins_eval.studies.diagrams import arrow, box, canvas, enclosure

HIGH, LOW = 2.35, 0.35  # lower edges of the two rows of boxes
TALL = 0.95
SUM = (2.05, HIGH + TALL / 2)


@styled
def loop_structure() -> Figure:
    """Pendulum, forward channel and feedback channel."""
    ax = _loop(
        "The closed loop (Fig. 2)", "Three sections as in the paper: pendulosity, forward channel, feedback channel."
    )
    return ax.figure


@styled
def loop_with_current() -> Figure:
    """The same with switch M1, which adds I_ref to the current of the torquer."""
    ax = _loop(
        "The closed loop with the constant current (Fig. 7)",
        "M1 adds I_ref to the current of the torquer, so that k_t cancels in N_on − N_off = −I_ref/(k_VI k_DA).",
    )
    _marked(ax, 2.55, 1.42, 1.3, 0.62, "I_ref\nthrough M1")
    _line(ax, (3.2, 1.42), (3.2, LOW + TALL / 2), ACCENT)
    return ax.figure


@styled
def loop_with_compensation() -> Figure:
    """The same with the corrections of the controller and of DA0."""
    ax = _loop(
        "The closed loop with both corrections (Fig. 8)",
        "Forward gain: 1/(1 + δ) in the controller, eq. (22). Feedback gain: N_VREF/(1 + δ), eq. (30).",
    )
    _marked(ax, 7.9, 1.5, 1.6, 0.5, "1/(1 + δk_pre)")
    _line(ax, (8.75, 2.0), (8.75, HIGH), ACCENT)
    _marked(ax, 5.55, 1.65, 2.15, 0.5, "DA0: N_VREF/(1 + δk_fb)")
    _line(ax, (6.65, 1.65), (6.65, LOW + TALL), ACCENT)
    return ax.figure


@styled
def bridge_chain() -> Figure:
    """Carrier, bridge, amplifier, converter, demodulator."""
    ax = canvas(
        "How ΔC is measured (Fig. 3)",
        "At null k_CV = V_IN k_amp/(4 C0), with C1, C2 = C0 ± ΔC/2; eq. (4) as printed gives zero there.",
    )
    enclosure(ax, 3.5, 0.3, 2.2, 3.2, "AC bridge")
    box(ax, 3.75, 1.85, 1.7, 1.05, "C1, C2\nof the pendulum")
    box(ax, 3.75, 0.55, 1.7, 1.05, "C_ref1, C_ref2\nequal to C0")
    box(ax, 0.1, 1.2, 1.35, 1.3, "FPGA:\nN_FPGA\nsin")
    box(ax, 1.9, 1.2, 1.15, 1.3, "DA1,\nk_tz")
    box(ax, 6.15, 1.2, 1.15, 1.3, "k_amp")
    box(ax, 7.65, 1.2, 0.9, 1.3, "AD")
    box(ax, 8.9, 1.2, 1.05, 1.3, "FPGA:\nk_demo")
    for start, end in ((1.45, 1.9), (3.05, 3.5), (5.7, 6.15), (7.3, 7.65), (8.55, 8.9)):
        arrow(ax, (start, 1.85), (end, 1.85))
    ax.text(3.27, 2.0, "V_IN", fontsize=8.0, ha="center", color=QUIET)
    ax.text(5.92, 2.0, "ΔV", fontsize=8.0, ha="center", color=QUIET)
    return ax.figure


@styled
def open_loop_chain() -> Figure:
    """What the scan sees, and what it does not."""
    return _chain(
        "The forward channel with the plate on its stop (Fig. 4)",
        "The stop sets ΔC, so moment, stiffness and k1 (grey) do not reach the counts; the paper has them in eq. (17).",
        ("M_in", "1/D", "k1", "bridge\n1 − ρ", "k_amp", "k_AD", "k_demo\nk(D(z))"),
        unseen=3,
        leads_in=(3, "N_FPGA"),
    ).figure


@styled
def excited_open_loop() -> Figure:
    """The rejected method."""
    return _chain(
        "The open loop excited through the torquer (Fig. 6)",
        "A current that balances 1 g, and steps around it: the gap leaves room for little, and the bias wanders.",
        ("N_DA2", "k_DA\nk_VI", "k_t", "1/D", "k1 k_CV", "k_AD", "k_demo"),
        unseen=0,
        leads_in=(3, "k0 a"),
    ).figure


@styled
def scan_schedule() -> Figure:
    """Steps of N_FPGA, counts, slope, drift."""
    return _chain(
        "Scan of the carrier's amplitude and least squares (Fig. 5)",
        "The slope of N_out against N_FPGA is the gain; its change is the drift of the forward channel's electronics.",
        (
            "N_FPGA\n+ i ΔN",
            "open-loop\nchain",
            "mean of\nN_out(i)",
            "centred least\nsquares (19)",
            "slope k",
            "k/k0 − 1",
        ),
        unseen=0,
        leads_in=None,
    ).figure


@styled
def procedure_steps() -> Figure:
    """Steps 1 to 5."""
    return _chain(
        "The procedure (Fig. 9)",
        "Steps 1 to 5 of section IV-A, at one position; between step 2 and step 3 time passes and the unit warms up.",
        (
            "1 references\nk_pre-eq,\nN_on − N_off",
            "2 static\nN_out(0)",
            "3 drift put in\nstatic\nN'_out(1)",
            "4 estimate,\ncorrect, static\nN_out(1)",
            "5 compare\n(31)",
        ),
        unseen=0,
        leads_in=None,
    ).figure


def _loop(title: str, note: str) -> Axes:
    ax = canvas(title, note, 3.1)
    middle = HIGH + TALL / 2
    box(ax, 0.05, HIGH, 1.0, TALL, "k0 = m L")
    for x, width, text in (
        (2.5, 1.45, "pendulum\n1/(J s² + C s + D)"),
        (4.2, 1.1, "k1"),
        (5.55, 1.1, "k_CV\nbridge"),
        (6.9, 1.1, "k_AD,\nk_demo"),
        (8.25, 1.05, "D(z)"),
    ):
        box(ax, x, HIGH, width, TALL, text)
    for x, width, text in (
        (5.95, 1.4, "DA2\nk_DA"),
        (4.2, 1.3, "V to I\nk_VI = 1/R"),
        (1.45, 1.2, "torquer\nk_t = B L_c L"),
    ):
        box(ax, x, LOW, width, TALL, text)
    ax.plot(*SUM, "o", color="white", markeredgecolor=INK, markersize=13, zorder=3)
    ax.text(*SUM, "+", ha="center", va="center", fontsize=10, zorder=4)
    ax.text(SUM[0] - 0.16, SUM[1] - 0.4, "−", ha="center", fontsize=10)
    for start, end in ((1.05, 1.87), (2.22, 2.5), (3.95, 4.2), (5.3, 5.55), (6.65, 6.9), (8.0, 8.25), (9.3, 9.95)):
        arrow(ax, (start, middle), (end, middle))
    ax.text(0.0, HIGH + TALL + 0.1, "acceleration a", fontsize=8.5, color=QUIET)
    ax.text(9.97, middle + 0.15, "N_out", fontsize=8.5, ha="right", color=QUIET)
    low = LOW + TALL / 2
    ax.plot([9.65, 9.65], [middle, low], color=INK, linewidth=1.0)
    arrow(ax, (9.65, low), (7.35, low))
    arrow(ax, (5.95, low), (5.5, low))
    arrow(ax, (4.2, low), (2.65, low))
    ax.plot([1.45, 1.25, 1.25, SUM[0]], [low, low, 1.65, 1.65], color=INK, linewidth=1.0)
    arrow(ax, (SUM[0], 1.65), (SUM[0], middle - 0.22))
    return ax


def _chain(title: str, note: str, texts: Sequence[str], unseen: int, leads_in: tuple[int, str] | None) -> Axes:
    """Boxes from left to right, the first `unseen` grey; `leads_in` names what enters a box from above."""
    ax = canvas(title, note, 2.1 if leads_in else 1.7)
    ax.set_ylim(0.7, 3.3 if leads_in else 2.6)
    gap = 0.32
    width = (9.9 - gap * (len(texts) - 1)) / len(texts)
    for k, text in enumerate(texts):
        x = 0.05 + k * (width + gap)
        box(ax, x, 0.9, width, 1.5, text)
        if k < unseen:
            ax.texts[-1].set_color("#9a9a9a")
        if k + 1 < len(texts) and k + 1 != unseen:
            arrow(ax, (x + width, 1.65), (x + width + gap, 1.65))
        if leads_in and leads_in[0] == k:
            arrow(ax, (x + width / 2, 3.2), (x + width / 2, 2.4))
            ax.text(x + width / 2 + 0.12, 2.85, leads_in[1], fontsize=8.5, color=QUIET)
    return ax


def _marked(ax: Axes, x: float, y: float, width: float, height: float, text: str) -> None:
    box(ax, x, y, width, height, text)
    ax.patches[-1].set(edgecolor=ACCENT, linewidth=1.4)


def _line(ax: Axes, start: tuple[float, float], end: tuple[float, float], color: str) -> None:
    ax.annotate("", end, start, arrowprops={"arrowstyle": "-|>", "color": color, "linewidth": 1.4}, zorder=4)
