"""How good an instrument is, from its own recording or from several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

from ins_eval.analysis.evaluate import RecordingEvaluation, evaluate_recording
from ins_eval.analysis.several import SeveralEvaluations, Summary
from ins_eval.analysis.solution import SolutionEvaluation, evaluate_solution
from ins_eval.compensation import CompensationModel
from ins_eval.errors import UsageError
from ins_eval.figures.results.evaluation import evaluation_figures
from ins_eval.figures.results.solution import solution_figures
from ins_eval.figures.results.summary import several_figures
from ins_eval.interface.result import Result
from ins_eval.recording import Recording
from ins_eval.report.evaluation import evaluation_content, solution_content
from ins_eval.report.several import several_content


def evaluate(
    recording: Recording,
    compensations: Sequence[str] = (),
    restart_every_s: float | None = None,
    models: Mapping[str, Sequence[CompensationModel]] | None = None,
) -> Result[RecordingEvaluation | SolutionEvaluation]:
    """How good an instrument is, from its own recording: see `analysis.evaluate.evaluate_recording`.

    Where only the solution of an INS was recorded: see `analysis.solution.evaluate_solution`.
    """
    if not isinstance(recording, Recording):
        raise UsageError(f"evaluate takes a recording, not {recording!r:.60}; give it ins_eval.read(FOLDER)")
    if isinstance(compensations, str) or not all(isinstance(name, str) for name in compensations):
        raise UsageError(
            f"{recording.name}: compensations are a list of names, such as ['believed']; models of your own go into "
            "models, increments of your own into the recording"
        )
    title = f"Evaluation: {recording.name}"
    if recording.imu is None:
        if compensations or restart_every_s is not None or models:
            raise UsageError(
                f"{recording.name}: holds no imu, only the solution that an INS put out, so there is nothing to "
                "compensate or to start afresh; leave --compensation and --restart-every out"
            )
        own = evaluate_solution(recording)
        words = solution_content(own.facts, own.numbers)
        return Result(title, own, own.tree, *words, partial(solution_figures, own))
    found = evaluate_recording(recording, compensations, restart_every_s, models)
    words = evaluation_content(found.numbers)
    return Result(title, found, found.tree, *words, partial(evaluation_figures, found))


def evaluate_several(recordings: Sequence[Summary]) -> Result[SeveralEvaluations]:
    """Recordings that were evaluated, or refused, on one page with their CEP: see `analysis.several`.

    Each is a `summary`, named as the folder below this page in which its own is written.
    """
    found = SeveralEvaluations(recordings)
    title = f"Evaluation of {len(recordings)} recordings"
    return Result(title, found, found.tree, *several_content(found), partial(several_figures, found))
