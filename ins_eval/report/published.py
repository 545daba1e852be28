"""The published flight beside our ensemble."""

from __future__ import annotations

from collections.abc import Mapping

from ins_eval.figures.style import label
from ins_eval.published_flight import CHOSEN_WITH_TABLE_7
from ins_eval.report.content import Block, Picture, paragraphs, table
from ins_eval.tables import pick
from ins_eval.vocabulary import DEFINITIONS, PAPER, PAPER_ARM, definition_name, measure_name, of_ensemble
from ins_eval.wording import MISSING, fixed, with_interval


def beside_published(metrics: Mapping) -> list[Block]:
    """Our ensemble beside Table 7 and the CEP of the paper, and where its flight lies among ours; may be empty."""
    printed = {
        (arm, f"velocity_rms_{c}"): pick(metrics, "paper", "table7", arm, c)
        for arm in PAPER_ARM
        for c in ("east", "north")
    }
    printed |= {(arm, f"cep_rate_{d}"): pick(metrics, "paper", "cep", arm) for arm in PAPER_ARM for d in DEFINITIONS}
    rows, farthest = [], ("", 0.0)
    for measure in dict.fromkeys(measure for _, measure in printed):
        cells = []
        for arm, name in PAPER_ARM.items():
            theirs, ours = printed[arm, measure], of_ensemble(metrics, name, measure)
            cells += [fixed(theirs), with_interval(ours)]
            if theirs is not None and ours and measure.startswith("velocity"):
                distance = ours["value"] - theirs
                farthest = max(
                    farthest, (f"{measure_name(measure)} of {label(name)}", distance), key=lambda f: abs(f[1])
                )
        if MISSING not in cells:
            unit = "m/s" if measure.startswith("velocity") else "nmi/h"
            rows.append((f"{measure_name(measure)} [{unit}]", *cells))
    if not rows:
        return []
    text = ""
    if farthest[0]:
        text = (
            f"Of the four velocity RMS in Table 7 of {PAPER} ours differ by at most "
            f"{fixed(abs(farthest[1]))} m/s; the "
            f"farthest is the {farthest[0]}, {'above' if farthest[1] > 0 else 'below'} the published one. "
            f"That is no independent agreement: {CHOSEN_WITH_TABLE_7}."
        )
    return [
        *paragraphs(text),
        *table(
            "Published and ours",
            ("measure", "paper, simple", "ours, simple", "paper, hysteresis", "ours, hysteresis refined"),
            rows,
            "The published numbers come from one flight and no definition of CEP is given, so that one number stands "
            "beside each of our definitions.",
        ),
        *_percentiles(metrics),
        Picture(
            "single_flight_rates",
            "The height at which a dashed line cuts the curve of its colour is the share of our "
            "flights that did better than the published one; it depends on the definition.",
        ),
    ]


def _percentiles(metrics: Mapping) -> list[Block]:
    tree = pick(metrics, "paper", "percentile_of_paper") or {}
    arms = [arm for arm in PAPER_ARM if arm in tree]
    values = [entry["value"] for arm in arms for entry in tree[arm].values()]
    if not values:
        return []
    inside = sum(2.5 <= value <= 97.5 for value in values)
    text = "The published flight lies within the central 95 % of our single flights in "
    text += "every case below." if inside == len(values) else f"{inside} of the {len(values)} cases below."
    definitions = dict.fromkeys(d for arm in arms for d in tree[arm])
    rows = [(definition_name(d), *(with_interval(tree[arm].get(d), 0) for arm in arms)) for d in definitions]
    published = [pick(metrics, "paper", "cep", arm) for arm in arms]
    heads = [f"{arm}, below {fixed(value)} nmi/h [%]" for arm, value in zip(arms, published, strict=True)]
    return [
        *paragraphs(text),
        *table(
            "Share of our single flights that did better than the published one",
            ("definition of the rate", *heads),
            rows,
            "In brackets: 95 % interval.",
        ),
    ]
