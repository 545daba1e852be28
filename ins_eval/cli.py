"""The command line: verbs and their arguments, nothing else."""

from __future__ import annotations

import argparse
import contextlib
import errno
import math
import os
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path

from ins_eval import process
from ins_eval.boundary import GIB
from ins_eval.errors import InsEvalError, StorageError
from ins_eval.printable import LONGEST_SENTENCE, printable, shortened

INTERRUPTED, DEFECT = 130, 5
LEAST_GIB = 0.5  # the libraries alone take 0.3 GiB
# where a verb is that does not stand in `commands` under its own name
MODULES = {
    "import": "commands.import_recording",
    "paper-report": "studies.paper_report",
    "loop-report": "studies.loop_report",
}
_PROFILE_HELP = "name of a shipped profile or a .toml file (default: %(default)s)"
_POPULATION_HELP = "accelerometers: a shipped population or a .toml file (default: %(default)s)"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="ins-eval",
        description="How good an inertial navigation system is, with which compensation of its accelerometers.",
        epilog="exit codes: 0 done, 1 gate not met, 2 unusable option, profile or model, 3 recording refused, "
        "4 cannot write, 5 our defect or a worker that was ended from outside",
    )
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    for add in (
        *(_flight_report, _paper_report, _loop_report, _presets, _evaluate, _results, _simulate),
        *(_calibrate, _import, _compare, _diagnose, _predict, _loop, _check_model, _check_cep),
    ):
        add(verbs)
    for verb in _leaves(verbs):
        verb.add_argument(
            "--memory",
            type=_gib,
            dest="memory_bytes",
            metavar="GIB",
            help="ceiling of what each process takes, in GiB (default: half of what is there)",
        )
    return parser


def _leaves(verbs: argparse._SubParsersAction) -> Iterator[argparse.ArgumentParser]:
    """The parsers of verbs, and of the actions of those that have some."""
    for parser in verbs.choices.values():
        below = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
        yield from _leaves(below[0]) if below else [parser]


def _flight_report(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser(
        "flight-report", help="fly an ensemble with every compensation and report velocity RMS and CEP"
    )
    parser.add_argument("--profile", default="climb-cruise-landing", help=_PROFILE_HELP)
    parser.add_argument("--model", help="one more compensation: my.py:MyModel, or a compensation FILE.toml")
    parser.add_argument("--population", default="jb-kt8", help=_POPULATION_HELP)
    _size(parser, "--ensemble", 200, "number of instruments; more than 200 are flown linearly (default: %(default)s)")
    _output(parser, Path("reports/flight"), "folder of the report (default: %(default)s)")
    parser.add_argument(
        "--storage-years",
        type=float,
        default=1.0,
        metavar="Y",
        help="time between calibration and flight in the section on storage; 0 leaves it out (default: %(default)g)",
    )
    parser.add_argument(
        "--missions",
        type=_at_least(0),
        metavar="N",
        help="missions, one for each of N instruments; 0 leaves them out (default: 50, or --ensemble if that is less)",
    )
    parser.add_argument(
        "--missions-from",
        default="worldwide",
        dest="population_of_missions",
        metavar="NAME",
        help="how missions differ: a population of missions or a TOML file; a table left out does not vary "
        "(default: %(default)s)",
    )
    parser.add_argument(
        "--flights",
        nargs="+",
        default=(),
        metavar="PROFILE",
        help="other profiles to fly, the oven keeping to --profile; as many instruments as missions",
    )
    _common(parser)


def _paper_report(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("paper-report", help="each number and claim of Paper A beside ours")
    _size(parser, "--ensemble", 200, "instruments in flight (default: %(default)s)")
    _output(parser, Path("reports/paper-a"), "folder of the report (default: %(default)s)")
    _common(parser)


def _loop_report(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser(
        "loop-report", help="each number and claim of Paper B, a digital accelerometer, beside ours"
    )
    _size(parser, "--population", 200, "accelerometers through the paper's procedure (default: %(default)s)")
    _output(parser, Path("reports/paper-b"), "folder of the report (default: %(default)s)")
    _common(parser)


def _presets(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("presets", help="list what ships: accelerometers, data sheets, profiles, with sources")
    parser.add_argument("name", nargs="?", metavar="NAME", help="print this one in full, each number with its source")


def _evaluate(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("evaluate", help="navigate recordings and report their errors")
    parser.add_argument(
        "inputs",
        type=Path,
        nargs="+",
        metavar="DIR",
        help="recordings in the form ins-recording/1, or a PSINS .imu file; of several also one table and one page",
    )
    _output(parser, None, "folder of the report (default: reports/NAME, of several reports/evaluation)")
    parser.add_argument(
        "--compensation",
        nargs="+",
        default=(),
        metavar="NAME",
        help="only these: none, believed, a name in DIR/compensation, or a model FILE.toml (default: all there are)",
    )
    _belief(parser)
    parser.add_argument(
        "--restart-every",
        type=float,
        dest="restart_every_s",
        metavar="S",
        help="also navigate in pieces of S seconds, each from a fix: for instruments that drift away in minutes",
    )
    parser.add_argument(
        "--magnetometer",
        nargs=3,
        default=(),
        metavar=("X", "Y", "Z"),
        help="columns of imu, body axes, that give the heading of a start where none is stated (10 degrees)",
    )
    parser.add_argument(
        "--declination",
        type=float,
        default=0.0,
        dest="declination_deg",
        metavar="DEG",
        help="of the magnetic field, east positive (default: %(default)s)",
    )
    parser.add_argument("--quiet", action="store_true", help="no text on the terminal")


def _results(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser(
        "results", help="results of runs side by side, paired by recording; fails on a regression"
    )
    parser.add_argument(
        "folders",
        type=Path,
        nargs="+",
        metavar="DIR",
        help="what evaluate or flight-report wrote; the first is held up to",
    )
    parser.add_argument(
        "--fail-if",
        action="append",
        default=[],
        metavar="KEY+P%",
        help="exit with 1 where the whole 95 %% interval of the paired change of KEY lies above P %%, or, with "
        "KEY.value+P%%, where its value does; velocity_rms is its horizontal, cep_rate and radial_error_rate their "
        "final; may be repeated",
    )
    _output(parser, Path("reports/results"), "folder of the report (default: %(default)s)")
    parser.add_argument("--quiet", action="store_true", help="no text on the terminal")


def _simulate(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("simulate", help="write a simulated recording")
    parser.add_argument("kind", choices=("flight", "oven", "chamber"))
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="folder of the recording")
    parser.add_argument("--profile", default="climb-cruise-landing", help=_PROFILE_HELP)
    parser.add_argument("--population", default="jb-kt8", help=_POPULATION_HELP)
    parser.add_argument(
        "--instrument", type=_at_least(0), default=0, metavar="I", help="its number (default: %(default)s)"
    )
    parser.add_argument("--axis", choices="xyz", help="of the accelerometer in the chamber (default: x)")
    parser.add_argument(
        "--unit", metavar="NAME", help='a printed accelerometer in the chamber: "JB-KT8 #1", or all in one table'
    )
    parser.add_argument(
        "--ramps", type=float, nargs="+", dest="ramps_c_per_min", metavar="R", help="of the chamber, in degC/min"
    )
    dwell = parser.add_mutually_exclusive_group()
    dwell.add_argument("--dwell", type=float, dest="dwell_s", metavar="S", help="wait of the chamber at each degree")
    dwell.add_argument("--no-dwell", action="store_const", const=0.0, dest="dwell_s", help="steady ramps")
    parser.add_argument("--rate", type=float, dest="rate_hz", metavar="HZ", help="samples a second")
    parser.add_argument("--seed", type=_at_least(0), default=1, help="of all random draws (default: %(default)s)")
    parser.add_argument("--quiet", action="store_true", help="no text on the terminal")


def _calibrate(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("calibrate", help="models of an accelerometer from its chamber readings")
    parser.add_argument(
        "chambers", type=Path, nargs="+", metavar="CHAMBER", help="a chamber recording, or three of the axes x, y and z"
    )
    parser.add_argument("-o", type=Path, dest="model_file", metavar="FILE.toml", help="write a compensation file")
    parser.add_argument(
        "--compensation", metavar="NAME", help="model of that file (default: hysteresis, or the best determined)"
    )
    parser.add_argument("--unit", metavar="ID", help="of a table with several accelerometers, this unit_id")
    _output(parser, None, "folder of the report (default: reports/NAME-calibration)")
    parser.add_argument("--quiet", action="store_true", help="no text on the terminal")


def _import(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("import", help="bring a file of another format into the form")
    parser.add_argument("format_name", metavar="FORMAT", help="see --formats")
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.add_argument(
        "--formats", nargs=0, action=_ListFormats, default=argparse.SUPPRESS, help="list the formats and end"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="folder of the recording")
    parser.add_argument(
        "--assume", action="append", default=[], metavar="KEY=VALUE", help="override one finding; may be repeated"
    )


def _compare(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("compare", help="hold the recorded IMU against the one that the reference implies")
    parser.add_argument("recording_folder", type=Path, metavar="DIR", help="a recording with a reference")
    _output(parser, None, "folder of the report (default: reports/NAME-compare)")
    parser.add_argument("--unit", metavar="NAME", help="its data sheet fills what nobody stated, see ins-eval presets")
    parser.add_argument(
        "--use-found-offset", action="store_true", help="take the clock offset found instead of the believed"
    )
    parser.add_argument("--quiet", action="store_true", help="no text on the terminal")


def _diagnose(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("diagnose", help="where recordings leave what is believed, and what was left out")
    parser.add_argument("recordings", type=Path, nargs="+", metavar="RECORDING")
    _belief(parser)
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the answer, ins-diagnosis/1")
    parser.add_argument("--report", type=Path, metavar="DIR", help="folder of the page")
    parser.add_argument(
        "--write-model", type=Path, metavar="FILE", help="write the belief with all effects, each with what it may be"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress and no text on the terminal")


def _predict(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("predict", help="what a model that diagnose wrote is expected to gain on a flight")
    parser.add_argument("model", type=Path, metavar="MODEL", help="a file of diagnose --write-model")
    parser.add_argument("flight", type=Path, metavar="PROFILE|DIR", help="a profile, or a recording with its course")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write medians and intervals")
    parser.add_argument("--quiet", action="store_true", help="no text on the terminal")


def _loop(verbs: argparse._SubParsersAction) -> None:
    actions = verbs.add_parser("loop", help="the gains of a digital accelerometer loop").add_subparsers(
        dest="action", required=True, metavar="ACTION"
    )
    tests = actions.add_parser("simulate", help="write the scans and current tests of a simulated loop")
    tests.add_argument("preset_or_file", metavar="PRESET|FILE.toml", help="digital-qfa, paper-unit, or your own loop")
    tests.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="folder of the CSV files")
    tests.add_argument(
        "--forward-ppm", type=float, default=-200.0, metavar="PPM", help="drift put in (default: %(default)g)"
    )
    tests.add_argument(
        "--feedback-ppm", type=float, default=200.0, metavar="PPM", help="drift put in (default: %(default)g)"
    )
    tests.add_argument(
        "--through",
        choices=("gain", "resistor"),
        default="gain",
        help="change the gain by that much, or a resistor behind it (default: %(default)s)",
    )
    tests.add_argument(
        "--unit", type=_at_least(0), default=0, metavar="I", help="its number in the population (default: %(default)s)"
    )
    tests.add_argument("--seed", type=_at_least(0), default=1, help="of all random draws (default: %(default)s)")
    tests.add_argument("--quiet", action="store_true", help="no text on the terminal")
    gains = actions.add_parser(
        "calibrate",
        help="gains, their drift and its compensation from recorded tests",
        description="A scan has the columns state, repetition, n_fpga, n_out; a test with the reference current state, "
        "repetition, current, n_out. state is reference or test, current is on or off.",
    )
    gains.add_argument(
        "files", type=Path, nargs="+", metavar="SCAN.csv", help="scans, and tests with the reference current on and off"
    )
    gains.add_argument(
        "--n-vref",
        type=_at_least(1),
        dest="reference_code",
        default=524288,
        metavar="N",
        help="code of DA0 as it is set now (default: %(default)s)",
    )
    gains.add_argument("--json", type=Path, metavar="FILE", help="write the numbers")
    gains.add_argument("--quiet", action="store_true", help="no text on the terminal")


def _check_model(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("check-model", help="does a compensation model keep its contract?")
    parser.add_argument("model", help="my.py:MyModel, package.module:Class, or a built-in name")


def _check_cep(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("check-cep", help="the gate: hysteresis compensation still improves CEP and velocity RMS")
    parser.add_argument(
        "--committed",
        type=Path,
        dest="committed_file",
        metavar="FILE",
        help="the committed gains (default: gate.toml of the package)",
    )
    parser.add_argument("--profile", default="climb-cruise-landing", help=argparse.SUPPRESS)
    _size(parser, "--ensemble", None, "number of instruments (default: from the power calculation)")
    _output(parser, Path("reports/check-cep"), "where finished instruments are kept (default: %(default)s)")
    parser.add_argument("--commit", action="store_true", help="write the gains found to the file of committed gains")
    _common(parser)


class _ListFormats(argparse.Action):
    """Print the formats that can be imported and end, as ``--help`` does."""

    def __call__(self, parser, *_) -> None:
        from ins_eval.readers import FORMATS

        print("\n".join(f"{name:14s}{known.description}" for name, known in FORMATS.items()))
        parser.exit()


def _size(parser: argparse.ArgumentParser, option: str, default: int | None, words: str) -> None:
    parser.add_argument(option, type=_at_least(2), dest="size", default=default, metavar="N", help=words)


def _output(parser: argparse.ArgumentParser, default: Path | None, words: str) -> None:
    parser.add_argument("--output", type=Path, default=default, metavar="DIR", help=words)


def _belief(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--belief", type=Path, metavar="FILE", help="take the belief tables of this file instead")
    parser.add_argument("--unit", metavar="NAME", help="its data sheet fills what nobody stated, see ins-eval presets")


def _common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seed", type=_at_least(0), default=1, help="of all random draws (default: %(default)s)")
    parser.add_argument(
        "--workers", type=_at_least(1), metavar="N", help="processes (default: all cores); changes no digit"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress and no text on the terminal")


def _at_least(smallest: int) -> Callable[[str], int]:
    """A whole number of at least `smallest`."""

    def number(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{text!r}, expected a whole number") from None
        if value < smallest:
            raise argparse.ArgumentTypeError(f"{value}, expected at least {smallest}")
        return value

    return number


def _gib(text: str) -> int:
    """GiB as bytes, of at least `LEAST_GIB`."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}, expected a number of GiB") from None
    if not LEAST_GIB <= value < math.inf:
        raise argparse.ArgumentTypeError(f"{text}, expected at least {LEAST_GIB:g} GiB")
    return int(value * GIB)


def main(arguments: list[str] | None = None) -> int:
    """Run a verb and return its exit code; a failure is one sentence on standard error.

    Without `arguments` it is a program of its own: those of the command line count, and the process is made ready.
    """
    closed = process.open_streams() if arguments is None else False
    options = vars(_parser().parse_args(arguments))
    verb, memory = options.pop("verb"), options.pop("memory_bytes") or process.memory_ceiling_bytes()
    try:
        if closed and not options.get("quiet"):
            raise StorageError("standard output is closed, expected a place for the text; give one, or add --quiet")
        if arguments is None:
            process.keep_quiet()
            process.limit_memory(memory)
        code = _run(verb, options)
        sys.stdout.flush()
        return code
    except InsEvalError as error:
        print(f"ins-eval: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("ins-eval: interrupted; what was finished is kept, run the same command again to go on", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:  # whoever read our text has left; nothing is wrong
        _stop_writing()
        return 0
    except MemoryError:
        size = f"{memory / GIB:.3g} GiB" if memory else "what is there"
        print(
            f"ins-eval: {verb} needs more memory than its ceiling of {size}; raise --memory or cut the recording",
            file=sys.stderr,
        )
        return StorageError.exit_code
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EFBIG):
            return _defect(error)
        _stop_writing()
        print(f"ins-eval: the text cannot be written ({error.strerror}); free some space", file=sys.stderr)
        return StorageError.exit_code
    except Exception as error:  # our defect: keep the details, spare the reader
        return _defect(error)


def _stop_writing() -> None:
    """Let nothing more go to a standard output that takes no more, not even at the end of the program."""
    with contextlib.suppress(OSError, ValueError):  # a standard output that is no file
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _run(verb: str, options: dict) -> int:
    # imported here: a verb should not wait for what only another one needs
    command = import_module(f"ins_eval.{MODULES.get(verb) or 'commands.' + verb.replace('-', '_')}")
    return getattr(command, options.pop("action", "run"))(**options)


def _defect(error: Exception) -> int:
    kept, said = "and its details cannot be kept", shortened(printable(str(error)), LONGEST_SENTENCE)
    with (
        contextlib.suppress(OSError),
        tempfile.NamedTemporaryFile("w", prefix="ins-eval-", suffix=".txt", delete=False, encoding="utf-8") as file,
    ):
        traceback.print_exception(error, file=file)
        kept = f"the details are in {file.name}"
    print(f"ins-eval: a defect of ours, {type(error).__name__}: {said}; {kept}, please report it", file=sys.stderr)
    return DEFECT


if __name__ == "__main__":
    sys.exit(main())
