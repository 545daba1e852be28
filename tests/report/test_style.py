"""Figures: decimation keeps what matters, every panel is labelled, the same bytes each time."""

from __future__ import annotations

import io

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import colors
from matplotlib.backends.backend_svg import RendererSVG
from matplotlib.transforms import Bbox

from ins_eval import figures
from ins_eval.figures import style

LARGEST_SVG_BYTES = 150_000
LARGEST_PAGE_BYTES = 5_000_000
SMALLEST_COLOUR_DISTANCE = 25.0  # in CIE Lab; about 2 is just visible side by side
SMALLEST_CONTRAST = 1.6  # of a colour on white; the lightest is used for bars only

# Viénot, Brettel & Mollon (1999): linear RGB as a person without the long- or the middle-wave cones sees it
PROTANOPIA = np.array([[0.11238, 0.88762, 0.0], [0.11238, 0.88762, 0.0], [0.00401, -0.00401, 1.0]])
DEUTERANOPIA = np.array([[0.29275, 0.70725, 0.0], [0.29275, 0.70725, 0.0], [-0.02234, 0.02234, 1.0]])
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def linear_rgb(colour: str) -> np.ndarray:
    rgb = np.array(colors.to_rgb(colour))
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def lab(linear: np.ndarray) -> np.ndarray:
    f = np.cbrt(TO_XYZ @ np.clip(linear, 0.0, 1.0) / np.array([0.9505, 1.0, 1.089]))
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("eye", [np.eye(3), PROTANOPIA, DEUTERANOPIA], ids=["normal", "protanopia", "deuteranopia"])
def test_compensations_that_share_a_line_plot_stay_apart(eye):
    names = ("simple", "simple_refined", "hysteresis", "hysteresis_refined")
    seen = [lab(eye @ linear_rgb(style.colour(name))) for name in names]
    distances = [np.linalg.norm(a - b) for k, a in enumerate(seen) for b in seen[:k]]
    assert min(distances) > SMALLEST_COLOUR_DISTANCE


def test_every_colour_shows_on_white_and_refined_is_darker_than_unrefined():
    luminance = {name: float(TO_XYZ[1] @ linear_rgb(style.colour(name))) for name in (*style.COLOUR, "mine")}
    assert min(1.05 / (value + 0.05) for value in luminance.values()) > SMALLEST_CONTRAST
    assert luminance["simple_refined"] < luminance["simple"]
    assert luminance["hysteresis_refined"] < luminance["hysteresis"]


def test_decimation_keeps_extremes_and_gaps():
    time = np.arange(100_000.0)
    values = np.sin(time / 5000.0)
    values[41_234], values[77_777] = 9.0, -9.0
    values[50_000:50_010] = np.nan
    t, v = style.decimate(time, values, limit=500)
    assert v.size < 600
    assert np.nanmax(v) == 9.0 and t[np.nanargmax(v)] == 41_234.0
    assert np.nanmin(v) == -9.0 and t[np.nanargmin(v)] == 77_777.0
    assert np.isnan(v[(t >= 50_000) & (t < 50_010)]).all() and ((t >= 50_000) & (t < 50_010)).any()
    assert (t[0], t[-1]) == (0.0, 99_999.0) and np.all(np.diff(t) > 0)


def test_a_track_that_dwarfs_the_others_is_named_and_not_drawn():
    time_s = np.linspace(0.0, 6000.0, 200)
    errors = {"none": 80.0, "simple": 1.0, "hysteresis": 0.6}
    figure = figures.ground_track(
        time_s=time_s,
        reference_m=np.column_stack([200.0 * time_s, 0.0 * time_s]),
        errors_m={name: size * np.column_stack([time_s, -time_s]) / 6.0 for name, size in errors.items()},
    )
    ground, error = figure.axes
    assert {"simple", "hysteresis", "GPS"} <= {line.get_label() for line in ground.lines}
    assert all(line.get_label() != "none" for ax in figure.axes for line in ax.lines)
    note = " ".join(" ".join(text.get_text() for text in figure.texts).split())
    assert "Not drawn, for the others would be points: none." in note
    assert (ground.get_xlabel(), error.get_xlabel()) == ("east [km]", "east [km]")
    (mark,) = [one for one in error.lines if one.get_marker() == "D" and one.get_color() == style.colour("simple")]
    assert mark.get_xydata()[0] == pytest.approx([-5063.0 / 6e3, 5063.0 / 6e3], rel=0.01)  # at a Schuler period


@pytest.mark.parametrize("words", ["none", "hysteresis, bias only", "hysteresis, blind to direction, RMS 1.23 m/s"])
def test_a_legend_is_as_wide_as_its_figure_at_most(words):
    names = [f"{words} {k}" for k in range(7)]

    @style.styled
    def draw():
        figure, ax = style.sheet(3.0, "title", "note")
        for name in names:
            ax.plot([0.0, 1.0], label=name)
        style.legend_below(figure, ax)
        return figure

    figure = draw()
    style.svg(figure)  # lays it out
    (legend,) = figure.legends
    assert legend.get_window_extent().x1 <= figure.bbox.x1


def test_decimation_leaves_a_short_series_alone():
    time = np.arange(10.0)
    t, v = style.decimate(time, time**2)
    assert np.array_equal(t, time) and np.array_equal(v, time**2)


def panels(figure):
    return [ax for ax in figure.axes if ax.get_visible()]


def test_every_figure_function_is_drawn_here(drawn):
    """So that the checks below miss none."""
    used = {"angle_error": "latitude_error", "velocity_error": "east_velocity_error"}
    assert {used.get(name, name) for name in figures.__all__} <= set(drawn)


def test_titles_labels_and_legends(drawn):
    for name, figure in drawn.items():
        assert figure.get_suptitle().strip(), name
        assert any(len(text.get_text()) > 25 for text in figure.texts), f"{name}: no note on definition or window"
        assert any(ax.get_xlabel() for ax in panels(figure)), name
        for ax in panels(figure):
            shared = (
                len(ax.get_shared_x_axes().get_siblings(ax)) > 1 or len(ax.get_shared_y_axes().get_siblings(ax)) > 1
            )
            assert ax.get_ylabel() or shared, name
            for text in (ax.get_xlabel(), ax.get_ylabel()):
                assert not text or "[" in text or text in ("compensation", "source of error"), (
                    f"{name}: {text} has no unit"
                )
        assert figure.legends, name
        entries = [text.get_text() for text in figure.legends[0].get_texts()]
        assert entries and len(entries) == len(set(entries)), name


def extent(text, renderer) -> Bbox:
    """The box of a text without the blank lines at its end, which keep room for the note below a title."""
    box = text.get_window_extent(renderer)
    lines = text.get_text().split("\n")
    share = len(text.get_text().rstrip("\n").split("\n")) / len(lines)
    return Bbox([[box.x0, box.y1 - share * box.height], [box.x1, box.y1]])


def overlaps(a, b) -> bool:
    return a.x0 < b.x1 - 0.5 and b.x0 < a.x1 - 0.5 and a.y0 < b.y1 - 0.5 and b.y0 < a.y1 - 0.5


def test_no_text_overlaps_or_leaves_the_sheet(drawn):
    for name, figure in drawn.items():
        style.svg(figure)  # lays it out
        renderer = RendererSVG(figure.bbox.width, figure.bbox.height, io.StringIO())
        sheet = figure.bbox
        texts = [*figure.texts, *figure.legends[0].get_texts()]
        for ax in panels(figure):
            texts += [ax.xaxis.label, ax.yaxis.label, ax.title, *ax.texts]
            # a tick outside the limits is not drawn
            x, y = sorted(ax.get_xlim()), sorted(ax.get_ylim())
            texts += [t.label1 for t in ax.xaxis.get_major_ticks() if x[0] <= t.get_loc() <= x[1]]
            texts += [t.label1 for t in ax.yaxis.get_major_ticks() if y[0] <= t.get_loc() <= y[1]]
        boxes = [(t.get_text(), extent(t, renderer)) for t in texts if t.get_text().strip() and t.get_visible()]
        for k, (text, box) in enumerate(boxes):
            inside = box.x0 >= -1 and box.y0 >= -1 and box.x1 <= sheet.width + 1 and box.y1 <= sheet.height + 1
            assert inside, f"{name}: {text!r} leaves the sheet"
            for other, rival in boxes[:k]:
                assert not overlaps(box, rival), f"{name}: {text!r} over {other!r}"


def test_svg_is_small_and_dateless(drawn):
    sizes = {name: len(style.svg(figure).encode()) for name, figure in drawn.items()}
    assert max(sizes.values()) < LARGEST_SVG_BYTES, sizes
    assert sum(sizes.values()) < LARGEST_PAGE_BYTES
    assert not any("dc:date" in style.svg(figure) for figure in drawn.values())


def test_same_arguments_give_the_same_bytes_whatever_the_settings_around(series):
    def draw() -> str:
        return style.svg(
            figures.position_error(
                time_s=series["time_s"], errors_m=series["radial"], bridged=series["bridged"], outages=series["outages"]
            )
        )

    first = draw()
    with mpl.rc_context({"font.size": 20.0, "axes.grid": False, "svg.fonttype": "path", "svg.hashsalt": None}):
        assert draw() == first


def test_a_compensation_has_one_colour_in_every_figure(drawn):
    for name in ("latitude_error", "position_error", "cep_over_time", "single_flight_rates"):
        lines = {line.get_label(): line.get_color() for line in panels(drawn[name])[0].lines}
        assert lines["simple"] == style.COLOUR["simple"], name
        assert lines["hysteresis, refined"] == style.COLOUR["hysteresis_refined"], name


def test_bridged_epochs_are_dotted_and_not_in_the_solid_line(series):
    figure = figures.velocity_error(
        time_s=series["time_s"],
        errors_mps={"simple": series["east"]["simple"]},
        component="east",
        bridged=series["bridged"],
        outages=series["outages"],
    )
    solid, dotted = [line for line in figure.axes[0].lines if line.get_color() == style.COLOUR["simple"]]
    start, end = series["outages"][0]
    within = (solid.get_xdata() > start) & (solid.get_xdata() < end)
    assert np.isnan(solid.get_ydata()[within]).all()
    within = (dotted.get_xdata() > start) & (dotted.get_xdata() < end)
    assert np.isfinite(dotted.get_ydata()[within]).all() and within.any()
    assert dotted.get_linestyle() != solid.get_linestyle()


def test_optional_parts_of_figures_may_be_missing(series):
    t = series["time_s"]
    one = {"mine": series["radial"]["simple"]}
    drawn = [
        figures.temperature_and_rate(
            time_s=t, temperature_c=None, reading_c=series["reading_c"], rate_c_per_min=series["rate_c_per_min"]
        ),
        figures.position_error(time_s=t, errors_m=one),
        figures.angle_error(time_s=t, errors_arcmin=one, component="latitude"),
        figures.velocity_error(time_s=t, errors_mps=one, component="down", reference="standstill"),
        figures.cep_over_time(time_s=t, cep_m=one, band_m={}, size=3),
        figures.error_budget(budget={"size": 3, "gyro": {"simple": {"cep_rate_final": {"value": 0.7}}}}),
        figures.velocity_rms_by_compensation(rms_mps={"mine": {"east": {"value": 1.0}}}),
        figures.single_flight_rates(rates_nmi_per_h={"final": {"mine": np.array([0.3, 0.5])}}),
        figures.improvement_per_instrument(ratios={"a/b": {"velocity_rms_horizontal": np.array([0.5, 1.5])}}),
        figures.flight_path(
            time_s=t,
            latitude_deg=series["latitude_deg"],
            longitude_deg=series["longitude_deg"],
            height_m=series["height_m"],
        ),
    ]
    assert all("<svg" in style.svg(figure) for figure in drawn)


@pytest.mark.parametrize(("largest_m", "unit"), [(500.0, "m"), (2000.0, "nmi")])
def test_small_position_errors_are_in_metres(largest_m, unit):
    time_s = np.linspace(0.0, 6000.0, 100)
    error = largest_m * time_s / time_s[-1]
    errors = {"none": 100.0 * error, "simple": error, "hysteresis": 0.5 * error}
    figure = figures.position_error(time_s=time_s, errors_m=errors)
    lines = {line.get_label(): line for line in figure.axes[0].lines}
    assert figure.axes[0].get_ylabel() == f"radial error [{unit}]"
    assert {"none (goes beyond)", "simple", "0.8 nmi/h", "1 nmi/h", "Schuler period, 84.4 min"} <= set(lines)
    metres = {"m": 1.0, "nmi": 1852.0}[unit]
    assert metres * lines["simple"].get_ydata()[-1] == pytest.approx(largest_m)
    assert metres * lines["1 nmi/h"].get_ydata()[-1] == pytest.approx(1852.0 * 6000.0 / 3600.0)
    figure = figures.angle_error(
        time_s=time_s, errors_arcmin={"simple": error / 1500.0}, component="longitude", metres_per_arcmin=1500.0
    )
    (line, *_), on_right = figure.axes[0].lines, len(figure.axes[0].child_axes)
    assert (figure.axes[0].get_ylabel(), on_right) == (
        ("longitude error [m]", 0) if unit == "m" else ("longitude error [arc-minute]", 1)
    )
    assert line.get_ydata()[-1] * (1.0 if unit == "m" else 1500.0) == pytest.approx(largest_m)


def test_an_axis_of_many_decades_has_numbers_at_its_decades():
    time_s = np.linspace(0.0, 100.0, 50)
    wide = 10.0 ** np.linspace(-5.0, 0.0, 50)
    figure = figures.activity(
        time_s=time_s, force_mps2=wide, rate_deg_per_s=0.1 + 0.001 * time_s, stretch_s=(-9.0, 0.0)
    )
    assert "−9 to 0\u00a0s" in " ".join(text.get_text() for text in figure.texts)
    shown = [tick for tick in figure.axes[0].get_yticks() if 1e-5 <= tick <= 1.0]
    assert shown == pytest.approx([1e-4, 1e-2, 1.0])


@pytest.mark.parametrize(
    ("sizes", "cut"),
    [
        ({"believed": 100.0, "none": 1.0}, set()),  # the main curve sets the scale
        ({"believed": 1.0, "none": 5.0}, {"none"}),
        ({"believed": 1.0, "simple": 3.0, "none": 50.0}, {"none"}),
        ({"none": 1.0, "simple": 10.0}, set()),
        ({"none": 1.0, "simple": 10.0, "hysteresis": 1.0}, {"simple"}),
        ({"none": 9.0}, set()),
    ],
)
def test_an_axis_is_scaled_by_the_main_curves_and_cuts_what_dwarfs_them(sizes, cut):
    time_s = np.linspace(0.0, 100.0, 50)
    figure = figures.velocity_error(
        time_s=time_s,
        errors_mps={name: size * np.sin(time_s) / np.abs(np.sin(time_s)).max() for name, size in sizes.items()},
        component="north",
    )
    shown = {line.get_label() for line in figure.axes[0].lines}
    assert {name for name in sizes if f"{name} (goes beyond)" in shown} == cut
    kept = max(size for name, size in sizes.items() if name not in cut)
    assert kept < figure.axes[0].get_ylim()[1] < 2.0 * kept


def test_curves_that_coincide_are_drawn_once_and_named_together():
    time_s = np.linspace(0.0, 100.0, 50)
    errors = {"believed": time_s, "simple": time_s.copy(), "none": 2.0 * time_s}
    figure = figures.velocity_error(time_s=time_s, errors_mps=errors, component="north")
    assert [line.get_label() for line in figure.axes[0].lines][:2] == ["believed (same as simple)", "none"]


def test_of_many_compensations_few_have_bands():
    after_s, names = np.arange(1.0, 31.0), ["believed", *style.COLOUR]
    position = {name: (2.0 + k) * after_s for k, name in enumerate(names)}
    band = {name: np.vstack([0.9 * one, 1.1 * one]) for name, one in position.items()}
    figure = figures.error_growth(after_s=after_s, position_m=position, band_m=band, count=20)
    ax = figure.axes[0]
    assert len(ax.lines) == len(names) and len(ax.collections) == 3
    note = " ".join(text.get_text() for text in figure.texts)
    assert "interval of the thick curves; the others are drawn thin." in note.replace("\n", " ")
    thick = [line.get_label() for line in ax.lines if line.get_linewidth() > 1.0]
    assert thick == ["believed", "none", "hysteresis, piecewise scale factor"]
