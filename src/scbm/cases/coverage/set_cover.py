"""Minimum set cover: the fewest sets whose union is the union of all sets, such as the smallest suite of cases.

Set cover is NP-hard, so the search has a work limit, and the answer includes the lower bound that is proved. Branch and
bound stays small in practice for three reasons:

1. **Reductions** (Garfinkel and Nemhauser, 1972): drop a set that is a subset of another; drop an element that is in
   every set of some other element; choose the only set with an element. Each reduction can enable the others, so they
   are repeated up to a fixed point. The remaining problem is split into independent components.
2. **A lower bound** from the dual of the linear relaxation by the subgradient method (Held and Karp, 1971; Beasley,
   1990). Any prices of elements give a valid bound, so the prices are integers and the bound is exact. Sets whose
   reduced cost is too high are in no better cover, and are dropped.
3. **Branching** on an element with the fewest sets: one of these sets must be chosen, so each is tried in turn, without
   those tried before.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from heapq import heapify, heappop, heapreplace
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from msgspec import Struct

from scbm.cases.coverage.visits import bits_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

DEFAULT_LIMIT = 20_000_000
"""Maximum number of set elements that the search visits; this takes some seconds."""

_ONE = 1 << 24
"""The price 1: prices are integers, in units of 1 / `_ONE`."""

_ROWS_AT_ONCE = 4096
"""Number of rows that are transposed together; a larger text would take too much memory."""

_MAX_STEPS = 200
_STEPS_WITHOUT_GAIN = 8
_SMALLEST_PACE = 64


class Cover(Struct, frozen=True):
    """A selection of sets whose union is the union of all sets.

    Attributes:
        chosen: the indices of the chosen sets, ascending.
        at_least: the proved lower bound on the number of sets in a cover.
    """

    chosen: tuple[int, ...]
    at_least: int

    @property
    def is_smallest(self) -> bool:
        """Whether no smaller cover exists, which is proved."""
        return len(self.chosen) == self.at_least


def smallest_cover(sets: Sequence[int], limit: int = DEFAULT_LIMIT) -> Cover:
    """Return the smallest cover of the union of `sets`; of equal sets it has the first.

    Args:
        sets: the sets, each as bits.
        limit: maximum number of set elements that the search visits; it then returns the smallest cover so far.
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
    """Sets as bits, with their original indices; the bit of an element changes as elements are dropped."""

    rows: tuple[int, ...]
    places: tuple[int, ...]

    @property
    def union(self) -> int:
        union = 0
        for row in self.rows:
            union |= row
        return union

    def keeping(self, kept: Sequence[int]) -> _Table:
        """Return the table with only the rows `kept`."""
        return _Table(tuple(self.rows[row] for row in kept), tuple(self.places[row] for row in kept))

    def without(self, elements: int) -> _Table:
        """Return the table without the elements in the bits `elements`."""
        return _Table(tuple(row & ~elements for row in self.rows), self.places)


_CoverNode: TypeAlias = tuple[_Table, tuple[int, ...]]
"""A node of the search: the remaining table, and the indices chosen so far."""


def _transposed(rows: Sequence[int], width: int) -> list[int]:
    """Return the columns of a bit matrix: bit r of column c is bit c of row r. Slices of text make this fast."""
    columns = [0] * width
    for begin in range(0, len(rows), _ROWS_AT_ONCE):
        text = "".join(f"{row:0{width}b}" for row in reversed(rows[begin : begin + _ROWS_AT_ONCE]))
        for column in range(width):
            columns[column] |= int(text[width - 1 - column :: width], 2) << begin
    return columns


def _maximal(rows: Sequence[int], width: int) -> list[int]:
    """Return the indices of the rows that are subsets of no other row, ascending; of equal rows the first."""
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
            larger &= columns[_lowest(missing)]  # a set without this element cannot be a superset
        else:
            kept |= 1 << position
    return sorted(order[position] for position in bits_of(kept))


def _lowest(bits: int) -> int:
    return (bits & -bits).bit_length() - 1


def _reduced(table: _Table) -> tuple[tuple[int, ...], _Table]:
    """Return the indices of sets that some smallest cover contains, and the table that remains."""
    forced: list[int] = []
    while table.rows:
        everything = (1 << len(table.rows)) - 1
        columns = [column for column in _transposed(table.rows, table.union.bit_length()) if column]
        # a column that is a subset of another: a set with its element has the other's too, so drop the larger column
        kept = _maximal([everything ^ column for column in columns], len(table.rows))
        columns = sorted((columns[column] for column in kept), key=int.bit_count)  # rarest first excludes most
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
    """Return the independent components of the table, in the order of their first sets."""
    unions: list[int] = []
    for row in table.rows:
        merged = row
        for union in unions:
            merged |= union if union & row else 0
        unions = [*(union for union in unions if not union & row), merged]
    groups: dict[int, list[int]] = {}
    for position, row in enumerate(table.rows):
        groups.setdefault(next(number for number, union in enumerate(unions) if union & row), []).append(position)
    return [_renumbered(table.keeping(rows)) for rows in groups.values()]


def _renumbered(table: _Table) -> _Table:
    """Return the table with its elements renumbered without gaps.

    An element that is in no set would have a price, and the sum of prices would be no bound.
    """
    columns = [column for column in _transposed(table.rows, table.union.bit_length()) if column]
    return _Table(tuple(_transposed(columns, len(table.rows))), table.places)


class _LowerBound(Struct, frozen=True):
    """The lower bound that prices of elements prove, in units of 1 / `_ONE`.

    Attributes:
        total: the lower bound on the cost of a cover.
        costs: the reduced cost of each set: 1 minus the prices of its elements.
    """

    total: int
    costs: tuple[int, ...]

    @property
    def at_least(self) -> int:
        """The lower bound as a number of sets."""
        return -(-self.total // _ONE)

    def allows(self, row: int, below: int) -> bool:
        """Return whether the set `row` can be in a cover of fewer than `below` sets."""
        return self.total + max(self.costs[row], 0) <= (below - 1) * _ONE


@dataclass
class _CoverSearch:
    """Depth-first branch and bound over the covers of one table."""

    table: _Table
    work: int
    best: tuple[int, ...] = field(init=False)

    def run(self) -> Cover:
        """Return the smallest cover, or the best one at the work limit, with the proved bound."""
        self.best = _greedy(self.table, [0] * len(self.table.rows))
        bound = self._bound(self.table, len(self.best))
        nodes = [self._better(self.table, (), bound)]
        while nodes and self.work > 0:
            node = next(nodes[-1], None)
            if node is None:
                nodes.pop()
            else:
                nodes.append(self._children(*node))
        return Cover(self.best, min(bound.at_least, len(self.best)) if nodes else len(self.best))

    def _children(self, table: _Table, chosen: tuple[int, ...]) -> Iterator[_CoverNode]:
        """Yield the child nodes that can lead to a better cover."""
        forced, table = _reduced(table)
        chosen += forced
        if not table.rows:
            self._keep_if_smaller(chosen)
            return
        yield from self._better(table, chosen, self._bound(table, len(self.best) - len(chosen)))

    def _better(self, table: _Table, chosen: tuple[int, ...], bound: _LowerBound) -> Iterator[_CoverNode]:
        """Yield the child nodes of a table that no reduction applies to; none if the bound excludes a better cover."""
        self._keep_if_smaller((*chosen, *_greedy(table, bound.costs)))
        below = len(self.best) - len(chosen)
        if bound.at_least >= below:
            return
        needed = table.union
        table = table.keeping([row for row in range(len(table.rows)) if bound.allows(row, below)])
        if table.union == needed:
            yield from self._branches(table, chosen)

    def _branches(self, table: _Table, chosen: tuple[int, ...]) -> Iterator[_CoverNode]:
        """Yield a child node for each set with the rarest element: it is chosen, and the sets before it are not."""
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

    def _keep_if_smaller(self, chosen: tuple[int, ...]) -> None:
        if len(chosen) < len(self.best):
            self.best = chosen

    def _bound(self, table: _Table, below: int) -> _LowerBound:
        """Return the best bound that the subgradient method finds; it stops once the bound reaches `below`."""
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
    """Return prices with no negative reduced cost: 1 divided by the size of the largest set with the element."""
    largest = [1] * width
    for elements in members:
        for element in elements:
            largest[element] = max(largest[element], len(elements))
    return [_ONE // size for size in largest]


def _priced(members: Sequence[Sequence[int]], prices: Sequence[int]) -> tuple[int, list[int], list[int]]:
    """Return the bound at `prices`, the reduced cost of each set, and the subgradient of each element."""
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
    """Return an irredundant greedy cover; each step takes the set with most uncovered elements, then the cheapest."""
    left = table.union
    queue = [(-row.bit_count(), cost, place) for place, (row, cost) in enumerate(zip(table.rows, costs, strict=True))]
    heapify(queue)
    picked = []
    while left:
        _, cost, row = queue[0]
        now = (-(table.rows[row] & left).bit_count(), cost, row)  # its gain can only have decreased since
        heapreplace(queue, now)
        if queue[0] == now:
            heappop(queue)
            picked.append(row)
            left &= ~table.rows[row]
    return tuple(table.places[row] for row in _irredundant(table, picked))


def _irredundant(table: _Table, picked: Sequence[int]) -> list[int]:
    """Return `picked` without redundant sets; the last sets are dropped first."""
    kept = list(picked)
    for row in reversed(picked):
        others = table.keeping([other for other in kept if other != row]).union
        if not table.rows[row] & ~others:
            kept.remove(row)
    return kept


def _earliest(chosen: Sequence[int], sets: Sequence[int]) -> tuple[int, ...]:
    """Return the cover with each set replaced by the earliest set that has the elements only it covers."""
    selection = _without_redundant(chosen, sets)
    for index in range(len(selection)):
        others = 0
        for other, place in enumerate(selection):
            others |= sets[place] if other != index else 0
        own = sets[selection[index]] & ~others
        selection[index] = next(place for place, bits in enumerate(sets) if not own & ~bits)
    return tuple(sorted(_without_redundant(list(dict.fromkeys(selection)), sets)))


def _without_redundant(chosen: Sequence[int], sets: Sequence[int]) -> list[int]:
    """Return `chosen` without redundant sets; a search that stopped at its limit can leave some."""
    return _irredundant(_Table(tuple(sets), tuple(range(len(sets)))), chosen)
