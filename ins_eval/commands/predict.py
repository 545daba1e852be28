"""``ins-eval predict``: what a written model is expected to gain on a flight."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ins_eval.commands.delivery import deliver
from ins_eval.interface.predict import predict


def run(
    model: Path,
    flight: Path,
    output: Path | None = None,
    export: Sequence[str] = (),
    json: Path | None = None,
    quiet: bool = False,
) -> int:
    """Report what `model` expects on `flight`, a profile or a recording (default: ``reports/NAME-prediction``)."""
    result = predict(model, flight)
    deliver(result, output or Path("reports") / f"{result.found.flight}-prediction", quiet, json, export)
    return 0
