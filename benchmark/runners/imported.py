"""Real recordings brought into the form by the command line, as a user would; what is refused keeps its sentence."""

from __future__ import annotations

import contextlib
import io
import shutil
import tempfile
from pathlib import Path

from benchmark.worlds import real
from benchmark.worlds.real import Source
from benchmark.worlds.recorded import Recorded, read

RECORDINGS = Path(__file__).resolve().parents[3] / "shared" / "recordings"


def command(*words: str) -> tuple[int, str]:
    """Exit code of `ins-eval`, and what it said on standard error."""
    from ins_eval.cli import main

    said = io.StringIO()
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
        code = main(list(words))
    return int(code or 0), said.getvalue().strip()


def imported(format_name: str, file: Path, folder: Path, mapping: str = "", beside: tuple[Path, ...] = ()) -> str:
    """Bring a file into the form as `folder`; returns what was said where that was refused, else nothing."""
    if (folder / "recording.toml").exists():
        return ""
    with tempfile.TemporaryDirectory() as place:
        if mapping:
            for one in (file, *beside):
                shutil.copy(one, place)
            file = Path(place, file.name)
            Path(place, f"{file.name.split('.')[0]}.toml").write_text(mapping)
        code, said = command("import", format_name, str(file), "-o", str(folder))
    return said or f"exit code {code}" if code else ""


def recorded(source: Source, recordings: Path, folder: Path) -> Recorded | None:
    """The recording of a source, imported into `folder`; None where it is absent."""
    file = recordings / source.file
    if not file.exists():
        return None
    if not source.format:
        return real.chamber(file)
    said = imported(source.format, file, folder, source.mapping, tuple(recordings / one for one in source.beside))
    if said:
        raise SystemExit(f"{file}: is refused ({said}), expected a recording; see {source.format} in docs/formats.md")
    return read(folder)
