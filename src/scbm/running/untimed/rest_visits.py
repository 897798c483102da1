"""What a runner without a goal can ever visit, whatever changes from outside: a search that all ends of runs share."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from scbm.running.outside_changes import FreeMaker
from scbm.running.untimed.situations import TooManyRestsError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from scbm.running.outside_changes import Maker, OutsideChanges

MOST_RESTS = 100_000
"""Maximum number of states at rest, those of all ends of runs together."""

_Node: TypeAlias = int | tuple[str, int]
"""A settled state; or who changes variables freely, and a state without these variables: all their values follow it."""


class RestVisits:
    """What changes from outside lead to from settled states on.

    States that lead to each other visit the same. So they are found by Tarjan's algorithm for strongly connected
    components (Depth-first search and linear graph algorithms, 1972), and each change is followed once.
    """

    def __init__(self, outside: OutsideChanges, settle: Callable[[int], tuple[int, tuple[int, ...]]]) -> None:
        """Prepare the search.

        Args:
            outside: the changes from outside.
            settle: returns what is visited from a packed state until the runner is settled, and the states then.
        """
        self._outside = outside
        self._settle = settle
        self._known: dict[_Node, int] = {}
        self._examples: dict[_Node, tuple[Maker, int]] = {}

    def of(self, state: int) -> int:
        """Return the visits that can follow a settled packed state. Raises `TooManyRestsError`."""
        if state not in self._known:
            self._search(state)
        return self._known[state]

    def _search(self, root: _Node) -> None:
        known = self._known
        order, lowest, visits = {root: 0}, {root: 0}, {root: 0}
        path, pending = [(root, self._following(root))], [root]
        while path:
            node, following = path[-1]
            for visited, after in following:
                visits[node] |= visited | known.get(after, 0)
                if after in known:
                    continue
                if after not in order:
                    order[after] = lowest[after] = len(order)
                    visits[after] = 0
                    path.append((after, self._following(after)))
                    pending.append(after)
                    break
                lowest[node] = min(lowest[node], order[after])
            else:
                path.pop()
                while lowest[node] == order[node] and node not in known:
                    known[pending.pop()] = visits[node]
                if path:
                    before, _ = path[-1]
                    lowest[before] = min(lowest[before], lowest[node])
                    visits[before] |= visits[node]
            if len(order) + len(known) > MOST_RESTS:
                raise TooManyRestsError

    def _following(self, node: _Node) -> Iterator[tuple[int, _Node]]:
        """Yield what follows a node at once, each with what is visited on the way."""
        if not isinstance(node, int):
            yield from self._changed(*self._examples[node], node)
            return
        for maker in self._outside.makers:
            if isinstance(maker, FreeMaker) and maker.can_return(node):
                free = (maker.name, node & ~maker.mask)
                self._examples.setdefault(free, (maker, node))
                yield 0, free
            else:
                yield from self._changed(maker, node, node)

    def _changed(self, maker: Maker, state: int, node: _Node) -> Iterator[tuple[int, _Node]]:
        kept = self._outside.kept
        for after in dict.fromkeys(each & kept for each in maker.following(state, ())):
            visited, settled = self._settle(after)
            yield from ((visited, each) for each in settled or (node,))
