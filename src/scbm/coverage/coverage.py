"""What many cases together have visited. Coverage is a value that adds up by union (semantics 8.4)."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.coverage.figures import Figure
from scbm.coverage.sets import bits_of

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.coverage.obligations import Aspect, Obligation, Obligations


@dataclass(frozen=True, slots=True)
class Coverage:
    """The obligations of a model, and for each case the set of those that it visited.

    Attributes:
        obligations: what there is to visit.
        cases: the name of each case with its visited obligations as bits, in the order in which they were run.
    """

    obligations: Obligations
    cases: tuple[tuple[str, int], ...] = ()

    def __add__(self, other: Coverage) -> Coverage:
        """The union. Raises `ValueError` for coverage of another model."""
        if self.obligations != other.obligations:
            raise ValueError("coverage of different models cannot be added")
        merged = dict(self.cases)
        for name, visited in other.cases:
            merged[name] = merged.get(name, 0) | visited
        return Coverage(self.obligations, tuple(merged.items()))

    @property
    def visited(self) -> int:
        """All obligations that any case visited, as bits."""
        union = 0
        for _, visited in self.cases:
            union |= visited
        return union

    @property
    def figure(self) -> Figure:
        """The paper's figure: visited of all obligations."""
        return self.obligations.figure(self.visited)

    def figure_of(self, *aspects: Aspect) -> Figure:
        """The figure of the obligations of some aspects."""
        mask = self.obligations.mask(*aspects)
        return Figure((self.visited & mask).bit_count(), mask.bit_count())

    def missed(self, *aspects: Aspect) -> tuple[Obligation, ...]:
        """The obligations that no case visited: of some aspects, or all that count if none is named."""
        mask = self.obligations.mask(*aspects) if aspects else self.obligations.counted
        open_ones = mask & ~self.visited
        return tuple(obligation for obligation in self.obligations if self.obligations.bit(obligation) & open_ones)

    def visitors(self, obligation: Obligation) -> Iterable[str]:
        """The cases that visited an obligation, in the order in which they were run."""
        bit = self.obligations.bit(obligation)
        return (name for name, visited in self.cases if visited & bit)

    def visits(self) -> dict[Obligation, int]:
        """For each obligation the number of cases that visited it."""
        counts = Counter(position for _, visited in self.cases for position in bits_of(visited))
        return {obligation: counts[position] for position, obligation in enumerate(self.obligations)}

    def first_visitor(self, obligation: Obligation) -> str | None:
        """The case that visited an obligation first."""
        return next(iter(self.visitors(obligation)), None)
