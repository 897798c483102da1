"""Coverage: the obligations that the cases of a suite visit, read from their traces (semantics 8.4).

A set of obligations is an integer: bit i stands for obligation i. `visited_by` alone decides which obligations a trace
visits; everything else here counts and combines such sets.
"""

from __future__ import annotations

from collections import Counter
from itertools import zip_longest
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.coverage.obligations import Aspect, Figure, Obligations
from scbm.cases.trace import AutomaticTaken, InjectionApplied, OperationStepped, PlanReceived, Record
from scbm.model import OperationState

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.cases.coverage.obligations import Obligation


def bits_of(visited: int) -> Iterator[int]:
    """Yield the positions of the one bits of `visited`, ascending."""
    while visited:
        lowest = visited & -visited
        yield lowest.bit_length() - 1
        visited ^= lowest


_ASPECTS: dict[OperationState, Aspect] = {
    state: Aspect(state.value) for state in OperationState if state is not OperationState.INITIAL
}


def visited_by(records: Iterable[Record], obligations: Obligations) -> int:
    """Return the obligations that `records` visit, as bits."""
    visited = 0
    bit_of = obligations.bit_of
    for record in records:
        if isinstance(record, OperationStepped):
            aspect = _ASPECTS.get(record.target)
            if aspect is not None:
                visited |= bit_of(record.operation, aspect)
        elif isinstance(record, AutomaticTaken):
            visited |= bit_of(record.transition, Aspect.TAKEN)
            if record.failed is not None:
                visited |= bit_of(record.failed, Aspect.FAILED)
        elif isinstance(record, InjectionApplied):
            if record.failed is not None:
                visited |= bit_of(record.failed, Aspect.FAILED)
        elif isinstance(record, PlanReceived):
            for operation in record.plan:
                visited |= bit_of(operation, Aspect.QUEUED)
    return visited


class Unnamed(Struct, frozen=True):
    """Cases of a long campaign that are only counted: they visited nothing that a named case did not.

    Attributes:
        count: how many there are.
        visits: for each obligation how many of them visited it; empty if there are none.
    """

    count: int = 0
    visits: tuple[int, ...] = ()

    def __add__(self, other: Unnamed) -> Unnamed:
        """Return the cases of both."""
        pairs = zip_longest(self.visits, other.visits, fillvalue=0)
        return Unnamed(self.count + other.count, tuple(mine + others for mine, others in pairs))


class Coverage(Struct, frozen=True):
    """The obligations of a model, and for each case the set of those that it visited.

    Attributes:
        obligations: the obligations of the model.
        cases: the name of each case with its visited obligations as bits, in the order in which they were run.
        unnamed: further cases, which are only counted.
    """

    obligations: Obligations
    cases: tuple[tuple[str, int], ...] = ()
    unnamed: Unnamed = Unnamed()

    def __add__(self, other: Coverage) -> Coverage:
        """Return the union of two coverages. Raises `ValueError` for coverage of another model."""
        if self.obligations != other.obligations:
            raise ValueError("coverage of different models cannot be added")
        merged = dict(self.cases)
        for name, visited in other.cases:
            merged[name] = merged.get(name, 0) | visited
        return Coverage(self.obligations, tuple(merged.items()), self.unnamed + other.unnamed)

    @property
    def count(self) -> int:
        """The number of cases."""
        return len(self.cases) + self.unnamed.count

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
        """Return the figure of the obligations with one of `aspects`."""
        mask = self.obligations.mask(*aspects)
        return Figure((self.visited & mask).bit_count(), mask.bit_count())

    def missed(self, *aspects: Aspect) -> tuple[Obligation, ...]:
        """Return the obligations with one of `aspects` that no case visited; without `aspects`, of all that count."""
        mask = self.obligations.mask(*aspects) if aspects else self.obligations.counted
        open_ones = mask & ~self.visited
        return tuple(obligation for obligation in self.obligations if self.obligations.bit(obligation) & open_ones)

    def visitors(self, obligation: Obligation) -> Iterable[str]:
        """Return the names of the named cases that visited `obligation`, in the order in which they were run."""
        bit = self.obligations.bit(obligation)
        return (name for name, visited in self.cases if visited & bit)

    def visits(self) -> dict[Obligation, int]:
        """Return for each obligation the number of cases that visited it."""
        counts = Counter(position for _, visited in self.cases for position in bits_of(visited))
        counts.update(dict(enumerate(self.unnamed.visits)))
        return {obligation: counts[position] for position, obligation in enumerate(self.obligations)}

    def first_visitor(self, obligation: Obligation) -> str | None:
        """Return the name of the first case that visited `obligation`; `None` if no case did."""
        return next(iter(self.visitors(obligation)), None)


def visitors_of_each(coverage: Coverage) -> tuple[tuple[int, ...], ...]:
    """Return for each obligation the cases that visit it, as ascending indices into `coverage.cases`."""
    visitors: tuple[list[int], ...] = tuple([] for _ in coverage.obligations)
    for place, (_, visited) in enumerate(coverage.cases):
        for position in bits_of(visited):
            visitors[position].append(place)
    return tuple(map(tuple, visitors))


def only_by(coverage: Coverage) -> tuple[int, ...]:
    """Return for each case the obligations that no other case visits, as bits."""
    once = twice = 0
    for _, visited in coverage.cases:
        twice |= once & visited
        once |= visited
    return tuple(visited & ~twice for _, visited in coverage.cases)


class GrowthStep(Struct, frozen=True):
    """A case that increased the figure.

    Attributes:
        number: its position among the cases, from 1.
        case: its name.
        added: the obligations in the figure that it was the first to visit.
        figure: the figure of all cases up to this one.
    """

    number: int
    case: str
    added: tuple[Obligation, ...]
    figure: Figure


def growth(coverage: Coverage) -> Iterator[GrowthStep]:
    """Yield the cases that increased the figure, in the order in which they were run."""
    obligations = coverage.obligations
    counted = obligations.counted
    union = 0
    for number, (case, visited) in enumerate(coverage.cases, start=1):
        new = visited & counted & ~union
        if new:
            union |= new
            added = tuple(obligation for obligation in obligations if obligations.bit(obligation) & new)
            yield GrowthStep(number, case, added, obligations.figure(union))
