"""`python -m benchmark.runners.real_report [--output reports/real]`: what diagnose says of each real recording.

One page: what was removed from the belief or is wrong with the recording, what `diagnose` says, what independent
sources say, rivals, and the fit on data that were not used, before and after. The recordings are read from
`--recordings`, by default ../shared/recordings; what is missing there is left out, and the page says so.
Each diagnosis has a page of its own, ``STUDY/index.html``. An answer that this package has already given is kept.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from benchmark.runners import imported, real_figures, run
from benchmark.runners.real_studies import OTHERS, STUDIES, Z95, Other, Said, Study
from benchmark.worlds.real import SOURCES, Source
from benchmark.worlds.recorded import Recorded
from ins_eval.files import write_whole
from ins_eval.report.content import Block, Number, Paragraph, Picture, Section, Table, at_a_glance, paragraphs, table
from ins_eval.report.diagnosis_words import alike, channel, effect_words, nats, probability
from ins_eval.report.json_file import as_json
from ins_eval.report.results import write_results
from ins_eval.wording import MISSING, sentence, significant

TITLE = "Real recordings"
NOTE = (
    "Agrees: the two 95 % intervals overlap. A constant bias within the stated turn-on sigma is part of the belief and "
    "is not named."
)


def study(one: Study, recorded: Recorded, output: Path, limit_s: float) -> dict:
    """Diagnose, and hold the answer against what sources say: a record of words and numbers."""
    name = f"{one.source} {one.name}".replace(" ", "-")
    folder, answer, page = (output / part / name for part in ("recordings", "answers", "diagnoses"))
    answer = answer.with_suffix(".json")
    runs = run.read_runs(answer.parent) if answer.parent.exists() else {}
    if not run.whole(answer.parent, name, runs, run.package_hash()):
        answer.parent.mkdir(parents=True, exist_ok=True)
        if not folder.exists():
            one.change(recorded).save(folder)
        code, words, seconds, used = run.diagnose([str(folder)], str(answer), limit_s, "--output", str(page))
        runs[name] = {"seconds": round(seconds, 1), "processor_s": round(used, 1), "package": run.package_hash(),
                      "said": words.splitlines()[-1] if code else ""}  # fmt: skip
        if code:
            answer.unlink(missing_ok=True)
        run.write(answer.parent / run.RUNS, json.dumps(runs, indent=1, sort_keys=True) + "\n")
    given = json.loads(answer.read_text()) if answer.exists() else None
    told = one.said(recorded)
    return {
        "source": one.source, "name": one.name, "what": one.what, "page": f"diagnoses/{name}/index.html",
        "seconds": runs[name]["seconds"], "refused": runs[name].get("said", ""), "answer": given,
        "sources": [asdict(said) | {"answer": _stated(given, said), "agrees": agrees(given, said)} for said in told],
        "control": one.silent_about, "alarm": _alarm(given, one.silent_about),
    }  # fmt: skip


def _entry(given: dict | None, said: Said) -> dict | None:
    effects = (given or {}).get("effects") or ()
    return next((one for one in effects if (one["name"], one["axis"]) == (said.name, said.axis)), None)


def _stated(given: dict | None, said: Said) -> dict | None:
    entry = _entry(given, said)
    return None if entry is None else entry["parameters"]


def agrees(given: dict | None, said: Said) -> bool | None:
    """Whether the two 95 % intervals meet; None where the answer does not name it."""
    entry = _entry(given, said)
    if entry is None:
        return None
    low, high = entry["parameters"]["interval95"]
    return low <= said.value + Z95 * said.sigma and high >= said.value - Z95 * said.sigma


def _alarm(given: dict | None, part: str) -> list[str]:
    """What a control names that is not in it."""
    effects = (given or {}).get("effects") or ()
    return [effect_words(one) for one in effects if part and part in one["name"]]


# ------------------------------------------------------------------------------------------------ the page


def section(source: Source, studies: list[dict], pictures: list[str]) -> Section:
    """All that is said of one recording."""
    blocks: list[Block] = [Picture(name, real_figures.CAPTIONS[name.rsplit("_", 1)[-1]]) for name in pictures]
    for one in studies:
        blocks += [Paragraph(one["what"], lead=sentence(one["name"])), *_verdict(one)]
        if one["answer"] is not None:
            blocks += [*_effects(one), *_rivals(one), *_fit(one)]
        blocks += _sources(one)
    if any(one["sources"] for one in studies):
        blocks += paragraphs(NOTE)
    return Section(source.title, blocks)


def _verdict(one: dict) -> list[Paragraph]:
    if one["answer"] is None:
        return paragraphs(f"No answer: {one['refused'] or 'none was given'}")
    given = one["answer"]
    left = given["unexplained"]
    rest = ""
    if left["channel"]:
        begin, end = left["interval_s"]
        rest = (f" Unexplained: {channel(left['channel'])} from {begin:.0f} to {end:.0f} s, "
                f"{left['significance_sigma']:.1f} σ.")  # fmt: skip
    words = f"Verdict: {given['verdict']}.{rest} The diagnosis took {one['seconds']:.0f} s."
    if one["control"]:
        alarms = ", ".join(one["alarm"])
        words += (
            f" The control {'fails: it names ' + alarms if one['alarm'] else 'holds: no effect of this kind is named'}."
        )
    return paragraphs(words)


def _effects(one: dict) -> list[Block]:
    rows = []
    for effect in one["answer"]["effects"]:
        of = effect["parameters"]
        value, low, high = alike(of["value"], of["interval95"])
        rows.append((effect_words(effect), value, f"{low} to {high}", of["unit"], probability(effect["probability"])))
    header = ("named effect", "value", "95 % interval", "unit", "probability")
    return [Table("", header, rows, align="lrrlr", links=[one["page"]] * len(rows))] if rows else []


def _rivals(one: dict) -> list[Block]:
    rows = [
        (effect_words(rival), nats(rival["log_evidence_below_best"]), probability(rival["probability"]),
         "yes" if rival["told_apart_by_prior_only"] else "no", rival["experiment"] or MISSING)
        for rival in one["answer"]["indistinguishable"]
    ]  # fmt: skip
    header = ("rival", "nats below the best", "probability", "prior only", "experiment to separate them")
    return table("", header, rows, align="lrrll")


def _fit(one: dict) -> list[Block]:
    fit, rows = one["answer"]["fit"], []
    if held := fit.get("held_out"):
        rows.append(("mean squared innovation on unused data", *(significant(held[key]) for key in
                     ("before", "after", "placebo"))))  # fmt: skip
    if velocity := fit.get("velocity_rms_mps"):
        after = velocity.get("after")
        for axis in ("north", "east"):
            rows.append((f"velocity RMS {axis} [m/s]", significant(velocity["before"][axis]),
                         significant(after[axis]) if after else MISSING, MISSING))  # fmt: skip
    return table("", ("fit", "before", "after", "placebo"), rows)


def _sources(one: dict) -> list[Block]:
    rows, tones = [], []
    for said in one["sources"]:
        stated = said["answer"]
        word = {None: "not named", True: "agrees", False: "disagrees"}[said["agrees"]]
        half = Z95 * said["sigma"]
        value, low, high = alike(said["value"], (said["value"] - half, said["value"] + half))
        told = MISSING if stated is None else alike(stated["value"], stated["interval95"])[0]
        rows.append((effect_words(said), value, f"{low} to {high}", told, said["unit"], said["source"], word))
        tones.append({None: "quiet", True: "good", False: "bad"}[said["agrees"]])
    header = ("effect", "known value", "95 % interval", "named value", "unit", "source", "verdict")
    return [Table("", header, rows, align="lrrrlll", tones=tones)] if rows else []


def other(one: Other, recordings: Path, output: Path) -> dict:
    """A recording that is imported, and evaluated where it can be: what was said of it."""
    file = recordings / one.file
    if not file.exists():
        return {"title": one.title, "what": one.what, "said": one.said, "came": "the recording is missing here."}
    folder = output / "recordings" / Path(one.file).parts[-1].split(".")[0]
    refused = imported.imported(one.format, file, folder, one.mapping)
    if refused:
        said = refused.splitlines()[-1].replace(f"{recordings}/", "")
        return {"title": one.title, "what": one.what, "said": one.said, "came": f"{said}."}
    page = output / "evaluations" / folder.name
    code, words = imported.command("evaluate", str(folder), "--output", str(page), "--quiet")
    came = f"{words.splitlines()[-1]}." if code else _evaluated(page)
    return {"title": one.title, "what": one.what, "said": one.said, "came": came}


def _evaluated(page: Path) -> str:
    """The first lines of the text of an evaluation."""
    lines = (page / "report.txt").read_text().split("\n\n")[0]
    return " ".join(lines.split())


def _others(rows: list[dict]) -> Section:
    blocks = [Paragraph(f"{one['what']} ins_eval says: {one['came']} {one['said']}", lead=f"{one['title']}.")
              for one in rows]  # fmt: skip
    return Section("Not diagnosed", blocks)


def answer_of(studies: list[dict], absent: list[str]) -> str:
    """The first lines."""
    named = [said for one in studies for said in one["sources"] if said["agrees"] is not None]
    missed = [said for one in studies for said in one["sources"] if said["agrees"] is None]
    refused = [one for one in studies if one["answer"] is None]
    controls = [one for one in studies if one["control"] and one["answer"] is not None]
    lines = [
        f"{len(studies)} diagnoses of real recordings: of {len(named) + len(missed)} values known from other sources, "
        f"{sum(said['agrees'] for said in named)} are named and agree, {sum(not said['agrees'] for said in named)} are "
        f"named with a different value and {len(missed)} are not named."
    ]
    if controls:
        lines.append(f"{sum(not one['alarm'] for one in controls)} of {len(controls)} controls hold.")
    if refused:
        lines.append(
            f"{len(refused)} got no answer: {', '.join(one['source'] + ' ' + one['name'] for one in refused)}."
        )
    if absent:
        lines.append(f"Missing here and left out: {', '.join(absent)}.")
    return "\n".join(lines)


def glance(studies: list[dict]) -> Section:
    """How many of the values known from other sources are named, and how many controls hold."""
    said = [one["agrees"] for study in studies for one in study["sources"]]
    held = [not one["alarm"] for one in studies if one["control"] and one["answer"] is not None]
    numbers = [
        Number("known values that are named and agree", f"{said.count(True)} of {len(said)}"),
        Number("named with a different value", f"{said.count(False)} of {len(said)}"),
        Number("controls that hold", f"{sum(held)} of {len(held)}"),
    ]
    return at_a_glance(
        numbers, None, "Read below which effects are named in each recording, and what other sources say of them."
    )


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmark.runners.real_report", description=__doc__.splitlines()[0]
    )
    parser.add_argument("--recordings", type=Path, default=imported.RECORDINGS)
    parser.add_argument("--output", type=Path, default=Path("reports/real"))
    parser.add_argument("--limit", type=float, default=300.0, metavar="S", help="seconds of the processor for a case")
    parser.add_argument("--quiet", action="store_true")
    chosen = parser.parse_args(arguments)
    studies, sections, drawn, absent = [], [], {}, []
    for source in SOURCES:
        recorded = imported.recorded(source, chosen.recordings, chosen.output / "imported" / source.name)
        if recorded is None:
            absent.append(source.title)
            continue
        asked = [one for one in STUDIES if one.source == source.name]
        done = [study(one, recorded, chosen.output, chosen.limit) for one in asked]
        pictures = real_figures.of(source.name, recorded, done)
        sections.append(section(source, done, list(pictures)))
        studies, drawn = studies + done, drawn | pictures
    rest = [other(one, chosen.recordings, chosen.output) for one in OTHERS]
    if not studies:
        print(f"{chosen.recordings}: no real recording is here, nothing to report", file=sys.stderr)
        return 1
    words = answer_of(studies, absent)
    metrics = {"studies": studies, "others": rest}
    write_whole(chosen.output / "manifest.json", as_json({"package_sha256": run.package_hash()}))
    write_results(
        chosen.output, TITLE, words, [glance(studies), *sections, _others(rest)], metrics, drawn, chosen.quiet
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
