"""``ins-eval check-model``: does a compensation model keep its contract?"""

from __future__ import annotations

from pathlib import Path

from ins_eval.compensation.check import NOT_SEEN, check_model
from ins_eval.compensation.registry import load_model
from ins_eval.errors import UsageError
from ins_eval.report.json_file import write_json


def run(model: str, json: Path | None = None, quiet: bool = False) -> int:
    """Print a line for each point of the contract and one of what is not seen; raise UsageError with what is broken."""
    findings = check_model(load_model(model))
    refusals = {finding.check: finding.refusal for finding in findings}
    write_json(json, {"format": "ins-eval-check/1", "model": model, "refusals": refusals, "not_seen": NOT_SEEN})
    if not quiet:
        print("\n".join(f"{check}: {'refused' if refusal else 'ok'}" for check, refusal in refusals.items()))
        print(NOT_SEEN)
    if broken := [refusal for refusal in refusals.values() if refusal]:
        raise UsageError(f"compensation model '{model}': {'; '.join(broken)}")
    if not quiet:
        print(f"{model} keeps the contract of a compensation model")
    return 0
