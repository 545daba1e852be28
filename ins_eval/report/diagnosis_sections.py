"""The sections of a diagnosis below its first lines: tables, figures and what they mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import floor, log10

from ins_eval.effects import VOCABULARY
from ins_eval.policy import Policy
from ins_eval.report.belief import belief_section
from ins_eval.report.content import Block, Picture, Section, paragraphs, table
from ins_eval.report.diagnosis_limits import limits
from ins_eval.report.diagnosis_words import (
    amount,
    chance,
    channel,
    effect_words,
    further,
    nats,
    numbered,
    probability,
    sigmas,
    size,
    where,
)
from ins_eval.wording import MISSING, fixed, joined, sentence, significant

NOISE = (
    ("velocity_random_walk_ug_per_sqrt_hz", "velocity random walk [µg/√Hz]"),
    ("angle_random_walk_deg_per_sqrt_h", "angle random walk [deg/sqrt(h)]"),
    ("accelerometer_wander_ug", "wander of the accelerometers [µg]"),
    ("gyro_wander_deg_per_h", "wander of the gyros [deg/h]"),
    ("slow_position_m", "slow error of position [m]"),
    ("slow_position_time_s", "its correlation time [s]"),
    ("slow_velocity_mps", "slow error of velocity [m/s]"),
    ("slow_velocity_time_s", "its correlation time [s]"),
    ("slow_output_ug", "slow error of the output [µg]"),
    ("slow_output_time_s", "its correlation time [s]"),
)
BEST = 5  # families in the table of the evidence


def sections_of(tree: Mapping) -> list[Section]:
    """Every section that has something to say."""
    sections = [
        belief_section(tree.get("belief", ())),
        Section("What was left out", _left_out(tree)),
        Section("What else it could be", _rivals(tree)),
        Section("The belief that was written", _written(tree)),
        Section("Evidence of each effect", _evidence(tree)),
        Section("Where", _where(tree)),
        Section("The fit on data that were not used", _held_out(tree)),
        Section("Navigation before and after", _navigation(tree)),
        Section("What stays unexplained", _unexplained(tree)),
        Section("What is left over", _residuals(tree)),
        Section("Noise found", _noise(tree)),
        Section("Start and turn-on", _turned_on(tree)),
        Section("What this recording cannot show", limits(tree)),
    ]
    return [section for section in sections if section.blocks]


def _left_out(tree: Mapping) -> list[Block]:
    found = tree["diagnosis"]
    rows = []
    for one in found["effects"]:
        value, interval, unit = size(one)
        rows.append(
            (effect_words(one), value, interval or MISSING, unit or MISSING, ", ".join(further(one)) or MISSING,
             probability(one["probability"]),
             nats(one["log_evidence_gain"]), chance(one["false_alarm_probability"]))
        )  # fmt: skip
    header = (
        "effect", "value", "95 % interval", "unit", "further", "probability", "gain [nats]", "false alarm probability"
    )  # fmt: skip
    note = (
        "Value: true minus believed, in what the sensor indicates. Interval: from the noise; for creep and hysteresis "
        "it is wider, since no material follows a single time constant or width. Probability: among all families tried "
        "in its place and none. Gain: log evidence over the same set without it, at the noise of the answer; with the "
        "noise fitted again it is smaller. False alarm probability: how often noise alone gains as much among all that "
        "were tried."
    )
    blocks: list[Block] = table("Effects", header, rows, note, align="lrllllrl")
    blocks += paragraphs(
        *dict.fromkeys(
            f"{sentence(effect_words(one))} {sentence(VOCABULARY[one['name']].physics)} "
            f"Source: {VOCABULARY[one['name']].reference}."
            for one in found["effects"]
        )
    )
    return [*blocks, *_against_drive(tree, True), *_before_and_after(tree)]


def _caption(name: str, explained: bool) -> str:
    if explained:
        return f"Error of {name} with one standard deviation: over time, and over what the effect multiplies."
    return f"Error of {name} with one standard deviation, which no effect explains."


def _against_drive(tree: Mapping, explained: bool) -> list[Block]:
    """What is estimated without a model in the channels that an effect explains, or in those that none does."""
    blocks: list[Block] = []
    for one in tree["located"]:
        if (one["effect"] is not None) != explained:
            continue
        name = channel(one["channel"])
        if explained:
            words = _beside_effect(name, one["effect"], one["share"])
        else:
            beside = " beside the effects" if tree["diagnosis"]["effects"] else ""
            words = f"Error of {name} estimated in each window{beside}, over time and, if recorded, temperature."
        blocks += [*paragraphs(words), Picture(one["figure"], _caption(name, explained))]
    return blocks


def _beside_effect(name: str, effect: str, share: float) -> str:
    """What the error that is estimated without a model says of an effect."""
    words = f"Error of {name} estimated in each window without a model"
    if share == 0.0:  # no part of it
        return (
            f"{words} does not follow {effect}: either what this effect multiplies changes within a window, or "
            "the effect is not the cause. The figure before and after shows what it explains; weigh it with care."
        )
    return f"{words}, beside {effect}: the effect explains {100.0 * share:.0f} % of the mean square."


def _before_and_after(tree: Mapping) -> list[Block]:
    several = len(tree["recordings"]) > 1
    return [
        Picture(
            numbered("before_and_after", k, several),
            f"The residual of {one['name']} without and with what was left out.",
        )
        for k, one in enumerate(tree["recordings"])
        if one["whiteness_after"] is not None
    ]


def _evidence(tree: Mapping) -> list[Block]:
    evidence = tree["evidence"]
    rows = [
        (effect_words(one), nats(one["log_bayes_factor"]), "yes" if one["named"] else "no")
        for one in evidence["families"][:BEST]
    ]
    place = f" in the place of {evidence['in_place_of']}" if evidence["in_place_of"] else ""
    note = (
        "In nats, each with its prior over sizes and times integrated out. An effect has to gain "
        f"{fixed(evidence['threshold'], 1)} nats, the price of choosing among all that were tried."
    )
    title = f"Log Bayes factor of each effect{place}"
    return [
        *table(title, ("effect", "log Bayes factor", "in the answer"), rows, note, align="lrl"),
        Picture("evidence_of_effects", f"{title}; what lies within {Policy.near:g} nats of the best is a rival."),
    ]


def _rivals(tree: Mapping) -> list[Block]:
    rows = [
        (effect_words(one), amount(one) if "parameters" in one else MISSING,
         effect_words({"name": one["from"] or "noise"}), nats(one["log_evidence_below_best"]),
         probability(one["probability"]), "yes" if one["told_apart_by_prior_only"] else "no",
         one["experiment"] or MISSING,
         nats(one["expected_log_bayes_factor"]))
        for one in tree["diagnosis"]["indistinguishable"]
    ]  # fmt: skip
    header = (
        "rival", "size it would have", "instead of", "nats below the best", "probability", "prior only",
        "experiment to separate them", "expected log Bayes factor",
    )  # fmt: skip
    note = (
        "Listed is also what is far below and leaves at most 9 more of chi-square (3 sigma) at any size, at this noise "
        "or at one that is fitted beside another rival. Prior only: both fit equally well; only what was expected "
        "before the recording separates them. Experiment: the cheapest of the catalogue that would separate them, by "
        "its planned motion and temperatures. What could stand instead of noise is told by any further recording: an "
        "effect comes back."
    )
    return table("Rivals", header, rows, note, align="lllrrllr")


def _written(tree: Mapping) -> list[Block]:
    rows = []
    for one in tree["written"]:
        beside = [
            f"{parameter.words} {significant(one[parameter.name])} {parameter.unit}".strip()
            for parameter in VOCABULARY[one["name"]].parameters
            if parameter.name in one
        ]
        beside += [f"only in {one['recording']}"] if "recording" in one else []
        sigma = significant(one["sigma"]) if "sigma" in one else MISSING
        rows.append((effect_words(one), significant(one["value"]), sigma, one["unit"], ", ".join(beside) or MISSING))
    note = (
        "For other recordings of the instrument. An effect is named above only if it is sure. The values here are "
        "posterior means of all effects of the sensors, estimated at once, so that an uncertain one is near 0; of an "
        "uncertain time or width several values are given. The file holds their covariance; ins-eval predict says what "
        "they are expected to gain on a flight."
    )
    header = ("effect", "value", "one sigma", "unit", "further")
    return table("Effects in the written belief", header, rows, note, align="lrrll")


def _where(tree: Mapping) -> list[Block]:
    rows = [
        (one["recording"], channel(one["channel"]), fixed(one["interval_s"][0], 0), fixed(one["interval_s"][1], 0),
         where(one), sigmas(one))
        for one in tree["diagnosis"]["mismatch"]
    ]  # fmt: skip
    header = ("recording", "channel", "from [s]", "to [s]", "where", "sigma")
    note = "Sigma: the deviate of the probability that nothing wrong would look as remarkable anywhere."
    return table("Located", header, rows, note, align="llrrlr")


def _held_out(tree: Mapping) -> list[Block]:
    held, gain = tree["diagnosis"]["fit"].get("held_out"), tree.get("gain")
    if not held:
        return []
    gained = {"before": "0", "after": nats(gain["nats"]), "placebo": nats(gain["placebo_nats"])} if gain else {}
    rows = [(name, gained.get(name, MISSING), significant(held[name])) for name in ("before", "after", "placebo")]
    note = (
        "The recording is cut into blocks; what is fitted on every other of them is judged on the rest, and the other "
        "way round. Before: the belief. After: the belief with the effects. Placebo: as many coefficients, on the "
        "effects' own responses half a recording late. Gain: log predictive density over that of the belief. Squared "
        "innovation: mean, normalised; 1 is what noise alone leaves."
    )
    return table("Predicted from the other blocks", ("fit", "gain [nats]", "squared innovation"), rows, note)


def _navigation(tree: Mapping) -> list[Block]:
    fit = tree["diagnosis"]["fit"]
    velocity, rate = fit.get("velocity_rms_mps"), fit.get("radial_error_rate_nmi_per_h")
    times = [time for time in ("before", "after") if time in {**(velocity or {}), **(rate or {})}]
    rows = []
    if velocity:
        for side in ("north", "east"):
            rows.append((f"{side} velocity RMS [m/s]", *(significant(velocity[time][side]) for time in times)))
    if rate:
        rows.append(("radial error rate [nmi/h]", *(significant(rate[time]) for time in times)))
    note = "Of the pure-inertial solution of all recordings in full; before: the belief, after: the effects too."
    return table("Pure-inertial navigation", ("measure", *times), rows, note)


def _unexplained(tree: Mapping) -> list[Block]:
    found = tree["diagnosis"]
    left = found["unexplained"]
    sigma = sigmas(left)
    if left["channel"] is None:
        return paragraphs(
            f"The largest residual that is left has {sigma} σ, with every channel and interval searched: no more "
            "than noise makes."
        )
    begin, end = left["interval_s"]
    beside = "Beside the effects, " if found["effects"] else ""
    words = (
        f"{beside}{channel(left['channel'])} is disturbed from {begin:.0f} to {end:.0f} s, {sigma} σ, with every "
        "channel and interval searched; no effect of the vocabulary and nothing composed of a recorded column "
        "accounts for it"
    )
    return [*paragraphs(sentence(words)), *_against_drive(tree, False)]


def _residuals(tree: Mapping) -> list[Block]:
    blocks: list[Block] = []
    several = len(tree["recordings"]) > 1
    for k, one in enumerate(tree["recordings"]):
        after = one["whiteness_after"] or [None] * len(one["channels"])
        rows = [
            (name, fixed(white["rms"]), fixed(white["correlation"]), fixed(white["rms_of_means"]),
             fixed(then["rms_of_means"] if then else None))
            for name, white, then in zip(one["channels"], one["whiteness"], after, strict=True)
            if white is not None
        ]  # fmt: skip
        header = [
            "channel", "RMS", "correlation of neighbours", "RMS of means over a minute", "the same with the effects"
        ]  # fmt: skip
        if one["whiteness_after"] is None:
            header, rows = header[:4], [row[:4] for row in rows]
        measured = joined([name.replace("gps", "GPS") for name in one["measured_by"]])
        more = "." if one["whiteness_after"] is None else "; in the last column with the effects."
        note = (
            f"White noise has 1, 0 and 1 here. {one['measurements']} measurements by {measured}, {one['outliers']} "
            f"more left out as outliers, up to five in a row. {_jumps(one['jumps_s'])}The noise was fitted with the "
            f"belief, where it may hide a part of what is wrong{more}"
        )
        blocks += table(f"Whitened residual of {one['name']}", header, rows, note)
        name = numbered("whitened_residuals", k, several)
        blocks.append(Picture(name, "Whitened residual of each channel; the band holds 95 % of a white one."))
    return blocks


def _jumps(at_s: Sequence[float]) -> str:
    """Where the receiver jumps, as a sentence with a blank behind it, or nothing."""
    if not at_s:
        return ""
    return (
        f"The position of the receiver jumps at {joined([f'{t:.0f}' for t in at_s])} s, which is taken as its noise. "
    )


def _noise(tree: Mapping) -> list[Block]:
    recordings = tree["recordings"]
    several = len(recordings) > 1
    header, columns = ["level"], []
    for one in recordings:
        of = f"{one['name']}, " if several else ""
        header.append(f"{of}belief")
        columns.append(one["noise"])
        if one["noise_of_answer"] is not None:
            header.append(f"{of}answer")
            columns.append(one["noise_of_answer"])
    rows = [
        (words, *(significant(column[key]) if column.get(key) is not None else MISSING for column in columns))
        for key, words in NOISE
        if any(column.get(key) for column in columns)
    ]
    return [
        *paragraphs(
            "Noise is estimated together with the answer, each level with a prior around what is believed. Where it "
            "falls from the belief to the answer, it stood in for what was left out."
        ),
        *table("Most probable noise under the belief and under the answer", header, rows),
    ]


def _turned_on(tree: Mapping) -> list[Block]:
    rows = [
        (of["name"], one["name"], one["unit"], _with_sigma(one["believed"], one["believed_sigma"]),
         _with_sigma(one["found"], one["found_sigma"]))
        for of in tree["recordings"]
        for one in of["turned_on"]
    ]  # fmt: skip
    header = ("recording", "of", "unit", "believed", "found")
    note = "What is uncertain whatever the answer, and was fitted with it: one sigma each. It belongs to no effect."
    if any(unit == "share" for _, _, unit, *_ in rows):
        note += (
            " What is smoothed over h is (1 − s) x(t) + s (x(t − h) + x(t + h)) / 2, s the share; to one "
            "side is what a filter that looks back leaves out besides its delay."
        )
    return table("Turn-on biases, attitude at the start, receiver", header, rows, note, align="lllrr") if rows else []


def _with_sigma(value: float, sigma: float) -> str:
    """Both with as many decimals as make two figures of sigma."""
    digits = max(0, 1 - floor(log10(sigma))) if sigma > 0.0 else 3
    return f"{fixed(value, digits)} ± {fixed(sigma, digits)}"
