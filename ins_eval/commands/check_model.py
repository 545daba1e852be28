"""``ins-eval check-model``: does a compensation model keep its contract?"""

from __future__ import annotations

from ins_eval.compensation.check import check_model
from ins_eval.compensation.registry import load_model
from ins_eval.errors import UsageError


def run(spec: str) -> int:
    """Print one line for each point of the contract; a breach is refused with its sentence."""
    findings = check_model(load_model(spec))
    for finding in findings:
        print(finding)
    refusals = [finding.refusal for finding in findings if finding.refusal]
    if refusals:
        raise UsageError(f"compensation model '{spec}': {refusals[0]}")
    print(f"{spec} keeps the contract of a compensation model")
    return 0
