"""Effects of the Earth that the believed navigation equations leave out; physics fixes their value to 1."""

from __future__ import annotations

from functools import partial

from ins_eval.effects.effect import Effect

TEXTBOOK = "Titterton and Weston, 2nd ed., section 3.5"
SOMIGLIANA = "NGA.STND.0036 (WGS 84), section 4"

_of = partial(Effect, enters="earth", unit="fraction", si=1.0, nominal=0.05, centre=1.0, axes=(None,))

EFFECTS = (
    _of(
        name="earth.rotation",
        physics="the Earth turns under the gyros, and moves what stands on it",
        excited_by="time", reference=TEXTBOOK,
    ),
    _of(
        name="earth.coriolis",
        physics="2 w_ie x v in the velocity of a vehicle on a turning Earth",
        excited_by="speed", reference=TEXTBOOK,
    ),
    _of(
        name="earth.transport_rate",
        physics="the level plane turns as the vehicle moves over a curved Earth",
        excited_by="speed", reference=TEXTBOOK,
    ),
    _of(
        name="earth.gravity_height",
        physics="gravity falls with height",
        excited_by="height", reference=SOMIGLIANA,
    ),
    _of(
        name="earth.gravity_latitude",
        physics="gravity grows towards the poles",
        excited_by="a latitude other than 45 degrees", reference=SOMIGLIANA,
    ),
)  # fmt: skip
