"""Effects of the start: the attitude that is believed at `[start].time_s` is off."""

from __future__ import annotations

from ins_eval.effects.effect import Effect
from ins_eval.units import ARCSEC

TEXTBOOK = "Titterton and Weston, 2nd ed., sections 10.2 and 12.3"
# rows of phi: rotation about north, east, down
ROTATIONS = {("alignment.level", "north"): 0, ("alignment.level", "east"): 1, ("alignment.heading", None): 2}

EFFECTS = (
    Effect(
        name="alignment.level",
        physics="the true attitude is turned about north or east against the believed one",
        enters="start", unit="arcsec", si=ARCSEC, nominal=20.0, axes=("north", "east"), local=True,
        excited_by="minutes: gravity leaks into the horizontal", reference=TEXTBOOK,
    ),
    Effect(
        name="alignment.heading",
        physics="the true attitude is turned about down against the believed one",
        enters="start", unit="arcsec", si=ARCSEC, nominal=200.0, axes=(None,), local=True,
        excited_by="horizontal acceleration, and the Earth's rotation over an hour", reference=TEXTBOOK,
    ),
)  # fmt: skip
