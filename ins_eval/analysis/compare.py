"""The recorded IMU against the one that a reference trajectory implies, channel by channel."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ins_eval import channels
from ins_eval.alignment import Alignment, align
from ins_eval.believed import belief_rows, believed, velocity_increments
from ins_eval.channels import ChannelEstimate, FittedChannel, Windows, find_clock, fit_channels, in_windows
from ins_eval.effects import turned_start, without_effects
from ins_eval.errors import DataRefused
from ins_eval.implied import epoch_spacing_s, implied_increments
from ins_eval.recording import PARKED, Fixes, Recording, Start
from ins_eval.recording.stillness import ENOUGH_FOR_ALIGNMENT_S, Stretch, choose_alignment, still_stretches
from ins_eval.trajectory import Increments
from ins_eval.tree import as_tree
from ins_eval.units import DEG

if TYPE_CHECKING:
    import pandas as pd

WINDOW_S = 1.0  # at least, and never below the spacing of the reference's epochs
STANDSTILL_WINDOW_S, LONG_STANDSTILL_S = 5.0, 300.0  # coarse counts average out where there is time enough
STANDSTILL_SPACING_S = 1.0


@dataclass(frozen=True, eq=False)
class Known:
    """What the recording is held against, and how it is known."""

    fixes: Fixes
    kind: str  # "ins" or "standstill"
    attitude: str  # "reference", "given" or "aligned"
    time_offset_s: float = 0.0
    lever_arm_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    attitude_sigma_rad: tuple[float, float, float] | None = None


@dataclass(frozen=True, eq=False)
class ComparedChannel:
    """One channel: its fit, what remains with the clock that was found (None: none was), and the bias believed."""

    fitted: FittedChannel
    rms_with_clock: float | None
    believed_bias: float

    @property
    def sensor(self) -> str:
        """ "gyro" or "accelerometer"."""
        return self.fitted.name.rsplit("_", 1)[0]

    @property
    def axis(self) -> str:
        """ "x", "y" or "z"."""
        return "xyz"[self.fitted.axis]

    @property
    def scale_error(self) -> ChannelEstimate | None:
        """None where the motion does not determine it."""
        return self.fitted.terms[self.fitted.axis]

    @property
    def found_minus_believed(self) -> ChannelEstimate | None:
        """Of the bias; None where none is believed."""
        if not self.believed_bias:
            return None
        found = self.fitted.bias or self.fitted.mean_difference
        ends = {key: getattr(found, key) - self.believed_bias for key in ("value", "low", "high")}
        return replace(found, **ends)


@dataclass(frozen=True, eq=False)
class RecordingComparison:
    """A recording against what its reference implies.

    `fitted` holds one channel for each gyro and accelerometer, over `windows`; `close` are the shortest windows that
    the reference allows. `clock` is the offset that the gyros show, None where they cannot; `fitted_with_clock` are
    the channels with it, `used_s` is the offset that `windows` have.
    """

    recording: Recording
    known: Known
    windows: Windows
    close: Windows
    fitted: tuple[FittedChannel, ...]
    fitted_with_clock: tuple[FittedChannel, ...] | None
    clock: ChannelEstimate | None
    used_s: float

    def to_frame(self) -> pd.DataFrame:
        """One row a channel: bias and scale factor with 95 % intervals, RMS as recorded and after the fit; SI."""
        import pandas as pd

        rows = {}
        for channel in self.fitted:
            bias, scale = channel.bias or channel.mean_difference, channel.terms[channel.axis]
            rows[channel.name] = {
                "bias": bias.value,
                "bias_low": bias.low,
                "bias_high": bias.high,
                "scale_error": None if scale is None else scale.value,
                "scale_error_low": None if scale is None else scale.low,
                "scale_error_high": None if scale is None else scale.high,
                "rms_as_recorded": channel.rms_before,
                "rms_after_fit": channel.rms_after,
            }
        return pd.DataFrame.from_dict(rows, orient="index").rename_axis("channel")

    @property
    def rate_hz(self) -> float:
        """Samples a second."""
        return round(1.0 / float(np.median(np.diff(self.recording.imu.time_s))), 6)

    @property
    def duration_s(self) -> float:
        """Length of the recording."""
        return float(self.recording.imu.time_s[-1] - self.recording.start.time_s)

    @property
    def clock_reason(self) -> str:
        """Why no offset of the clocks was found."""
        if self.known.kind == "standstill":
            return "nothing moves at a standstill"
        return f"the motion does not determine it to {1e3 * channels.CLOCK_LIMIT_S:g} ms"

    @property
    def level_sigma_deg(self) -> float | None:
        """How well roll and pitch of a standstill are known; None: exactly, or they are those of a reference."""
        sigma_rad = self.known.attitude_sigma_rad
        return None if sigma_rad is None else max(sigma_rad[:2]) / DEG

    @cached_property
    def channels(self) -> dict[str, list[ComparedChannel]]:
        """The channels x, y, z of "gyro" and of "accelerometer"."""
        belief, pulses = self.recording.belief, self.recording.imu.accelerometer_form == "pulse"
        # of pulses the believed bias is in the velocity already
        force = (0.0, 0.0, 0.0) if pulses else belief.accelerometer.bias_mps2
        found: dict[str, list[ComparedChannel]] = {"gyro": [], "accelerometer": []}
        for k, (one, bias) in enumerate(zip(self.fitted, (*belief.gyro.bias_radps, *force), strict=True)):
            rms = None if self.fitted_with_clock is None else self.fitted_with_clock[k].rms_after
            channel = ComparedChannel(one, rms, bias)
            found[channel.sensor].append(channel)
        return found

    @cached_property
    def tree(self) -> dict[str, Any]:
        """The tree ``ins-eval-comparison/1`` of ``metrics.json``."""
        recording, known, windows = self.recording, self.known, self.windows
        reference = {
            "kind": known.kind,
            "attitude": known.attitude,
            "epoch_spacing_s": epoch_spacing_s(known.fixes),
            "window_s": windows.length_s,
            "windows": int(windows.time_s.size),
            "first_s": float(windows.time_s[0] - windows.length_s),
            "last_s": float(windows.time_s[-1]),
            "blocks": channels.BLOCKS,
            "scale_limit": channels.LIMIT,
        }
        if known.attitude_sigma_rad is not None:
            heading_deg = known.attitude_sigma_rad[2] / DEG
            reference |= {"level_sigma_deg": self.level_sigma_deg, "heading_sigma_deg": heading_deg}
        clock: dict[str, Any] = {"believed_s": known.time_offset_s, "used_s": self.used_s, "found_s": None}
        if self.clock is None:
            clock["reason"] = self.clock_reason
        else:
            ends = [self.clock.low, self.clock.high]
            clock |= {"found_s": self.clock.value, "standard_error_s": self.clock.standard_error, "interval95_s": ends}
        return {
            "format": "ins-eval-comparison/1",
            "recording": {
                "name": recording.name,
                "kind": recording.kind,
                "rate_hz": self.rate_hz,
                "duration_s": self.duration_s,
                "notes": list(recording.notes),
            },
            "belief": as_tree(belief_rows(recording)),
            "reference": reference,
            "clock": clock,
            **{sensor: {one.axis: _channel(one) for one in triad} for sensor, triad in self.channels.items()},
        }


def compare_recording(recording: Recording, use_found_offset: bool = False) -> RecordingComparison:
    """Compare a recording with its reference, or with the standstill that it is known to have had.

    With `use_found_offset` the clock offset that the gyros show is used instead of the believed one.
    Raises: DataRefused.
    """
    recording = believed(recording)
    recording, velocity = without_effects(recording, _velocity(recording), recording.folder)
    recording = replace(recording, start=turned_start(recording.start, recording.belief))
    recorded = Increments(recording.imu.time_s, recording.imu.gyro, velocity)
    known = _known(recording, recorded)
    start_s, earth = recording.start.time_s, recording.belief.earth

    def implied_at(offset_s: float) -> Increments:
        return implied_increments(known.fixes, recorded.time_s, start_s, offset_s, known.lever_arm_m, earth)

    def windows_at(offset_s: float, length_s: float) -> Windows:
        return in_windows(recorded, implied_at(offset_s), start_s, length_s, stamp_s - offset_s)

    length_s, stamp_s = _window_s(known), float(known.fixes.time_s[0])
    clock = None
    if known.kind == "ins":
        clock = find_clock(recorded, implied_at, start_s, length_s, stamp_s, known.time_offset_s)
    used_s = clock.value if clock is not None and use_found_offset else known.time_offset_s
    windows = windows_at(used_s, length_s)
    fitted = fit_channels(windows)
    with_clock = None if clock is None else fit_channels(windows_at(clock.value, length_s))

    close = windows_at(used_s, max(epoch_spacing_s(known.fixes), float(np.median(np.diff(recorded.time_s)))))
    return RecordingComparison(recording, known, windows, close, fitted, with_clock, clock, used_s)


def _window_s(known: Known) -> float:
    spacing_s = epoch_spacing_s(known.fixes)
    if known.kind == "standstill" and np.count_nonzero(known.fixes.valid) * spacing_s >= LONG_STANDSTILL_S:
        return STANDSTILL_WINDOW_S
    return spacing_s * max(1, round(WINDOW_S / spacing_s))


def _velocity(recording: Recording) -> np.ndarray:
    """Velocity increments (n, 3) in m/s as recorded; of pulses, what the recording believes they are worth."""
    found = velocity_increments(recording)
    if found is None:
        raise DataRefused(
            f"{recording.folder}: the accelerometers deliver pulses, and recording.toml does not say what one is "
            "worth; expected [accelerometer.x], [accelerometer.y] and [accelerometer.z], add them"
        )
    return found


def _known(recording: Recording, recorded: Increments) -> Known:
    reference, believed = recording.reference, recording.belief.reference
    if reference is not None and reference.attitude_rad is not None and np.isfinite(reference.attitude_rad).any():
        return Known(reference, "ins", "reference", believed.time_offset_s, believed.lever_arm_m)
    if recording.kind in PARKED or recording.start.still_until_s is not None:
        return _standstill(recording, recorded)
    raise DataRefused(
        f"{recording.name}: it moves and has no reference with attitude, and only a known motion implies what an IMU "
        "measures; expected a reference table with roll_deg, pitch_deg and heading_deg, or a recording at rest"
    )


def _standstill(recording: Recording, recorded: Increments) -> Known:
    """The standstill at the start's position, in the stretches that are quiet.

    An attitude that comes with its sigma is taken. Else each long quiet stretch is aligned by itself, since a vehicle
    settles differently after every disturbance; where the gyros cannot find north, a given attitude is taken after all.
    """
    start = recording.start
    stretches = _stretches(recording)
    attitudes = [start.attitude_rad] * len(stretches)
    sigmas, source = start.attitude_sigma_rad, "given"
    if sigmas is None:
        try:
            found = [_aligned(start, recorded, stretch) for stretch in stretches]
        except DataRefused:
            if start.attitude_rad is None:
                raise
        else:
            attitudes, source = [alignment.start.attitude_rad for alignment in found], "aligned"
            level = max(alignment.level_sigma_rad for alignment in found)
            sigmas = (level, level, max(alignment.heading_sigma_rad for alignment in found))
    time_s = np.arange(start.time_s, recorded.time_s[-1] + STANDSTILL_SPACING_S, STANDSTILL_SPACING_S)
    attitude = np.full((time_s.size, 3), np.nan)
    for stretch, angles in zip(stretches, attitudes, strict=True):
        attitude[(time_s >= stretch.start_s - 1e-6) & (time_s <= stretch.end_s + 1e-6)] = angles
    fixes = Fixes(
        time_s,
        np.full(time_s.size, start.latitude_rad),
        np.full(time_s.size, start.longitude_rad),
        np.full(time_s.size, start.height_m),
        np.zeros((time_s.size, 3)),
        np.isfinite(attitude).all(axis=1),
        attitude,
    )
    return Known(fixes, "standstill", source, attitude_sigma_rad=sigmas)


def _stretches(recording: Recording) -> list[Stretch]:
    """Where the vehicle stood: as written down, or the quiet stretches that are long enough, at least the longest."""
    if recording.start.still_until_s is not None:
        return [Stretch(recording.start.time_s, recording.start.still_until_s)]
    quiet = still_stretches(recording.imu)
    return [s for s in quiet if s.duration_s >= ENOUGH_FOR_ALIGNMENT_S] or [choose_alignment(quiet)]


def _aligned(start: Start, recorded: Increments, stretch: Stretch) -> Alignment:
    rows = slice(*np.searchsorted(recorded.time_s, [stretch.start_s + 1e-6, stretch.end_s + 1e-6]))
    at = replace(start, time_s=stretch.start_s)
    return align(recorded.time_s[rows], recorded.dtheta_b[rows], recorded.dv_b[rows], at)


def _channel(one: ComparedChannel) -> dict[str, Any]:
    channel = one.fitted
    rms = {
        "as_recorded": channel.rms_before,
        "without_mean": channel.rms_without_mean,
        "after_fit": channel.rms_after,
    }
    if one.rms_with_clock is not None:
        rms["after_fit_found_clock"] = one.rms_with_clock
    entry: dict[str, Any] = {
        "mean_difference": _estimate(channel.mean_difference),
        "bias": _estimate(channel.bias),
        "scale_error": _estimate(one.scale_error),
        "misalignment": {
            other: _estimate(term) for other, term in zip("xyz", channel.terms, strict=True) if other != one.axis
        },
        "rms": rms,
        "attenuation": channel.attenuation if np.isfinite(channel.attenuation) else None,
        "noise_density": channel.density if np.isfinite(channel.density) else None,
        "neighbour_correlation": channel.neighbour_correlation,
        "largest": {"value": channel.largest, "time_s": channel.largest_s},
        "believed_bias": one.believed_bias,
    }
    if one.found_minus_believed is not None:
        entry["found_minus_believed"] = _estimate(one.found_minus_believed)
    return entry


def _estimate(estimate: ChannelEstimate | None) -> dict[str, Any] | None:
    if estimate is None:
        return None
    return {
        "value": estimate.value,
        "standard_error": estimate.standard_error,
        "interval95": [estimate.low, estimate.high],
    }
