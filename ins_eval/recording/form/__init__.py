"""The form `ins-recording/1`: a recording as a folder, written and read without losing a digit.

    NAME/recording.toml        what it is and what is believed of the instrument
    NAME/imu.parquet           or .csv, one row a sample
    NAME/gps.parquet           or .csv, one row a fix, optional
    NAME/reference.parquet     or .csv, a better navigator, optional
    NAME/solution.parquet      or .csv, what the INS put out itself, optional beside imu, or instead of it
    NAME/chamber.parquet       or .csv, one row a reading, of kind "chamber" only
    NAME/truth.parquet         optional; nothing here ever opens it

Degrees on disk, radians in memory; rates on disk become increments in memory. Whatever cannot be right is refused
in one sentence.
Every column and key: docs/recording.md.
"""

from __future__ import annotations

from ins_eval.recording.form.reading import belief_of_file, read, read_belief, read_chamber, validated
from ins_eval.recording.form.writing import write, write_belief, write_chamber

__all__ = [
    "belief_of_file",
    "read",
    "read_belief",
    "read_chamber",
    "validated",
    "write",
    "write_belief",
    "write_chamber",
]
