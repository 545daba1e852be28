"""What the score of a whole set allows of a fresh, smaller one: intervals of beta-binomial counts.

After h hits in n cases the rate p has the density Beta(h + 1/2, n - h + 1/2) (Jeffreys prior). Of m fresh cases the
number of hits is then beta-binomial. Source: Gelman et al., Bayesian Data Analysis, 3rd ed., 2013, sections 2.1, 2.8.
"""

from __future__ import annotations

from dataclasses import dataclass

from scipy.stats import betabinom

JEFFREYS = 0.5
TOGETHER = 0.05  # chance that any of the rates that are compared falls outside, where nothing has changed


def allowed(hits: int, count: int, fresh: int, rates: int = 1) -> tuple[int, int]:
    """Fewest and most hits among `fresh` cases after `hits` among `count`.

    Where nothing has changed, one of as many `rates` as are compared falls outside in at most `TOGETHER` of all sets.
    """
    shape = hits + JEFFREYS, count - hits + JEFFREYS
    tail = 0.5 * TOGETHER / rates
    return int(betabinom.ppf(tail, fresh, *shape)), int(betabinom.ppf(1.0 - tail, fresh, *shape))


@dataclass(frozen=True)
class Compared:
    """A rate of the fresh set beside that of the whole one, hits and cases, and the hits that are allowed."""

    name: str
    fresh: tuple[int, int]
    whole: tuple[int, int]
    least: int
    most: int

    @property
    def inside(self) -> bool:
        return self.least <= self.fresh[0] <= self.most

    @property
    def words(self) -> str:
        return (
            f"{self.name}: {self.fresh[0]} of {self.fresh[1]}, where {self.whole[0]} of {self.whole[1]} in the whole "
            f"set allow {self.least} to {self.most}"
        )


def compare(name: str, fresh: tuple[int, int], whole: tuple[int, int], rates: int) -> Compared:
    """A rate of a fresh set, hits and cases, held against that of the whole one; see `allowed`."""
    return Compared(name, fresh, whole, *allowed(*whole, fresh[1], rates))


def shares(counts: dict[str, int], total: int) -> dict[str, int]:
    """`total` cases in the proportions of `counts`, by largest remainder."""
    whole = sum(counts.values())
    out = {name: total * count // whole for name, count in counts.items()}
    late = sorted(counts, key=lambda name: (-(total * counts[name] % whole), name))
    for name in late[: total - sum(out.values())]:
        out[name] += 1
    return out
