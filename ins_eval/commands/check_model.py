"""``ins-eval check-model``: does a compensation model keep its contract?"""

from __future__ import annotations

from ins_eval.compensation.check import NOT_SEEN, check_model
from ins_eval.compensation.registry import load_model
from ins_eval.errors import UsageError


def run(model: str) -> int:
    """Print a line for each point of the contract and one of what is not seen; raise UsageError with what is broken."""
    findings = check_model(load_model(model))
    for finding in findings:
        print(f"{finding.check}: {'refused' if finding.refusal else 'ok'}")
    print(NOT_SEEN)
    refusals = [finding.refusal for finding in findings if finding.refusal]
    if refusals:
        raise UsageError(f"compensation model '{model}': {'; '.join(refusals)}")
    print(f"{model} keeps the contract of a compensation model")
    return 0
