"""Columns that are driven alike over some nodes, whitened together.

Hundreds of columns are jumps of one error at other instants, or intervals in which one is off. Once a jump is over it
drives its column as every other of its kind does, and an interval that is over drives nothing: what then still tells
such columns apart are the states in which the last nodes left them, and to those the response is linear.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from ins_eval.error_model.columns import Assembled

WORTH = 24  # columns fewer, from which it is worth it: the responses to the 24 states of the filter cost as much


class Split(NamedTuple):
    """Columns over some nodes: `own` (n,) are whitened as they are, `alike` (m,) what others are driven as well.

    Of the first `given` of those of their own the whitened rows are known.

    A jump that is over drives its column as every other of its kind does, and an interval that is over drives nothing.
    With xi the state of such a column at the first of the nodes, Phi the responses to each of the states and d that to
    the drive, begun with nothing, its whitened rows are Phi xi + d. Phi and one d for each of `drives` (k,), columns
    that stand for all `of` (m,) the same, are whitened behind those of `own`.
    """

    given: int
    own: np.ndarray
    alike: np.ndarray
    of: np.ndarray
    drives: np.ndarray

    @classmethod
    def of_nodes(cls, columns: Assembled, keep: int, first: int, last: int, given: int = 0) -> Split:
        """The columns that have begun before node `last`, from node `first` on; the first `keep` are their own.

        Rows of the first `given` are known.
        """
        begin, end = columns.acting.T
        begun, none = np.flatnonzero((begin < last) | (np.arange(columns.count) < given)), np.zeros(0, dtype=int)
        keep = max(keep, given)
        if begun.size - keep <= WORTH:
            return cls(given, begun, none, none, none)
        acting: dict[int, list[tuple]] = {int(c): [] for c in begun}
        alive = (begin < last) & (end > first)
        for terms, weights, slow in (
            (columns.drive_terms, columns.drive_weights, columns.slow_epochs[:, max(first - 1, 0) : last - 1]),
            (columns.observation_terms, columns.observation_weights, columns.slow_nodes[:, first:last]),
        ):
            steady = (slow == slow[:, :1]).all(axis=1)
            chosen = alive[terms[:, 0]] & ~(steady & (slow[:, 0] == 0.0))[terms[:, -1]]
            for (c, *what, factor), weight in zip(terms[chosen].tolist(), weights[chosen].tolist(), strict=True):
                if steady[factor]:
                    acting[c].append((*what, weight * slow[factor, 0]))
                else:
                    acting[c].append((*what, weight, factor))
        kinds: dict[tuple, list[int]] = {}
        for c, acts in acting.items():
            if c >= keep:
                kinds.setdefault(tuple(acts), []).append(c)
        shared = [ones for ones in kinds.values() if len(ones) > 1]
        if sum(map(len, shared)) - len(shared) <= WORTH:
            return cls(given, begun, none, none, none)
        alike = np.array([c for ones in shared for c in ones], dtype=int)
        of = np.repeat(np.arange(len(shared)), [len(ones) for ones in shared])
        return cls(given, np.setdiff1d(begun, alike), alike, of, np.array([ones[0] for ones in shared], dtype=int))

    @property
    def which(self) -> np.ndarray:
        """The columns whose drives count, in the order in which they are whitened."""
        return np.append(self.own[self.given :], self.drives)

    def states(self, xi: np.ndarray) -> np.ndarray:
        """The states in which what is whitened begins, of those of all columns `xi`."""
        states, k = len(xi), self.drives.size
        return np.hstack([xi[:, self.own[self.given :]], np.zeros((states, k)), np.eye(states, states * bool(k))])

    def add(self, total: np.ndarray, xi: np.ndarray, product: np.ndarray) -> None:
        """Add to the sums of all columns those of what was whitened, `product`."""
        n = self.own.size
        total[np.ix_(self.own, self.own)] += product[:n, :n]
        if not self.drives.size:
            return
        share = np.vstack([np.equal.outer(np.arange(self.drives.size), self.of), xi[:, self.alike]])
        across = product[:n, n:] @ share
        total[np.ix_(self.own, self.alike)] += across
        total[np.ix_(self.alike, self.own)] += across.T
        total[np.ix_(self.alike, self.alike)] += share.T @ product[n:, n:] @ share

    def move(self, xi: np.ndarray, end: np.ndarray) -> None:
        """Bring the states of all columns to where those of what was whitened `end`."""
        moved = self.own[self.given :]
        n, k = moved.size, self.drives.size
        xi[:, moved] = end[:, :n]
        if k:
            xi[:, self.alike] = end[:, n + k :] @ xi[:, self.alike] + end[:, n + self.of]
