"""The numbers that Paper B prints: nothing here is ours, and nothing is corrected."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from ins_eval import datasheets

PRINTED: dict[str, Any] = tomllib.loads((Path(__file__).parent / "printed.toml").read_text(encoding="utf-8"))
INS = datasheets.load("tested-ins")  # Table 5 of Paper A
