"""The command line: verbs and their arguments, nothing else."""

from __future__ import annotations

import argparse
import sys
import tempfile
import traceback
from pathlib import Path

from ins_eval.errors import InsEvalError

INTERRUPTED, DEFECT = 130, 5


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="ins-eval",
        description="How good an inertial navigation system is, with which compensation of its accelerometers.",
        epilog="exit codes: 0 done, 1 gate not met, 2 unusable option, profile or model, 3 recording refused, "
        "4 cannot write, 5 our defect",
    )
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")

    flight = verbs.add_parser(
        "flight-report", help="fly an ensemble with every compensation and report velocity RMS and CEP"
    )
    flight.add_argument(
        "--profile",
        default="climb-cruise-landing",
        help="name of a shipped profile or a .toml file (default: %(default)s)",
    )
    flight.add_argument("--model", help="a model of your own beside the others: my.py:MyModel")
    flight.add_argument(
        "--population",
        default="jb-kt8",
        help="accelerometers: a shipped population or a .toml file (default: %(default)s)",
    )
    flight.add_argument(
        "--ensemble", type=_positive, default=200, metavar="N", help="number of instruments (default: %(default)s)"
    )
    flight.add_argument(
        "--output", type=Path, default=Path("reports/flight"), help="folder of the report (default: %(default)s)"
    )
    _common(flight)

    evaluate = verbs.add_parser("evaluate", help="navigate a real recording and report its errors")
    evaluate.add_argument("recording", type=Path, help="a PSINS text recording (.imu) of a parked instrument")
    evaluate.add_argument("--output", type=Path, help="folder of the report (default: reports/NAME)")
    evaluate.add_argument("--quiet", action="store_true", help="no text on the terminal")

    model = verbs.add_parser("check-model", help="does a compensation model keep its contract?")
    model.add_argument("model", help="my.py:MyModel, package.module:Class, or a built-in name")

    gate = verbs.add_parser("check-cep", help="the gate: hysteresis compensation still improves CEP and velocity RMS")
    gate.add_argument(
        "--committed",
        type=Path,
        default=Path("tests/golden/cep-gate.toml"),
        help="the committed gains (default: %(default)s)",
    )
    gate.add_argument("--profile", default="climb-cruise-landing", help=argparse.SUPPRESS)
    gate.add_argument(
        "--ensemble", type=_positive, metavar="N", help="number of instruments (default: from the power calculation)"
    )
    gate.add_argument(
        "--output",
        type=Path,
        default=Path("reports/check-cep"),
        help="where finished instruments are kept (default: %(default)s)",
    )
    gate.add_argument("--commit", action="store_true", help="write the gains found to the file of committed gains")
    _common(gate)
    return parser


def _common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seed", type=int, default=1, help="of all random draws (default: %(default)s)")
    parser.add_argument(
        "--workers", type=_positive, metavar="N", help="processes (default: all cores); changes no digit"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress and no text on the terminal")


def _positive(text: str) -> int:
    number = int(text)
    if number < 1:
        raise argparse.ArgumentTypeError(f"{number}, expected at least 1")
    return number


def main(arguments: list[str] | None = None) -> int:
    """Run a verb and return its exit code; a failure is one sentence on standard error."""
    options = vars(_parser().parse_args(arguments))
    verb = options.pop("verb")
    try:
        return _run(verb, options)
    except InsEvalError as error:
        print(f"ins-eval: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("ins-eval: interrupted; what was finished is kept, run the same command again to go on", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        return 0
    except Exception as error:  # our defect: keep the details, spare the reader
        return _defect(error)


def _run(verb: str, options: dict) -> int:
    # imported here: a verb should not wait for what only another one needs
    if verb == "flight-report":
        from ins_eval.commands import flight_report

        return flight_report.run(size=options.pop("ensemble"), **options)
    if verb == "evaluate":
        from ins_eval.commands import evaluate

        recording = options.pop("recording")
        output = options.pop("output") or Path("reports") / recording.stem
        return evaluate.run(recording, output, **options)
    if verb == "check-model":
        from ins_eval.commands import check_model

        return check_model.run(options["model"])
    from ins_eval.commands import check_cep

    return check_cep.run(committed_file=options.pop("committed"), size=options.pop("ensemble"), **options)


def _defect(error: Exception) -> int:
    with tempfile.NamedTemporaryFile("w", prefix="ins-eval-", suffix=".txt", delete=False, encoding="utf-8") as file:
        traceback.print_exception(error, file=file)
    print(
        f"ins-eval: a defect of ours, {type(error).__name__}: {error}; the details are in {file.name}, "
        "please report them",
        file=sys.stderr,
    )
    return DEFECT


if __name__ == "__main__":
    sys.exit(main())
