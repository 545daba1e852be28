"""The doctor on files as users have them: right, said to be undecided, or wrong; counted with intervals."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import beta

from ins_eval.analysis.simulate import simulate
from ins_eval.errors import DataRefused, UsageError
from ins_eval.readers import doctor, find, read
from ins_eval.recording import consistency
from ins_eval.recording.validation import validate
from tests.recording import corpus

RIGHT, UNDECIDED, LEFT_OPEN_TOO_SOON = "right", "undecided, as is an oracle", "undecided, where an oracle is not"
NAMED_OTHERWISE, SILENT = "named otherwise", "silent"
LEAST_RIGHT, MOST_SILENT = 0.95, 0.01  # of the files
FEWEST_FILES = 120
UNTOLD = 20.0  # to 1: below it an oracle that knows motion and noise could not tell either
# what stands in an answer that leaves a question open, for the quirks that the motion may not tell
LEFT_OPEN = {
    "sign of down": r"does not determine.*the down velocity",
    "both turned": r"does not determine.*gyro x.*accelerometer y",
    "clock offset": r"the motion does not show their offset",
    "sign of force y": r"does not determine.*accelerometer y",
    "sign of force x": r"does not determine.*accelerometer x",
}


def answer(file: corpus.File, folder: Path) -> tuple[bool, str]:
    """Whether the file was refused, and all that was said."""
    name, path, stated = file.write(folder)
    try:
        recording = validate(doctor.examine(read(name, path, stated), stated, find(name).keys))
    except (DataRefused, UsageError) as refused:
        assert "\n" not in str(refused)
        return True, str(refused)
    return False, "\n".join(recording.notes)


def outcome(file: corpus.File, folder: Path) -> tuple[str, str]:
    """What the answer counts for, and the answer."""
    refused, said = answer(file, folder)
    named = [bool(re.search(quirk.named, said)) for quirk in file.quirks]
    if refused or "Warning: " in said or any(named):
        return (RIGHT if any(named) else NAMED_OTHERWISE), said
    open_ = [re.search(LEFT_OPEN.get(quirk.name, "(?!)"), said) for quirk in file.quirks]
    untold = all(oracle_odds(quirk, file.motion) < UNTOLD for quirk in file.quirks)
    if not all(open_):
        return SILENT, said
    return (UNDECIDED if untold else LEFT_OPEN_TOO_SOON), said


def oracle_odds(quirk: corpus.Quirk, name: str) -> float:
    """Odds of the quirk against a sound file for one who knows motion and noise; infinite where nothing is hidden."""
    c = corpus.motion(name)
    if quirk.name == "sign of down":
        # velocity against differences of height over 10 s; the height's error is correlated over 30 s
        every = int(10 * corpus.GPS_HZ)
        down = -np.diff(c.height_m[::every])
        variance = 2.0 * corpus.POSITION_NOISE_M**2 * (1.0 - np.exp(-10.0 / corpus.CORRELATION_S))
        return float(np.exp(min(np.sum((2.0 * down) ** 2 - 2.0 * variance) / (2.0 * variance), 700.0)))
    if quirk.name == "both turned" and c.kind == "flight":
        return 1.0  # without an attitude nothing says how the unit is turned in the aeroplane
    return np.inf


def interval(count: int, of: int) -> tuple[float, float]:
    """Clopper-Pearson, 95 %."""
    low = beta.ppf(0.025, count, of - count + 1) if count else 0.0
    high = beta.ppf(0.975, count + 1, of - count) if count < of else 1.0
    return float(low), float(high)


def counted(files: Iterable[corpus.File], folder: Path) -> dict[str, int]:
    counts = dict.fromkeys((RIGHT, UNDECIDED, LEFT_OPEN_TOO_SOON, NAMED_OTHERWISE, SILENT), 0)
    for k, file in enumerate(files):
        what, said = outcome(file, folder / str(k))
        counts[what] += 1
        if what not in (RIGHT, UNDECIDED):
            print(f"{what}: {file.name}\n    {said[-600:]}")
    total = sum(counts.values())
    for what, count in counts.items():
        low, high = interval(count, total)
        print(f"{what}: {count} of {total}, {100 * low:.1f} to {100 * high:.1f} %")
    return counts


# rows of the table "what was seen" of importers and forms, a file each: way to write, motion, quirk
SEEN = [
    ("apm-text", "car", "course in rad"),
    ("csv", "van", "km/h"),
    ("form", "aeroplane", "sign of down"),
    ("csv", "car", "latitude and longitude"),
    ("csv", "car", "both sign of x"),
    ("form", "van", "both swapped"),
    ("csv-attitude", "car", "gyro deg/s"),
    ("csv-attitude", "van", "clock jump"),
    ("form", "car", "temperature outlier"),
    pytest.param("form", "aeroplane", "velocity outlier", marks=pytest.mark.slow),
    ("csv", "van", "latitude outlier"),
    ("form", "car", "baro"),
    ("form", "car", "lever arm"),
    ("form-pulse", "van", "gamma"),
    # and logs
    ("ulog", "van", "gyros swapped"),
    ("novatel", "car", "sign of gyro z"),
    pytest.param("nmea", "car", "course in rad", marks=pytest.mark.slow),
    ("rosbag", "car", "stuck force"),
    ("mat", "van", "baro in feet"),
]
BY_NAME = {quirk.name: quirk for quirk in corpus.QUIRKS}


@pytest.mark.parametrize(
    ("writer", "motion", "name"), SEEN, ids=[": ".join(getattr(row, "values", row)) for row in SEEN]
)
def test_what_was_seen_is_right_or_refused_with_its_remedy(writer, motion, name, tmp_path):
    what, said = outcome(corpus.File(motion, writer, (BY_NAME[name],)), tmp_path / "file")
    assert what == RIGHT, said


@pytest.mark.parametrize("name", list(corpus.MOTIONS)[::2])
def test_a_sound_file_passes(name, tmp_path):
    refused, said = answer(corpus.File(name, "csv-attitude", ()), tmp_path)
    assert not refused, said
    assert "contradict" not in said


@pytest.mark.slow
def test_every_sound_file_passes(tmp_path):
    for k, file in enumerate(corpus.sound()):
        refused, said = answer(file, tmp_path / str(k))
        assert not refused, f"{file.name}: {said}"
        assert "contradict" not in said, f"{file.name}: {said}"


@pytest.mark.slow
@pytest.mark.parametrize("logs", [False, True])
def test_the_whole_corpus(tmp_path, logs):
    files = [*corpus.singles(logs), *corpus.pairs(logs=logs)]
    assert len(files) >= FEWEST_FILES
    counts = counted(files, tmp_path)
    assert counts[RIGHT] + counts[UNDECIDED] >= LEAST_RIGHT * len(files)
    assert counts[SILENT] <= MOST_SILENT * len(files)


@pytest.mark.slow
@pytest.mark.parametrize("profile", ["climb-cruise-landing", "box", "straight", "wing-rock"])
def test_a_simulated_flight_contradicts_nothing(profile):
    recording = simulate(profile, rate_hz=20.0).recording
    assert not [found.seen for found in consistency.findings(recording) if found.decided]
