"""Logs of autopilots, receivers and robots: written from one motion by their own rules, the motion must come back."""

from __future__ import annotations

import gzip

import numpy as np
import pytest

from ins_eval.errors import DataRefused, UsageError
from ins_eval.readers import doctor, read
from ins_eval.readers.novatel import SCALES, crc32
from ins_eval.recording.validation import validate
from tests.recording.readers import writers

SINGLE = 2e-6  # relative, of 32 bit floats
STAMP_S = 1e-6
MILLIMETRE_RAD = 1e-3 / 6.4e6
E7_RAD = np.radians(1e-7)
RATE_HZ, LASTED_S = 20.0, 10.0
STEP_S = 1.0 / RATE_HZ
PLACE = {"latitude_deg": "40.1", "longitude_deg": "17.2", "height_m": "100"}
EPOCH, LEAP_S = 1714558830, 18  # 2024-05-01T10:20:30Z
WEEK, SECOND = divmod(EPOCH - 315964800 + LEAP_S, 604800)


@pytest.fixture(scope="module")
def motion(weaving):
    return weaving(RATE_HZ, LASTED_S)


def imported(folder, form: str, name: str, content: bytes, **assumed: str):
    (folder / name).write_bytes(content)
    return read(form, folder / name, {key.replace("__", "."): value for key, value in assumed.items()})


def trapezoids(values: np.ndarray) -> np.ndarray:
    return 0.5 * STEP_S * (values[1:] + values[:-1])


def assert_fixes(fixes, motion, every: int, place_rad: float = MILLIMETRE_RAD, metres: float = 1e-3):
    np.testing.assert_allclose(fixes.latitude_rad, motion.latitude[::every], atol=place_rad)
    np.testing.assert_allclose(fixes.longitude_rad, motion.longitude[::every], atol=place_rad)
    np.testing.assert_allclose(fixes.height_m, motion.height[::every], atol=metres)


# ---------------------------------------------------------------------------------------------- autopilots


@pytest.mark.parametrize("packed", [False, True])
def test_px4(tmp_path, motion, packed):
    raw = writers.ulog(motion)
    recording = validate(imported(tmp_path, "ulog", "log.ulg", gzip.compress(raw) if packed else raw))
    np.testing.assert_allclose(recording.imu.gyro, STEP_S * motion.rate_b, rtol=SINGLE, atol=1e-9)
    np.testing.assert_allclose(recording.imu.accelerometer, STEP_S * motion.force_b, rtol=SINGLE, atol=1e-8)
    np.testing.assert_allclose(recording.imu.time_s, 100.0 + motion.time_s, atol=STAMP_S)
    assert_fixes(recording.gps, motion, 5)
    np.testing.assert_allclose(recording.gps.velocity_n, motion.velocity_n[::5], rtol=SINGLE, atol=1e-6)
    np.testing.assert_allclose(recording.reference.attitude_rad, motion.attitude, atol=1e-6)
    assert_fixes(recording.solution, motion, 5, 1e-9, 1e-2)  # its metres are floats beside a float origin
    assert "Found 1 dropouts of the logger, 0.04 s in all." in recording.notes


def test_another_imu_of_px4(tmp_path, motion):
    raw = writers.ulog(motion)
    recording = imported(tmp_path, "ulog", "log.ulg", raw, imu__instance="1")
    np.testing.assert_allclose(recording.imu.gyro, 1.01 * STEP_S * motion.rate_b, rtol=SINGLE, atol=1e-9)
    with pytest.raises(UsageError, match="kind: 'fly' is not known"):
        imported(tmp_path, "ulog", "log.ulg", raw, kind="fly")
    with pytest.raises(UsageError, match="has the IMUs 1; choose one"):
        imported(tmp_path, "ulog", "log.ulg", raw, imu__instance="2")


def test_the_real_px4_log(real):
    path = real("log_formats") / "px4_sample.ulg.gz"
    with pytest.raises(UsageError, match=r"--assume latitude_deg=DEG"):
        read("ulog", path, {})
    recording = validate(doctor.examine(read("ulog", path, PLACE), PLACE, doctor.KEYS))
    said = "\n".join(recording.notes)
    assert "17070 samples of sensor_combined" in said and "Found 4 dropouts of the logger, 0.119 s in all." in said
    assert "along up (0.99 of it)" in said
    assert recording.solution is None  # its local position marks neither x, y nor their velocity as valid


def test_ardupilot(tmp_path, motion):
    recording = validate(imported(tmp_path, "dataflash", "log.bin", writers.dataflash(motion, (3, 1))))
    np.testing.assert_allclose(recording.imu.gyro, trapezoids(motion.rate_b), rtol=SINGLE, atol=1e-8)
    np.testing.assert_allclose(recording.imu.accelerometer, trapezoids(motion.force_b), rtol=SINGLE, atol=1e-7)
    assert_fixes(recording.gps, motion, 5, E7_RAD, 1e-4)
    np.testing.assert_allclose(recording.gps.velocity_n, motion.velocity_n[::5], atol=1e-5)
    np.testing.assert_allclose(
        recording.reference.attitude_rad[:, :2] % (2 * np.pi), motion.attitude[:, :2] % (2 * np.pi), atol=1e-5
    )
    said = "\n".join(recording.notes)
    assert "of 2 boots, of which number 2 is read" in said and "IMU 0 of 0, 1 is read" in said


def test_a_boot_and_another_imu_of_ardupilot(tmp_path, motion):
    raw = writers.dataflash(motion, (3, 1))
    recording = imported(tmp_path, "dataflash", "log.bin", raw, boot="1", imu__instance="1")
    n = len(motion.time_s) // 3
    np.testing.assert_allclose(recording.imu.gyro, 1.01 * trapezoids(motion.rate_b[:n]), rtol=SINGLE, atol=1e-8)
    assert recording.imu.temperature_c[0] == 26.0
    with pytest.raises(UsageError, match="has 2 boots; choose 1 to 2"):
        imported(tmp_path, "dataflash", "log.bin", raw, boot="3")


def test_the_real_ardupilot_log(real):
    recording = validate(read("dataflash", real("log_formats") / "ardupilot_test.BIN", {}))
    assert len(recording.gps.time_s) == 5 and len(recording.reference.time_s) == 24
    np.testing.assert_allclose(np.degrees(recording.gps.latitude_rad), -35.36263, atol=1e-5)
    assert recording.imu.temperature_c[0] == pytest.approx(44.42, abs=0.01)


# ---------------------------------------------------------------------------------- receivers beside an IMU


def rtklib(motion, time: str = "date", place: str = "geodetic") -> bytes:
    names = {
        "geodetic": "latitude(deg) longitude(deg)  height(m)",
        "ecef": "x-ecef(m)      y-ecef(m)      z-ecef(m)",
    }[place]
    lines = ["% program   : RTKPOST", f"%  GPST                  {names}   Q  ns   sdn(m)   sde(m)   sdu(m)"]
    xyz = writers.earth_fixed(motion.latitude, motion.longitude, motion.height)
    for k in range(0, len(motion.time_s), 10):
        at = np.datetime64(EPOCH + LEAP_S, "s") + np.timedelta64(round(1000 * motion.time_s[k]), "ms")
        stamp = (
            str(at).replace("-", "/").replace("T", " ") if time == "date" else f"{WEEK} {SECOND + motion.time_s[k]:.3f}"
        )
        values = [np.degrees(motion.latitude[k]), np.degrees(motion.longitude[k]), motion.height[k]]
        values = values if place == "geodetic" else xyz[k]
        lines.append(f"{stamp} " + " ".join(f"{v:.9f}" for v in values) + "   1  12 0.0100 0.0100 0.0200")
    return ("\n".join(lines) + "\n").encode()


def nmea(motion) -> bytes:
    lines = []

    def sentence(text: str) -> None:
        checksum = 0
        for byte in text.encode():
            checksum ^= byte
        lines.append(f"${text}*{checksum:02X}")

    def angle(rad: float, width: int) -> str:
        degrees = np.degrees(rad)
        return f"{int(degrees):0{width}d}{60.0 * (degrees - int(degrees)):011.8f}"

    for k in range(0, len(motion.time_s), 10):
        at = np.datetime64(EPOCH, "s") + np.timedelta64(round(1000 * motion.time_s[k]), "ms")
        clock = str(at)[11:].replace(":", "")[:9]
        place = f"{angle(motion.latitude[k], 2)},N,{angle(motion.longitude[k], 3)},E"
        north, east, _ = motion.velocity_n[k]
        knots, course = np.hypot(north, east) * 3600.0 / 1852.0, np.degrees(np.arctan2(east, north)) % 360.0
        sentence(f"GPGGA,{clock},{place},1,08,0.9,{motion.height[k] - 40.0:.4f},M,40.0,M,,")
        sentence(f"GPRMC,{clock},A,{place},{knots:.5f},{course:.5f},010524,,,A")
        sentence("GPGSV,1,1,00")
    return ("\r\n".join(lines) + "\r\n").encode()


def kf_gins(motion) -> bytes:
    rows = np.column_stack([SECOND + motion.time_s, STEP_S * motion.rate_b, STEP_S * motion.force_b])
    return "".join(" ".join(f"{value:.12f}" for value in row) + "\n" for row in rows).encode()


@pytest.mark.parametrize(("time", "place"), [("date", "geodetic"), ("week", "geodetic"), ("date", "ecef")])
def test_rtklib_beside_the_imu_of_kf_gins(tmp_path, motion, time, place):
    (tmp_path / "rover.pos").write_bytes(rtklib(motion, time, place))
    recording = validate(
        imported(tmp_path, "kf-gins", "imu.txt", kf_gins(motion), gps__file=str(tmp_path / "rover.pos"))
    )
    np.testing.assert_allclose(recording.imu.gyro, STEP_S * motion.rate_b, atol=1e-11)
    np.testing.assert_allclose(recording.imu.time_s, SECOND + motion.time_s, atol=STAMP_S)
    np.testing.assert_allclose(recording.gps.time_s, SECOND + motion.time_s[::10], atol=STAMP_S)
    assert_fixes(recording.gps, motion, 10)
    assert recording.gps.position_sigma_m[0] == pytest.approx(np.sqrt(2e-4), rel=1e-6)
    said = "\n".join(recording.notes)
    assert "taken as the seconds of the GPS week" in said and "of quality 1" in said


def test_nmea_beside_a_table(tmp_path, made, motion):
    (tmp_path / "gps.txt").write_bytes(nmea(motion))
    shifted = motion.time_s + EPOCH
    columns = writers.table(motion) | {"t": shifted}
    (tmp_path / "log.toml").write_text(made.csv_mapping)
    recording = imported(tmp_path, "csv", "log.csv", writers.csv(columns), gps__file=str(tmp_path / "gps.txt"))
    np.testing.assert_allclose(recording.gps.time_s, motion.time_s[::10], atol=STAMP_S)
    assert_fixes(recording.gps, motion, 10)
    np.testing.assert_allclose(recording.gps.velocity_n[:, :2], motion.velocity_n[::10, :2], atol=1e-4)
    assert np.isnan(recording.gps.velocity_n[:, 2]).all() and recording.gps.valid.all()
    assert "taken as UTC, seconds since 1970" in "\n".join(recording.notes)


def test_receivers_that_do_not_belong_to_the_imu_are_refused(tmp_path, motion):
    (tmp_path / "rover.pos").write_bytes(rtklib(motion))
    late = kf_gins(motion).replace(f"{SECOND // 1000}".encode(), f"{SECOND // 1000 + 5}".encode())
    with pytest.raises(DataRefused, match="expected an overlap in UTC, the GPS week or the UTC day"):
        imported(tmp_path, "kf-gins", "imu.txt", late, gps__file=str(tmp_path / "rover.pos"))
    (tmp_path / "rover.pos").write_bytes(rtklib(motion).replace(b"   1  12", b"   1  x2", 1))
    with pytest.raises(DataRefused, match=r"rover.pos, line 3: .*correct that line"):
        imported(tmp_path, "kf-gins", "imu.txt", kf_gins(motion), gps__file=str(tmp_path / "rover.pos"))


def test_kf_gins_with_its_own_fixes_and_truth(tmp_path, motion):
    north_east_down = motion.velocity_n
    degrees = [np.degrees(motion.latitude), np.degrees(motion.longitude), motion.height]
    fixes = np.column_stack([SECOND + motion.time_s, *degrees, np.full((len(motion.time_s), 3), 0.02)])[::20]
    truth = np.column_stack(
        [
            0 * motion.time_s + WEEK,
            SECOND + motion.time_s,
            *degrees,
            north_east_down,
            np.degrees(motion.attitude) % 360.0,
        ]
    )
    np.savetxt(tmp_path / "gnss.txt", fixes, fmt="%.10f")
    np.savetxt(tmp_path / "truth.nav", truth, fmt="%.10f")
    files = {"gps__file": str(tmp_path / "gnss.txt"), "reference__file": str(tmp_path / "truth.nav")}
    recording = validate(imported(tmp_path, "kf-gins", "imu.txt", kf_gins(motion), **files))
    assert_fixes(recording.gps, motion, 20)
    assert_fixes(recording.reference, motion, 1)
    np.testing.assert_allclose(recording.start.attitude_rad[2], motion.attitude[0, 2], atol=1e-9)
    assert recording.gps.position_sigma_m[0] == pytest.approx(0.02)


# ------------------------------------------------------------------------------------------------- NovAtel


def novatel(motion, gyro: float = 2.0**-19, force: float = 2.0**-14, short: bool = True) -> bytes:
    """Counts of an LN200 turned to right-forward-up, y with the opposite sign; fixes each second."""
    lines = []

    def sentence(name: str, at: float, body: str) -> None:
        brief = name in ("RAWIMUSA", "INSPVASA")
        head = (
            f"{name},{WEEK},{at:.3f}" if brief else f"{name},COM1,0,50.0,FINESTEERING,{WEEK},{at:.3f},00000000,0000,0"
        )
        text = f"{head};{body}"
        lines.append(f"{'%' if brief else '#'}{text}*{crc32(text.encode()):08x}")

    lost = np.zeros(6)
    for k, at in enumerate(SECOND + motion.time_s):
        (wf, wr, wd), (ff, fr, fd) = STEP_S * motion.rate_b[k] / gyro, STEP_S * motion.force_b[k] / force
        exact = np.array([-fd, -ff, fr, -wd, -wf, wr]) + lost
        counts = np.rint(exact)
        lost = exact - counts
        name = "RAWIMUSA" if short else "RAWIMUA"
        sentence(name, at, f"{WEEK},{at:.6f},00000077," + ",".join(f"{count:.0f}" for count in counts))
        north, east, down = motion.velocity_n[k]
        place = f"{np.degrees(motion.latitude[k]):.11f},{np.degrees(motion.longitude[k]):.11f}"
        if k % 20 == 0:
            sentence(
                "BESTPOSA",
                at,
                f'SOL_COMPUTED,SINGLE,{place},{motion.height[k] - 30:.4f},30.0000,WGS84,1.0,1.0,2.0,"",0.0,0.0,9,9',
            )
            course = np.degrees(np.arctan2(east, north)) % 360.0
            sentence(
                "BESTVELA",
                at,
                f"SOL_COMPUTED,DOPPLER,0.000,0.000,{np.hypot(north, east):.6f},{course:.7f},{-down:.6f},0.0",
            )
        roll, pitch, heading = np.degrees(motion.attitude[k])
        moving = f"{north:.6f},{east:.6f},{-down:.6f},{roll:.9f},{pitch:.9f},{heading % 360.0:.9f}"
        sentence(
            "INSPVASA" if short else "INSPVAA",
            at,
            f"{WEEK},{at:.6f},{place},{motion.height[k]:.4f},{moving},INS_SOLUTION_GOOD",
        )
    return ("\r\n".join(lines) + "\r\n").encode()


@pytest.mark.parametrize("short", [True, False])
def test_novatel(tmp_path, motion, short):
    raw = novatel(motion, short=short)
    recording = validate(imported(tmp_path, "novatel", "log.asc", raw, imu__model="LN200"))
    # counts are whole, so that sums are right to a count
    np.testing.assert_allclose(
        np.cumsum(recording.imu.gyro, axis=0), STEP_S * np.cumsum(motion.rate_b, axis=0), atol=2.0**-19
    )
    np.testing.assert_allclose(
        np.cumsum(recording.imu.accelerometer, axis=0), STEP_S * np.cumsum(motion.force_b, axis=0), atol=2.0**-14
    )
    assert_fixes(recording.gps, motion, 20)
    np.testing.assert_allclose(recording.gps.velocity_n, motion.velocity_n[::20], atol=1e-5)
    assert_fixes(recording.solution, motion, 1)
    np.testing.assert_allclose(recording.solution.attitude_rad[:, :2], motion.attitude[:, :2], atol=1e-9)


def test_the_checksum_is_that_of_the_manual():
    """The example of the manual of BESTPOS, whose checksum a direct evaluation of the polynomial gives."""
    text = b"BESTPOSA,COM1,0,90.5,FINESTEERING,1949,403742.000,02000000,b1f6,32768;SOL_COMPUTED,SINGLE,51.1,-114.0"
    value = 0
    for byte in text:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xEDB88320 if value & 1 else 0)
    assert crc32(text) == value


# rad and m/s a count as the GearBox decoder prints them (imudecoder.h), those of the HG1700-AG62 verified on hardware
PRINTED_COUNTS = {
    "HG1700-AG58": (1.16415321826934814453e-10, 2.27094150781631469727e-9),
    "HG1700-AG62": (1.16415321826934814453e-10, 4.54188301563262939453e-9),
    "LN200": (1.9073486328125e-6, 6.103515625e-5),
}


@pytest.mark.parametrize("unit", PRINTED_COUNTS)
def test_a_count_of_a_novatel_unit_is_the_printed_one(unit):
    assert SCALES[unit] == pytest.approx(PRINTED_COUNTS[unit], rel=1e-12)


def test_novatel_needs_its_scale_factors_and_counts_damage(tmp_path, motion):
    raw = novatel(motion)
    with pytest.raises(UsageError, match=r"its counts need the scale factors of the unit; --assume imu.model=NAME"):
        imported(tmp_path, "novatel", "log.asc", raw)
    with pytest.raises(UsageError, match="'LN20' is not known; did you mean 'LN200'"):
        imported(tmp_path, "novatel", "log.asc", raw, imu__model="LN20")
    lines = raw.split(b"\r\n")
    fix = next(k for k, line in enumerate(lines) if line.startswith(b"#BESTPOSA"))
    lines[fix] = lines[fix].replace(b"SINGLE", b"SINGLX")
    scales = {"gyro__scale": str(2.0**-19), "accelerometer__scale": str(2.0**-14)}
    recording = imported(tmp_path, "novatel", "log.asc", b"\r\n".join(lines), **scales)
    assert "1 damaged lines were left out" in recording.notes[0]
    assert np.isnan(recording.gps.latitude_rad[0]) and recording.gps.valid[0]


# ------------------------------------------------------------------------------------------- EuRoC and ROS


def euroc(folder, motion) -> None:
    """Axes up-right-forward, ground truth from there into east-north-up, stamps in ns."""
    (folder / "mav0/imu0").mkdir(parents=True)
    (folder / "mav0/state_groundtruth_estimate0").mkdir()
    turned = np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]])
    stamps = [EPOCH * 10**9 + round(1e9 * t) for t in motion.time_s]
    rows = np.column_stack([motion.rate_b @ turned.T, motion.force_b @ turned.T])
    units = {"w": "rad s^-1", "a": "m s^-2"}
    head = ",".join(["#timestamp [ns]", *(f"{s}_RS_S_{axis} [{unit}]" for s, unit in units.items() for axis in "xyz")])
    text = [head, *(f"{t}," + ",".join(f"{v:.15f}" for v in row) for t, row in zip(stamps, rows, strict=True))]
    (folder / "mav0/imu0/data.csv").write_text("\n".join(text) + "\n")
    from scipy.spatial.transform import Rotation

    roll, pitch, heading = motion.attitude.T
    to_ned = Rotation.from_euler("ZYX", np.column_stack([heading, pitch, roll])).as_matrix()
    to_enu = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
    quaternion = Rotation.from_matrix(to_enu @ to_ned @ turned.T).as_quat()[:, [3, 0, 1, 2]]
    rows = np.column_stack(
        [writers.local(motion) @ to_enu.T, quaternion, motion.velocity_n @ to_enu.T, np.zeros((len(roll), 6))]
    )
    text = ["#timestamp," + ",".join(f"c{k}" for k in range(16))]
    text += [f"{t}," + ",".join(f"{v:.12f}" for v in row) for t, row in zip(stamps, rows, strict=True)]
    (folder / "mav0/state_groundtruth_estimate0/data.csv").write_text("\n".join(text) + "\n")


def test_euroc(tmp_path, motion):
    euroc(tmp_path, motion)
    place = {
        "latitude_deg": repr(float(np.degrees(motion.latitude[0]))),
        "longitude_deg": repr(float(np.degrees(motion.longitude[0]))),
        "height_m": repr(float(motion.height[0])),
    }
    recording = validate(read("euroc", tmp_path, place))
    np.testing.assert_allclose(recording.imu.gyro, trapezoids(motion.rate_b), atol=1e-6)
    np.testing.assert_allclose(recording.imu.accelerometer, trapezoids(motion.force_b), atol=1e-5)
    assert_fixes(recording.reference, motion, 1)
    np.testing.assert_allclose(recording.reference.attitude_rad, motion.attitude, atol=1e-8)
    np.testing.assert_allclose(recording.reference.velocity_n, motion.velocity_n, atol=1e-8)
    with pytest.raises(UsageError, match="does not say where it was made"):
        read("euroc", tmp_path, {})


@pytest.mark.parametrize("version", [1, 2])
def test_ros(tmp_path, motion, version):
    path = writers.rosbag(tmp_path, motion, version)
    recording = validate(read("rosbag", path, {}))
    np.testing.assert_allclose(recording.imu.gyro, trapezoids(motion.rate_b), atol=1e-6)
    np.testing.assert_allclose(recording.imu.accelerometer, trapezoids(motion.force_b), atol=1e-5)
    assert_fixes(recording.gps, motion, 5)
    np.testing.assert_allclose(recording.gps.velocity_n, motion.velocity_n[::5], atol=1e-9)
    np.testing.assert_allclose(recording.reference.attitude_rad, motion.attitude, atol=1e-9)
    np.testing.assert_allclose(recording.solution.velocity_n, motion.velocity_n[::5], atol=1e-9)
    with pytest.raises(UsageError, match="has no such topic of sensor_msgs/msg/Imu; did you mean '/imu/data'"):
        read("rosbag", path, {"imu.topic": "/imu/dat"})
