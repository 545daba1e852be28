"""Several recordings side by side, and what they come to as an ensemble of flights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ins_eval import metrics
from ins_eval.analysis.evaluate import RecordingEvaluation
from ins_eval.analysis.solution import SHORTEST_FOR_RATE_S, SolutionEvaluation
from ins_eval.errors import InsEvalError
from ins_eval.navigation import since_start
from ins_eval.recording import Recording
from ins_eval.reference import Errors
from ins_eval.streams import Streams
from ins_eval.tables import pick
from ins_eval.tree import as_tree

if TYPE_CHECKING:
    import pandas as pd

SOLUTION = "solution"  # beside the compensations: what the INS put out itself
FEWEST_FLIGHTS = 5  # of which a CEP is given
SEED = 1  # of the bootstrap


@dataclass(frozen=True)
class Row:
    """One recording with one compensation, or the solution that was recorded; None: not compared."""

    name: str
    compensation: str
    kind: str
    span_s: float
    velocity_rms_north_mps: float | None
    velocity_rms_east_mps: float | None
    velocity_rms_horizontal_mps: float | None
    radial_error_rate_final_nmi_per_h: float | None
    final_radial_error_m: float | None


@dataclass(frozen=True)
class Refused:
    """A recording that was refused, and why."""

    name: str
    refused: str
    compensation: str = ""


@dataclass(frozen=True)
class FlightsOfArm:
    """What the flights with one compensation come to; of fewer than `FEWEST_FLIGHTS` nothing."""

    size: int
    velocity_rms_mps: Mapping[str, metrics.Estimate] = field(default_factory=dict)
    cep_rate_nmi_per_h: Mapping[str, metrics.Estimate] = field(default_factory=dict)


@dataclass(frozen=True)
class FlightsTogether:
    """All flights by compensation; `too_short` were left out."""

    too_short: int
    arms: Mapping[str, FlightsOfArm]

    def as_tree(self) -> dict[str, Any]:
        """The branch ``ensemble`` of ``metrics.json``."""
        return {"too_short": self.too_short, "fewest": FEWEST_FLIGHTS, **as_tree(self.arms)}


@dataclass(frozen=True, eq=False)
class Summary:
    """What is kept of one recording: its rows of the table, and what it contributes to an ensemble by compensation.

    `flights` is empty where the recording is too short or has no positions, None where it is no flight.
    """

    rows: tuple[Row | Refused, ...]
    flights: Mapping[str, Mapping[str, np.ndarray]] | None = None

    @property
    def refused(self) -> bool:
        return any(isinstance(row, Refused) for row in self.rows)


@dataclass(frozen=True, eq=False)
class SeveralEvaluations:
    """Recordings in the order given: each evaluated, or refused."""

    recordings: Sequence[Summary]

    def to_frame(self) -> pd.DataFrame:
        """One row a recording and compensation (or its own solution): the figures of `tree`, and why it was refused."""
        import pandas as pd

        rows = [as_tree(row) for row in self.rows]
        return pd.DataFrame(rows).set_index(["name", "compensation"])

    @property
    def rows(self) -> list[Row | Refused]:
        """Those of all recordings."""
        return [row for one in self.recordings for row in one.rows]

    @cached_property
    def tree(self) -> dict[str, Any]:
        """The tree ``ins-eval-evaluations/1`` of ``metrics.json``."""
        return {
            "format": "ins-eval-evaluations/1",
            "recordings": as_tree(self.rows),
            "ensemble": as_tree(self.ensemble),
        }

    @cached_property
    def ensemble(self) -> FlightsTogether:
        """CEP rate under each definition and velocity RMS with intervals over the flights, by compensation.

        A flight counts where it moves, has positions to compare and lasts half a Schuler period or longer.
        """
        flights: dict[str, list[Mapping[str, np.ndarray]]] = {}
        for one in self.recordings:
            for arm, of_flight in (one.flights or {}).items():
                flights.setdefault(arm, []).append(of_flight)
        short = sum(one.flights is not None and not one.flights for one in self.recordings)
        return FlightsTogether(short, {arm: _of_arm(arm, members) for arm, members in flights.items()})


def summary(name: str, found: RecordingEvaluation | SolutionEvaluation | InsEvalError) -> Summary:
    """What is kept of a recording in the folder `name`, evaluated or refused."""
    if isinstance(found, InsEvalError):
        return Summary((Refused(name, str(found)),))
    return Summary(tuple(rows_of(name, found.tree)), _flights(found))


def rows_of(name: str, tree: Mapping[str, Any]) -> list[Row]:
    """One row a compensation, and one of the solution, of the tree of one recording as its ``metrics.json`` has it."""
    rows = []
    for arm, values in tree.get("compensations", {}).items():
        rows.append(_row(name, tree, arm, values, tree["reference"]["last_s"]))
    if (solution := tree.get(SOLUTION)) is not None:
        rows.append(_row(name, tree, SOLUTION, solution, solution["end_s"] - solution["start_s"]))
    return rows


def _row(name: str, tree: Mapping[str, Any], arm: str, values: Mapping[str, Any], span_s: float) -> Row:
    def rms(axis: str) -> float | None:
        value = pick(values, "velocity_rms_mps", axis)
        return value["value"] if isinstance(value, Mapping) else value

    rate = pick(values, "radial_error_rate_nmi_per_h", "final") if span_s >= SHORTEST_FOR_RATE_S else None
    kind, last_m = tree["recording"]["kind"], values.get("final_radial_error_m")
    return Row(name, arm, kind, span_s, rms("north"), rms("east"), rms("horizontal"), rate, last_m)


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
                velocity = one.measures[arm].velocity_rms_mps
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


def _of_arm(arm: str, members: Sequence[Mapping[str, np.ndarray]]) -> FlightsOfArm:
    """Estimates of an ensemble, sorted as in the flight report."""
    if len(members) < FEWEST_FLIGHTS:
        return FlightsOfArm(len(members))
    shared = [measure for measure in members[0] if all(measure in one for one in members)]
    statistics = {
        measure: metrics.DEFINITIONS[measure.removeprefix("cep_rate_")].statistic
        if measure.startswith("cep_rate_")
        else metrics.root_mean_square
        for measure in shared
    }
    data = {arm: {measure: np.stack([one[measure] for one in members]) for measure in shared}}
    estimates = metrics.paired_bootstrap(data, statistics, (), Streams(SEED).at("several").rng()).arms[arm]
    velocity, cep = (
        {measure.removeprefix(prefix): one for measure, one in estimates.items() if measure.startswith(prefix)}
        for prefix in ("velocity_rms_", "cep_rate_")
    )
    return FlightsOfArm(len(members), velocity, cep)
