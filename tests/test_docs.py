"""The pages of `docs` say what the code does: every name, unit, default and formula, in both directions."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import pytest
from pydantic import BaseModel
from pydantic_core import PydanticUndefined

from ins_eval.effects import VOCABULARY
from ins_eval.effects.composed import SHAPES, TARGETS
from ins_eval.errors import DataRefused
from ins_eval.metrics import DEFINITIONS
from ins_eval.navigation import measures
from ins_eval.recording import form
from ins_eval.recording.belief import Belief
from ins_eval.recording.form.description import Description
from ins_eval.recording.form.names import AIR, READINGS, UNIT
from ins_eval.tree import as_tree
from ins_eval.units import HOUR, NMI
from tests.diagnosis.test_diagnose import CHANNELS, OF_VERDICT, VERDICTS, answer
from tests.recording.test_form import flight_of

DOCS = Path(__file__).resolve().parent.parent / "docs"
CODE = re.compile(r"`([^`]+)`")

Row = dict[str, str]


def tables(page: str) -> list[tuple[str, list[Row]]]:
    """Every table of a page under the heading that it follows, rows by the names of their columns."""
    found, heading, names = [], "", None
    for line in (DOCS / page).read_text().splitlines():
        if line.startswith("#"):
            heading = line.lstrip("# ")
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")] if line.startswith("|") else None
        if cells is None:
            names = None
        elif names is None:
            names = cells
            found.append((heading, []))
        elif set(line) - set("|- :"):
            assert len(cells) == len(names), f"{page}: {line}"
            found[-1][1].append(dict(zip(names, cells, strict=True)))
    return found


def rows(page: str, column: str, heading: str | None = None) -> list[Row]:
    """The rows of all tables of a page that begin with this column, or of those under a heading."""
    chosen = [(h, t) for h, t in tables(page) if next(iter(t[0])) == column and heading in (None, h)]
    assert chosen, f"{page} has no table of '{column}' under '{heading}'"
    return [row for _, table in chosen for row in table]


def named(cell: str) -> list[str]:
    return CODE.findall(cell)


def once(names: list[str]) -> set[str]:
    assert sorted(names) == sorted(set(names))
    return set(names)


# ------------------------------------------------------------------------------------------------ the recording

UNITS = {  # ends of names, the longest that fits decides
    "_per_min": "degC/min", "_ug_per_c": "ug/degC", "_deg_per_h": "deg/h", "_deg_per_sqrt_h": "deg/sqrt(h)",
    "_ug_per_sqrt_hz": "ug/sqrt(Hz)", "_ug": "ug", "_hz": "Hz", "_s": "s", "_deg": "deg", "_mps": "m/s",
    "_mps2": "m/s^2", "_radps": "rad/s", "_m": "m", "_c": "degC", "_g": "g",
}  # fmt: skip


def unit_of(name: str) -> str | None:
    ends = [end for end in UNITS if name.endswith(end)]
    return UNITS[max(ends, key=len)] if ends else None


def below(model: type[BaseModel], path: str) -> Iterator[tuple[str, type[BaseModel]]]:
    """The tables of a model with their headings in the page."""
    for key, field in model.model_fields.items():
        annotation = str(field.annotation)
        for inner in _models(field.annotation):
            repeated = annotation.startswith("tuple")
            name = f"{path}.{key}" if path else key
            if name in ("accelerometer.y", "accelerometer.z"):
                continue
            yield (f"[[{name}]]" if repeated else f"[{name}]"), inner
            yield from below(inner, name)


def _models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in getattr(annotation, "__args__", ()) for model in _models(part)]


SECTIONS = {"Top of the file": Description, "Tables of a belief": Belief}
SECTIONS |= {f"`{heading}`": model for model in (Description, Belief) for heading, model in below(model, "")}


def default(field) -> Any:
    """The default as the page has it."""
    if field.is_required():
        return "required"
    value = field.default_factory() if field.default is PydanticUndefined else field.default
    if isinstance(value, BaseModel):
        assert value == type(value)()
        return {}
    return "none" if value is None else list(value) if isinstance(value, tuple) else value


def stated(cell: str) -> Any:
    return cell if cell in ("required", "none") else tomllib.loads(f"it = {cell.strip('`')}")["it"]


def test_the_page_has_every_table_of_the_form_and_no_other() -> None:
    assert {heading for heading, table in tables("recording.md") if "key" in table[0]} == set(SECTIONS)


@pytest.mark.parametrize("heading", SECTIONS)
def test_every_key_of_a_recording_stands_with_its_default_and_unit(heading: str) -> None:
    page = {named(row["key"])[0]: row for row in rows("recording.md", "key", heading)}
    fields = SECTIONS[heading].model_fields
    assert set(page) == set(fields)
    assert {key: stated(row["default"]) for key, row in page.items()} == {k: default(f) for k, f in fields.items()}
    units = {key: unit_of(key) for key in page}
    assert {key: row["unit"] for key, row in page.items() if units[key]} == {k: u for k, u in units.items() if u}


def test_the_choices_of_a_key_are_those_of_the_form() -> None:
    for heading, model in SECTIONS.items():
        page = {named(row["key"])[0]: row["meaning"] for row in rows("recording.md", "key", heading)}
        for key, field in model.model_fields.items():
            choices = set(re.findall(r"Literal\[(.*?)\]", str(field.annotation))[:1])
            if choices:
                assert set(re.findall(r'"([^"]+)"', page[key])) == set(re.findall(r"'([^']+)'", choices.pop())), key
    kinds = next(row["meaning"] for row in rows("recording.md", "key", "Top of the file") if row["key"] == "`kind`")
    for kind in re.findall(r'"(\w+)"', kinds):
        Description.model_validate({"format": "ins-recording/1", "kind": kind})


def columns(table: str) -> dict[str, Row]:
    return {name: row for row in rows("recording.md", "column", f"Table `{table}`") for name in named(row["column"])}


@pytest.fixture(scope="module")
def everything(tmp_path_factory) -> Path:
    """A recording with every column that the form has."""
    folder = tmp_path_factory.mktemp("form")
    flight = flight_of(np.random.default_rng(5), samples=50)
    flight = replace(flight, imu=replace(flight.imu, further={}))
    fixes = {name: getattr(flight.gps, name) for name in ("velocity_n", "position_sigma_m", "velocity_sigma_mps")}
    flight = replace(flight, reference=replace(flight.reference, **fixes))
    return form.write(replace(flight, solution=flight.reference), folder / "one")


@pytest.fixture(scope="module")
def triad(tmp_path_factory) -> Path:
    """A recording with a thermometer at each accelerometer."""
    flight = flight_of(np.random.default_rng(5), triad_temperatures=True, samples=50)
    return form.write(replace(flight, imu=replace(flight.imu, further={})), tmp_path_factory.mktemp("form") / "three")


def held(folder: Path, table: str) -> list[str]:
    return pa.parquet.read_schema(folder / f"{table}.parquet").names


@pytest.mark.parametrize("table", ["imu", "gps", "reference", "solution"])
def test_the_columns_of_the_page_are_those_that_are_written(everything: Path, triad: Path, table: str) -> None:
    assert set(columns(table)) == {*held(everything, table), *(held(triad, table) if table != "solution" else ())}
    units = {name: unit_of(name) for name in columns(table)}
    assert {n: row["unit"] for n, row in columns(table).items() if units[n]} == {n: u for n, u in units.items() if u}


def copied(folder: Path, to: Path, table: str, without: list[str]) -> Path:
    to.mkdir()
    for file in folder.iterdir():
        (to / file.name).write_bytes(file.read_bytes())
    data = pa.parquet.read_table(folder / f"{table}.parquet")
    pa.parquet.write_table(data.drop_columns(without), to / f"{table}.parquet")
    return to


@pytest.mark.parametrize("table", ["imu", "gps", "reference", "solution"])
def test_a_recording_is_refused_without_a_column_that_is_needed_and_only_then(
    everything: Path, triad: Path, table: str, tmp_path: Path
) -> None:
    for row in rows("recording.md", "column", f"Table `{table}`"):
        group = named(row["column"])
        folder = everything if group[0] in held(everything, table) else triad
        assert row["needed"] in ("yes", "no")
        if row["needed"] == "no":
            form.read(copied(folder, tmp_path / group[0], table, group))
            continue
        for name in group:
            with pytest.raises(DataRefused, match=name):
                form.read(copied(folder, tmp_path / name, table, [name]))


def chamber(folder: Path, names: list[str]) -> Path:
    """A chamber recording of two readings with these columns."""
    folder.mkdir()
    folder.joinpath("recording.toml").write_text('format = "ins-recording/1"\nkind = "chamber"\n')
    values = {"input_g": "1", "output": "320000", "unit_id": "one", "run": "0"}
    lines = [",".join({"time_s": str(k)}.get(name, values.get(name, "20.0")) for name in names) for k in range(2)]
    folder.joinpath("chamber.csv").write_text("\n".join([",".join(names), *lines]) + "\n")
    return folder


def test_a_chamber_is_refused_without_a_column_that_is_needed_and_only_then(tmp_path: Path) -> None:
    page = columns("chamber")
    readings = form.read_chamber(chamber(tmp_path / "whole", list(page)))
    assert readings.unit_id == "one"
    for name, row in page.items():
        folder = chamber(tmp_path / name, [other for other in page if other != name])
        if row["needed"] == "no":
            form.read_chamber(folder)
            continue
        with pytest.raises(DataRefused, match=name):
            form.read_chamber(folder)


def test_the_files_of_a_recording_are_those_of_the_page(everything: Path, tmp_path: Path) -> None:
    page = {named(row["file"])[0] for row in rows("recording.md", "file")}
    whole = form.read(everything)
    folder = form.write(whole, tmp_path / "with-truth", truth=whole.reference)
    assert page == {"chamber", *(file.name.removesuffix(".parquet") for file in folder.iterdir())}


def test_the_further_column_that_an_effect_uses_stands_in_the_page() -> None:
    used = {effect.slow.removesuffix("^2") for effect in VOCABULARY.values() if effect.slow.endswith("^2")}
    text = (DOCS / "recording.md").read_text()
    assert all(f"`{name}`" in text for name in used - {"T", "r"})


def test_the_columns_of_a_chamber_are_those_that_are_read() -> None:
    assert set(columns("chamber")) == {"time_s", *READINGS, AIR, UNIT}


# ------------------------------------------------------------------------------------------------ effects

# how a multiplier and a slow factor stand in the page
FACTORS = {"1": "", "creep": "(y - y(0))", "branch": "h", "step": "s", "f f_pendulous": "f f_p", "f f_output": "f f_o",
           "|f|": "abs(f)", "|w|": "abs(w)"}  # fmt: skip


def effects() -> dict[str, Row]:
    return {named(row["name"])[0]: row for row in rows("effects.md", "name")}


def test_every_effect_stands_in_the_page_and_no_other() -> None:
    assert once([named(row["name"])[0] for row in rows("effects.md", "name")]) == set(VOCABULARY)


@pytest.mark.parametrize("name", VOCABULARY)
def test_an_effect_has_the_unit_axes_and_parameters_of_the_page(name: str) -> None:
    effect, row = VOCABULARY[name], effects()[name]
    assert row["unit"] == effect.unit
    assert row["axis"] == ", ".join(axis or "none" for axis in effect.axes)
    expected = {parameter.name for parameter in effect.parameters}
    expected |= {"other_axis"} if len(effect.multipliers) > 1 else set()
    expected |= set(effect.words)
    assert once(named(row["parameters"])) == expected


@pytest.mark.parametrize("name", [name for name, e in VOCABULARY.items() if e.enters in ("accelerometer", "gyro")])
def test_the_error_of_an_effect_is_that_of_the_page(name: str) -> None:
    effect = VOCABULARY[name]
    several = len(effect.multipliers) > 1
    multiplier = f"{effect.multipliers[0][0]}_other" if several else effect.multipliers[0]
    parts = ("v", *(FACTORS.get(one, re.sub(r"\bT\b", "(T - T0)", one)) for one in (multiplier, effect.slow)))
    assert effects()[name]["error"] == " ".join(part for part in parts if part)


def test_every_symbol_of_an_error_is_explained_and_no_other() -> None:
    known = {symbol for row in rows("effects.md", "symbol") for symbol in re.findall(r"\w+", row["symbol"])}
    known |= set(re.findall(r"\b[fw]_\w+", " ".join(row["meaning"] for row in rows("effects.md", "symbol"))))
    of_sensors = [row["error"] for name, row in effects().items() if name.startswith(("accelerometer", "gyro"))]
    used = set(re.findall(r"[A-Za-z]\w*", " ".join(of_sensors)))
    assert used == known | {"v", "vibration_rms_g"}


def test_every_parameter_stands_in_the_page_with_its_unit_and_range() -> None:
    page = {named(row["parameter"])[0]: row for row in rows("effects.md", "parameter")}
    parameters = {p.name: p for effect in VOCABULARY.values() for p in effect.parameters}
    assert set(page) == {*parameters, "other_axis", *(word for effect in VOCABULARY.values() for word in effect.words)}
    for name, parameter in parameters.items():
        assert page[name]["unit"] == (parameter.unit or "-")
        if parameter.low is not None:
            assert page[name]["range"] == f"{parameter.low:g} to {parameter.high:g}"


def test_targets_and_shapes_of_a_composed_effect_stand_in_the_page() -> None:
    targets = {named(row["target"])[0]: row["unit of the value"] for row in rows("effects.md", "target")}
    assert {name: unit.split(" per ")[0] for name, unit in targets.items()} == {n: t.unit for n, t in TARGETS.items()}
    shapes = {named(row["shape"])[0]: row["argument"] != "none" for row in rows("effects.md", "shape")}
    assert shapes == SHAPES


def test_a_belief_can_state_every_parameter_but_the_lag_itself() -> None:
    keys = {named(row["key"])[0] for row in rows("recording.md", "key", "`[[effects]]`")}
    parameters = {named(row["parameter"])[0] for row in rows("effects.md", "parameter")}
    assert parameters - keys == {"lag_s"}


# ------------------------------------------------------------------------------------------------ the answer


def paths(tree: Any, path: str = "") -> Iterator[str]:
    """Every key below a tree; a further parameter of an effect as PARAMETER."""
    if isinstance(tree, list):
        for one in tree:
            yield from paths(one, f"{path}[]")
    elif isinstance(tree, dict):
        for key, value in tree.items():
            bare = key.removesuffix("_interval95")
            if path.endswith(".parameters") and bare in PARAMETERS:
                key = key.replace(bare, "PARAMETER")
            yield (here := f"{path}.{key}".lstrip("."))
            yield from paths(value, here)


PARAMETERS = {p.name for effect in VOCABULARY.values() for p in effect.parameters} | {"other_axis", "driver", "form"}


def answer_page() -> dict[str, Row]:
    table = [row for row in rows("answer.md", "key")]
    once([row["key"] for row in table])
    return {named(row["key"])[0]: row for row in table}


def written_by_the_answer() -> set[str]:
    """The keys of the tables in the module that writes the answer."""
    package = Path(__file__).resolve().parent.parent / "ins_eval" / "diagnosis"
    sources = [text for file in package.rglob("*.py") if '"ins-diagnosis/1"' in (text := file.read_text())]
    assert sources
    nodes = [node for source in sources for node in ast.walk(ast.parse(source))]
    inside = [key for node in nodes if isinstance(node, ast.Dict) for key in node.keys]
    return {key.value for key in inside if isinstance(key, ast.Constant)}


@pytest.mark.parametrize("verdict", sorted(VERDICTS))
def test_every_key_of_an_answer_stands_in_the_page(verdict: str) -> None:
    found = answer(OF_VERDICT[verdict])
    page = answer_page()
    assert set(paths(found)) - set(page) == set()
    always = {key for key, row in page.items() if row["when"] == "always" and key.count(".") == 0 and "[]" not in key}
    assert set(found) == always
    for part in ("mismatch", "effects", "indistinguishable"):
        needed = {key.partition(".")[2] for key, row in page.items()
                  if row["when"] == "always" and key.startswith(f"{part}[].") and key.count(".") == 1}  # fmt: skip
        assert all(needed <= set(one) for one in found[part])


def test_the_page_has_every_key_that_the_answer_writes_and_no_other() -> None:
    keys = written_by_the_answer()
    leaves = {key.rpartition(".")[2] for key in answer_page()}
    made = {path for found in OF_VERDICT.values() for path in paths(answer(found))}
    assert keys - leaves == set()
    assert set(answer_page()) == made


def test_verdicts_and_channels_of_the_page() -> None:
    assert {named(row["verdict"])[0] for row in rows("answer.md", "verdict")} == VERDICTS
    assert once([name for row in rows("answer.md", "channel") for name in named(row["channel"])]) == CHANNELS


def test_the_nats_of_the_page_are_those_that_decide() -> None:
    from ins_eval.policy import Policy

    text = (DOCS / "answer.md").read_text()
    assert {float(nats) for nats in re.findall(r"(\d+) nats", text)} == {Policy.near, Policy.harm}


# ------------------------------------------------------------------------------------------------ metrics


def test_every_definition_stands_in_the_page_with_formula_window_and_words() -> None:
    page = {named(row["key"])[0]: row for row in rows("metrics.md", "key", "Many flights")}
    assert set(page) == set(DEFINITIONS)
    for key, definition in DEFINITIONS.items():
        row = page[key]
        assert (row["formula"], row["window"], row["in words"]) == (
            definition.formula, definition.window, definition.words
        )  # fmt: skip


def test_the_example_of_the_page() -> None:
    flights = rows("metrics.md", "flight")
    position = np.array([[[float(f[f"{way}, {h} h"]) for way in ("north", "east")] for h in (1, 2)] for f in flights])
    page = {named(row["definition"])[0]: float(row["nmi/h"]) for row in rows("metrics.md", "definition")}
    assert set(page) == set(DEFINITIONS)
    for key, rate in page.items():
        assert DEFINITIONS[key].rate(NMI * position, HOUR * np.array([1.0, 2.0])) == pytest.approx(rate, abs=5e-5)
    assert len(set(page.values())) > 5


class _Flight:
    """What `measures` sees of one navigated recording: one that is valid at t = 0, 1 h and 2 h."""

    def __init__(self) -> None:
        from ins_eval.reference import AttitudeErrors, Errors

        time_s = HOUR * np.array([0.0, 1.0, 2.0])
        north, east = NMI * np.array([[0.0, 0.3, 0.6], [0.0, 0.4, 0.8]])
        velocity = np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 3.0], [2.0, -1.0, 0.5]])
        self.errors = Errors(time_s, north, east, 0.0 * north, velocity, np.ones(3, dtype=bool), ())
        self.attitude = AttitudeErrors(time_s, np.radians([[0.0, 1.0, 2.0], [3.0, 1.0, 2.0], [0.0, 1.0, 2.0]]))
        self.solution = self
        self.time_s = time_s


def test_the_figures_of_one_flight_stand_in_the_page() -> None:
    found = as_tree(measures(_Flight()))
    page = {named(row["key"])[0]: row for row in rows("metrics.md", "key", "One flight")}
    assert set(page) == {f"{group}.{key}" for group, of in found.items() for key in of}
    assert {row["unit"] for key, row in page.items() if key.startswith("velocity")} == {"m/s"}
    rms = found["velocity_rms_mps"]
    assert rms["north"] == pytest.approx(np.sqrt(5.0 / 3.0))
    assert rms["horizontal"] == pytest.approx(np.hypot(rms["north"], rms["east"]))
    assert list(found["attitude_rms_deg"].values()) == pytest.approx([np.sqrt(3.0), 1.0, 2.0])


def missing_figures(command: str, found: dict[str, Any]) -> list[str]:
    """Figures that the page says a command writes and that are not there for every compensation NAME.

    The tests of the command call this with what it wrote.
    """
    keys = [named(row["key"])[0] for row in rows("metrics.md", "key", f"What `{command}` writes")]
    assert len(keys) > 4
    return [key for key in keys if not _present(found, key.split("."))]


def _present(tree: Any, steps: list[str]) -> bool:
    if not steps:
        return True
    if steps[0] == "NAME":
        arms = [below for below in tree.values() if isinstance(below, dict) and steps[1] in below]
        return bool(arms) and all(_present(below, steps[1:]) for below in arms)
    return steps[0] in tree and _present(tree[steps[0]], steps[1:])


def test_a_figure_that_is_not_there_is_missed() -> None:
    whole = {"velocity_rms_mps": {}, "radial_error_rate_nmi_per_h": {}, "final_radial_error_m": 1.0}
    figures = ("position_rms_m", "velocity_rms_mps", "position_interval95_m", "velocity_interval95_mps")
    pieces = dict.fromkeys(figures, [])
    assert missing_figures("evaluate", {"compensations": {"none": whole}, "restarts": {"none": pieces}}) == []
    assert missing_figures("evaluate", {"compensations": {"none": whole}}) == [
        f"restarts.NAME.{figure}" for figure in figures
    ]
    assert len(missing_figures("evaluate", {})) == 3 + len(figures)


# ------------------------------------------------------------------------------------------------ the index


def test_every_place_of_the_index_exists(repository: Path) -> None:
    for row in rows("index.md", "question"):
        file, name = repository / named(row["file"])[0], named(row["name"])[0]
        assert re.search(rf"^ *(?:def |class )?{re.escape(name)}\b", file.read_text(), re.MULTILINE), f"{file}: {name}"


def test_every_link_and_every_file_of_the_pages_exists(repository: Path) -> None:
    pages = [*DOCS.glob("*.md"), repository / "CONTRIBUTING.md", repository / "CHANGELOG.md", repository / "README.md"]
    for page in pages:
        text = re.sub(r"new file `[^`]+`", "", page.read_text())
        for target in re.findall(r"\]\((?!https:)([^)#]+)[^)]*\)", text):
            assert (page.parent / target).exists(), f"{page.name}: {target}"
        for path in re.findall(r"`((?:ins_eval|tests|docs|trajectories)/[\w./-]+)`", text):
            assert (repository / path).exists(), f"{page.name}: {path}"


def test_the_index_lists_every_page() -> None:
    linked = set(re.findall(r"\]\((\w+\.md)\)", (DOCS / "index.md").read_text()))
    assert linked == {page.name for page in DOCS.glob("*.md")} - {"index.md"}
