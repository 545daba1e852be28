"""The command line: verbs and their arguments, nothing else."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from ins_eval import options, process
from ins_eval.verb import run

SHELLS = ("bash", "zsh", "fish")


def make_parser() -> argparse.ArgumentParser:
    """The verbs and their options."""
    parser = argparse.ArgumentParser(
        prog="ins-eval",
        description="How good an inertial navigation system is, with which compensation of its accelerometers.",
        epilog="exit codes: 0 done, 1 gate not met, 2 unusable option, profile or model, 3 recording refused, "
        "4 cannot write, 5 our defect or a worker that was ended from outside",
    )
    parser.add_argument(
        "--version", nargs=0, action=options.Version, default=argparse.SUPPRESS, help="print the version and end"
    )
    parser.add_argument(
        "--completion",
        choices=SHELLS,
        action=options.Completion,
        default=argparse.SUPPRESS,
        help="print what makes a shell complete verbs and options, and end",
    )
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    for add in (
        *(_flight_report, _paper_report, _loop_report, _presets, _evaluate, _results, _simulate),
        *(_calibrate, _import, _compare, _diagnose, _predict, _loop, _open, _check_model, _check_cep),
    ):
        add(verbs)
    for verb in leaves(verbs):
        options.said(verb)
    return parser


def leaves(verbs: argparse._SubParsersAction) -> Iterator[argparse.ArgumentParser]:
    """The parsers of verbs, and of the actions of those that have some."""
    for parser in verbs.choices.values():
        below = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
        yield from leaves(below[0]) if below else [parser]


def _flight_report(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser(
        "flight-report", help="fly an ensemble with every compensation and report velocity RMS and CEP"
    )
    options.flown(parser)
    parser.add_argument("--model", help="one more compensation: my.py:MyModel, or a compensation FILE.toml")
    options.instruments(parser, 200, "number of instruments; more than 200 are flown linearly (default: %(default)s)")
    options.export(parser)
    options.output(parser, "folder of the report (default: %(default)s)", Path("reports/flight"))
    parser.add_argument(
        "--storage-years",
        type=float,
        default=1.0,
        metavar="Y",
        help="time between calibration and flight in the section on storage; 0 leaves it out (default: %(default)g)",
    )
    parser.add_argument(
        "--missions",
        type=options.at_least(0),
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
    options.seed(parser)
    options.cluster(parser)


def _paper_report(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("paper-report", help="each number and claim of Paper A beside ours")
    options.instruments(parser, 200, "instruments in flight (default: %(default)s)")
    options.output(parser, "folder of the report (default: %(default)s)", Path("reports/paper-a"))
    options.seed(parser)
    options.cluster(parser)


def _loop_report(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser(
        "loop-report", help="each number and claim of Paper B, a digital accelerometer, beside ours"
    )
    options.instruments(parser, 200, "accelerometers through the paper's procedure (default: %(default)s)")
    options.replaced(parser, "--population", "--ensemble")
    options.output(parser, "folder of the report (default: %(default)s)", Path("reports/paper-b"))
    options.seed(parser)
    options.workers(parser)


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
    options.export(parser)
    options.output(parser, "folder of the report (default: reports/NAME, of several reports/evaluation)")
    parser.add_argument(
        "--compensation",
        nargs="+",
        default=(),
        metavar="NAME",
        help="only these: none, believed, a name in DIR/compensation, or a model FILE.toml (default: all there are)",
    )
    options.belief(parser)
    options.cluster(parser)
    parser.add_argument(
        "--restart-every",
        type=float,
        dest="restart_every_s",
        metavar="S",
        help="also navigate in pieces of S seconds, each from a fix (default: 30 where it is lost when left alone)",
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


def _results(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser(
        "results", help="results of runs side by side, paired by recording; fails on a regression"
    )
    parser.add_argument(
        "folders",
        type=Path,
        nargs="+",
        metavar="DIR",
        help="what evaluate or flight-report wrote; the first is the baseline",
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
    options.export(parser)
    options.output(parser, "folder of the report (default: %(default)s)", Path("reports/results"))


def _simulate(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("simulate", help="write a simulated recording")
    parser.add_argument("kind", choices=("flight", "oven", "chamber"))
    options.output(parser, "folder of the recording", required=True)
    options.flown(parser)
    options.instrument(parser)
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
    options.seed(parser)


def _calibrate(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("calibrate", help="models of an accelerometer from its chamber readings")
    parser.add_argument(
        "chambers", type=Path, nargs="+", metavar="CHAMBER", help="a chamber recording, or three of the axes x, y and z"
    )
    parser.add_argument(
        "--write-model", type=Path, dest="model_file", metavar="FILE.toml", help="write a compensation file"
    )
    parser.add_argument(
        "--compensation", metavar="NAME", help="model of that file (default: hysteresis, or the best determined)"
    )
    parser.add_argument("--unit", metavar="ID", help="of a table with several accelerometers, this unit_id")
    options.export(parser)
    options.output(parser, "folder of the report (default: reports/NAME-calibration)")


def _import(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("import", help="bring a file of another format into the form")
    parser.add_argument("format_name", metavar="FORMAT", help="see --formats")
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.add_argument(
        "--formats", nargs=0, action=options.Formats, default=argparse.SUPPRESS, help="list the formats and end"
    )
    options.output(parser, "folder of the recording", required=True)
    parser.add_argument(
        "--assume", action="append", default=[], metavar="KEY=VALUE", help="override one finding; may be repeated"
    )
    parser.add_argument(
        "--write-mapping",
        type=Path,
        dest="mapping_file",
        metavar="FILE.toml",
        help="write the mapping with what was assumed, so that the next import need not assume it",
    )


def _compare(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("compare", help="compare the recorded IMU with the one that the reference implies")
    parser.add_argument("recording_folder", type=Path, metavar="DIR", help="a recording with a reference")
    options.export(parser)
    options.output(parser, "folder of the report (default: reports/NAME-compare)")
    options.unit(parser)
    parser.add_argument(
        "--use-found-offset", action="store_true", help="take the clock offset found instead of the believed"
    )


def _diagnose(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("diagnose", help="where recordings contradict the belief, and which effects explain it")
    parser.add_argument("recordings", type=Path, nargs="+", metavar="RECORDING")
    options.belief(parser)
    options.export(parser)
    options.output(parser, "folder of the report (default: none is written)")
    options.replaced(parser, "--report", "-o, --output")
    parser.add_argument(
        "--write-model",
        type=Path,
        dest="model_file",
        metavar="FILE.toml",
        help="write the belief with all effects and their covariance",
    )


def _predict(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("predict", help="what a model that diagnose wrote is expected to gain on a flight")
    parser.add_argument("model", type=Path, metavar="MODEL", help="a file of diagnose --write-model")
    parser.add_argument("flight", type=Path, metavar="PROFILE|DIR", help="a profile, or a recording with its course")
    options.export(parser)
    options.output(parser, "folder of the report (default: reports/NAME-prediction)")


def _loop(verbs: argparse._SubParsersAction) -> None:
    actions = verbs.add_parser("loop", help="the gains of a digital accelerometer loop").add_subparsers(
        dest="action", required=True, metavar="ACTION"
    )
    tests = actions.add_parser("simulate", help="write the scans and current tests of a simulated loop")
    tests.add_argument("preset_or_file", metavar="PRESET|FILE.toml", help="digital-qfa, paper-unit, or your own loop")
    options.output(tests, "folder of the CSV files", required=True)
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
    options.instrument(tests)
    options.replaced(tests, "--unit", "--instrument")
    options.seed(tests)
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
        type=options.at_least(1),
        dest="reference_code",
        default=524288,
        metavar="N",
        help="code of DA0 as it is set now (default: %(default)s)",
    )


def _open(verbs: argparse._SubParsersAction) -> None:
    parser = verbs.add_parser("open", help="show the latest report in the browser, or a list of all")
    parser.add_argument(
        "folder",
        type=Path,
        nargs="?",
        default=Path("reports"),
        metavar="DIR",
        help="a report, or a folder of reports (default: %(default)s)",
    )
    parser.add_argument("--serve", action="store_true", help="serve the list to this machine, read-only, until Ctrl-C")
    parser.add_argument("--port", type=options.port, metavar="N", help="of --serve (default: a free one)")


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
    options.instruments(parser, None, "number of instruments (default: from the power calculation)")
    options.output(parser, "where finished instruments are kept (default: %(default)s)", Path("reports/check-cep"))
    parser.add_argument("--commit", action="store_true", help="write the gains found to the file of committed gains")
    options.seed(parser)
    options.cluster(parser)


def main(arguments: list[str] | None = None) -> int:
    """Run a verb and return its exit code; a failure is one sentence on standard error.

    Without `arguments` it is a program of its own: those of the command line count, and the process is made ready.
    """
    closed = process.open_streams() if arguments is None else False
    chosen = vars(make_parser().parse_args(arguments))
    verb, memory = chosen.pop("verb"), chosen.pop("memory_bytes") or process.memory_ceiling_bytes()
    chosen["quiet"] |= chosen["json"] == options.STANDARD_OUTPUT
    code = run(verb, chosen, memory, own_process=arguments is None, closed=closed)
    if arguments is None:
        process.collect_no_more()
    return code


if __name__ == "__main__":
    sys.exit(main())
