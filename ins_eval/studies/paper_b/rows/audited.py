"""What the audits give that more than one row of Paper B states, from the paper's numbers alone."""

from __future__ import annotations

import functools
from typing import Any

from ins_eval.studies.paper_b.audit import bridge, electronics, estimation, loop, output, pendulum
from ins_eval.studies.paper_b.printed import PRINTED

ANY_PENDULUM = (2.0, 5.0, 1.0)  # J, C, D: overdamped; which factor is lost does not depend on them
DRIFT_PPM = 200.0
DA0_PPM = 2.0  # to which the reference voltage has to be set


@functools.cache
def audited() -> dict[str, Any]:
    """By name."""
    magnet, forward_gain = loop.seen_ppm(k_t=DRIFT_PPM), loop.seen_ppm(k_pre=-DRIFT_PPM)
    printed, right = (pendulum.steady_state(*ANY_PENDULUM, printed=of) for of in (True, False))
    residual, inverse = output.residual_percent()
    shift, bits = {table: estimation.shift(table) for table in ("table3", "table4")}, electronics.bits_for(DA0_PPM)
    return {
        "pendulum": {"inertia": ANY_PENDULUM[0], "printed": printed, "right": right, "times": printed / right},
        "bridge": {
            "printed_gain_at_null": bridge.printed_gain_at_null(),
            "gain": bridge.gain(1.0),
            "closed_loop_ppm": bridge.closed_loop_gain_ppm(DRIFT_PPM),
            "open_loop_ppm": bridge.open_loop_gain_ppm(DRIFT_PPM),
            "null_shift_ppm": bridge.null_shift_ppm(DRIFT_PPM),
        },
        "not_in_the_scan": ", ".join(bridge.not_in_the_scan()),
        "factors": {
            "printed": len(PRINTED["factors"]["eq17"]),
            "counted": len(PRINTED["factors"]["open_loop"]),
        },
        "inverse_error_ppm": electronics.inverse_error_ppm(DRIFT_PPM),
        "da0": {"bits": str(bits), "step_ppm": electronics.step_ppm(bits)},
        "mass": loop.seen_ppm(k_0=DRIFT_PPM),
        "magnet": magnet,
        "magnet_unseen_ppm": abs(magnet.on_less_off),
        "forward_gain": forward_gain,
        "forward_unseen_ppm": abs(forward_gain.off),
        "not_seen": " and ".join(loop.not_seen()),
        "room_ppm": estimation.room_ppm(),
        "shift": shift,
        "shifts_ppm": [of_table.mean_ppm for of_table in shift.values()],
        "over_claimed_error": estimation.over_claimed_error(),
        "found_percent": {table: estimation.found_share_percent(table) for table in ("table3", "table4")},
        "expected_by_26_ppm": estimation.expected_by_26_ppm(),
        "output": {
            "residual_percent": residual,
            "inverse_percent": inverse,
            "expected_change_ug": output.expected_change_ug(),
            "missing_ppm": abs(output.missing_ppm()),
            "closure_ug": output.closure_ug()[0],
            "magnet_and_current_ppm": output.magnet_and_current_ppm(),
        },
    }
