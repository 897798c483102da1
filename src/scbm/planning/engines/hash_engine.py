"""The engine for codes of any width: states one by one, in dictionaries."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

from scbm.model.packing import compile_test, compile_update
from scbm.planning.engines.breadth_first import BreadthFirst, DistancesOnDemand
from scbm.planning.engines.engine import check_bytes, check_states
from scbm.planning.engines.reduced_system import StateCodes

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from scbm.model.normal_form import NormalForm
    from scbm.model.packing import Test
    from scbm.planning.engines.engine import ExplorationLimits
    from scbm.planning.engines.reduced_system import ReducedRegion, ReducedSystem

_BYTES_OF_STATE = 400
"""Approximate memory of a state, its distance and its edges."""


class HashedEngine:
    """Explores state by state, breadth-first."""

    def __init__(self, system: ReducedSystem, limits: ExplorationLimits) -> None:
        self.layout = StateCodes.fields(system.counts)
        self._fields = self.layout.bit_ranges()
        self._system = system
        self._limits = limits
        self._moves = tuple(
            (move.index, self.test(move.guard), compile_update(move.writes, self._fields)) for move in system.moves
        )

    def test(self, form: NormalForm) -> Test:
        """Return a normal form as a function of codes."""
        return compile_test(form, self._fields)

    def successors(self, code: int) -> list[tuple[int, int]]:
        """Return the moves that are enabled in a state, by index and in order, and the states that they lead to."""
        return [
            (index, successor)
            for index, is_enabled, update in self._moves
            if is_enabled(code) and (successor := update(code)) is not None
        ]

    def reach(self) -> HashedStates:
        """Explore all states; the limits are checked before each level."""
        starts = (code for region in self._system.starts for code in self._starts_in(region))
        exploration = BreadthFirst(starts, self.successors)
        while exploration.frontier:
            check_states(len(exploration.states), self._limits)
            check_bytes(len(exploration.states) * _BYTES_OF_STATE, self._limits)
            exploration.expand_level()
        return HashedStates(self, exploration.parents)

    def _starts_in(self, region: ReducedRegion) -> Iterator[int]:
        return filter(self.test(region.where), map(self.layout.code, product(*region.values)))


class HashedStates:
    """A set of states that is closed under the moves."""

    def __init__(self, engine: HashedEngine, found: Mapping[int, object]) -> None:
        self._engine = engine
        self._found = found

    def __len__(self) -> int:
        return len(self._found)

    def __contains__(self, code: object) -> bool:
        return code in self._found

    def __iter__(self) -> Iterator[int]:
        return iter(sorted(self._found))

    def first(self, form: NormalForm) -> int | None:
        """Return the least code in which the form holds."""
        return min(filter(self._engine.test(form), self._found), default=None)

    def distances(self, goal: NormalForm) -> DistancesOnDemand:
        """Return the distances of all of these states."""
        known = DistancesOnDemand(self._engine.successors, self._engine.test(goal), len(self._found))
        for code in self._found:
            known.know(code)
        return known
