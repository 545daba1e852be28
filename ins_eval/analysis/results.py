"""Results of two or more runs side by side, paired by recording, or by instrument where it is an ensemble."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ins_eval import metrics
from ins_eval.analysis.several import rows_of
from ins_eval.boundary import file_bytes
from ins_eval.ensemble import STATISTICS, Store
from ins_eval.errors import DataRefused, UsageError, did_you_mean
from ins_eval.limits import OTHER
from ins_eval.metrics import Estimate
from ins_eval.printable import LONGEST_VALUE
from ins_eval.streams import Streams
from ins_eval.tree import as_tree

if TYPE_CHECKING:
    import pandas as pd

UNITS = {"velocity_rms": "m/s", "cep_rate": "nmi/h", "radial_error_rate": "nmi/h", "final_radial_error": "m"}
SUFFIX = re.compile(r"_(mps|nmi_per_h|m)$")
SHORT = {name: f"{name}_{which}" for name, which in (
    ("velocity_rms", "horizontal"), ("cep_rate", "final"), ("radial_error_rate", "final"))}  # fmt: skip
LIMIT = re.compile(r"([a-z0-9_]+)(\.value)?\+(\d+(?:\.\d+)?)%")
SEED = 1  # of the bootstrap


@dataclass(frozen=True, eq=False)
class Run:
    """What one run found: by compensation, measure and recording (or instrument) what it contributes.

    `refused` are the recordings that were refused.
    """

    name: str
    found: Mapping[str, Mapping[str, Mapping[str, np.ndarray]]]
    refused: tuple[str, ...] = ()

    @property
    def recordings(self) -> list[str]:
        """Names of all that were evaluated."""
        names = [one for arm in self.found.values() for of in arm.values() for one in of]
        return list(dict.fromkeys(names))


@dataclass(frozen=True)
class Change:
    """One measure with one compensation: the value of each run over the recordings that all have, and its ratios.

    `ratios` are those of every later run to the first, with their paired intervals over the recordings (None: of one
    recording, or where the first is 0).
    """

    compensation: str
    measure: str
    recordings: tuple[str, ...]
    values: tuple[float, ...]
    ratios: tuple[Estimate | None, ...]


@dataclass(frozen=True, eq=False)
class RunComparison:
    """Runs side by side, each later one held against the first."""

    runs: tuple[Run, ...]

    @cached_property
    def changes(self) -> list[Change]:
        """Every compensation and measure that all runs have."""
        first = self.runs[0]
        found = []
        for arm, measures in first.found.items():
            for measure, of_first in measures.items():
                others = [run.found.get(arm, {}).get(measure, {}) for run in self.runs[1:]]
                shared = tuple(name for name in of_first if all(name in one for one in others))
                if shared:
                    found.append(_change(arm, measure, shared, [of_first, *others]))
        return found

    @property
    def lost(self) -> list[str]:
        """Recordings that the first run has and a later one has not."""
        return [name for name in self.runs[0].recordings if any(name not in run.recordings for run in self.runs[1:])]

    def to_frame(self) -> pd.DataFrame:
        """One row a compensation and measure: the value of each run, ratios of the later ones to the first."""
        import pandas as pd

        rows = self.tree["changes"]
        return pd.DataFrame(rows).set_index(["compensation", "measure"])

    @cached_property
    def tree(self) -> dict[str, Any]:
        """The tree ``ins-eval-results/1`` of ``metrics.json``."""
        return {
            "format": "ins-eval-results/1",
            "runs": [run.name for run in self.runs],
            "lost": self.lost,
            "changes": [
                {
                    "compensation": one.compensation,
                    "measure": one.measure,
                    "recordings": len(one.recordings),
                    "values": list(one.values),
                    "ratios": [_tree(ratio) for ratio in one.ratios],
                }
                for one in self.changes
            ],
        }


def compare_results(folders: Sequence[Path]) -> RunComparison:
    """Read what `evaluate` or `flight-report` wrote into each folder and pair it.

    Raises: UsageError for a folder without results, DataRefused where the runs have nothing in common.
    """
    names = [folder.name for folder in folders]
    labels = names if len(set(names)) == len(names) and all(names) else [str(folder) for folder in folders]
    found = RunComparison(tuple(read_run(folder, label) for folder, label in zip(folders, labels, strict=True)))
    if not found.changes:
        raise DataRefused(
            f"{labels[0]} and {', '.join(labels[1:])}: no recording with the same compensation is in all of them, "
            "expected at least one; give results of the same recordings"
        )
    return found


def read_run(folder: Path, name: str) -> Run:
    """The results in a folder: its ``metrics.json``, or those of the folders in it."""
    own = folder / "metrics.json"
    files = [own] if own.is_file() else sorted(folder.glob("*/metrics.json"))
    if not files:
        raise UsageError(
            f"{folder}: holds no metrics.json and no folder with one, expected what evaluate or flight-report wrote; "
            "name that folder"
        )
    found: dict[str, dict[str, dict[str, np.ndarray]]] = {}
    refused: list[str] = []
    for file in files:
        tree = _json(file)
        kind = tree.get("format")
        if kind == "ins-eval-metrics/1":
            with _as_written(file):
                return Run(name, _members(folder))
        if kind not in ("ins-eval-evaluations/1", "ins-eval-evaluation/1"):
            raise UsageError(
                f"{file}: is of format {str(kind)[:40]!r}, expected results of evaluate or flight-report; name "
                "their folder"
            )
        several = kind == "ins-eval-evaluations/1"
        with _as_written(file):
            label = tree.get("recording", {}).get("name", "") if file == own else file.parent.name
            refused += _add(found, tree["recordings"] if several else as_tree(rows_of(label, tree)))
    return Run(name, found, tuple(refused))


@contextmanager
def _as_written(file: Path) -> Iterator[None]:
    """Refuse a tree that has another shape than what writes it gives it."""
    try:
        yield
    except (LookupError, TypeError, ValueError, AttributeError) as fault:
        raise DataRefused(
            f"{file}: lacks keys of its format ({type(fault).__name__}: {fault}), expected what evaluate or "
            "flight-report wrote; write it anew"
        ) from None


def _add(found: dict[str, dict[str, dict[str, np.ndarray]]], rows: Iterable[Mapping[str, Any]]) -> list[str]:
    """Put the measures of rows where they belong, and return the names of those refused."""
    refused = []
    for row in rows:
        if "refused" in row:
            refused.append(row["name"])
        for key, value in row.items():
            if isinstance(value, float) and SUFFIX.search(key):
                arm = found.setdefault(row["compensation"], {})
                arm.setdefault(SUFFIX.sub("", key), {})[row["name"]] = np.asarray(value)
    return refused


def regression(found: RunComparison, limit: str) -> str:
    """A sentence that says where a later run is worse than the first by more than a `limit`, or nothing.

    ``KEY+P%`` is passed where the whole 95 % interval of the paired ratio lies above 1 + P/100, ``KEY.value+P%`` where
    the ratio of the values does.

    Raises: UsageError for a limit that cannot be read, a key that the runs do not have or a change without interval.
    """
    read = LIMIT.fullmatch(limit)
    if read is None:
        raise UsageError(
            f"--fail-if {limit}: expected KEY+PERCENT% or KEY.value+PERCENT%, such as velocity_rms+5%; correct it"
        )
    key, by_value, most = SHORT.get(read[1], read[1]), bool(read[2]), 1.0 + float(read[3]) / 100.0
    known = list(dict.fromkeys(one.measure for one in found.changes))
    if key not in known:
        raise UsageError(
            f"--fail-if {limit}: no measure '{read[1]}' in these results{did_you_mean(read[1], known)}; all are "
            f"{', '.join(known)}"
        )
    if found.lost:
        return f"{found.lost[0]} was evaluated in {found.runs[0].name} and is missing or refused in a later run"
    for one in found.changes:
        for run, value, ratio in zip(found.runs[1:], one.values[1:], one.ratios, strict=True):
            if one.measure != key:
                continue
            if not by_value and (ratio is None or not np.isfinite(ratio.low)):
                raise UsageError(
                    f"--fail-if {limit}: the change of {key} with compensation '{one.compensation}' has no interval "
                    f"({len(one.recordings)} recordings), expected two or more with errors that are not zero; "
                    f"--fail-if {read[1]}.value+{read[3]}% compares the values"
                )
            if (value > most * one.values[0]) if by_value else (ratio.low > most):
                unit = next(unit for name, unit in UNITS.items() if key.startswith(name))
                interval = "" if by_value else f" ({_percent(ratio.low)} to {_percent(ratio.high)} %, paired)"
                return (
                    f"{key} with compensation '{one.compensation}' is {value:.4g} {unit} in {run.name} and "
                    f"{one.values[0]:.4g} {unit} in {found.runs[0].name}{interval}, expected at most {read[3]} % more"
                )
    return ""


def _percent(ratio: float) -> str:
    return f"{100.0 * (ratio - 1.0):+.1f}"


def statistic(measure: str):
    """What the contributions of several recordings come to: root mean square or median over them."""
    if measure in STATISTICS:
        return STATISTICS[measure]
    return metrics.median if measure.startswith("radial_error_rate") else metrics.root_mean_square


def _change(arm: str, measure: str, shared: tuple[str, ...], runs: Sequence[Mapping[str, np.ndarray]]) -> Change:
    reduce = statistic(measure)
    data = {str(k): {measure: np.stack([of[name] for name in shared])} for k, of in enumerate(runs)}
    values = tuple(float(reduce(of[measure])) for of in data.values())
    ratios: list[Estimate | None] = []
    for k in range(1, len(runs)):
        if values[0] <= 0.0:
            ratios.append(None)
            continue
        ratio = values[k] / values[0]
        interval = (np.nan, np.nan)
        if len(shared) > 1 and all(_not_zero(of[measure]) for of in data.values()):
            rng = Streams(SEED).at("results").rng()
            paired = metrics.paired_bootstrap(data, {measure: reduce}, [(str(k), "0")], rng).ratios[f"{k}/0"][measure]
            interval = (paired.low, paired.high)
        ratios.append(Estimate(ratio, *interval))
    return Change(arm, measure, shared, values, tuple(ratios))


def _not_zero(contributions: np.ndarray) -> bool:
    return bool(np.abs(contributions).reshape(len(contributions), -1).max(axis=1).all())


def _members(folder: Path) -> dict[str, dict[str, dict[str, np.ndarray]]]:
    """What each instrument of a flight report contributes, from its members on disk."""
    made = _json(folder / "manifest.json")
    store = Store(folder / "members" / made["key"])
    members = [store.read(k) for k in range(made["sizes"]["all"])]
    if not members or any(one is None for one in members):
        raise UsageError(
            f"{folder}: its instruments are not in {store.folder}, expected those of the flight report; run it again "
            "with this --output"
        )
    label = "-".join(str(made["plan"][key]) for key in ("profile", "population", "seed"))
    found: dict[str, dict[str, dict[str, np.ndarray]]] = {}
    for number, one in enumerate(members):
        for arm, data in one.items():
            for measure in STATISTICS:
                if measure in data:
                    of_measure = found.setdefault(arm, {}).setdefault(measure, {})
                    of_measure[f"{label}-{number}"] = np.asarray(data[measure])
    return found


def _json(file: Path) -> dict[str, Any]:
    try:
        raw = file_bytes(file, "the metrics.json of a folder with results")
        tree = json.loads(raw, parse_float=_number, parse_int=_number, parse_constant=_number)
    except (ValueError, RecursionError):
        raise DataRefused(
            f"{file}: is no JSON with numbers within 1e15; let evaluate or flight-report write it anew"
        ) from None
    if not isinstance(tree, dict):
        raise DataRefused(f"{file}: holds no table, expected what evaluate or flight-report wrote; write it anew")
    return tree


def _number(text: str) -> int | float:
    value: int | float = float(text) if set(text) & set(".eEnN") else int(text)
    if not abs(value) <= OTHER[1]:
        raise ValueError(f"{text[:LONGEST_VALUE]} is beyond all numbers")
    return value


def _tree(ratio: Estimate | None) -> dict[str, Any] | None:
    return None if ratio is None else {"ratio": ratio.value, "interval95": ratio.as_tree()["interval95"]}
