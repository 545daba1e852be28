"""What the answer to a real recording with an effect in it got right, against the answer to the recording as it is.

A real recording departs from its belief without our doing, so an answer counts for what it says beyond the answer to
the unmodified recording: a name that this one neither names nor lists, a size or an instant whose 95 % interval lies
apart from that there, a place (channel and interval) that is not located there. A null alarms if it names what the
unmodified recording neither names nor lists.
"""

from __future__ import annotations

from benchmark.scores.score import CLEAR, SILENT, Count, band, confidently_wrong, explanations, key, overlap, rate

Z95 = 1.96
SAME_PLACE = 0.5  # intersection over union of two intervals of one channel that are one place
REFUSED, FAULT, ENDED = "refused", "fault", "took too long"
CODES = {3: REFUSED, 124: ENDED}
FAST_S, LONG_S = 60.0, 150.0  # of the processor: what two cores without other load take by the clock


def words(entry: dict) -> str:
    """Name, axis and sensor of an entry, as one word for each; two axes that are exchanged have no order."""
    of = entry | entry.get("parameters", {})
    name, axis = key(entry)
    if name == "recording.axes_exchanged":
        axis = "".join(sorted((axis or "", of.get("other_axis") or "")))
    return " ".join(str(one) for one in (name, axis, of.get("sensor")) if one)


def interval(entry: dict) -> list[float] | None:
    return entry.get("parameters", {}).get("interval95")


def _is_another(one: dict, old: dict) -> bool:
    """Whether an effect of a name that is known has another size, or jumps at another instant, where both are told."""
    now, then = one.get("parameters", {}), old.get("parameters", {})
    spans = [(of.get("interval95"), of.get("at_s_interval95")) for of in (now, then)]
    return any(new and known and not overlap(new, known) for new, known in zip(*spans, strict=True))


def beyond(answer: dict, unmodified: dict) -> tuple[list[str], list[str]]:
    """Names that stand in the answer only, or are another there, best first, and channels with a place of its own."""
    before = list(explanations(unmodified))
    new = [
        words(one)
        for one in answer.get("effects") or ()
        if all(_is_another(one, old) for old in before if words(old) == words(one))
    ]
    known = located(unmodified)
    places = [
        channel
        for channel, span in located(answer)
        if not any(channel == other and overlap(span, old) >= SAME_PLACE for other, old in known)
    ]
    return new, places


def located(answer: dict) -> list[tuple[str, list[float] | None]]:
    """Channel and interval of every mismatch, and of what stays unexplained."""
    rows = [*(answer.get("mismatch") or ()), answer.get("unexplained") or {}]
    return [(one["channel"], one.get("interval_s")) for one in rows if one.get("channel")]


def judged(truth: dict, answer: dict | None, unmodified: dict | None, run: dict, error: str = "") -> dict:
    """One flat record of a case; `error` is what the command said where it gave no answer."""
    given, base = answer or {}, unmodified or {}
    verdict = given.get("verdict") or _failure(error)
    oracle = truth["oracle"] or {}
    new, channels = beyond(given, base)
    record = {
        "case": truth["case"], "recording": truth["recordings"][0]["name"], "kind": truth["kind"],
        "what": truth["what"],
        "truth": [words(one) for one in truth["effects"]], "d": oracle.get("log_bayes_factor"),
        "open_d": oracle.get("open_log_bayes_factor"), "verdict": verdict,
        "band": band(oracle.get("log_bayes_factor")), "answered": answer is not None, "said": error,
        "named": [words(one) for one in given.get("effects") or ()], "new": new, "seconds": run.get("seconds"),
        "processor_s": run.get("processor_s"), "alarm": truth["kind"] == "null" and any(
            one not in {words(old) for old in explanations(base)} for one in map(words, given.get("effects") or ())),
    }  # fmt: skip
    if truth["kind"] == "single":
        record |= _of_effect(truth["effects"][0], truth, given, base, new, channels)
    return record


def _failure(error: str) -> str:
    head = error.split("\n", 1)[0].rsplit(" ", 1)[-1]
    return CODES.get(int(head), FAULT) if head.isdigit() else "missing"


def _of_effect(effect: dict, truth: dict, answer: dict, base: dict, new: list[str], channels: list[str]) -> dict:
    target, before = words(effect), {words(one) for one in explanations(base)}
    after = {words(one): one for one in reversed(explanations(answer))}
    found = target in new or (target in after and target not in before)
    places = channels or [".".join((name.split(".")[0], *name.split()[1:2])) for name in new]
    return {
        "value": effect["value"], "unit": effect["unit"], "detected": bool(new or channels or found),
        "place": found or bool(places and places[0] in truth["channels"]), "first": bool(new) and new[0] == target,
        "found": found, "holds": _holds(effect, truth["oracle"], after.get(target) if found else None),
        "wrong": bool(answer) and answer["verdict"] != SILENT and confidently_wrong(answer, {key(effect)}),
    }  # fmt: skip


def _holds(effect: dict, oracle: dict | None, entry: dict | None) -> bool | None:
    """Whether the stated interval meets what was put in plus what the recording shows of it already, as fitted."""
    if not entry or not interval(entry) or effect["unit"] == "factor" or (oracle or {}).get("own") is None:
        return None
    middle, half = effect["value"] + oracle["own"], Z95 * oracle["sigma"]
    low, high = interval(entry)
    return low <= middle + half and high >= middle - half


def summary(records: list[dict]) -> dict:
    """The rates of records, as a whole, by recording, and by effect; each with its exact interval.

    Without an answer nothing is detected; alarms and confidently wrong ones are counted among answers only.
    """
    counts = {name: Count() for name in ("all", "own laws open", "by recording", "by effect", "nulls", "times")}
    for one in records:
        if one["kind"] == "null" and one["answered"]:
            for name in ("all", one["recording"]):
                counts["nulls"].add(name, one["alarm"])
        if one["kind"] == "single":
            _hidden(counts, one)
        if one["processor_s"] is not None:
            counts["times"].add(f"below {FAST_S:g} s", one["processor_s"] < FAST_S)
            counts["times"].add(f"above {LONG_S:g} s", one["processor_s"] > LONG_S or one["verdict"] == ENDED)
        counts["all"].add("answered", one["answered"])
        counts["all"].add("ended with a fault", one["verdict"] == FAULT)
    result = {name: one.rates() for name, one in counts.items()}
    return {"cases": len(records)} | result | {"records": records}


def _hidden(counts: dict, one: dict) -> None:
    clear = one["band"] == CLEAR
    if one["answered"]:
        counts["all"].add("confidently wrong", one["wrong"])
    if one["holds"] is not None:
        counts["all"].add("interval holds what was put in", one["holds"])
    for word, label in (("detected", "detected"), ("place", "right channel"), ("found", "named first or listed")):
        counts["all"].add(f"{label}, {one['band']}", one[word])
        if one["open_d"] is not None and band(one["open_d"]) == CLEAR:
            counts["own laws open"].add(f"{label}, {CLEAR}", one[word])
        if not clear:
            continue
        name = one["truth"][0].split()[0]
        counts["by recording"].add(f"{one['recording']}: {label}", one[word])
        counts["by effect"].add(f"{name}: {label}", one[word])


TARGETS = (  # line of the requirement, words, group and name of the rate, least, most
    ("7d", "detected, D of at least 16", "all", f"detected, {CLEAR}", 0.95, 1.0),
    ("7d", "right channel, D of at least 16", "all", f"right channel, {CLEAR}", 0.95, 1.0),
    ("7d", "named first or listed, D of at least 16", "all", f"named first or listed, {CLEAR}", 0.90, 1.0),
    ("7d", "confidently wrong", "all", "confidently wrong", 0.0, 0.03),
    ("7d", "nulls that alarm", "nulls", "all", 0.0, 0.05),
    ("7f", "ended with a fault of the program", "all", "ended with a fault", 0.0, 0.0),
    ("7f", f"below {FAST_S:g} s of the processor", "times", f"below {FAST_S:g} s", 0.95, 1.0),
    ("7f", f"above {LONG_S:g} s of the processor", "times", f"above {LONG_S:g} s", 0.0, 0.0),
)  # fmt: skip


def targets(result: dict) -> list[dict]:
    """Each target with its rate and whether the point estimate meets it; without cases it is open."""
    out = []
    for line, label, group, name, least, most in TARGETS:
        found = result[group].get(name) or rate(0, 0)
        met = None if not found["count"] else least <= found["rate"] <= most
        out.append({"line": line, "words": label, "least": least, "most": most, "found": found, "met": met})
    return out
