"""Options that several verbs share: one name, one meaning, one help text each, and names that were replaced."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path

from ins_eval.boundary import GIB

LEAST_GIB = 0.5  # the libraries alone take 0.3 GiB
LAST_PORT = 65535
STANDARD_OUTPUT = Path("-")
EXPORTS = ("csv", "parquet", "mat", "nc", "kml", "gpx", "tex")  # `exports.FORMATS`, without importing them
FILES = (".toml", ".json", ".html", ".csv", ".py")  # a folder with such a name is a slip


def output(parser: argparse.ArgumentParser, words: str, default: Path | None = None, required: bool = False) -> None:
    """``-o, --output DIR``: the folder that the verb writes."""
    parser.add_argument(
        *("-o", "--output"), type=_folder, default=default, required=required, metavar="DIR", help=words
    )


def said(parser: argparse.ArgumentParser) -> None:
    """``--json``, ``--quiet`` and ``--memory``, which every verb takes."""
    parser.add_argument(
        "--json", type=Path, metavar="FILE", help="write the numbers; - prints them instead of the text"
    )
    parser.add_argument("--quiet", action="store_true", help="no progress and no text on the terminal")
    parser.add_argument(
        "--memory",
        type=gib,
        dest="memory_bytes",
        metavar="GIB",
        help="ceiling of what each process takes, in GiB (default: half of what is there)",
    )


def seed(parser: argparse.ArgumentParser) -> None:
    """``--seed``, of verbs that draw random numbers."""
    parser.add_argument("--seed", type=at_least(0), default=1, help="of all random draws (default: %(default)s)")


def workers(parser: argparse.ArgumentParser) -> None:
    """``--workers``, of verbs that compute in several processes."""
    parser.add_argument(
        "--workers", type=at_least(1), metavar="N", help="processes (default: all cores); changes no digit"
    )


def cluster(parser: argparse.ArgumentParser) -> None:
    """``--workers`` and ``--scheduler``, of verbs whose jobs may leave this machine."""
    workers(parser)
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="compute on the workers of this Dask scheduler, such as tcp://node:8786; changes no digit",
    )


def flown(parser: argparse.ArgumentParser) -> None:
    """``--profile`` and ``--population``, of verbs that simulate flights."""
    words = "name of a shipped profile or a .toml file (default: %(default)s)"
    parser.add_argument("--profile", default="climb-cruise-landing", help=words)
    words = "accelerometers: a shipped population or a .toml file (default: %(default)s)"
    parser.add_argument("--population", default="jb-kt8", help=words)


def instrument(parser: argparse.ArgumentParser) -> None:
    """``--instrument``, of verbs that simulate one of many."""
    words = "its number (default: %(default)s)"
    parser.add_argument("--instrument", type=at_least(0), default=0, metavar="I", help=words)


def instruments(parser: argparse.ArgumentParser, default: int | None, words: str) -> None:
    """``--ensemble``, of verbs that take many instruments."""
    parser.add_argument("--ensemble", type=at_least(2), dest="size", default=default, metavar="N", help=words)


def belief(parser: argparse.ArgumentParser) -> None:
    """``--belief`` and ``--unit``: what is believed of an instrument."""
    parser.add_argument("--belief", type=Path, metavar="FILE", help="take the belief tables of this file instead")
    unit(parser)


def unit(parser: argparse.ArgumentParser) -> None:
    """``--unit``: the data sheet of the instrument."""
    parser.add_argument("--unit", metavar="NAME", help="its data sheet fills what nobody stated, see ins-eval presets")


def export(parser: argparse.ArgumentParser) -> None:
    """``--export``, of verbs that write a report."""
    parser.add_argument(
        "--export",
        nargs="+",
        choices=EXPORTS,
        default=(),
        metavar="FORMAT",
        help=f"also write tables and tracks into DIR/data: {', '.join(EXPORTS)}",
    )


def replaced(parser: argparse.ArgumentParser, old: str, new: str) -> None:
    """An option that is called otherwise now: it is refused with its new name."""
    parser.add_argument(old, action=_Replaced, const=new, nargs="?", default=argparse.SUPPRESS, help=argparse.SUPPRESS)


class _Replaced(argparse.Action):
    def __call__(self, parser, namespace, values, option_string=None) -> None:
        parser.error(f"{option_string} is called {self.const} now")


class Formats(argparse.Action):
    """Print the formats that can be imported and end, as ``--help`` does."""

    def __call__(self, parser, *_) -> None:
        from ins_eval.readers import FORMATS

        print("\n".join(f"{name:14s}{known.description}" for name, known in FORMATS.items()))
        parser.exit()


class Version(argparse.Action):
    """Print the version and end."""

    def __call__(self, parser, *_) -> None:
        from importlib.metadata import version

        print(f"{parser.prog} {version('ins-eval')}")
        parser.exit()


class Completion(argparse.Action):
    """Print what makes a shell complete verbs and options, and end."""

    def __call__(self, parser, namespace, values, option_string=None) -> None:
        import shtab

        print(shtab.complete(parser, values))
        parser.exit()


def at_least(smallest: int) -> Callable[[str], int]:
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


def port(text: str) -> int:
    """The number of a port that needs no rights."""
    value = at_least(1024)(text)
    if value > LAST_PORT:
        raise argparse.ArgumentTypeError(f"{value}, expected at most {LAST_PORT}")
    return value


def gib(text: str) -> int:
    """GiB as bytes, of at least `LEAST_GIB`."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}, expected a number of GiB") from None
    if not LEAST_GIB <= value < math.inf:
        raise argparse.ArgumentTypeError(f"{text}, expected at least {LEAST_GIB:g} GiB")
    return int(value * GIB)


def _folder(text: str) -> Path:
    if text.endswith(FILES):
        raise argparse.ArgumentTypeError(
            f"{text}, expected a folder; numbers go to --json FILE, a model or a belief to --write-model FILE"
        )
    return Path(text)
