"""The figure of a page that sets numbers side by side: recordings, runs, what a model expects."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from ins_eval.analysis.several import Row, SeveralEvaluations
from ins_eval.figures import side_by_side
from ins_eval.figures.side_by_side import Value
from ins_eval.figures.style import colour, label
from ins_eval.vocabulary import PREDICTED, measure_name

if TYPE_CHECKING:  # `evaluate` needs neither, and both import much
    from ins_eval.analysis.predict import Prediction
    from ins_eval.analysis.results import RunComparison

MOST_PERCENT = 900.0  # of a change that is drawn; a larger one would leave the others flat


def several_figures(found: SeveralEvaluations) -> dict[str, Figure]:
    """Horizontal velocity RMS of each recording with each compensation."""
    values = [
        Value(row.name, rms, of=label(row.compensation), colour=colour(row.compensation))
        for row in found.rows
        if isinstance(row, Row) and (rms := row.velocity_rms_horizontal_mps) is not None
    ]
    if not values:
        return {}
    return {
        "each_recording": side_by_side(
            values=values,
            title="Each recording",
            rows="recording",
            axis="horizontal velocity RMS [m/s]",
            note="One run each, so that there is no interval.",
        )
    }


def runs_figures(found: RunComparison) -> dict[str, Figure]:
    """Every change with its interval, a colour each later run."""
    values = [
        Value(
            f"{measure_name(one.measure)}, {label(one.compensation)}",
            *(100.0 * (x - 1.0) for x in ratio),
            of=run.name if len(found.runs) > 2 else "",
            colour=f"C{k}",
        )
        for one in found.changes
        for k, (run, ratio) in enumerate(zip(found.runs[1:], one.ratios, strict=True))
        if ratio is not None and abs(ratio.value - 1.0) < MOST_PERCENT / 100.0
    ]
    if not values:
        return {}
    return {
        "changes": side_by_side(
            values=values,
            title=f"Change from {found.runs[0].name}",
            rows="measure",
            axis="change [%]",
            note="Paired, with 95 % intervals where two recordings or more are paired. Negative is better.",
            nothing=0.0,
        )
    }


def prediction_figures(found: Prediction) -> dict[str, Figure]:
    """Velocity RMS with and without the model."""
    of = found.tree["velocity_rms"]
    values = [
        Value(words.removesuffix(" [m/s]"), *(of[name][end] for end in ("median", "low", "high")))
        for name, words in PREDICTED
        if words.endswith(" [m/s]")
    ]
    return {
        "expected_velocity_rms": side_by_side(
            values=values,
            title="What the model is expected to gain",
            rows="errors",
            axis="horizontal velocity RMS [m/s]",
            note="Medians and 95 % intervals over instruments that the model holds possible.",
        )
    }
