"""``ins-eval import``: bring a file of another format into the form, saying what was found and what was assumed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ins_eval.errors import UsageError
from ins_eval.interface.import_file import import_file
from ins_eval.readers import find
from ins_eval.readers.mapping_written import write_mapping
from ins_eval.recording import form
from ins_eval.report.json_file import write_json
from ins_eval.wording import in_symbols


def run(
    format_name: str,
    file: Path,
    output: Path,
    assume: Sequence[str] = (),
    mapping_file: Path | None = None,
    json: Path | None = None,
    quiet: bool = False,
) -> int:
    """Read, examine, validate, fill in what is believed, write into `output`, print the notes.

    `assume` holds KEY=VALUE each. Where gaps cut the recording, each stretch is written into a folder of its own,
    `output`-1 and on. `mapping_file` gets the mapping with what was assumed.
    Raises: UsageError, DataRefused, StorageError.
    """
    assumed = _assumed(assume)
    if mapping_file is not None and "mapping" not in find(format_name).keys:
        raise UsageError(f"--write-mapping: {format_name} has no mapping, expected csv, mat or netcdf; leave it out")
    parts = import_file(format_name, file, assumed)
    written = []
    for k, recording in enumerate(parts, start=1):
        folder = output if len(parts) == 1 else output.with_name(f"{output.name}-{k}")
        form.write(recording, folder)
        written.append({"recording": str(folder), "notes": list(recording.notes)})
        if not quiet:
            print(in_symbols("\n".join(recording.notes)), f"recording: {folder}", sep="\n")
    if mapping_file is not None:
        left = write_mapping(mapping_file, file, assumed)
        if not quiet:
            print(f"mapping: {mapping_file}" + (f"; still to be assumed: {', '.join(left)}" if left else ""))
    write_json(json, {"format": "ins-eval-imported/1", "recordings": written})
    return 0


def _assumed(assume: Sequence[str]) -> dict[str, str]:
    assumed: dict[str, str] = {}
    for text in assume:
        key, equals, value = text.partition("=")
        if not equals or not key.strip() or not value.strip():
            raise UsageError(f"--assume {text}: expected KEY=VALUE, such as --assume axes=RFU")
        if key.strip() in assumed:
            raise UsageError(f"--assume {key.strip()}: is given twice; give it once")
        assumed[key.strip()] = value.strip()
    return assumed
