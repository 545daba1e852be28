"""What the numbers of a report on ensembles were made from."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ins_eval.compensation.registry import model_files
from ins_eval.ensemble import Plan
from ins_eval.missions import find as find_missions
from ins_eval.profile import find
from ins_eval.report.results import made_with


def manifest(plan: Plan, plans: Mapping[str, tuple[Plan, int]]) -> dict[str, Any]:
    """What the numbers were made from: plan, inputs, versions, machine; `plans` holds the others beside it."""
    profiles = {other.profile for other, _ in plans.values()}
    populations = {other.missions for other, _ in plans.values() if other.missions}
    files = [*map(find, sorted(profiles)), *map(find_missions, sorted(populations)), *model_files(plan.arms)]
    return {
        "plan": asdict(plan),
        "key": plan.key(),
        "sizes": {label: size for label, (_, size) in plans.items()},
        "inputs": {Path(f).name: hashlib.sha256(Path(f).read_bytes()).hexdigest() for f in files},
        **made_with(),
    }
