"""``ins-eval presets``: everything that ships with values of its own, one line each or one of them in full."""

from __future__ import annotations

import dataclasses
import inspect
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from ins_eval import datasheets, missions, profile
from ins_eval.accelerometer.model import PRESETS as POPULATIONS
from ins_eval.boundary import LARGEST_TEXT_BYTES, file_bytes
from ins_eval.digital_loop import parameters as loops
from ins_eval.errors import UsageError, did_you_mean
from ins_eval.gyro import GyroPopulation
from ins_eval.laboratory import Chamber
from ins_eval.laboratory.creep_rig import CreepRig
from ins_eval.printable import printable
from ins_eval.report.json_file import write_json
from ins_eval.tables import read_toml


@dataclass(frozen=True)
class Preset:
    """Something that ships: where it belongs, its name, what it is, its source and its full text when asked for."""

    kind: str
    name: str
    words: str
    text: Callable[[], str]


def run(name: str | None, json: Path | None = None, quiet: bool = False) -> int:
    """List all presets, or print those of that name in full. Raises UsageError for a name that none has."""
    known = list(_all())
    found = [preset for preset in known if name in (None, preset.name)]
    if not found:
        raise UsageError(f"no preset '{name}'{did_you_mean(str(name), {preset.name for preset in known})}")
    rows = [{"kind": one.kind, "name": one.name, "words": one.words} for one in found]
    if name is not None:
        rows = [row | {"text": one.text()} for row, one in zip(rows, found, strict=True)]
    write_json(json, {"format": "ins-eval-presets/1", "presets": rows})
    if quiet:
        return 0
    if name is None:
        _print_list(known)
    else:
        print("\n\n".join(f"{preset.kind}: {preset.name}\n\n{preset.text().rstrip()}" for preset in found))
    return 0


def _print_list(presets: list[Preset]) -> None:
    width = max(len(preset.name) for preset in presets) + 2
    for kind in dict.fromkeys(preset.kind for preset in presets):
        print(f"{kind}:")
        for preset in presets:
            if preset.kind == kind:
                print(f"  {preset.name:{width}s}{preset.words}")
    print("\nins-eval presets NAME prints one in full, each number with its source")


def _all() -> Iterator[Preset]:
    for path in _tomls(POPULATIONS):
        yield Preset("accelerometer population", path.stem, _words(path), partial(_with_bases, path, _population))
    for path in _tomls(loops.PRESETS):
        yield Preset("digital loop", path.stem, _words(path), partial(_with_bases, path, loops.find))
    for path in _tomls(datasheets.FOLDER):
        kind = _kind(datasheets.load(path.stem))
        yield Preset(kind, path.stem, _words(path), partial(_sheet, path))
    words = "The gyro triad of every instrument. Source: Paper A, Table 5; what it lacks is assumed."
    yield Preset("gyro population", "gyros", words, _gyros)
    for name, path in _of_folders(Path()):
        yield Preset("profile of a flight or oven run", name, _words(path), partial(_with_bases, path, profile.find))
    for name, path in _of_folders(Path(missions.FOLDER)):
        yield Preset("population of missions", name, _words(path), partial(_with_bases, path, missions.find))
    words = "The four-point programme in the thermal chamber. Source: Paper A, section 3.1."
    yield Preset("laboratory", "four-point-chamber", words, partial(_fields, Chamber()))
    words = "Blocks of epoxy resin in three containers. Source: Paper A, section 2.2, Figs 2 and 3."
    yield Preset("laboratory", "creep-rig", words, partial(_fields, CreepRig()))


def _kind(sheet: datasheets.AccelerometerSheet | datasheets.InsSheet | datasheets.UnitSheet) -> str:
    if isinstance(sheet, datasheets.UnitSheet):
        return "inertial unit"
    return "INS" if isinstance(sheet, datasheets.InsSheet) else "data sheet"


def _of_folders(within: Path) -> list[tuple[str, Path]]:
    """Names and files below each folder of ``trajectories``; of one name that which would be found."""
    files: dict[str, Path] = {}
    for folder in profile.folders():
        files = {path.stem: path for path in _tomls(folder / within)} | files
    return sorted(files.items())


def _population(name: str) -> Path:
    return POPULATIONS / f"{name}.toml"


def _tomls(folder: Path) -> list[Path]:
    return sorted(path for path in folder.glob("*.toml") if path.is_file())


def _text(path: Path) -> str:
    return printable(
        file_bytes(path, "a .toml file", LARGEST_TEXT_BYTES).decode("utf-8", errors="replace"), keep="\n\t"
    )


def _words(path: Path) -> str:
    """The first sentence of the head comment, and the second where it names the source."""
    head = itertools.takewhile(lambda line: line.startswith("#"), _text(path).splitlines())
    sentences = " ".join(line.lstrip("# ") for line in head).replace(". ", ".\n").splitlines()
    return " ".join(sentences[: 2 if any(s.startswith("Source") for s in sentences[1:2]) else 1])


def _with_bases(path: Path, find: Callable[[str], Path]) -> str:
    """A file, and below it those that it extends."""
    text, chain = _text(path), [path]
    while (base := read_toml(chain[-1]).get("extends")) is not None:
        chain.append(find(str(base)))
        if chain[-1] in chain[:-1]:
            raise UsageError(f"{path}: 'extends' leads back to itself; break the circle")
        text += f"\n# ---- {base}, which it extends ----\n\n{_text(chain[-1])}"
    return text


def _sheet(path: Path) -> str:
    sheet = datasheets.load(path.stem)
    text = path.read_text(encoding="utf-8")
    if isinstance(sheet, datasheets.InsSheet):
        return f"{text}\n# The gyros of every simulated instrument take these values up as follows.\n{_gyros()}"
    if isinstance(sheet, datasheets.UnitSheet):
        return text
    drift = datasheets.worst_case_drift(sheet)
    return (
        f"{text}\n# Worst case without compensation, {datasheets.COLD_C:g} to {datasheets.HOT_C:g} degC "
        "(Paper A, section 1):\n"
        f"#   bias         {sheet.bias_temperature_ug_per_c:g} ug/degC x {drift.span_c:g} degC "
        f"= {drift.bias_ug:g} ug = {drift.bias_ug / 1e3:g} mg\n"
        f"#   scale factor {sheet.scale_temperature_ppm_per_c:g} ppm/degC x {drift.span_c:g} degC "
        f"= {drift.scale_ppm:g} ppm"
    )


def _gyros() -> str:
    words = "\n".join(f"# {line}".rstrip() for line in inspect.cleandoc(GyroPopulation.__doc__ or "").splitlines())
    return f"{words}\n{_fields(GyroPopulation())}"


def _fields(of: Any, indent: str = "") -> str:
    """The values of a dataclass or table, one a line, each with its source where it carries one."""
    if isinstance(of, BaseModel):
        return "\n".join(f"{indent}{name} = {value}" for name, value in of.model_dump().items())
    lines = []
    for field in dataclasses.fields(of):
        value, source = getattr(of, field.name), field.metadata.get("source", "")
        comment = f"# {source}" if source else ""
        if isinstance(value, BaseModel) or dataclasses.is_dataclass(value):
            lines += [f"{indent}{field.name:28s}{comment}", _fields(value, indent + "    ")]
        else:
            shown = f"{value:g}" if isinstance(value, float) else str(value)
            lines.append(f"{indent}{f'{field.name} = {shown}':50s}  {comment}".rstrip())
    return "\n".join(lines)
