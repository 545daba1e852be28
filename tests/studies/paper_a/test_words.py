"""The page of Paper A loses no row, its words follow the numbers, and its figures show what they were given."""

from __future__ import annotations

import copy
import importlib.util
import io
import re
from pathlib import Path

import numpy as np
import pytest

from ins_eval import figures
from ins_eval.calibration.four_point import four_point
from ins_eval.ensemble.sensitivity import CASES
from ins_eval.figures import style
from ins_eval.laboratory import Chamber, draw_printed_units, magnet
from ins_eval.laboratory.creep_rig import CreepRig
from ins_eval.report import page, text
from ins_eval.report.content import Paragraph, Picture, Section, Table
from ins_eval.streams import Streams
from ins_eval.studies.diagrams import diagrams
from ins_eval.studies.paper_a import figures as of_paper
from ins_eval.studies.paper_a import oven_figures as of_oven
from ins_eval.studies.paper_a.words import PICTURES, paper_a_content
from ins_eval.studies.papers import COMPATIBLE, CONTRADICTS, GIVEN, NOT_COMPUTED, NOT_REPRODUCED, REPRODUCED, Row
from ins_eval.wording import in_symbols

PAIR = ("simple", "hysteresis_refined")
AXES = ("east", "north", "horizontal")
LARGEST_SVG_BYTES = 150_000
RIGS = diagrams(Path(of_paper.__file__).with_name("diagrams.toml"))
FLIGHT_FIGURES = {  # drawn by the flight report, too
    "flight_path",
    "temperature_and_rate",
    "east_velocity_error",
    "north_velocity_error",
    "latitude_error",
    "longitude_error",
    "position_error",
}


def estimate(value: float, spread: float = 0.1) -> dict:
    return {"value": value, "interval95": sorted((value * (1 - spread), value * (1 + spread)))}


def row(id: str, verdict: str = REPRODUCED, reason: str = "It holds.", group: str = "tables", **numbers) -> Row:
    values = {"printed": None, "recomputed": None, "ours": None, "interval95": None, **numbers}
    return Row(id=id, group=group, title=f"statement {id}", verdict=verdict, reason=reason, **values)


@pytest.fixture
def rows() -> list[Row]:
    figures_of_paper = [f"A-F{k}" for k in range(1, 14)]
    return [
        row("A-T2/-55", CONTRADICTS, "An extreme at -55 °C was missed.", printed=84.88, recomputed=86.7374, unit="%"),
        row("A-T4/#1/none", CONTRADICTS, printed=74.14, recomputed=107.25, ours=104.4, interval95=(99.96, 110.2)),
        row("A-T5", NOT_REPRODUCED, GIVEN + "drawn after it.", printed="-28 to 78"),
        row("A-T6", NOT_REPRODUCED, "Outside.", printed=0.98, ours=1.2, interval95=(1.1, 1.3)),
        row(
            "A-T7",
            COMPATIBLE,
            "Inside.",
            printed=1.36,
            ours=1.25,
            interval95=(0.378, 2.24),
            passes=(0.378, 2.24),
            chosen="the path was chosen so",
        ),
        row("A-E15/gamma", printed=320320.0, group="equations", passes=(320319.5, 320320.5)),
        row("A-E16", group="equations", fails="it were not so"),
        row("A-P7", NOT_REPRODUCED, NOT_COMPUTED, group="procedures"),
        *(row(id, group="figures") for id in figures_of_paper),
        row("A30", printed=1.39, recomputed=1.3878, group="inconsistencies"),
    ]


@pytest.fixture
def results(flight_metrics) -> dict:
    velocities = {a: estimate(v) for a, v in zip(AXES, (1.2, 1.3, 1.8), strict=True)}
    cases = ("given", "aligned")
    arms = ("none", "simple", "simple_anchored", "quadratic", "hysteresis", "simple_refined", "hysteresis_refined")
    return {
        "seed": 1,
        "flight": {**flight_metrics, "difference_m": {"1800": estimate(30.0), "6000": estimate(310.0)}},
        "oven": {
            "size": 40,
            "runs": 10,
            **{case: {arm: velocities for arm in arms} for case in cases},
            "gain": {case: {a: estimate(0.75, 0.05) for a in AXES} for case in cases},
            "best_of_ten": {case: {a: estimate(61.0) for a in AXES} for case in cases},
            "median_of_ten": {case: {a: estimate(22.0) for a in AXES} for case in cases},
        },
        "chamber": {
            "coverage": {
                "coefficients": estimate(0.951, 0.01),
                "predictive": estimate(0.9, 0.01),
                "predictive_by_position": {"-1 g": estimate(0.94, 0.01)},
                "units": 300,
            },
            "residual_rms_ppm": {"JB-KT8 #1": {"simple": estimate(520.0), "hysteresis": estimate(55.0)}},
            "magnet_share": {"JB-KT8 #1": estimate(0.71)},
        },
        "sensitivity": {
            name: {"words": case.words, **dict.fromkeys(PAIR, velocities), "ratio": estimate(0.8)}
            for name, case in CASES.items()
        },
    }


def said(rows: list[Row], results: dict) -> str:
    answer, sections = paper_a_content(rows, results)
    return text.render("Paper A", answer, sections, figures=figure_names(sections))


def figure_names(sections: list[Section]) -> set[str]:
    return {block.name for section in sections for block in section.blocks if isinstance(block, Picture)}


# -------------------------------------------------------------------------------------------------------------- rows


def test_every_row_is_on_the_page_and_in_the_text_with_its_verdict_and_reason(rows, results):
    answer, sections = paper_a_content(rows, results)
    html = page.render(title="Paper A", answer=answer, sections=sections, drawings={}, metrics=results)
    assert "://" not in html and html.count("<script") == 1
    words = said(rows, results)
    bodies = re.findall(r"<tr class=\"(?:good|weak|bad|odd|quiet)\">.*?</tr>\s*<tr class=\"remark\">.*?</tr>", html)
    assert len(bodies) == len(rows)
    for one, body in zip(rows, bodies, strict=True):
        assert f"<strong>{one.id}</strong>" in body and one.title.split()[0] in body
        assert one.reason.replace("-55", "−55").replace(" °C", " °C") in body.replace("\u00a0", " ")
        untested = one.reason.startswith((GIVEN, NOT_COMPUTED))
        assert ("– not tested" if untested else one.verdict.removeprefix("the paper ").split(",")[0]) in body
        assert re.search(rf"^    {re.escape(one.id)} ", words, re.MULTILINE), one.id


def test_groups_are_sections_in_the_order_of_the_rows(rows, results):
    headings = [section.heading for section in paper_a_content(rows, results)[1]]
    assert headings[:7] == [
        "At a glance",
        "Verdicts",
        "Tables",
        "Equations",
        "Procedures",
        "Figures",
        "Inconsistencies",
    ]
    assert len(set(headings)) == len(headings)


def test_numbers_keep_what_is_printed_and_show_their_interval(rows, results):
    words = said(rows, results)
    assert "84.88    86.74" in re.sub(r" {4,}", "    ", words)
    assert "104 [100, 110]" in words and "320320" in words and "−28 to 78" in words
    assert "    A-T2/-55 An extreme at −55 °C was missed." in words  # an id keeps its hyphen


def test_verdicts_are_counted_and_what_was_not_tested_is_told_apart(rows, results):
    first = paper_a_content(rows, results)[0].splitlines()[0]
    assert first == (
        "Of 22 statements of Paper A, 16 are reproduced by a test that could have failed; 1 are compatible with ours, "
        "but the test has little power; in 2 the paper contradicts itself; 3 are not reproduced, of which 2 could not "
        "be tested."
    )
    tables = [b for s in paper_a_content(rows, results)[1] for b in s.blocks if isinstance(b, Table)]
    assert tables[0].rows[-1] == ("total", "16", "1", "2", "3", "2", "22")
    tones = [tone for table in tables for tone in table.tones]
    assert tones[:6] == ["odd", "odd", "quiet", "bad", "weak", "good"]


def test_a_row_says_what_would_have_passed_or_failed_and_what_was_chosen(rows, results):
    words = re.sub(r"\s+", " ", said(rows, results).replace("\u00a0", " "))
    assert "Inside. A printed value would have passed from 0.378 to 2.24. Chosen with this in view: the path" in words
    assert "~ compatible, little power; chosen in view" in words
    assert "would have passed from 320319.5 to 320320.5." in words
    assert "It holds. It would have failed if it were not so." in words


def test_figures_stand_below_the_rows_of_their_id(rows, results):
    _, sections = paper_a_content(rows, results)
    blocks = next(s for s in sections if s.heading == "Figures").blocks
    below: dict[str, list[str]] = {}
    for block in blocks:
        if isinstance(block, Table):
            last = block.remarks[-1].lead
        else:
            below.setdefault(last, []).append(block.name)
    assert below == {id: list(PICTURES[id]) for id in (f"A-F{k}" for k in range(1, 14))}


def test_every_figure_that_is_mentioned_can_be_drawn(rows, results):
    of_modules = {name for module in (of_paper, of_oven) for name in vars(module)}
    drawable = of_modules | set(RIGS) | set(figures.__all__) | FLIGHT_FIGURES
    assert figure_names(paper_a_content(rows, results)[1]) <= drawable


def test_what_the_results_lack_is_left_out(rows, results):
    def cuts(tree: dict, path: tuple = ()):
        for key, value in tree.items():
            yield (*path, key)
            if isinstance(value, dict) and len(path) < 2:
                yield from cuts(value, (*path, key))

    for path in cuts({key: results[key] for key in ("chamber", "oven", "sensitivity", "flight")}):
        if path[:2] == ("sensitivity", "path/straight") or path[0] != "sensitivity" or len(path) < 2:
            cut = copy.deepcopy(results)
            inner = cut
            for key in path[:-1]:
                inner = inner[key]
            del inner[path[-1]]
            words = said(rows, cut)
            assert "None" not in words and "nan" not in words, path
    assert "In flight" not in said(rows, {}) and said([], {}).startswith("Of 0 statements")


# ------------------------------------------------------------------------------------------------------------- words


def test_the_answer_sets_the_papers_change_beside_ours(rows, results):
    gain = paper_a_content(rows, results)[0].splitlines()[1]
    # sqrt(1.36² + 1.40²) = 1.952 to sqrt(1.09² + 1.19²) = 1.614 m/s: 17 %; 1.54 to 1.29 nmi/h: 16 %
    assert "lowers the horizontal velocity RMS by 20 % (95 % interval 14 to 24 %; Paper A: 17 %)" in gain
    assert "lowers the CEP rate (final) by 12 % (95 % interval 3 to 18 %; Paper A: 16 %)" in gain


def put(results: dict, pair: str, value: float, low: float, high: float) -> None:
    found = results["flight"]["ensemble"]["improvement"][pair]
    found["velocity_rms_horizontal"] = {"ratio": value, "interval95": [low, high]}


def test_what_it_means_has_no_order_and_advises_nothing_of_other_flights(rows, results):
    def last() -> str:
        return paper_a_content(rows, results)[0].splitlines()[-1]

    assert "Shapley" not in last()
    part = {"ratio": 0.8, "interval95": [0.7, 0.9]}
    order = {"model": part, "refinement": part}
    results["flight"]["ensemble"]["attribution"] = {
        "velocity_rms_horizontal": {
            "model_first": order, "refinement_first": order, "shapley": order, "together": part,
        }
    }  # fmt: skip
    assert "On average over both orders (Shapley)" in last()
    assert "The flight report says, over missions, whether" in last()
    assert "first put" not in last()
    put(results, "hysteresis_refined/simple", 1.1, 1.05, 1.2)
    gain = paper_a_content(rows, results)[0].splitlines()[1]
    assert "raises the horizontal velocity RMS by 10 % (95 % interval 5 to 20 %; Paper A: −17 %)" in gain


def test_ratios_become_what_is_taken_off(rows, results):
    table = next(
        b
        for s in paper_a_content(rows, results)[1]
        for b in s.blocks
        if isinstance(b, Table) and b.title.startswith("Reduction")
    )
    assert table.rows[2][1] == "25 [21, 29]"  # 1 - 0.75, of 0.7125 to 0.7875


def test_assumptions_are_told_with_the_signs_of_their_units(rows, results):
    table = next(b for b in paper_a_content(rows, results)[1][-1].blocks if isinstance(b, Table))
    told = [in_symbols(line[0]) for line in table.rows]
    assert "thermal bias 20 µg/°C (50)" in told and "constant gyro bias 0.02 °/h (0.014)" in told
    assert not re.search("deg|ug", " ".join(told))


@pytest.mark.parametrize("width", [80, 100])
def test_a_remark_stands_below_its_row_and_keeps_the_width(width):
    table = Table(
        "", ("a", "b"), [("one", "1"), ("two", "2")], remarks=[Paragraph("why " * 40, "X1"), Paragraph("short")]
    )
    lines = text.format_table(table, width).splitlines()
    assert max(map(len, lines)) <= width
    assert lines[2].startswith("one") and lines[3].startswith("    X1 why") and lines[-2:] == ["two  2", "    short"]


# ----------------------------------------------------------------------------------------------------------- figures


def columns(unit, chamber: Chamber, streams: Streams) -> dict[str, np.ndarray]:
    points = four_point(chamber.measure(unit, streams))
    names = ("temperature_c", "rate_c_per_min", "ramp_c_per_min", "elapsed_s", "scale", "bias_ug")
    return {name: getattr(points, name) for name in names}


def models(unit: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    difference, rate = unit["temperature_c"] - 22.0, unit["rate_c_per_min"]
    ones = np.ones(difference.size)
    six = np.column_stack([rate**2, difference**2, rate * difference, rate, difference, ones])
    return {
        name: design @ np.linalg.lstsq(design, unit["scale"], rcond=None)[0]
        for name, design in (("simple", six[:, 4:]), ("hysteresis", six))
    }


@pytest.fixture(scope="module")
def units() -> dict:
    streams = Streams(3).at("instrument", 0)
    chamber = Chamber(rates_c_per_min=(0.5, 0.9))
    return {name: columns(unit, chamber, streams) for name, unit in draw_printed_units(streams).items()}


@pytest.fixture(scope="module")
def drawn_for_paper(units) -> dict:
    rng = np.random.default_rng(4)
    t = np.arange(0.0, 8401.0, 30.0)
    runs = {name: 1.3 * rng.standard_normal((10, 1)) * np.sin(2 * np.pi * t / 5064.0) for name in PAIR}
    accelerometers = draw_printed_units(Streams(3).at("instrument", 0))
    loops = {
        f"{high - low} °C": magnet.loop((22.0, low, high, low))[1:] for low, high in ((-60, 70), (-30, 40), (0, 20))
    }
    table4 = {u: {n: estimate(v) for n, v in (("none", 104.0), ("simple", 13.0), ("hysteresis", 2.4))} for u in units}
    sizes = {"given": 0.5, "aligned": 2.0}
    rms = {
        case: {n: {a: size * rng.uniform(0.5, 1.5, 10) for a in AXES[:2]} for n in PAIR} for case, size in sizes.items()
    }
    counts = {str(n): estimate(1.1 + 0.1 / n) for n in range(1, 6)}
    cases = {
        name: {
            "words": case.words,
            "ratio": estimate(0.8),
            "against_base": {
                n: estimate(1.0 if name == "base" else rng.uniform(0.5, 2.0)) for n in (*PAIR, "hysteresis")
            },
        }
        for name, case in CASES.items()
    }
    return {
        "magnet_loops": of_paper.magnet_loops(loops=loops),
        "loop_opening": of_paper.loop_opening(
            openings={n: magnet.opening(unit)._asdict() for n, unit in accelerometers.items()}
        ),
        "creep_elongation": of_paper.creep_elongation(runs=[r._asdict() for r in CreepRig().first()]),
        "scale_factor_by_temperature": of_paper.scale_factor_by_temperature(units=units),
        "bias_by_temperature": of_paper.bias_by_temperature(units=units),
        "compensated_scale_factor": of_paper.compensated_scale_factor(
            units=units, fitted={name: models(unit) for name, unit in units.items()}
        ),
        "oven_velocity_error": of_oven.oven_velocity_error(time_s=t, east_mps=runs, north_mps=runs, best=2),
        "oven_position_error": of_oven.oven_position_error(
            time_s=t, longitude_arcmin=runs, latitude_arcmin=runs, best=2, case="aligned"
        ),
        "temperature_sensitivity": of_paper.temperature_sensitivity(
            ours=table4, scaled=table4, printed={u: {"none": 74.14, "simple": 12.78} for u in units}, draws=100
        ),
        "oven_runs": of_oven.oven_runs(
            rms_mps=rms, best={"given": 1, "aligned": 7}, printed_mps={n: {"east": 0.9, "north": 1.0} for n in PAIR}
        ),
        "best_of_ten": of_oven.best_of_ten(
            ratios={a: np.exp(rng.normal(-0.2, 0.5, (40, 10))) for a in AXES}, printed={"east": 0.755, "north": 0.885}
        ),
        "refinement": of_oven.refinement(
            rms_mps={"given": {"refined": counts, "free": counts}, "aligned": {"refined": {"1": estimate(3.0)}}},
            unrefined_mps={"given": estimate(1.3)},
            size=40,
        ),
        "sensitivity": of_oven.sensitivity(cases=cases),
    }


@pytest.fixture(scope="module")
def checks(repository: Path):
    """The checks that every figure of the reports undergoes."""
    of_reports = repository / "tests" / "report" / "test_style.py"
    spec = importlib.util.spec_from_file_location("checks_of_style", of_reports)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_figures_have_titles_units_and_legends(drawn_for_paper, checks):
    checks.test_titles_labels_and_legends(drawn_for_paper)


def test_no_text_of_a_figure_overlaps_or_leaves_the_sheet(drawn_for_paper, checks):
    checks.test_no_text_overlaps_or_leaves_the_sheet(drawn_for_paper)


def test_every_dot_lies_within_its_panel(drawn_for_paper):
    for name, figure in drawn_for_paper.items():
        for ax in figure.axes:
            for line in ax.lines:
                if line.get_marker() not in ("o", "s", "D"):
                    continue
                for values, (low, high) in ((line.get_xdata(), ax.get_xlim()), (line.get_ydata(), ax.get_ylim())):
                    inside = (np.asarray(values) >= min(low, high)) & (np.asarray(values) <= max(low, high))
                    assert inside.all(), name


def test_figures_are_small(drawn_for_paper):
    sizes = {name: len(style.svg(figure).encode()) for name, figure in drawn_for_paper.items()}
    assert max(sizes.values()) < LARGEST_SVG_BYTES, sizes


@pytest.mark.parametrize("name", ["creep_rig", "chamber_rig", "oven_rig"])
def test_rigs_are_boxes_with_words_that_stay_apart(name, checks):
    figure = RIGS[name]
    drawing = style.svg(figure)
    assert figure.get_suptitle() and "<svg" in drawing and len(drawing.encode()) < LARGEST_SVG_BYTES
    renderer = checks.RendererSVG(figure.bbox.width, figure.bbox.height, io.StringIO())
    boxes = [checks.extent(t, renderer) for t in (*figure.texts, *figure.axes[0].texts) if t.get_text()]
    assert len(boxes) > 5
    for k, box in enumerate(boxes):
        assert box.x0 >= 0 and box.x1 <= figure.bbox.width and box.y0 >= 0 and box.y1 <= figure.bbox.height
        assert not any(checks.overlaps(box, other) for other in boxes[:k])


def cycle(apart_ppm: float, k1: float = 3e5) -> dict[str, np.ndarray]:
    """A scale factor that falls with temperature, the falling branch higher by so many ppm of its mean."""
    temperature = np.concatenate([np.arange(70.0, -61.0, -0.5), np.arange(-60.0, 70.5, 0.5)])
    rate = np.where(np.arange(temperature.size) < temperature.size // 2, -0.5, 0.5)
    scale = k1 * (1.0 - 1e-4 * (temperature - 5.0) - 1e-6 * apart_ppm * np.sign(rate) / 2.0)
    time_s = np.cumsum(np.full(temperature.size, 60.0))
    ramp = np.full(temperature.size, 0.5)
    return dict(
        zip(
            ("temperature_c", "rate_c_per_min", "ramp_c_per_min", "elapsed_s", "scale", "bias_ug"),
            (temperature, rate, ramp, time_s, scale, -80.0 * np.sign(rate)),
            strict=True,
        )
    )


def test_branches_are_told_by_the_rate_and_their_distance_is_right():
    figure = of_paper.scale_factor_by_temperature(units={"wide": cycle(300.0), "reversed": cycle(-50.0)})
    below = figure.axes[2:]
    for ax, apart in zip(below, (300.0, -50.0), strict=True):
        x, y = ax.lines[0].get_data()
        inner = (x > -59.0) & (x < 69.0)  # at the ends a mean over a degree holds other temperatures on each branch
        assert np.allclose(y[inner], apart, rtol=1e-3)
        assert x[0] == -60.0 and x[-1] == 70.0
    figure = of_paper.bias_by_temperature(units={"one": cycle(0.0)})
    assert np.allclose(figure.axes[1].lines[0].get_ydata(), 160.0)


def test_the_unit_with_the_least_residual_is_shown_large():
    units = {"poor": cycle(0.0), "good": cycle(0.0)}
    wave = 1e-6 * np.sin(np.arange(units["good"]["scale"].size))
    fitted = {
        name: {"hysteresis": units[name]["scale"] * (1.0 + size * wave), "simple": units[name]["scale"] * 1.001}
        for name, size in (("poor", 200.0), ("good", 20.0))
    }
    figure = of_paper.compensated_scale_factor(units=units, fitted=fitted)
    large, small = figure.axes[:2]
    assert large.get_title().startswith("good\n14 ppm")  # 20 / sqrt(2)
    assert small.get_title().startswith("poor\n141 ppm")
    style.svg(figure)  # lays it out
    assert large.get_position().width > 1.5 * small.get_position().width


def test_the_best_of_ten_is_chosen_by_the_horizontal_velocity_in_every_panel():
    rng = np.random.default_rng(7)
    ratios = {a: np.exp(rng.normal(0.0, 0.3, (25, 10))) for a in AXES}
    figure = of_oven.best_of_ten(ratios=ratios)
    best = np.array([np.argmin(runs) for runs in ratios["horizontal"]])
    for ax, component in zip(figure.axes, AXES, strict=True):
        dots = [line.get_xdata()[0] for line in ax.lines if line.get_marker() == "o"]
        expected = np.median([ratios[component][k, best[k]] for k in range(25)])
        assert dots == pytest.approx([np.median(ratios[component]), expected])


def test_all_ten_runs_are_drawn_and_the_best_is_thick():
    t = np.arange(0.0, 100.0)
    runs = {name: np.outer(np.arange(1.0, 11.0), np.ones(t.size)) for name in PAIR}
    figure = of_oven.oven_velocity_error(time_s=t, east_mps=runs, north_mps=runs, best=3)
    for ax in figure.axes:
        curves = [line for line in ax.lines if line.get_xdata()[-1] == t[-1]]
        assert len(curves) == 20
        thick = [line for line in curves if line.get_linewidth() > 1.5]
        assert [line.get_ydata()[0] for line in thick] == [4.0, 4.0]


def test_the_curve_of_a_fresh_magnet_is_left_out():
    path = np.array([22.0, 0.0, -60.0, 0.0, 70.0, 0.0, -60.0])
    figure = of_paper.magnet_loops(loops={"all": (path, np.arange(7.0))})
    assert figure.axes[0].lines[0].get_xdata()[0] == -60.0 and figure.axes[0].lines[0].get_ydata()[0] == 2.0


def test_parts_of_an_opening_are_stacked_on_their_own_side_of_zero():
    columns = {"ramp_c_per_min": [0.3], "magnet_ppm": [400.0], "rate_ppm": [-90.0], "reading_ppm": [10.0]}
    figure = of_paper.loop_opening(openings={"#1": {**columns, "total_ppm": [320.0]}})
    bars = [(bar.get_y(), bar.get_y() + bar.get_height()) for bar in figure.axes[0].patches]
    assert bars == [(0.0, 400.0), (0.0, -90.0), (400.0, 410.0)]


def test_the_largest_change_comes_first_after_the_base():
    def case(value: float) -> dict:
        return {"words": f"times {value}", "ratio": estimate(0.8), "against_base": {"simple": estimate(value)}}

    figure = of_oven.sensitivity(cases={"a": case(1.2), "b": case(0.4), "base": case(1.0), "c": case(2.0)})
    labels = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert labels == ["base", "times 0.4", "times 2.0", "times 1.2"]
