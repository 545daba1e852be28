"""Rows from tables: what a text may hold, and that no sentence of the papers is lost."""

from __future__ import annotations

from pathlib import Path

import pytest

from ins_eval.studies.paper_a.rows import GROUPS as OF_PAPER_A
from ins_eval.studies.paper_b.rows import GROUPS as OF_PAPER_B
from ins_eval.studies.papers import CONTRADICTS, GIVEN, NOT_COMPUTED, NOT_REPRODUCED, REPRODUCED
from ins_eval.studies.row_tables import Statement, read, rows

ESTIMATE = {"value": 2.0, "interval95": [1.0, 3.0]}
COMPUTED = {"paper": {"size": 3.0, "sizes": [1.0, 2.5]}, "flight": {"rms": ESTIMATE}, "oven": None}


def row(said: Statement, **own):
    return next(rows({"x": said}, {"x": own} if own else {}, COMPUTED))


def test_a_path_is_a_number_an_estimate_or_a_text() -> None:
    said = Statement("t", "contradicts", ["{flight.rms}, {paper.size:4}, {paper.sizes:g}, {own:.1f}, {name}."])
    found = row(said, own=0.25, name="a", printed=1.0)
    assert found.reason == "2.00 (1.00 to 3.00), 3.000, 1 / 2.5, 0.2, a."
    assert (found.printed, found.verdict) == (1.0, CONTRADICTS)
    stated = row(Statement("t", "given", ["so."], printed="{paper.size}", recomputed="{paper.sizes:g} m", unit="m"))
    assert (stated.printed, stated.recomputed, stated.unit) == (3.0, "1 / 2.5 m", "m")
    assert stated.reason == f"{GIVEN}so."


def test_a_sentence_without_its_numbers_is_left_out_and_another_may_stand_for_it() -> None:
    either = ["In the oven {oven.rms}.", "Not in the oven."]
    assert row(Statement("t", "open", ["So.", "In the oven {oven.rms}.", either])).reason == "So. Not in the oven."
    assert row(Statement("t", "open", ["In the oven {oven.rms}."])).reason == NOT_COMPUTED


def test_each_kind_is_judged() -> None:
    known, unknown = Statement("t", "claimed", ["So."], ours="{flight.rms}", above=0.0), "{oven.rms}"
    assert row(known).verdict == REPRODUCED
    assert row(Statement("t", "claimed", ["So."], ours=unknown, above=0.0)).reason == NOT_COMPUTED
    exact = Statement("t", "recalculated", ["So."], printed="{paper.size}", digit=0.1)
    assert [row(exact, recomputed=of).verdict for of in (3.04, 3.06)] == [REPRODUCED, CONTRADICTS]
    simulated = Statement("t", "simulated", printed=2.5, ours="{flight.rms}", of="ours")
    assert row(simulated).passes == (1.0, 3.0) and "inside ours" in row(simulated).reason
    for kind, otherwise in (("decided", NOT_REPRODUCED), ("consistent", CONTRADICTS)):
        said = Statement("t", kind, ["So."], fails="it were not so")
        assert [row(said, holds=of).verdict for of in (True, False)] == [REPRODUCED, otherwise]
        assert row(said, holds=None).reason == NOT_COMPUTED
    with pytest.raises(ValueError, match="guessed"):
        row(Statement("t", "guessed", ["So."]))


def test_a_pattern_has_the_rows_of_its_values_in_their_order() -> None:
    said = {"a": Statement("A", "given"), "(b|c)/.*": Statement("{axis}", "given"), "b/x": Statement("X", "given")}
    found = rows(said, {"c/2": {"axis": "two"}, "b/1": {"axis": "one"}, "b/x": {}}, {})
    assert [(one.id, one.title) for one in found] == [("a", "A"), ("c/2", "two"), ("b/1", "one"), ("b/x", "X")]


def test_what_cannot_be_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "rows.toml"
    file.write_text('[x]\ntitle = "t"\nguess = 2.0\n')
    with pytest.raises(TypeError, match="guess"):
        read(file)
    with pytest.raises(KeyError, match="nowhere"):
        row(Statement("t", "given", ["{nowhere.rms}."]))
    with pytest.raises(KeyError, match="y: values without a statement"):
        list(rows({}, {"y": {}}, {}))


@pytest.mark.parametrize("groups", [OF_PAPER_A, OF_PAPER_B])
def test_every_group_has_its_statements(groups: dict) -> None:
    for module in groups.values():
        assert read(Path(module.__file__).with_suffix(".toml"))
