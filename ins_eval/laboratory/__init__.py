"""The virtual laboratory of Paper A.

    chamber.py        the four-point test of an accelerometer in a thermal chamber
    printed_units.py  the accelerometers JB-KT8 #1, #2 and #3
    creep_rig.py      blocks of epoxy resin in three containers, under a camera
    magnet.py         loops of the scale factor, and what opens them

It knows the truth, so nothing that estimates may look here.
"""

from ins_eval.laboratory.chamber import POSITIONS, Chamber
from ins_eval.laboratory.printed_units import draw_printed_units, printed_units

__all__ = ["POSITIONS", "Chamber", "draw_printed_units", "printed_units"]
