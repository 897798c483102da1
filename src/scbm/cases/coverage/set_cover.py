"""The fewest sets that together hold what all of them hold: the smallest suite that visits the same.

Set cover is hard in general, so there is a limit of work, and the answer says how much is proved. Three things make
it small in practice:

1. **Reductions** (Garfinkel and Nemhauser, 1972): a set within another is not needed; an element that comes with every
   set of another element need not be looked at; the only set with an element is chosen. Each can make room for the
   others, so they go round until nothing changes. What is left falls apart into parts that share nothing.
2. **A lower bound** from the dual of the linear relaxation by the subgradient method (Held and Karp, 1971; Beasley,
   1990): prices of elements. Any prices give a bound, so they are searched with integers and the bound is exact.
   Sets that are too dear at these prices are in no better cover, and are left out.
3. **Branching** on an element of the fewest sets: one of them is chosen, so each is tried, without those before it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from heapq import heapify, heappop, heapreplace
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from scbm.cases.coverage.visits import bits_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

DEFAULT_LIMIT = 20_000_000
"""How many elements of sets the search may look at; some seconds."""

_ONE = 1 << 24
"""A price of one: prices are whole numbers of its parts."""

_ROWS_AT_ONCE = 4096
"""So many rows are turned into columns together; a text of them all could be large."""

_MAX_STEPS = 200
_STEPS_WITHOUT_GAIN = 8
_SMALLEST_PACE = 64


@dataclass(frozen=True, slots=True)
class Cover:
    """A selection of sets that holds all that all sets hold.

    Attributes:
        chosen: which sets, by their places, ascending.
        at_least: no selection with fewer than this holds all.
    """

    chosen: tuple[int, ...]
    at_least: int

    @property
    def is_smallest(self) -> bool:
        """Whether it is proved that none is smaller."""
        return len(self.chosen) == self.at_least


def smallest_cover(sets: Sequence[int], limit: int = DEFAULT_LIMIT) -> Cover:
    """The smallest selection of sets whose union is the union of all; of equal sets the first.

    Args:
        sets: each as bits.
        limit: how many elements of sets the search may look at; then the smallest selection so far is the answer.
    """
    first_of = {bits: place for place, bits in reversed(list(enumerate(sets))) if bits}
    rows = sorted((place, bits) for bits, place in first_of.items())
    table = _Table(tuple(bits for _, bits in rows), tuple(place for place, _ in rows))
    forced, rest = _reduced(table)
    found = [_CoverSearch(part, limit).run() for part in _parts(rest)]
    chosen = sorted((*forced, *(place for cover in found for place in cover.chosen)))
    at_least = len(forced) + sum(cover.at_least for cover in found)
    return Cover(_earliest(chosen, sets), at_least)


class _Table(NamedTuple):
    """Sets as bits, and what they are called. Which bit is which element changes as elements are left out."""

    rows: tuple[int, ...]
    places: tuple[int, ...]

    @property
    def union(self) -> int:
        union = 0
        for row in self.rows:
            union |= row
        return union

    def keeping(self, kept: Sequence[int]) -> _Table:
        """Only some of the sets."""
        return _Table(tuple(self.rows[row] for row in kept), tuple(self.places[row] for row in kept))

    def without(self, elements: int) -> _Table:
        """The sets without some elements."""
        return _Table(tuple(row & ~elements for row in self.rows), self.places)


_Way: TypeAlias = tuple[_Table, tuple[int, ...]]
"""What is left to cover, and what is chosen so far."""


def _transposed(rows: Sequence[int], width: int) -> list[int]:
    """Columns of rows: bit r of column c is bit c of row r. By way of text, whose slices and numbers are fast."""
    columns = [0] * width
    for begin in range(0, len(rows), _ROWS_AT_ONCE):
        text = "".join(f"{row:0{width}b}" for row in reversed(rows[begin : begin + _ROWS_AT_ONCE]))
        for column in range(width):
            columns[column] |= int(text[width - 1 - column :: width], 2) << begin
    return columns


def _maximal(rows: Sequence[int], width: int) -> list[int]:
    """Which rows are within no other, ascending; of equal ones the first."""
    order = sorted(range(len(rows)), key=lambda row: (-rows[row].bit_count(), row))
    ordered = [rows[row] for row in order]
    columns = _transposed(ordered, width)
    kept = 0
    for position, row in enumerate(ordered):
        larger = kept
        while larger:
            missing = row & ~ordered[_lowest(larger)]
            if not missing:
                break
            larger &= columns[_lowest(missing)]  # who lacks one element of the row need not be asked for others
        else:
            kept |= 1 << position
    return sorted(order[position] for position in bits_of(kept))


def _lowest(bits: int) -> int:
    return (bits & -bits).bit_length() - 1


def _reduced(table: _Table) -> tuple[tuple[int, ...], _Table]:
    """The sets that must be chosen, or may be, and what is left to decide then, its elements numbered anew."""
    forced: list[int] = []
    while table.rows:
        everything = (1 << len(table.rows)) - 1
        columns = [column for column in _transposed(table.rows, table.union.bit_length()) if column]
        # a column within another: who covers its element covers the other's too, so the larger column goes
        kept = _maximal([everything ^ column for column in columns], len(table.rows))
        columns = sorted((columns[column] for column in kept), key=int.bit_count)  # the rarest tells most, so it leads
        only = 0
        for column in columns:
            only |= column if column.bit_count() == 1 else 0
        forced += (table.places[row] for row in bits_of(only))
        columns = [column for column in columns if not column & only]
        rows = _transposed(columns, len(table.rows))
        staying = _maximal(rows, len(columns)) if columns else []
        is_done = len(staying) == len(table.rows)
        table = _Table(tuple(rows), table.places).keeping(staying)
        if is_done:
            break
    return tuple(forced), table


def _parts(table: _Table) -> list[_Table]:
    """The sets in groups that share no element, in the order of their first sets."""
    unions: list[int] = []
    for row in table.rows:
        merged = row
        for union in unions:
            merged |= union if union & row else 0
        unions = [*(union for union in unions if not union & row), merged]
    groups: dict[int, list[int]] = {}
    for position, row in enumerate(table.rows):
        groups.setdefault(next(number for number, union in enumerate(unions) if union & row), []).append(position)
    return [_numbered_anew(table.keeping(rows)) for rows in groups.values()]


def _numbered_anew(table: _Table) -> _Table:
    """The sets with their elements numbered without gaps: a price of an element that no set has would be no bound."""
    columns = [column for column in _transposed(table.rows, table.union.bit_length()) if column]
    return _Table(tuple(_transposed(columns, len(table.rows))), table.places)


@dataclass(frozen=True, slots=True)
class _LowerBound:
    """What prices of elements prove, all in parts of `_ONE`.

    Attributes:
        total: no cover costs less.
        costs: for each set what it costs beyond the prices of its elements.
    """

    total: int
    costs: tuple[int, ...]

    @property
    def at_least(self) -> int:
        """So many sets are needed."""
        return -(-self.total // _ONE)

    def allows(self, row: int, below: int) -> bool:
        """Whether a set can be in a cover of fewer than `below` sets."""
        return self.total + max(self.costs[row], 0) <= (below - 1) * _ONE


@dataclass
class _CoverSearch:
    """Depth first through the covers of one table."""

    table: _Table
    work: int
    best: tuple[int, ...] = field(init=False)

    def run(self) -> Cover:
        """The smallest cover, or the best one when the work is done, and what is proved."""
        self.best = _greedy(self.table, [0] * len(self.table.rows))
        bound = self._bound(self.table, len(self.best))
        ways = [self._better(self.table, (), bound)]
        while ways and self.work > 0:
            way = next(ways[-1], None)
            if way is None:
                ways.pop()
            else:
                ways.append(self._ways(*way))
        return Cover(self.best, min(bound.at_least, len(self.best)) if ways else len(self.best))

    def _ways(self, table: _Table, chosen: tuple[int, ...]) -> Iterator[_Way]:
        """The ways on to a better cover: what is then left, and what is then chosen."""
        forced, table = _reduced(table)
        chosen += forced
        if not table.rows:
            self._note(chosen)
            return
        yield from self._better(table, chosen, self._bound(table, len(self.best) - len(chosen)))

    def _better(self, table: _Table, chosen: tuple[int, ...], bound: _LowerBound) -> Iterator[_Way]:
        """The same, from a table that nothing reduces; none if the bound says so."""
        self._note((*chosen, *_greedy(table, bound.costs)))
        below = len(self.best) - len(chosen)
        if bound.at_least >= below:
            return
        needed = table.union
        table = table.keeping([row for row in range(len(table.rows)) if bound.allows(row, below)])
        if table.union == needed:
            yield from self._branches(table, chosen)

    def _branches(self, table: _Table, chosen: tuple[int, ...]) -> Iterator[_Way]:
        """Each set with an element that few have: it is chosen, and those before it are not."""
        needed = table.union
        columns = _transposed(table.rows, needed.bit_length())
        column = min((column for column in columns if column), key=int.bit_count)
        tried = sorted(bits_of(column), key=lambda row: (-table.rows[row].bit_count(), row))
        left = table
        for row in tried:
            others = [other for other, place in enumerate(left.places) if place != table.places[row]]
            left = left.keeping(others)
            taken = table.rows[row]
            if left.union | taken == needed:
                yield left.without(taken), (*chosen, table.places[row])

    def _note(self, chosen: tuple[int, ...]) -> None:
        if len(chosen) < len(self.best):
            self.best = chosen

    def _bound(self, table: _Table, below: int) -> _LowerBound:
        """The best bound that some steps of the subgradient method find, enough if it is `below`."""
        members = [tuple(bits_of(row)) for row in table.rows]
        size = sum(map(len, members))
        prices = _first_prices(members, table.union.bit_length())
        best = _LowerBound(0, (_ONE,) * len(members))
        pace, idle = 2 * _SMALLEST_PACE, 0
        for _ in range(_MAX_STEPS):
            self.work -= size
            total, costs, slack = _priced(members, prices)
            idle += 1
            if total > best.total:
                best, idle = _LowerBound(total, tuple(costs)), 0
            if best.at_least >= below or self.work <= 0:
                break
            if idle >= _STEPS_WITHOUT_GAIN:
                pace, idle = pace // 2, 0
            length = sum(each * each for each in slack)
            if not length or not pace:
                break
            step = pace * (below * _ONE - total) // (_SMALLEST_PACE * length)
            prices = [max(0, price + step * each) for price, each in zip(prices, slack, strict=True)]
        return best


def _first_prices(members: Sequence[Sequence[int]], width: int) -> list[int]:
    """Prices that no set gains by: each element pays its share of the largest set that it is in."""
    largest = [1] * width
    for elements in members:
        for element in elements:
            largest[element] = max(largest[element], len(elements))
    return [_ONE // size for size in largest]


def _priced(members: Sequence[Sequence[int]], prices: Sequence[int]) -> tuple[int, list[int], list[int]]:
    """The bound at some prices, the cost of each set, and for each element 1 less the sets that are bought with it."""
    total = sum(prices)
    slack = [1] * len(prices)
    costs = [_ONE - sum([prices[element] for element in elements]) for elements in members]
    for cost, elements in zip(costs, members, strict=True):
        if cost < 0:
            total += cost
            for element in elements:
                slack[element] -= 1
    return total, costs, slack


def _greedy(table: _Table, costs: Sequence[int]) -> tuple[int, ...]:
    """A cover: always the set with most that is new, of these the cheapest, of these the first; none is redundant."""
    left = table.union
    queue = [(-row.bit_count(), cost, place) for place, (row, cost) in enumerate(zip(table.rows, costs, strict=True))]
    heapify(queue)
    picked = []
    while left:
        _, cost, row = queue[0]
        now = (-(table.rows[row] & left).bit_count(), cost, row)  # it may have become less, but never more
        heapreplace(queue, now)
        if queue[0] == now:
            heappop(queue)
            picked.append(row)
            left &= ~table.rows[row]
    return tuple(table.places[row] for row in _irredundant(table, picked))


def _irredundant(table: _Table, picked: Sequence[int]) -> list[int]:
    """The picked sets but for those that the others make needless; the last are looked at first."""
    kept = list(picked)
    for row in reversed(picked):
        others = table.keeping([other for other in kept if other != row]).union
        if not table.rows[row] & ~others:
            kept.remove(row)
    return kept


def _earliest(chosen: Sequence[int], sets: Sequence[int]) -> tuple[int, ...]:
    """The selection with each set exchanged for the earliest that holds what only it holds."""
    selection = _without_needless(chosen, sets)
    for index in range(len(selection)):
        others = 0
        for other, place in enumerate(selection):
            others |= sets[place] if other != index else 0
        own = sets[selection[index]] & ~others
        selection[index] = next(place for place, bits in enumerate(sets) if not own & ~bits)
    return tuple(sorted(_without_needless(list(dict.fromkeys(selection)), sets)))


def _without_needless(chosen: Sequence[int], sets: Sequence[int]) -> list[int]:
    """A search that had to stop can have chosen sets that those of other parts of its way make needless."""
    return _irredundant(_Table(tuple(sets), tuple(range(len(sets)))), chosen)
