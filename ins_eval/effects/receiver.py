"""Effects of what measures beside the instrument: a GPS receiver or a better navigator."""

from __future__ import annotations

from ins_eval.effects.effect import Effect

TEXTBOOK = "Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd ed."
STAMPING = "half a sample of it may come from stamps at the other end of the interval of a sample"

EFFECTS = (
    Effect(
        name="gps.lever_arm",
        physics="the antenna is farther out along an axis than believed",
        enters="gps", unit="m", si=1.0, nominal=0.5,
        excited_by="turns in heading and attitude", reference=f"{TEXTBOOK}, section 14.3",
    ),
    Effect(
        name="gps.time_offset",
        physics=f"the stamps of the receiver are later than believed; {STAMPING}",
        enters="gps", unit="s", si=1.0, nominal=0.02, axes=(None,),
        excited_by="acceleration; speed where the position is good", reference=f"{TEXTBOOK}, section 14.3",
    ),
    Effect(
        name="reference.time_offset",
        physics=f"the stamps of the better navigator are later than believed; {STAMPING}",
        enters="reference", unit="s", si=1.0, nominal=0.02, axes=(None,),
        excited_by="turns and acceleration", reference=f"{TEXTBOOK}, section 14.3",
    ),
    Effect(
        name="reference.misalignment",
        physics="the better navigator is turned about a body axis against the instrument",
        enters="reference", unit="urad", si=1e-6, nominal=200.0,
        excited_by="attitudes that differ", reference="Titterton and Weston, 2nd ed., section 10.4",
    ),
)  # fmt: skip
