"""The diagnosis in words: where a recording leaves what is believed of it, and how sure."""

from __future__ import annotations

from collections.abc import Mapping

from ins_eval.report.content import Block, Picture, Section, paragraphs, table
from ins_eval.report.figures.diagnosis import CHANNELS
from ins_eval.report.wording import listed, number, sentence

TITLE = "Diagnosis"
SPOKEN = {
    "gps.position": "GPS position",
    "gps.velocity": "GPS velocity",
    "reference.position": "position of the reference",
    "reference.velocity": "velocity of the reference",
    "reference.attitude": "attitude of the reference",
    "temperature": "temperature",
    "navigation": "the navigation",
}
NOISE = (
    ("velocity_random_walk_ug_per_sqrt_hz", "velocity random walk [ug/sqrt(Hz)]", 2),
    ("angle_random_walk_deg_per_sqrt_h", "angle random walk [deg/sqrt(h)]", 5),
    ("accelerometer_wander_ug", "wander of the accelerometers [ug]", 2),
    ("gyro_wander_deg_per_h", "wander of the gyros [deg/h]", 5),
    ("slow_position_m", "slow error of position [m]", 2),
    ("slow_position_time_s", "its correlation time [s]", 0),
    ("slow_velocity_mps", "slow error of velocity [m/s]", 4),
    ("slow_velocity_time_s", "its correlation time [s]", 0),
)


def diagnosis_content(tree: Mapping) -> tuple[str, list[Section]]:
    """The answer and the sections of a diagnosis."""
    sections = [
        Section("Where", _where(tree)),
        Section("What is left over", _residuals(tree)),
        Section("Noise found", _noise(tree)),
    ]
    return _answer(tree), [section for section in sections if section.blocks]


def _answer(tree: Mapping) -> str:
    found, recordings = tree["diagnosis"]["mismatch"], tree["recordings"]
    names = listed([one["name"] for one in recordings])
    if not found:
        return (
            f"{names}: no mismatch. What is believed accounts for the recording within what noise and stated "
            "uncertainty allow."
        )
    lines = [f"{names}: a mismatch that nothing named here accounts for."]
    lines += [_spoken(one, len(recordings) > 1) for one in found]
    return "\n".join(lines)


def _spoken(one: Mapping, several: bool) -> str:
    begin, end = one["interval_s"]
    of = f" of {one['recording']}" if several else ""
    words = f"; {one['where']}" if one["where"] else ""
    sigma = number(one["significance_sigma"], 1)
    when = f"{begin:.0f} to {end:.0f} s{words}"
    return sentence(f"{channel(one['channel'])}{of}, {when}: {sigma} sigma after having looked everywhere")


def channel(name: str) -> str:
    """A channel as a reader sees it."""
    sensor, _, axis = name.partition(".")
    return SPOKEN.get(name, f"{sensor} {axis}".strip())


def _where(tree: Mapping) -> list[Block]:
    rows = [
        (one["recording"], channel(one["channel"]), number(one["interval_s"][0], 0), number(one["interval_s"][1], 0),
         one["where"], number(one["significance_sigma"], 1))
        for one in tree["diagnosis"]["mismatch"]
    ]  # fmt: skip
    header = ("recording", "channel", "from [s]", "to [s]", "where", "sigma")
    note = "Sigma: the deviate of the probability that nothing wrong would look as remarkable anywhere."
    return table("Located", header, rows, note, align="llrrlr")


def _residuals(tree: Mapping) -> list[Block]:
    blocks: list[Block] = []
    for k, one in enumerate(tree["recordings"]):
        rows = [
            (name, number(white["rms"]), number(white["correlation"]), number(white["rms_of_means"]))
            for name, white in zip(CHANNELS, one["whiteness"], strict=True)
            if white is not None
        ]
        header = ("channel", "RMS", "correlation of neighbours", "RMS of means over a minute")
        measured = listed(one["measured_by"])
        note = (
            f"Of a white residual 1, 0 and 1. {one['measurements']} measurements by {measured}, {one['outliers']} "
            "isolated ones left out as outliers."
        )
        blocks += table(f"Whitened residual of {one['name']}", header, rows, note)
        name = "whitened_residuals" if len(tree["recordings"]) == 1 else f"whitened_residuals_{k + 1}"
        blocks.append(Picture(name, "Whitened residual of each channel; the band holds 95 % of a white one."))
    return blocks


def _noise(tree: Mapping) -> list[Block]:
    recordings = tree["recordings"]
    rows = [(words, *(number(one["noise"][key], digits) for one in recordings)) for key, words, digits in NOISE]
    header = ("level", *(one["name"] for one in recordings))
    return [
        *paragraphs("Noise is estimated together with the answer, each level with a prior around what is believed."),
        *table("Most probable noise under the belief", header, rows),
    ]
