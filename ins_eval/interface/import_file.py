"""Recordings from a file of another format."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ins_eval.believed import believed
from ins_eval.interface.result import PathLike
from ins_eval.readers import doctor, find, read
from ins_eval.readers.stretches import stretches
from ins_eval.recording import Recording
from ins_eval.recording.validation import validate


def import_file(format_name: str, file: PathLike, assume: Mapping[str, str] | None = None) -> list[Recording]:
    """Read a file of another format, examine it and fill in what nobody stated of the instrument.

    Parameters
    ----------
    format_name : one of `readers.FORMATS`
    assume : findings to override, by the keys of the format (docs/formats.md)

    Returns
    -------
    One recording; where gaps cut the file, one for each stretch. Their `notes` say what was found and assumed.

    Raises: UsageError, DataRefused.
    """
    assumed = dict(assume or {})
    keys = find(format_name).keys
    parts = stretches(read(format_name, Path(file), assumed))
    return [believed(validate(doctor.examine(part, assumed, keys))) for part in parts]
