"""The page of Paper B: its words follow the numbers, its figures show what they were given, none is lost."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import pytest

from ins_eval.figures import style
from ins_eval.report import text
from ins_eval.report.content import Picture, Section, Table
from ins_eval.studies.diagrams import diagrams
from ins_eval.studies.paper_b import figures
from ins_eval.studies.paper_b.rows import rows
from ins_eval.studies.paper_b.words import PICTURES, paper_b_content

LARGEST_SVG_BYTES = 150_000
DIAGRAMS = {f"B-F{k}" for k in range(2, 10)}
CHANNELS = ("forward", "feedback")


def said(results: dict) -> str:
    answer, sections = paper_b_content(rows(results), results)
    return text.render("Paper B", answer, sections, figures=pictures(sections))


def pictures(sections: list[Section]) -> set[str]:
    return {block.name for section in sections for block in section.blocks if isinstance(block, Picture)}


def test_the_answer_counts_and_then_says_what_matters(results: dict) -> None:
    lines = paper_b_content(rows(results), results)[0].splitlines()
    assert lines[0].startswith(f"Of {len(rows(results))} statements of Paper B, ")
    assert "forward gain shifts by 0 [−30, 30] ppm" in lines[1] and "changes by 0.01 [−0.02, 0.04]" in lines[1]
    assert "−193 µg before and +25 µg after" in lines[2]
    assert "Neither test detects a drift of the magnet" in lines[3] and "200 µg" in lines[3]
    assert "phase margin of 55° changes by 0.003°" in lines[4]
    assert lines[5].startswith("What it means") and "from 100 to 7 µg" in lines[5]


def test_blind_spots_are_named(results: dict) -> None:
    section = next(s for s in paper_b_content(rows(results), results)[1] if "each test detects" in s.heading)
    words, seen = section.blocks
    assert "Drifts of pendulous mass, magnet and coil length change the output" in words.text
    assert "drift of reference current" in words.text
    by_part = {row[0]: row[-1] for row in seen.rows}
    assert by_part["magnet"] == "output at 1 g" and by_part["bending stiffness"] == "nothing"


def test_figures_stand_below_the_rows_of_their_id(results: dict) -> None:
    _, sections = paper_b_content(rows(results), results)
    below: dict[str, list[str]] = {}
    for section in sections[1:]:
        last = ""
        for block in section.blocks:
            if isinstance(block, Table) and block.remarks:
                last = block.remarks[-1].lead.partition("/")[0]
            elif isinstance(block, Picture):
                below.setdefault(last, []).append(block.name)
    assert below == {id: list(named) for id, named in PICTURES.items()}
    assert set(PICTURES) >= DIAGRAMS | {"B-F11", "B-F12", "B-F13"}


def test_what_the_results_lack_is_left_out(results: dict) -> None:
    for key in results:
        cut = copy.deepcopy(results)
        del cut[key]
        words = said(cut)
        assert "None" not in words and "nan" not in words, key
    assert said({}).startswith("Of 1")


@pytest.mark.parametrize("id", sorted(DIAGRAMS))
def test_diagrams(id: str) -> None:
    (name,) = PICTURES[id]
    drawing = style.svg(diagrams(Path(figures.__file__).with_name("diagrams.toml"))[name])
    assert f"(Fig. {id.removeprefix('B-F')})" in drawing
    assert len(drawing) < LARGEST_SVG_BYTES


def drawn_of_computed(results: dict) -> dict:
    found, temperature = results["attraction"], results["temperature"]
    wave = np.sin(np.linspace(0.0, 60.0, 2000))
    stretch = {"time_s": np.linspace(0.0, 20.0, 2000), "force_g": wave, "off_ug": wave, "linear_ug": 0.5 * wave}
    return {
        "attraction_by_carrier": figures.attraction_by_carrier(
            volts=[0.1, 1.0, 5.0],
            gain_ppm=[20.0, 2e3, 1e5],
            added_scatter_ppm=[0.01, 1.0, 10.0],
            carrier_v=found["carrier_v"],
            excited_v=found["excited_v"],
            scatter_ppm=31.0,
            limit_ppm=10.0,
        ),
        "temperature_calibrated": figures.temperature_calibrated(
            **{key: temperature[key] for key in ("room", "far", "floor")}, changes_c=(2.0, 20.0)
        ),
        "loop_in_flight": figures.loop_in_flight(stretches={"flight, z axis": stretch, "wing rock, y axis": stretch}),
    }


@pytest.fixture
def drawn(results: dict) -> dict:
    rng = np.random.default_rng(2)
    n_fpga = 800.0 + 120.0 * np.arange(21)
    six = {"forward": (-180.0 + rng.normal(size=6)).tolist(), "feedback": (218.0 + rng.normal(size=6)).tolist()}
    shift = {channel: rng.normal(0.0, 15.0, 200) for channel in CHANNELS}
    band = {channel: {"value": 0.0, "interval95": [-230.0, 230.0]} for channel in CHANNELS}
    time_s = np.linspace(0.0, 4.0, 80)
    return {
        "forward_estimation": figures.forward_estimation(
            n_fpga=n_fpga, before=479.0 * n_fpga, after=478.9 * n_fpga, before_gain=479.0, after_gain=478.9
        ),
        "feedback_estimation": figures.feedback_estimation(
            before=[-71738.0] * 6, after=[-71723.0] * 6, printed={"before": [-71738.0] * 6, "after": [-71754.0] * 6}
        ),
        "static_output": figures.static_output(
            time_s=time_s,
            output_ug={name: rng.normal(size=80) for name in ("before", "after", "compensated")},
            printed_ug={"after": -193.0, "compensated": 24.0},
        ),
        "estimates_by_repetition": figures.estimates_by_repetition(
            identified_ppm=six,
            printed_ppm=six,
            population_ppm=band,
            injected_ppm={"forward": -200.0, "feedback": 200.0},
        ),
        "shift_distribution": figures.shift_distribution(
            shift_ppm=shift, printed_ppm={"forward": 19.5, "feedback": 18.2}
        ),
        "shift_and_size": figures.shift_and_size(small_ppm=shift, large_ppm=shift, sizes_ppm=(200.0, 1000.0)),
        "stability_against_drift": figures.stability_against_drift(
            forward_ppm=np.linspace(-5e5, 1e6, 7),
            phase_margin_deg=np.linspace(60.0, 40.0, 7),
            crossover_hz=np.linspace(60.0, 220.0, 7),
            steps={"as built": (1e-3 * time_s, np.ones(80))},
        ),
        **drawn_of_computed(results),
    }


def test_every_figure_that_is_mentioned_can_be_drawn(drawn: dict) -> None:
    named = {name for figures in PICTURES.values() for name in figures}
    assert named == set(drawn) | {name for id in DIAGRAMS for name in PICTURES[id]}


def test_figures_have_titles_units_and_legends(drawn: dict) -> None:
    for name, figure in drawn.items():
        assert figure.get_suptitle().strip(), name
        assert figure.legends, name
        for ax in figure.axes:
            assert "[" in ax.get_xlabel() or "repetition" in ax.get_xlabel(), name
        assert figure.axes[0].get_ylabel(), name
        assert len(style.svg(figure)) < LARGEST_SVG_BYTES, name


def test_figures_draw_what_they_are_given(drawn: dict) -> None:
    left, right = drawn["forward_estimation"].axes
    assert left.lines[0].get_xdata()[0] == 800.0
    assert right.lines[0].get_ydata()[-1] == pytest.approx(-0.1 * 3200.0)
    levels = [line.get_ydata()[0] for line in drawn["static_output"].axes[0].lines if line.get_linestyle() == "--"]
    before = drawn["static_output"].axes[0].lines[0].get_ydata().mean()
    assert sorted(levels) == pytest.approx([before - 193.0, before + 24.0])
    for ax, shift in zip(drawn["shift_distribution"].axes, (19.5, 18.2), strict=True):
        assert sum(patch.get_height() for patch in ax.patches) == 200
        assert any(np.allclose(line.get_xdata(), shift) for line in ax.lines)


def test_temperature_is_drawn_by_arm_and_flight_with_its_linear_response(drawn: dict, results: dict) -> None:
    room, far = drawn["temperature_calibrated"].axes
    assert "2 °C" in room.get_title() and "20 °C" in far.get_title()
    assert far.containers[0].lines[0].get_ydata().tolist() == [
        results["temperature"]["far"]["none"][error]["value"] for error in ("forward_ppm", "feedback_ppm", "output_ug")
    ]
    lower = drawn["loop_in_flight"].axes[2]
    assert np.abs(lower.lines[1].get_ydata()).max() == pytest.approx(0.5, rel=1e-3)


def test_what_was_computed_has_a_section(results: dict) -> None:
    words = said(results)
    assert "differs from its steady state by 2.4 µg RMS" in " ".join(words.split()) and "47.4 µs late" in words
    assert "of 28.9 V" in words and "with another unit's coefficients" in words
