"""The first screen of a diagnosis: three numbers, one figure, what to do next, and what its effects are worth."""

from __future__ import annotations

from collections.abc import Mapping
from math import exp, floor, hypot, log

from ins_eval.analysis.evaluation_numbers import LOST_MPS
from ins_eval.report.content import Number, Picture, Section, at_a_glance
from ins_eval.report.diagnosis_words import chance, channel, effect_words, nats, numbered, probability, sigmas, size
from ins_eval.wording import SUPERSCRIPTS, fixed, joined, sentence, significant

SPOKEN_ODDS = log(1e6)  # nats, beyond which odds are a power of ten
MOST_ODDS = log(1e100)
# what is wrong with columns, and is put right before a recording is navigated
PUT_RIGHT = tuple(f"recording.{what}" for what in ("axis_sign", "axes_exchanged", "unit", "gps_velocity"))
DESCRIPTIONS = ("recording", "clock", "gps", "reference", "alignment")  # whose effects are mended in words


def diagnosis_glance(tree: Mapping) -> Section:
    """What the first screen of a diagnosis says."""
    found = [*_first_effect(tree), *_probable(tree), *_nothing_found(tree), *_located(tree)]
    numbers = [*found, *_navigation(tree), *_excess(tree)]
    return at_a_glance(numbers, _picture(tree), *_next_steps(tree))


def worth(tree: Mapping) -> list[str]:
    """What the effects gain, each as a clause: on data that were not used, in the residual, in navigation."""
    found, parts = tree["diagnosis"], []
    gain = tree.get("gain")
    if gain:
        more = "more" if gain["nats"] >= 0.0 else "less"
        parts.append(
            f"data that were not used are {nats(abs(gain['nats']))} nats {more} probable (odds of "
            f"{odds(abs(gain['nats']))}; placebo, as many coefficients half a recording late: "
            f"{nats(gain['placebo_nats'])})"
        )
        if (share := gain["excess_removed"]) is not None:
            parts.append(f"{100.0 * share:.0f} % of the excess of the residual over its noise is gone")
    velocity = found["fit"].get("velocity_rms_mps")
    if velocity and "after" in velocity:
        each = [
            f"{side} {significant(velocity['before'][side])} to {significant(velocity['after'][side])} m/s"
            for side in ("north", "east")
        ]
        parts.append(f"velocity RMS of this pure-inertial navigation{_put_right(tree)} {joined(each)}")
    rate = found["fit"].get("radial_error_rate_nmi_per_h")
    if rate and "after" in rate:
        parts.append(f"radial error rate {significant(rate['before'])} to {significant(rate['after'])} nmi/h")
    return parts


def _put_right(tree: Mapping) -> str:
    """What was done to the recording before it was navigated, where its description was wrong."""
    wrong = any(one["name"] in PUT_RIGHT for one in tree["diagnosis"]["effects"])
    return ", its description put right" if wrong else ""


def odds(gained: float) -> str:
    """Odds of a log Bayes factor or difference of log predictive densities in nats: ``20 to 1``, ``10⁶⁵ to 1``."""
    if gained > MOST_ODDS:
        return "more than 10¹⁰⁰ to 1"
    if gained > SPOKEN_ODDS:
        return f"10{str(floor(gained / log(10.0))).translate(SUPERSCRIPTS)} to 1"
    return f"{significant(exp(gained), 2)} to 1"


def _first_effect(tree: Mapping) -> list[Number]:
    effects = tree["diagnosis"]["effects"]
    if not effects:
        return []
    value, interval, unit = size(effects[0])
    sure = f"95 %: {interval}" if interval else f"probability {probability(effects[0]['probability'])}"
    beside = f", the first of {len(effects)}" if len(effects) > 1 else ""
    return [Number(f"{effect_words(effects[0])}{beside}", f"{value} {unit}".strip(), sure)]


def _probable(tree: Mapping) -> list[Number]:
    gain = tree.get("gain")
    if not gain:
        return []
    against = "" if gain["nats"] >= 0.0 else " against"
    sure = f"odds of {odds(abs(gain['nats']))}{against}; placebo {nats(gain['placebo_nats'])} nats"
    return [Number("log probability gained on unused data", f"{nats(gain['nats'])} nats", sure)]


def _nothing_found(tree: Mapping) -> list[Number]:
    """How near the most remarkable effect and interval came, where nothing is wrong."""
    statistics = tree["statistics"]
    if tree["diagnosis"]["verdict"] != "no mismatch" or "largest_effect" not in statistics:
        return []
    most, cost = statistics["largest_log_bayes_factor"], statistics["cost_of_an_effect"]
    numbers = [Number("most that any effect gains", f"{nats(most)} nats", f"{nats(cost)} are needed to name one")]
    if (smallest := statistics.get("smallest_probability")) is not None:
        words = "chance of as remarkable an interval"
        numbers.append(Number(words, chance(smallest), "with every channel and interval searched"))
    return numbers


def _located(tree: Mapping) -> list[Number]:
    """The first place where a recording leaves the belief."""
    mismatch = tree["diagnosis"]["mismatch"]
    if not mismatch or tree["diagnosis"]["effects"]:
        return []
    one = max(mismatch, key=lambda one: one["significance_sigma"])
    begin, end = one["interval_s"]
    return [Number(f"{channel(one['channel'])} is disturbed", f"{sigmas(one)} σ", f"{begin:.0f} to {end:.0f} s")]


def _navigation(tree: Mapping) -> list[Number]:
    fit = tree["diagnosis"]["fit"]
    velocity, rate = fit.get("velocity_rms_mps"), fit.get("radial_error_rate_nmi_per_h")
    numbers: list[Number] = []
    if velocity and hypot(*velocity["before"].values()) > LOST_MPS:
        return numbers
    for what, of, unit in (
        ("horizontal velocity RMS", velocity and {k: hypot(v["north"], v["east"]) for k, v in velocity.items()}, "m/s"),
        ("radial error rate", rate, "nmi/h"),
    ):
        if of and "after" in of:
            before = f"with the effects; {fixed(of['before'])} {unit} as believed{_put_right(tree)}"
            numbers.append(Number(what, f"{fixed(of['after'])} {unit}", before))
        elif of:
            numbers.append(
                Number(what, f"{fixed(of['before'])} {unit}", f"as believed{_put_right(tree)}, this recording")
            )
    return numbers


def _excess(tree: Mapping) -> list[Number]:
    gain = tree.get("gain")
    if not gain or gain["excess_removed"] is None:
        return []
    return [Number("excess of the residual that is gone", f"{100.0 * gain['excess_removed']:.0f} %", "over its noise")]


def _picture(tree: Mapping) -> Picture:
    several = len(tree["recordings"]) > 1
    for k, one in enumerate(tree["recordings"]):
        if one["whiteness_after"] is not None:
            words = f"The residual of {one['name']} without and with what was left out; shaded: where it was located."
            return Picture(numbered("before_and_after", k, several), words)
    if tree["diagnosis"]["mismatch"]:
        words = "Whitened residual of each channel; shaded: where it was located."
        return Picture(numbered("whitened_residuals", 0, several), words)
    return Picture("evidence_of_effects", "What each effect would gain, and what it would have to.")


def _next_steps(tree: Mapping) -> list[str]:
    found = tree["diagnosis"]
    effects, left, rivals = found["effects"], found["unexplained"], found["indistinguishable"]
    steps = []
    described = [one for one in effects if one["name"].partition(".")[0] in DESCRIPTIONS]
    columns = [one for one in described if one["name"] in PUT_RIGHT]
    stated = [one for one in described if one not in columns]
    for ones, what in ((columns, "columns"), (stated, "description")):
        if ones:
            names = joined([effect_words(one) for one in ones])
            steps.append(f"Correct the {what} of the recording ({names}) and diagnose it again.")
    experiment = next((one for one in rivals if one["experiment"]), None)
    if found["verdict"] == "not identifiable" and experiment:
        steps.append(sentence(f"make this experiment, which would separate the rivals: {experiment['experiment']}"))
    if left["channel"] is not None:
        begin, end = left["interval_s"]
        steps.append(f"Look at {channel(left['channel'])} from {begin:.0f} to {end:.0f} s: something is wrong there.")
    if len(effects) > len(described):
        steps.append(
            "Add --write-model better.toml, and evaluate the next recording with --belief better.toml; ins-eval "
            "predict says what that should gain."
        )
    return steps or ["Nothing has to be changed. The last section says what this recording could not show."]
