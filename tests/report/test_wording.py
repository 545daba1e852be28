"""Words follow the numbers."""

from __future__ import annotations

import pytest

from ins_eval import wording


@pytest.mark.parametrize(
    ("value", "low", "high", "decided", "words"),
    [
        (0.81, 0.76, 0.86, "better", "lowers it by 19 % (95 % interval 14 to 24 %)"),
        (1.07, 1.02, 1.12, "worse", "raises it by 7 % (95 % interval 2 to 12 %)"),
        (0.96, 0.91, 1.02, "open", "changes it by −4 % (95 % interval −9 to +2 %)"),
        (1.0, 1.0, 1.0, "equal", "leaves it exactly as it is"),
        (0.97, 0.94, 0.998, "better", "lowers it by 3.0 % (95 % interval 0.2 to 6.0 %)"),
        (0.95, 0.9, 1.0, "open", "changes it by −5 % (95 % interval −10 to 0 %)"),
    ],
)
def test_effect_and_verdict(value, low, high, decided, words):
    ratio = {"ratio": value, "interval95": [low, high]}
    assert wording.verdict(ratio) == decided
    assert wording.effect("X", "it", ratio) == f"X {words}"


def test_certainty_names_each_case():
    assert "is real" in wording.certainty({"ratio": 0.8, "interval95": [0.7, 0.9]})
    assert "is worse" in wording.certainty({"ratio": 1.2, "interval95": [1.1, 1.3]})
    assert "not established" in wording.certainty({"ratio": 0.9, "interval95": [0.8, 1.1]})


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (2.9e-4, "0.29 mm"),
        (0.41, "0.41 m"),
        (12.4, "12 m"),
        (0.0, "below 1 nm"),
        (3e-11, "3.0e-11 m"),
        (None, "–"),
        (6e-5, "60 µm"),
    ],
)
def test_small(value, text):
    assert wording.small(value, "m") == text


def test_numbers_and_intervals():
    assert wording.fixed(-0.004) == "0.00"
    assert wording.fixed(-1.256) == "−1.26"
    assert wording.with_interval({"value": 1.256, "interval95": [1.18, 1.35]}) == "1.26 [1.18, 1.35]"
    assert wording.with_interval(None) == "–"
    assert wording.percent({"value": 0.69, "interval95": [0.62, 0.75]}) == "69 % [62, 75]"
    assert wording.change({"ratio": 0.81, "interval95": [0.76, 1.02]}) == "−19 % [−24, +2]"
    assert wording.change({"ratio": 1.0, "interval95": [1.0 - 1e-12, 1.0 + 1e-12]}) == "0 % [0, 0]"


def test_no_break_between_number_and_unit():
    assert wording.unbroken("19 % of 1.2 m/s in 8400 s at 5 more sites, Table 7") == (
        "19\u00a0% of 1.2\u00a0m/s in 8400\u00a0s at 5 more sites, Table\u00a07"
    )
    assert wording.unbroken("177.05 ± 0.21 ppm within 3 °C at 5.7 V, 68 mm² and −3 dB in 2 hops") == (
        "177.05\u00a0±\u00a00.21\u00a0ppm within 3\u00a0°C at 5.7\u00a0V, 68\u00a0mm² and −3\u00a0dB in 2 hops"
    )


@pytest.mark.parametrize(
    ("plain", "sign"),
    [
        ("ug/degC^2", "µg/°C²"),
        ("pulse/(g s)/(degC/min)^2", "pulse/(g s)/(°C/min)²"),
        ("deg/h/sqrt(h)", "°/h/√h"),
        ("ug/sqrt(Hz)", "µg/√Hz"),
        ("angle [deg]", "angle [°]"),
        ("deg", "°"),
        ("turn left by 90 degrees", "turn left by 90°"),
        ("3 +- 1 urad", "3 ± 1 µrad"),
        ("bias_sigma_deg_per_h", "bias_sigma_deg_per_h"),  # a key is no unit
        ("angles in degrees", "angles in degrees"),
        ("debug a plug", "debug a plug"),
        ("from -900 to -0.5 s", "from −900 to −0.5 s"),
        ("time_offset_s = -0.1, [-0.1, -2], --restart-every 30, 2025-11-25", None),  # what a user may copy
        ("x = 1e-5, --assume gyro=deg/s and ug", "x = 1e-5, --assume gyro=deg/s and µg"),
        ("4.44e-16 g, 5.5e-08, 1e-6 of 1e+04", "4.44 × 10⁻¹⁶ g, 5.5 × 10⁻⁸, 10⁻⁶ of 10⁴"),
        ("case 6555e15e, 12e4, 1e1234", None),  # no powers
    ],
)
def test_units_have_the_signs_of_the_field(plain: str, sign: str | None) -> None:
    assert wording.in_symbols(plain) == (plain if sign is None else sign)


@pytest.mark.parametrize("text, said", [("a word", "A word."), ("a word.", "A word."), ("stuck?", "Stuck?")])
def test_a_sentence_ends_once(text, said):
    assert wording.sentence(text) == said
