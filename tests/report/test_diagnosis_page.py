"""The words and figures of a diagnosis; the numbers here are made up."""

from __future__ import annotations

import re

import numpy as np
import pytest

from ins_eval.effects import VOCABULARY
from ins_eval.figures import diagnosis as drawn
from ins_eval.figures import style
from ins_eval.report import text
from ins_eval.report.content import Paragraph, Table
from ins_eval.report.diagnosis import diagnosis_content
from ins_eval.report.diagnosis_glance import odds
from ins_eval.report.diagnosis_sections import sections_of
from ins_eval.report.diagnosis_words import effect_words, nats, probability
from ins_eval.vocabulary import CHANNELS_MEASURED
from ins_eval.wording import MISSING, alike, in_symbols, significant

LARGEST_SVG_BYTES = 200_000
WHITE = {"rms": 1.0, "correlation": 0.01, "rms_of_means": 1.4}


def creep() -> dict:
    return {
        "name": "accelerometer.bias_creep",
        "axis": "z",
        "parameters": {
            "value": 4.8,
            "interval95": [4.5, 5.1],
            "unit": "ug/degC",
            "time_constant_s": 2400.0,
            "time_constant_s_interval95": [1900.0, 3000.0],
        },
        "probability": 0.97,
        "log_evidence_gain": 41.2,
        "false_alarm_probability": 0.0004,
    }


def drift(**further) -> dict:
    rival = {
        "from": "accelerometer.bias_creep",
        "name": "accelerometer.bias_drift",
        "axis": "z",
        "probability": 0.02,
        "log_evidence_below_best": 2.1,
        "told_apart_by_prior_only": False,
        "experiment": "an oven run with the flight's temperatures",
        "expected_log_bayes_factor": 21.0,
    }
    return {**rival, **further}


def recording(name: str = "climb, cruise, landing", after: bool = True) -> dict:
    noise = {"velocity_random_walk_ug_per_sqrt_hz": 4.2, "accelerometer_wander_ug": 68.0}
    return {
        "name": name,
        "kind": "flight",
        "channels": list(CHANNELS_MEASURED),
        "measured_by": ["gps"],
        "measurements": 46500,
        "outliers": 24,
        "jumps_s": [],
        "turned_on": [
            {
                "name": "heading",
                "unit": "deg",
                "believed": 90.0,
                "believed_sigma": 0.1,
                "found": 90.21,
                "found_sigma": 0.02,
            },
        ],
        "noise": noise,
        "noise_of_answer": {**noise, "accelerometer_wander_ug": 3.5} if after else None,
        "whiteness": [WHITE] * 6 + [None] * 3,
        "whiteness_after": [{**WHITE, "rms_of_means": 1.0}] * 6 + [None] * 3 if after else None,
    }


def limit(name: str, axis: str, gain: float, other_axis: str | None = None) -> dict:
    return {
        "name": name, "axis": axis, "other_axis": other_axis, "unit": VOCABULARY[name].unit,
        "usual": VOCABULARY[name].nominal, "expected_log_bayes_factor": gain, "shows_from": 93.0,
    }  # fmt: skip


def tree(verdict: str) -> dict:
    """A diagnosis of one flight with this verdict."""
    effects = [creep()] if verdict in ("explained", "not identifiable", "partly explained") else []
    left = verdict in ("partly explained", "unexplained")
    fit = {
        "velocity_rms_mps": {"before": {"north": 1.40, "east": 1.36}},
        "radial_error_rate_nmi_per_h": {"before": 1.54},
    }
    if effects:
        fit["velocity_rms_mps"]["after"] = {"north": 1.19, "east": 1.09}
        fit["radial_error_rate_nmi_per_h"]["after"] = 1.29
        fit["held_out"] = {"before": 14.2, "after": 1.03, "placebo": 13.8, "measure": "mean squared innovation"}
    located = {"recording": 0, "channel": "accelerometer.z", "axis": "z"}
    shown = [
        {**located, "effect": "accelerometer bias creep, z", "share": 0.96, "figure": "effect_against_drive"}
        for _ in effects
    ]
    if left:
        shown.append({**located, "channel": "gyro.x", "effect": None, "share": None, "figure": "unexplained"})
    return {
        "diagnosis": {
            "format": "ins-diagnosis/1",
            "verdict": verdict,
            "mismatch": []
            if verdict == "no mismatch"
            else [
                {
                    "recording": "climb, cruise, landing",
                    "channel": "accelerometer.z",
                    "interval_s": [5400.0, 7900.0],
                    "where": "descent, dT/dt > 0",
                    "significance_sigma": 9.1,
                }
            ],
            "effects": effects,
            "indistinguishable": [drift()] if verdict == "not identifiable" else [],
            "unexplained": {
                "significance_sigma": 6.2 if left else 1.1,
                "channel": "gyro.x" if left else None,
                "interval_s": [100.0, 900.0] if left else None,
            },
            "fit": fit,
        },
        "recordings": [recording(after=bool(effects))],
        "statistics": {
            "largest_log_bayes_factor": 1.2,
            "largest_effect": "accelerometer.bias_drift z",
            "cost_of_an_effect": 5.3,
            "smallest_probability": 0.18,
        },
        "evidence": {
            "in_place_of": "accelerometer bias creep, z" if effects else None,
            "threshold": 5.3,
            "families": [
                {**creep(), "log_bayes_factor": 41.2, "named": bool(effects)},
                {"name": "accelerometer.bias_drift", "axis": "z", "log_bayes_factor": 36.1, "named": False},
            ],
        },
        "gain": {"nats": 312.4, "placebo_nats": -2.0, "excess_removed": 0.97} if effects else None,
        "located": shown,
        "written": [],
        "limits": [
            limit("accelerometer.quadratic", "x", 0.1),
            limit("accelerometer.quadratic", "y", 0.2),
            limit("accelerometer.misalignment", "x", 0.3, "y"),
            limit("accelerometer.misalignment", "x", 0.3, "z"),
            limit("accelerometer.bias_temperature", "z", 300.0),
        ],
        "absent": [name for name in VOCABULARY if name.startswith("reference.")],
    }


VERDICTS = ("no mismatch", "explained", "not identifiable", "partly explained", "unexplained")


@pytest.mark.parametrize("verdict", VERDICTS)
def test_the_first_line_states_the_verdict(verdict: str) -> None:
    said, _ = diagnosis_content(tree(verdict))
    first = said.splitlines()[0]
    assert first.startswith(f"climb, cruise, landing: {verdict}")
    named = verdict in ("explained", "not identifiable", "partly explained")
    assert ("accelerometer bias creep, z: 4.8 ug/degC [4.5, 5.1], time constant 2400 s [1900, 3000]" in first) == named


def test_the_lines_below_say_where_how_sure_and_what_it_gains() -> None:
    said, _ = diagnosis_content(tree("explained"))
    for words in (
        "Probability 0.97; noise alone reaches it in 0.040 % of recordings",
        VOCABULARY["accelerometer.bias_creep"].physics,
        "Accelerometer z, 5400 to 7900 s; descent, dT/dt > 0: 9.1 σ",
        "the next, accelerometer bias drift, z, lies 5.1 nats below",
        "velocity RMS of this pure-inertial navigation north 1.40 to 1.19 m/s and east 1.36 to 1.09 m/s; "
        "radial error rate 1.54 to 1.29 nmi/h",
        "data that were not used are 312.4 nats more probable (odds of more than 10¹⁰⁰ to 1; placebo, as many "
        "coefficients half a recording late: −2.0)",
        "97 % of the excess of the residual over its noise is gone",
        "Nothing significant stays unexplained (1.1 σ)",
    ):
        assert words in said


@pytest.mark.parametrize(
    ("verdict", "values", "step"),
    [
        ("no mismatch", ["1.2 nats", "0.18", "1.95 m/s"], "Nothing has to be changed."),
        ("explained", ["4.8 ug/degC", "312.4 nats", "1.61 m/s"], "--belief better.toml"),
        ("not identifiable", ["4.8 ug/degC", "312.4 nats", "1.61 m/s"], "an oven run with the flight's temperatures"),
        ("partly explained", ["4.8 ug/degC", "312.4 nats", "1.61 m/s"], "Look at gyro x from 100 to 900 s"),
        ("unexplained", ["9.1 σ", "1.95 m/s", "1.54 nmi/h"], "Look at gyro x from 100 to 900 s"),
    ],
)
def test_the_first_screen_has_three_numbers_and_what_to_do_next(verdict: str, values: list[str], step: str) -> None:
    numbers, next_step, picture = diagnosis_content(tree(verdict))[1][0].blocks
    assert [one.value for one in numbers.items] == values
    assert all(one.interval for one in numbers.items)
    assert step in next_step.text
    assert picture.name in ("before_and_after", "whitened_residuals", "evidence_of_effects")


def test_odds_are_spoken_until_they_are_powers_of_ten() -> None:
    assert [odds(x) for x in (0.0, 3.0, 150.0, 312.4)] == ["1.0 to 1", "20 to 1", "10⁶⁵ to 1", "more than 10¹⁰⁰ to 1"]


SIZE = {"value": 12.0, "interval95": [10.0, 14.0], "unit": "ug/h"}


def test_a_rival_comes_with_the_experiment_that_would_tell() -> None:
    told = tree("not identifiable")
    said, sections = diagnosis_content(told)
    assert (
        "It could also be accelerometer bias drift, z (2.1 nats below the best): an oven run with the flight's "
        "temperatures would separate them (expected log Bayes factor 21.0)." in said
    )
    assert "Nothing else" not in said
    told["diagnosis"]["indistinguishable"][0]["log_evidence_below_best"] = -0.42
    assert "(0.4 nats above the best)" in diagnosis_content(told)[0]
    of_noise = {"from": None, "experiment": None, "parameters": SIZE}
    told["diagnosis"]["indistinguishable"] = [drift(**of_noise), drift(**of_noise, axis="x")]
    said, sections = diagnosis_content(told)
    assert (
        "What is noise of the sensors here may be effects, if they have other noise (accelerometer bias drift, z: 12 "
        "ug/h [10, 14]; accelerometer bias drift, x: 12 ug/h [10, 14]): 2.1 nats below the best. In another recording "
        "an effect would come back, noise would not." in said
    )
    rivals = blocks(sections, "What else it could be", Table)[0]
    assert [row[1:3] for row in rivals.rows] == [("12 ug/h [10, 14]", "noise")] * 2
    told["diagnosis"]["indistinguishable"] = [
        drift(experiment=None, expected_log_bayes_factor=None, told_apart_by_prior_only=True)
    ]
    said, sections = diagnosis_content(told)
    assert "what was expected before the recording): no experiment of the catalogue would separate them" in said
    rivals = blocks(sections, "What else it could be", Table)[0]
    assert rivals.rows[0][1] == "–" and rivals.rows[0][5:] == ("yes", "–", "–")  # of what is not known


@pytest.mark.parametrize(
    ("below", "words"), [(0.5, "0.5 nats less probable"), (-0.4, "0.4 nats more probable"), (3.1, "")]
)
def test_a_disturbance_without_a_name_that_is_near_is_said(below: float, words: str) -> None:
    told = tree("not identifiable")
    told["statistics"] |= {"unnamed_channel": "gyro.z", "unnamed_below_names": below}
    said, _ = diagnosis_content(told)
    assert ("A slow disturbance of gyro z that follows nothing known" in said) == bool(words)
    assert words in said


def test_what_is_left_is_named_as_the_next_place_to_look() -> None:
    said, sections = diagnosis_content(tree("partly explained"))
    assert "Still unexplained: gyro x, 100 to 900 s, 6.2 σ; look there next." in said
    words = " ".join(one.text for one in blocks(sections, "What stays unexplained", Paragraph))
    assert words.startswith("Beside the effects, gyro x is disturbed from 100 to 900 s")
    assert "Error of gyro x estimated in each window beside the effects" in words


def test_what_is_not_named_is_said_once_with_its_reason() -> None:
    told = tree("partly explained")
    one = {**creep(), "reason": "No rival lies above the effect in whose place it could stand"}
    told["diagnosis"]["withdrawn"] = [one, one, {**one, "reason": "An effect accounts for a part of what was seen"}]
    said, _ = diagnosis_content(told)
    assert said.count("Not named: ") == 2


def test_no_mismatch_says_how_near_the_nearest_came() -> None:
    said, sections = diagnosis_content(tree("no mismatch"))
    assert "1.2 nats, where 5.3 are needed; the most remarkable interval has a probability of 0.18" in said
    headings = [one.heading for one in sections]
    assert "What was left out" not in headings and "Where" not in headings
    assert blocks(sections, "Navigation before and after", Table)[0].header == ("measure", "before")


def test_several_effects_and_recordings_each_have_their_line() -> None:
    told = tree("explained")
    told["recordings"].append(recording("second"))
    second = {**creep(), "axis": "x", "probability": 0.9999, "false_alarm_probability": 1e-30}
    told["diagnosis"]["effects"].append(second)
    said, _ = diagnosis_content(told)
    both = "accelerometer bias creep, z; accelerometer bias creep, x"
    assert said.startswith(f"climb, cruise, landing and second: explained by 2 effects ({both}).")
    assert "Accelerometer bias creep, x: 4.8 ug/degC" in said
    assert "probability above 0.999; noise alone reaches it in fewer than one recording in a million" in said
    assert "Accelerometer z of climb, cruise, landing, 5400" in said
    assert "Nothing significant stays unexplained" in said
    told["diagnosis"]["effects"] += [second] * 3
    assert f"explained by 5 effects ({both}; accelerometer bias creep, x; 2 more)." in diagnosis_content(told)[0]


def test_what_cannot_be_shown_is_listed_once_for_each_name() -> None:
    _, sections = diagnosis_content(tree("explained"))
    table, needed = blocks(sections, "What this recording cannot show", Table)
    assert [(row[0], row[1]) for row in table.rows] == [
        ("accelerometer misalignment", "x with y/z"),
        ("accelerometer quadratic", "x, y"),
    ]
    assert {row[0] for row in needed.rows} == {
        VOCABULARY[f"accelerometer.{name}"].excited_by for name in ("misalignment", "quadratic")
    }
    words = blocks(sections, "What this recording cannot show", Paragraph)[0].text
    assert words.endswith("every effect of reference.")


@pytest.mark.parametrize("verdict", VERDICTS)
def test_the_text_holds_every_cell_of_the_page(verdict: str) -> None:
    said, sections = diagnosis_content(tree(verdict))
    words = text.render("Diagnosis", said, sections, width=2000)
    for section in sections:
        assert section.heading in words
        for one in section.blocks:
            if isinstance(one, Table):
                assert all(in_symbols(cell) in words for row in one.rows for cell in row)
            if isinstance(one, Paragraph):
                assert in_symbols(one.text) in words
    assert not re.search(r"\bNone\b|\bnan\b|_", words.replace("figures/", ""))


def test_words_for_effects_amounts_and_numbers() -> None:
    assert effect_words({"name": "earth.rotation", "axis": None}) == "earth rotation"
    assert effect_words({"name": "gps.lever_arm", "axis": "x"}) == "GPS lever arm, x"
    assert effect_words({"name": "gyro.misalignment", "axis": "x", "parameters": {"other_axis": "y"}}).endswith(
        "x with y"
    )
    composed = {"name": "composed", "axis": "z", "form": "accelerometer bias = value * change(supply_v)"}
    assert effect_words(composed) == "accelerometer bias = value * change(supply_v), z"
    assert alike(-23.7838, [-24.2, -23.4]) == ("−23.8", "−24.2", "−23.4")
    assert alike(0.05123, [0.045, 0.057]) == ("0.051", "0.045", "0.057")
    assert alike(-29341.0, [-41072.0, -17610.0]) == ("−29000", "−41000", "−18000")


def test_a_rival_whose_interval_is_not_known_has_its_size_alone() -> None:
    """As three constant biases in the place of the rotation of the Earth."""
    told = tree("not identifiable")
    size = {key: value for key, value in SIZE.items() if key != "interval95"}
    told["diagnosis"]["indistinguishable"] = [drift(parameters=size)]
    _, sections = diagnosis_content(told)
    assert blocks(sections, "What else it could be", Table)[0].rows[0][1] == "12.0 ug/h"


def test_a_probability_is_never_0_or_1() -> None:
    assert [probability(x) for x in (0.0, 0.004, 0.04, 0.5, 0.995, 1.0)] == [
        "below 0.001", "0.004", "0.04", "0.50", "0.995", "above 0.999"
    ]  # fmt: skip
    assert (significant(3919.8), significant(1.0302), significant(0.00042, 2)) == ("3920", "1.03", "0.00042")


def test_the_belief_that_was_written_is_told() -> None:
    told = tree("explained")
    assert not [one for one in sections_of(told) if one.heading == "The belief that was written"]
    told["written"] = [
        {"name": "accelerometer.bias_creep", "axis": "z", "value": 4.812, "unit": "ug/degC", "time_constant_s": 2400.0},
        {"name": "accelerometer.bias", "axis": "z", "value": 37.42, "unit": "ug", "sigma": 21.04},
    ]
    (table,) = blocks(sections_of(told), "The belief that was written", Table)
    assert table.rows == [
        ("accelerometer bias creep, z", "4.81", MISSING, "ug/degC", "time constant 2400 s"),
        ("accelerometer bias, z", "37.4", "21.0", "ug", MISSING),
    ]


def test_evidence_has_a_bar_for_each_effect_and_the_line_it_must_pass() -> None:
    figure = drawn.evidence_of_effects(
        names=["bias creep", "bias drift", "bias"], log_bayes_factors=[41.2, 36.1, -0.4], named=[True, False, False],
        threshold=5.3,
    )  # fmt: skip
    ax = figure.axes[0]
    widths = sorted(bar.get_width() for container in ax.containers for bar in container)
    assert widths == [-0.4, 36.1, 41.2]
    assert [line.get_xdata()[0] for line in ax.lines] == [5.3]
    assert [one.get_text() for one in ax.get_yticklabels()] == ["bias creep", "bias drift", "bias"]
    check(figure, "nats")
    small = drawn.evidence_of_effects(names=["bias"], log_bayes_factors=[-0.01], named=[False], threshold=5.3)
    assert [one.get_text() for one in small.axes[0].texts] == ["0.0"]


@pytest.mark.parametrize("explained", [True, False])
def test_effect_against_drive_draws_the_effect_where_there_is_one(explained: bool) -> None:
    time_s = np.arange(64.0) * 120.0
    drive = np.sin(time_s / 2000.0)
    effect = 4.8 * drive if explained else np.full(64, np.nan)
    figure = drawn.effect_against_drive(
        time_s=time_s, mean=4.8 * drive + 0.1, sigma=np.full(64, 0.3), effect=effect,
        drive=("drive [degC^2]", drive), quantity="accelerometer z [ug]",
    )  # fmt: skip
    assert len(figure.axes) == 2
    assert figure.axes[0].get_ylabel() == "accelerometer z [µg]"
    assert figure.axes[1].get_xlabel() == "drive [°C²]"
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert ("the effect" in labels) == explained
    alone = drawn.effect_against_drive(
        time_s=time_s, mean=drive, sigma=drive**2, effect=effect, drive=None, quantity="c [ug]"
    )
    assert len(alone.axes) == 1
    check(figure, "time in the recording [s]")


def test_before_and_after_shows_the_channels_that_change() -> None:
    rng = np.random.default_rng(3)
    after = rng.standard_normal((3600, 9))
    after[:, 6:] = np.nan
    before = after.copy()
    before[:, 5] += 1.0
    figure = drawn.before_and_after(time_s=np.arange(3600.0), before=before, after=after, block_s=60.0)
    assert [ax.get_ylabel() for ax in figure.axes] == ["velocity down"]
    check(figure, "before")


def blocks(sections: list, heading: str, kind: type) -> list:
    section = next(one for one in sections if one.heading == heading)
    return [one for one in section.blocks if isinstance(one, kind)]


def check(figure, words: str) -> None:
    drawing = style.svg(figure)
    assert words in drawing
    assert len(drawing) < LARGEST_SVG_BYTES


def test_an_effect_that_explains_no_part_of_its_channel_is_not_shown_as_an_explanation() -> None:
    shown = tree("explained")
    shown["located"][0]["share"] = 0.0
    words = text.render("t", "", diagnosis_content(shown)[1])
    assert "does not follow accelerometer bias creep, z" in " ".join(words.split())
    assert "0 % of" not in words


def test_a_wrong_sign_is_said_and_has_no_interval() -> None:
    told = tree("explained")
    turned = {
        **creep(),
        "name": "recording.axis_sign",
        "parameters": {"value": -1.0, "interval95": [-1.0, -1.0], "unit": "factor", "sensor": "gyro"},
    }
    told["diagnosis"]["effects"] = [turned]
    said, sections = diagnosis_content(told)
    assert "explained by recording axis sign, gyro z: sign turned." in said
    (first, *_) = sections[0].blocks[0].items
    assert first == ("recording axis sign, gyro z", "sign turned", "probability 0.97")
    assert blocks(sections, "What was left out", Table)[0].rows[0][1:5] == ("sign turned", *[MISSING] * 3)


def test_sigmas_and_temperatures_are_written_as_they_are_read() -> None:
    told = tree("unexplained")
    (one,) = told["diagnosis"]["mismatch"]
    one |= {"significance_sigma": 419556.3, "where": "level, dT/dt < 0, -11.3 to -2.2 degC"}
    said, sections = diagnosis_content(told)
    assert "dT/dt < 0, −11.3 to −2.2 degC: more than 1000 σ" in said
    assert blocks(sections, "Where", Table)[0].rows[0][4:] == ("level, dT/dt < 0, −11.3 to −2.2 degC", "more than 1000")


def test_a_single_further_rival_is_named() -> None:
    told = tree("not identifiable")
    told["diagnosis"]["indistinguishable"] = [drift(axis=axis) for axis in ("z", "x", "y", "z")]
    assert "Nor can accelerometer bias drift, z be excluded; it is listed below." in diagnosis_content(told)[0]


def test_nats_have_no_more_digits_than_mean_anything() -> None:
    assert [nats(x) for x in (None, 2.14, 975.3, 54290.0, 8.8e10, -2e6)] == [
        MISSING, "2.1", "975.3", "54300", "more than 10⁶", "less than −10⁶"
    ]  # fmt: skip
