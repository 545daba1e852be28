"""``ins-eval predict``: what a written model is expected to gain on a flight."""

from __future__ import annotations

from pathlib import Path

from ins_eval.interface.predict import predict
from ins_eval.report.json_file import write_json


def run(model: Path, flight: Path, json: Path | None = None, quiet: bool = False) -> int:
    """Print what `model` expects on `flight`, a profile or a recording; as JSON where wanted."""
    result = predict(model, flight)
    write_json(json, result.metrics)
    if not quiet:
        print(result)
    return 0
