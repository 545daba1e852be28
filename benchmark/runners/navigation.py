"""`python -m benchmark.runners.navigation FOLDER ANSWERS [--workers 2]`: what correcting with the truth would give.

Each flight or drive that conceals an effect which can be seen is drawn once more with nothing hidden: the same unit,
noise and path. Its pure-inertial velocity RMS and radial error rate, by the installed package's own evaluation, are
what a perfect model would reach; ``ANSWERS/navigation.json`` keeps them.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

from tqdm import tqdm

from benchmark.runners import again, run
from benchmark.scores.score import CLEAR, band, quantiles, read
from ins_eval.parallel import results

FILE = "navigation.json"
LEAST_GAIN = 0.05  # of the velocity RMS: where the truth itself gains less, there is nothing to share


def reached(folder: Path) -> dict[str, float]:
    """Horizontal velocity RMS (m/s) and radial error rate (nmi/h) of a recording navigated as believed."""
    from ins_eval.compensation.file import believed_model
    from ins_eval.effects import without_effects
    from ins_eval.navigation import compensate, evaluate, measures, samples, standstill_to_align_on
    from ins_eval.recording import form

    recording = form.read(folder)
    velocity = recording.imu.accelerometer
    if recording.imu.accelerometer_form == "pulse":
        triad = [believed_model(recording.belief, axis, folder) for axis in "xyz"]
        velocity = compensate(samples(recording), triad, recording.interval_s)
    align_on = standstill_to_align_on(recording)
    found = measures(evaluate(*without_effects(recording, velocity, folder), align_on))
    return {
        "velocity_rms_mps": found.velocity_rms_mps["horizontal"],
        "radial_error_rate_nmi_per_h": found.radial_error_rate_nmi_per_h["radial_error_rate_rms"],
    }


def corrected(truth: dict, manifest: dict) -> dict[str, float]:
    """What the recording of a case reaches with nothing hidden in it."""
    (made,) = again.without_effect(truth, manifest).made
    with tempfile.TemporaryDirectory() as folder:
        return reached(again.save(made, Path(folder, "recording")))


def wanted(truth: dict) -> bool:
    """One moving recording with effects of the vocabulary that can be seen."""
    d = (truth["oracle"] or {}).get("log_bayes_factor")
    one = len(truth["recordings"]) == 1 and truth["recordings"][0]["kind"] in ("flight", "drive")
    return one and bool(truth["effects"]) and not truth["outside"] and band(d) == CLEAR


def gains(records: list[dict], known: dict[str, dict]) -> dict:
    """Share of the gain of the truth that answers reach, in velocity RMS and in radial error rate.

    Share: (before - after) / (before - with the truth), of detected cases in which the truth gains more than
    `LEAST_GAIN`; a case without an `after` has the share 0.
    """
    rows = []
    for one in records:
        if one["case"] not in known or not one["heard"]:
            continue
        row = {"case": one["case"], "truth": one["truth"], "named": one["named"]}
        for measure, perfect in known[one["case"]].items():
            stated = one["fit"].get(measure) or {}
            before, after = (_horizontal(stated.get(name)) for name in ("before", "after"))
            worth = before is not None and before - perfect > LEAST_GAIN * before
            share = (0.0 if after is None else (before - after) / (before - perfect)) if worth else None
            row[measure] = {"before": before, "after": after, "truth": perfect, "share": share}
        rows.append(row)
    return {
        "cases": rows,
        **{measure: quantiles(row[measure]["share"] for row in rows if measure in row)
           for measure in ("velocity_rms_mps", "radial_error_rate_nmi_per_h")},
    }  # fmt: skip


def _horizontal(value) -> float | None:
    if isinstance(value, dict):
        return (value["north"] ** 2 + value["east"] ** 2) ** 0.5
    return value


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmark.runners.navigation", description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="what the maker wrote: recordings and truth")
    parser.add_argument("answers", type=Path)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of Dask, on whose workers they fly")
    chosen = parser.parse_args(arguments)
    manifest = json.loads((chosen.folder / "truth" / "manifest.json").read_text())
    place = chosen.answers / FILE
    known = json.loads(place.read_text()) if place.exists() else {}
    answered = {path.stem for path in chosen.answers.glob("*.json")}  # what was refused is refused here, too
    truths = {name: one for name, one in read(chosen.folder / "truth").items() if name in answered and wanted(one)}
    jobs = {name: (one, manifest) for name, one in truths.items() if name not in known}
    found = results(corrected, jobs, chosen.workers, chosen.scheduler)
    for name, one in tqdm(found, "flights with nothing hidden", len(jobs), file=sys.stderr):
        known[name] = one
        run.write(place, json.dumps(known, indent=1, sort_keys=True) + "\n")
    print(f"{len(known)} recordings with nothing hidden")
    return 0


if __name__ == "__main__":
    sys.exit(main())
