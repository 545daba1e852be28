"""Damaged files over every reader: accepted or refused in one sentence, never a traceback, never slow."""

from __future__ import annotations

import gzip
import resource
import time
from pathlib import Path

import numpy as np
import pytest

from ins_eval.errors import DataRefused, StorageError, UsageError
from ins_eval.readers import FORMATS, doctor, psins_text, read
from ins_eval.recording import form
from ins_eval.recording.validation import validate
from tests.faults.mutations import mutated
from tests.recording.readers import test_logs, writers

HANGS_S = 30.0
LARGEST_KIB = 1 << 20  # of memory, beyond what stood there before
FEW, MANY = 20, 1600  # for each reader
LONGEST_SENTENCE = 2000  # a damaged mapping may hold a long key
REPEATED = 60


def unit_text() -> bytes:
    header = ["% parked", "0 0 -90 0 0 0", "34 108 380 0 100 9.78", "0.1 0.1 0.1 125 125 125"]
    return ("\n".join([*header, *["0 0 2 0 0 800", "-7 9 3 -4 0 800"] * REPEATED]) + "\n").encode()


@pytest.fixture(scope="module")
def samples(made, weaving, tmp_path_factory) -> dict[str, dict[str, bytes]]:
    """For each reader the files of a sound recording; the first is the one that is named."""
    short = {"rate_hz": 10.0, "lasted_s": 60.0}
    rocket = "ts,id,Ax,Ay,Az,Gx,Gy,Gz\n" + "".join(f"{0.01 * k:.2f},IMU0,0,-9.8,0,1,2,3\n" for k in range(60))
    chamber = "".join(f"42652,12.0,17.0,1008.{k},-18.2\n" for k in range(60))
    folder = tmp_path_factory.mktemp("form") / "own"
    file = folder.parent / "unit.imu"
    file.write_bytes(unit_text())
    form.write(psins_text.read(file, {}), folder)
    members = made.apm_text_members(**short)
    motion = weaving(10.0, 10.0)
    held = {
        name: values
        for name, values in writers.table(motion).items()
        if name in ["t", "wx", "wy", "wz", "ax", "ay", "az"]
    }
    test_logs.euroc(folder.parent, motion)
    second = writers.rosbag(folder.parent, motion, 2)
    return {
        "psins-text": {"file.imu": unit_text()},
        "psins-mat": {"file.mat": made.psins_mat(rate_hz=10.0, lasted_s=60.0)},
        "apm-mat": {"file.mat": made.apm_mat(**short)},
        "apm-text": {"file.zip": made.zipped(members), **members},
        "csv": {"file.csv": made.csv_rows(weaving(10.0, 60.0)), "file.toml": made.csv_mapping.encode()},
        "mat": {"file.mat": made.matlab(**held), "file.toml": made.csv_mapping.encode()},
        "mat, 4": {"file.mat": writers.matlab_4(held), "file.toml": made.csv_mapping.encode()},
        "mat, 7.3": {"file.mat": writers.matlab_7_3(held), "file.toml": made.csv_mapping.encode()},
        "netcdf": {"file.nc": writers.netcdf_classic(held), "file.toml": made.csv_mapping.encode()},
        "netcdf, 4": {"file.nc": writers.netcdf_4(held), "file.toml": made.csv_mapping.encode()},
        "ulog": {"file.ulg": writers.ulog(motion)},
        "dataflash": {"file.bin": writers.dataflash(motion)},
        "novatel": {"file.asc": test_logs.novatel(motion)},
        "kf-gins": {"file.txt": test_logs.kf_gins(motion)},
        "kf-gins, rtklib": {"file.txt": test_logs.kf_gins(motion), "gps.txt": test_logs.rtklib(motion)},
        "kf-gins, nmea": {"file.txt": test_logs.kf_gins(motion), "gps.txt": test_logs.nmea(motion)},
        "euroc": {"data.csv": (folder.parent / "mav0/imu0/data.csv").read_bytes()},
        "rosbag": {"file.bag": writers.rosbag(folder.parent, motion, 1).read_bytes()},
        "rosbag, 2": {path.name: path.read_bytes() for path in sorted(second.iterdir(), reverse=True)},
        "cats": {"file.csv": gzip.compress(rocket.encode()), "plain.csv": rocket.encode()},
        "mems-chamber": {"file.csv": gzip.compress(chamber.encode()), "plain.csv": chamber.encode()},
        "ins-recording": {path.name: path.read_bytes() for path in sorted(folder.iterdir())},
    }


def damaged(name: str, files: dict[str, bytes], folder: Path, rng: np.random.Generator, zipped) -> Path:
    """Write the files of a reader with one of them damaged; the path to name."""
    names = list(files)
    chosen = names[rng.integers(len(names))]
    spoilt = files | {chosen: mutated(chosen, files[chosen], rng)}
    first = names[0]
    if name == "apm-text" and chosen != first:
        spoilt[first] = zipped({member: spoilt[member] for member in names[1:]})  # sound archive, damaged table
    if chosen == "plain.csv":
        spoilt[first] = spoilt[chosen]
    for file, content in spoilt.items():
        (folder / file).write_bytes(content)
    return folder if name in FOLDERS else folder / first


def outcome(name: str, path: Path) -> str:
    """What became of it."""
    began = time.process_time()
    try:
        form_name = name.partition(",")[0]
        assumed = ASSUMED.get(form_name, {})
        if (path.parent / "gps.txt").is_file():
            assumed = {"gps.file": str(path.parent / "gps.txt")}
        recording = validate(doctor.examine(read(form_name, path, assumed), assumed, FORMATS[form_name].keys))
    except (DataRefused, UsageError, StorageError) as refused:
        message = str(refused).split("\n\n")[0]
        assert "\n" not in message and 20 < len(message) < LONGEST_SENTENCE + len(str(path)), message
        found = "refused"
    else:
        assert np.isfinite(recording.imu.gyro).all() and np.isfinite(recording.imu.accelerometer).all()
        assert all("\n" not in note for note in recording.notes)
        found = "accepted"
    assert time.process_time() - began < HANGS_S
    return found


VARIANTS = ("mat, 4", "mat, 7.3", "netcdf, 4", "kf-gins, rtklib", "kf-gins, nmea", "rosbag, 2")
FOLDERS = {"ins-recording", "rosbag, 2"}
PLACE = {"latitude_deg": "40", "longitude_deg": "17"}
ASSUMED = {"kf-gins": PLACE, "euroc": PLACE, "novatel": {"imu.model": "LN200"}}
NEVER_ACCEPTED = {"cats", "mems-chamber"}


@pytest.mark.parametrize("name", sorted({*FORMATS, *VARIANTS}))
@pytest.mark.parametrize("count", [FEW, pytest.param(MANY, marks=pytest.mark.slow)])
def test_damaged_files(samples, made, tmp_path, record_property, name, count):
    rng = np.random.default_rng(sum(name.encode()))
    sound = {"refused": 0, "accepted": 0}
    for file, content in samples[name].items():
        (tmp_path / file).write_bytes(content)
    first = tmp_path if name in FOLDERS else tmp_path / next(iter(samples[name]))
    assert outcome(name, first) == ("refused" if name in NEVER_ACCEPTED else "accepted")
    before_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(count):
        sound[outcome(name, damaged(name, samples[name], tmp_path, rng, made.zipped))] += 1
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kib < LARGEST_KIB
    record_property("outcomes", f"{sound}")
    assert sound["refused"] > count // 20, sound


@pytest.mark.parametrize("name", sorted(set(FORMATS) - {"ins-recording"}))
@pytest.mark.parametrize(
    "content", [b"", b"\0" * 5000, bytes(range(256)) * 40, b"\x1f\x8b\x08" + b"x" * 300, b"PK\x03\x04" + b"y" * 300]
)
def test_rubbish(tmp_path, made, name, content):
    (tmp_path / "file.toml").write_text(made.csv_mapping)
    (tmp_path / "file.csv").write_bytes(content)
    assert outcome(name, tmp_path / "file.csv") == "refused"
