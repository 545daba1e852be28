"""Several recordings side by side, and what they come to as an ensemble of flights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ins_eval import metrics
from ins_eval.analysis.evaluate import RecordingEvaluation
from ins_eval.analysis.solution import SHORTEST_FOR_RATE_S, SolutionEvaluation
from ins_eval.errors import InsEvalError
from ins_eval.navigation import measures, since_start
from ins_eval.recording import Recording
from ins_eval.reference import Errors
from ins_eval.streams import Streams
from ins_eval.tables import pick

if TYPE_CHECKING:
    import pandas as pd

SOLUTION = "solution"  # beside the compensations: what the INS put out itself
FEWEST_FLIGHTS = 5  # of which a CEP is given
SEED = 1  # of the bootstrap


@dataclass(frozen=True, eq=False)
class Summary:
    """What is kept of one recording: its rows of the table, and what it contributes to an ensemble by compensation.

    `flights` is empty where the recording is too short or has no positions, None where it is no flight.
    """

    rows: tuple[Mapping[str, Any], ...]
    flights: Mapping[str, Mapping[str, np.ndarray]] | None = None

    @property
    def refused(self) -> bool:
        return any("refused" in row for row in self.rows)


@dataclass(frozen=True, eq=False)
class SeveralEvaluations:
    """Recordings in the order given: each evaluated, or refused."""

    recordings: Sequence[Summary]

    def to_frame(self) -> pd.DataFrame:
        """One row a recording and compensation (or its own solution): the figures of `tree`, and why it was refused."""
        import pandas as pd

        return pd.DataFrame(self.tree["recordings"]).set_index(["name", "compensation"])

    @cached_property
    def tree(self) -> dict[str, Any]:
        """The tree ``ins-eval-evaluations/1`` of ``metrics.json``."""
        rows = [row for one in self.recordings for row in one.rows]
        return {"format": "ins-eval-evaluations/1", "recordings": rows, "ensemble": self.ensemble}

    @cached_property
    def ensemble(self) -> dict[str, Any]:
        """CEP rate under each definition and velocity RMS with intervals over the flights, by compensation.

        A flight counts where it moves, has positions to compare and lasts half a Schuler period or longer.
        """
        flights: dict[str, list[Mapping[str, np.ndarray]]] = {}
        for one in self.recordings:
            for arm, of_flight in (one.flights or {}).items():
                flights.setdefault(arm, []).append(of_flight)
        short = sum(one.flights is not None and not one.flights for one in self.recordings)
        result: dict[str, Any] = {"too_short": short, "fewest": FEWEST_FLIGHTS}
        for arm, members in flights.items():
            result[arm] = {"size": len(members)}
            if len(members) >= FEWEST_FLIGHTS:
                result[arm] |= _of_arm(arm, members)
        return result


def summary(name: str, found: RecordingEvaluation | SolutionEvaluation | InsEvalError) -> Summary:
    """What is kept of a recording in the folder `name`, evaluated or refused."""
    if isinstance(found, InsEvalError):
        return Summary(({"name": name, "compensation": "", "refused": str(found)},))
    return Summary(tuple(rows_of(name, found.tree)), _flights(found))


def rows_of(name: str, tree: Mapping[str, Any]) -> list[dict[str, Any]]:
    """One row a compensation, and one of the solution, of the tree of one recording."""
    rows = []
    for arm, values in tree.get("compensations", {}).items():
        rows.append(_row(name, tree, arm, values, tree["reference"]["last_s"]))
    if (solution := tree.get(SOLUTION)) is not None:
        rows.append(_row(name, tree, SOLUTION, solution, solution["end_s"] - solution["start_s"]))
    return rows


def _row(name: str, tree: Mapping[str, Any], arm: str, values: Mapping[str, Any], span_s: float) -> dict[str, Any]:
    def plain(value: Any) -> float | None:
        return value["value"] if isinstance(value, Mapping) else value

    return {
        "name": name,
        "compensation": arm,
        "kind": tree["recording"]["kind"],
        "span_s": span_s,
        "velocity_rms_north_mps": plain(pick(values, "velocity_rms_mps", "north")),
        "velocity_rms_east_mps": plain(pick(values, "velocity_rms_mps", "east")),
        "velocity_rms_horizontal_mps": plain(pick(values, "velocity_rms_mps", "horizontal")),
        "radial_error_rate_final_nmi_per_h": pick(values, "radial_error_rate_nmi_per_h", "final")
        if span_s >= SHORTEST_FOR_RATE_S
        else None,
        "final_radial_error_m": values.get("final_radial_error_m"),
    }


def _flights(one: RecordingEvaluation | SolutionEvaluation) -> dict[str, dict[str, np.ndarray]] | None:
    """What a flight contributes by compensation; nothing where it is too short, None where it is no flight."""
    if not _moves(one.recording):
        return None
    found = {}
    if isinstance(one, RecordingEvaluation):
        for arm, evaluation in one.navigated.items():
            errors, time_s = since_start(evaluation)
            position = errors.valid & np.isfinite(errors.north_m + errors.east_m) & (time_s > 0.0)
            if position.any() and time_s[position][-1] >= SHORTEST_FOR_RATE_S:
                velocity = {k: v for k, v in measures(evaluation).get("velocity_rms_mps", {}).items()}
                track = np.column_stack([errors.north_m, errors.east_m])[position]
                found[arm] = _contributions(track, time_s[position], velocity)
        one = one.solution
    if one is not None and one.rates_follow:
        time_s, position_m = one.track
        found[SOLUTION] = _contributions(position_m, time_s, _velocity(one.velocity))
    return found


def _moves(recording: Recording) -> bool:
    return recording.kind in ("flight", "drive")


def _velocity(errors: Errors | None) -> dict[str, float]:
    if errors is None:
        return {}
    rms = metrics.velocity_rms(errors.velocity_n, errors.valid)._asdict()
    return {axis: float(value) for axis, value in rms.items() if np.isfinite(value)}


def _contributions(position_m: np.ndarray, time_s: np.ndarray, velocity: Mapping[str, float]) -> dict[str, np.ndarray]:
    """By measure, named as in the flight report."""
    return {
        **{f"velocity_rms_{axis}": np.asarray(value) for axis, value in velocity.items()},
        **{f"cep_rate_{k}": np.asarray(d.per_flight(position_m, time_s)) for k, d in metrics.DEFINITIONS.items()},
    }


def _of_arm(arm: str, members: Sequence[Mapping[str, np.ndarray]]) -> dict[str, Any]:
    """Estimates of an ensemble, sorted as in the flight report."""
    shared = [measure for measure in members[0] if all(measure in one for one in members)]
    statistics = {
        measure: metrics.DEFINITIONS[measure.removeprefix("cep_rate_")].statistic
        if measure.startswith("cep_rate_")
        else metrics.root_mean_square
        for measure in shared
    }
    data = {arm: {measure: np.stack([one[measure] for one in members]) for measure in shared}}
    estimates = metrics.paired_bootstrap(data, statistics, (), Streams(SEED).at("several").rng()).arms[arm]
    groups: dict[str, Any] = {"velocity_rms_mps": {}, "cep_rate_nmi_per_h": {}}
    for measure, estimate in estimates.items():
        group, prefix = (
            ("cep_rate_nmi_per_h", "cep_rate_")
            if measure.startswith("cep_rate_")
            else ("velocity_rms_mps", "velocity_rms_")
        )
        groups[group][measure.removeprefix(prefix)] = estimate.as_tree()
    return groups
