"""The engine for codes of any width: states one by one, in dictionaries."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

from scbm.planning.engines.breadth_first import BreadthFirst
from scbm.planning.engines.code_functions import Functions
from scbm.planning.engines.distances_on_demand import DistancesOnDemand
from scbm.planning.engines.engine import check_bytes, check_states
from scbm.planning.engines.reduced_system import StateCodes

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from scbm.planning.engines.conditions import Condition
    from scbm.planning.engines.engine import ExplorationLimits
    from scbm.planning.engines.reduced_system import ReducedRegion, ReducedSystem

_BYTES_OF_STATE = 400
"""About what a state, its distance and the edges from it take."""


class HashedEngine:
    """Explores level by level."""

    def __init__(self, box: ReducedSystem, limits: ExplorationLimits) -> None:
        self.layout = StateCodes.fields(box.counts)
        self.functions = Functions(self.layout)
        self._box = box
        self._limits = limits
        self._steps = tuple(
            (step.index, self.functions.test(step.guard), self.functions.transfer(step)) for step in box.steps
        )

    def successors(self, code: int) -> list[tuple[int, int]]:
        """The moves that can be taken, by index and in order, and where they lead."""
        return [(index, transfer(code)) for index, is_enabled, transfer in self._steps if is_enabled(code)]

    def reach(self) -> HashedStates:
        """Level by level."""
        exploration = BreadthFirst((code for region in self._box.starts for code in self._start(region)), self.successors)
        while exploration.frontier:
            self._check(len(exploration.states))
            exploration.expand_level()
        return HashedStates(self, exploration.parents)

    def _start(self, region: ReducedRegion) -> Iterator[int]:
        is_start = self.functions.test(region.where)
        return filter(is_start, map(self.layout.code, product(*region.values)))

    def _check(self, states: int) -> None:
        check_states(states, self._limits)
        check_bytes(states * _BYTES_OF_STATE, self._limits)


class HashedStates:
    """A set of states, closed under the moves."""

    def __init__(self, engine: HashedEngine, found: Mapping[int, object]) -> None:
        self._engine = engine
        self._found = found

    def __len__(self) -> int:
        return len(self._found)

    def __contains__(self, code: object) -> bool:
        return code in self._found

    def __iter__(self) -> Iterator[int]:
        return iter(sorted(self._found))

    def first(self, condition: Condition) -> int | None:
        """The least code in which the condition holds."""
        return min(filter(self._engine.functions.test(condition), self._found), default=None)

    def distances(self, goal: Condition) -> DistancesOnDemand:
        """Of all of these states."""
        known = DistancesOnDemand(self._engine.successors, self._engine.functions.test(goal), len(self._found))
        for code in self._found:
            known.know(code)
        return known
