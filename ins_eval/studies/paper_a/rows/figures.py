"""Rows of the figures: no curve can be read off the paper, so captions and what the text says of them are judged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ins_eval.calibration.labelings import FIGURE_4, TURNED
from ins_eval.studies.paper_a.audit import chamber, epoxy
from ins_eval.studies.paper_a.audit import scale_factor as audit
from ins_eval.studies.paper_a.printed import PRINTED, UNITS
from ins_eval.studies.papers import CONTRADICTS, Row, as_printed, between, claimed, given, number, row
from ins_eval.tables import pick

HALF = 50.0  # per cent of the variance: what a relation that is not explicit has to leave open


def figure_rows(results: Mapping, ours: Mapping) -> Iterator[Row]:
    """All of them."""
    kelvin, saturated = PRINTED["magnet"]["figure1_k"], PRINTED["magnet"]["saturated_below_k"]
    yield given(
        "A-F1",
        "Loops of a magnet",
        f"another material, between {kelvin[0]:g} and {kelvin[1]:g} K and saturated below {saturated:g} K, against "
        "the field. Only the kind, a loop that does not depend on the rate, is simulated.",
    )
    yield row(
        "A-F3",
        "Temperature and elongation of three blocks",
        CONTRADICTS,
        f"{epoxy.caption_differences()} of the three temperatures in the caption are not those of text and tables.",
        printed=as_printed(PRINTED["creep"]["figure3_caption_c"]),
        recomputed=as_printed(PRINTED["creep"]["temperature_c"]),
        unit="°C",
    )
    label = chamber.labelled(FIGURE_4, 1.0, 0.0)
    yield row(
        "A-F4",
        "Index head: specific force at 0°, 90°, 180°, 270°",
        CONTRADICTS,
        f"With the forces of the caption eq. (3) gives {number(label.eq3_scale)} K1 and eq. (13) "
        f"{number(label.eq13_scale)} (A7).",
        printed=as_printed(FIGURE_4),
        recomputed=as_printed(TURNED),
        unit="g",
    )
    yield from _curves(results, ours)
    yield from _navigation(results, ours)


def _curves(results: Mapping, ours: Mapping) -> Iterator[Row]:
    scale, bias = pick(ours, "scale"), pick(ours, "bias")
    for letter, unit in zip("abc", UNITS, strict=True):
        loop = audit.falling_minus_rising_ppm(unit)
        yield row(
            f"A-F5/{letter}",
            f"Scale factor of {unit}: upper curve while falling",
            CONTRADICTS,
            f"By the printed coefficients falling minus rising is {number(loop)} ppm at 0.3 °C/min and T0, so the "
            "falling curve is the lower one."
            + (
                f" Ours turns the sign of both odd rate terms: {between(scale['falling_minus_rising_ppm'])} ppm, "
                "magnet included."
                if scale
                else ""
            ),
            printed="falling above",
            recomputed=loop,
            ours=scale["falling_minus_rising_ppm"] if scale else None,
            unit="ppm",
        )
    best = min(UNITS, key=lambda unit: PRINTED[unit]["table4"]["hysteresis"])
    residual = pick(results, "chamber", "residual_rms_ppm", best, "hysteresis")
    implied = audit.residual_peak_to_peak_ppm(best)
    yield given(
        "A-F6",
        "Compensated scale factor over time, one of the best",
        f"the curve is not printed in numbers. Table 4 implies {number(implied)} ppm from peak to peak for {best}."
        + (f" Ours has a residual of {between(residual)} ppm RMS." if residual else ""),
        recomputed=implied,
        ours=residual,
        unit="ppm",
    )
    for letter, unit in zip("abc", UNITS, strict=True):
        yield claimed(
            f"A-F7/{letter}",
            f"Bias of {unit} against temperature: no explicit relation",
            bias and bias["open_by_curve_percent"],
            bias
            and f"In our units one curve for both directions leaves {between(bias['open_by_curve_percent'])} % of the "
            "variance of K0 open (central 95 % of units); the thermal slope, taken from Table 1, dominates.",
            above=HALF,
            what="the open variance",
            unit="%",
        )


def _navigation(results: Mapping, ours: Mapping) -> Iterator[Row]:
    position = pick(ours, "oven_position")
    for letter, axis in (("a", "east"), ("b", "north")):
        gain = pick(results, "oven", "best_of_ten", "given", axis)
        yield claimed(
            f"A-F9/{letter}",
            f"Oven, one of the best of ten: {axis} velocity error shrinks",
            gain,
            gain
            and f"In the best of ten runs the {axis} velocity RMS shrinks by {between(gain)} % (median and central "
            "95 % of our instruments, true attitude given).",
            above=0.0,
            what="the reduction",
            unit="%",
        )
    for letter, axis, place in (("a", "east", "longitude"), ("b", "north", "latitude")):
        best = pick(position, f"best_{axis}")
        yield claimed(
            f"A-F10/{letter}",
            f"Oven, one of the best of ten: {place} error shrinks",
            best,
            best
            and f"Of {position['size']:.0f} instruments, true attitude given, its RMS shrinks by {between(best)} % in "
            "the best of ten runs, chosen by velocity (median and central 95 %), and by "
            f"{between(position[f'median_{axis}'])} % in the median run; it shrinks in "
            f"{100.0 * position[f'improved_{axis}']:.0f} % of all runs.",
            above=0.0,
            what="the reduction",
            unit="%",
        )
    yield given("A-F11/a", "Flight path", "no path is printed in numbers; ours goes out and back and is assumed.")
    hot, coldest = pick(ours, "thermal"), PRINTED["flight"]["coldest_c"]
    yield given(
        "A-F11/b",
        "Temperature of the IMU over the flight",
        f"{coldest:g} °C at the end of the cruise is put in; the rest of the curve follows from a heat balance.",
        printed=coldest,
        ours=hot["cruise_end_c"] if hot else None,
        unit="°C",
    )
    gps = pick(results, "flight", "gps")
    for letter, axis in (("a", "east"), ("b", "north")):
        yield given(
            f"A-F12/{letter}",
            f"Flight: {axis} velocity error, with vertices where GPS is lost",
            "where GPS is lost follows from the bank of our turns, which is assumed; how far the error shrinks is "
            "judged in A-T7."
            + (
                f" {gps['outages']:.0f} outages make as many vertices where the reference is joined across them by a "
                "line."
                if gps
                else ""
            ),
            ours=gps["outages"] if gps else None,
        )
    for letter, what in (("a", "latitude"), ("b", "longitude"), ("c", "position")):
        ratio = pick(results, "flight", "position_ratio", what)
        single = pick(results, "flight", "position_improved", what)
        yield claimed(
            f"A-F13/{letter}",
            f"Flight: {what} error shrinks" + (" (the caption has (b) twice)" if letter == "c" else ""),
            ratio,
            ratio
            and f"RMS of the {what} error over the flight, refined hysteresis over simple: {between(ratio)} over our "
            f"instruments (95 % interval). The figure shows one flight; of ours it shrinks in {100.0 * single:.0f} %.",
            below=1.0,
            what="the ratio",
        )
