"""Instants at which something jumped, by the innovations: where several in a row are off together.

What jumps is tried at instants so far apart that a recording of hours has a few dozen. Where measurements are sharp, a
jump of a hundred sigmas that is tried two seconds too late explains nothing. The innovations of the filter at and
after a jump have one sign until it has learned it,

    z = |sum of e over w nodes| / sqrt(number of e),   w = 1, 2, 4, ...

in each channel; the begin of the largest is an instant that is tried as well.

Source: Basseville and Nikiforov, Detection of Abrupt Changes, 1993, 2.4 and 7.2 (moving sums, innovations).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ins_eval.error_model.columns import Column
    from ins_eval.estimation.case import Case

WIDTHS = (1, 2, 4, 8, 16, 32)  # nodes: by reasoning, up to half a minute, in which a filter learns a jump
REMARKABLE = 5.5  # sigmas: of 216 000 sums of white noise (4000 nodes, 9 channels, 6 widths) one in 120 has one
MOST = 4  # instants of a recording, by reasoning: each costs a column of every family that jumps


def innovations(case: Case, noise_point: np.ndarray, columns: Sequence[Column] = ()) -> np.ndarray:
    """Whitened residual (nodes, 9), nuisances and `columns` at their posterior mean; NaN where nothing is measured."""
    known = len(case.nuisances) + len(columns)
    whitened = case.whitened(columns, noise_point, keep=known + 1)
    best = np.linalg.solve(np.eye(known) + whitened.normal, whitened.projection)
    return whitened.kept[..., 0] - whitened.kept[..., 1:] @ best


def remarkable(left: np.ndarray, nodes_s: np.ndarray) -> list[float]:
    """Instants (s) at which the innovations `left` (nodes, 9) begin to be off, the most remarkable first."""
    known = np.isfinite(left)
    sums, counts = (
        np.concatenate([np.zeros((1, one.shape[1])), np.cumsum(one, axis=0)])
        for one in (np.where(known, left, 0.0), known)
    )
    largest = np.zeros(nodes_s.size)
    for width in (w for w in WIDTHS if w <= nodes_s.size):
        off = np.abs(sums[width:] - sums[:-width]) / np.sqrt(np.maximum(counts[width:] - counts[:-width], 1))
        begins = slice(0, off.shape[0])
        largest[begins] = np.maximum(largest[begins], off.max(axis=1))
    found: list[float] = []
    largest[0] = 0.0  # what is off from the start on has not jumped
    while len(found) < MOST and largest.max() > REMARKABLE:
        k = int(np.argmax(largest))
        found.append(0.5 * float(nodes_s[k - 1] + nodes_s[k]))
        largest[max(0, k - WIDTHS[-1]) : k + WIDTHS[-1]] = 0.0
    return found
