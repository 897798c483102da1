"""Who visits what: for each obligation its cases, for each case what it alone visits. In time linear in the visits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.coverage.sets import bits_of

if TYPE_CHECKING:
    from scbm.coverage.coverage import Coverage


def visitors_of_each(coverage: Coverage) -> tuple[tuple[int, ...], ...]:
    """For each obligation the cases that visit it, as their places in `coverage.cases`, ascending."""
    visitors: tuple[list[int], ...] = tuple([] for _ in coverage.obligations)
    for place, (_, visited) in enumerate(coverage.cases):
        for position in bits_of(visited):
            visitors[position].append(place)
    return tuple(map(tuple, visitors))


def only_by(coverage: Coverage) -> tuple[int, ...]:
    """For each case the obligations that no other case visits, as bits."""
    once = twice = 0
    for _, visited in coverage.cases:
        twice |= once & visited
        once |= visited
    return tuple(visited & ~twice for _, visited in coverage.cases)
