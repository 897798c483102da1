"""The search on sets as big integers: one bit for each state of the system, and a move is an AND and a shift.

Levels are computed forwards until one of them has a goal. Then a pass backwards keeps only the states on shortest
plans, and among these the first enabled move of each step gives the canonical plan.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.planning.engines.masks import Masks, ShiftedStep, shifts_of, stages_of
from scbm.planning.engines.reduced_system import StateCodes
from scbm.planning.plan_answers import Answer, Limit, LimitReached, PlanLimits, Solved, Unsolvable, raise_if_cancelled

if TYPE_CHECKING:
    from scbm.model.normal_form import NormalForm
    from scbm.planning.engines.reduced_system import ReducedSystem
    from scbm.planning.searches.search_request import SearchRequest

_MAX_STATES = 1 << 17
"""Maximum number of states of the system: sets of 16 KiB stay in the caches of the processor."""

_MAX_BITS_OF_MASKS = 1 << 24
"""Maximum number of bits of all masks. Each level reads all masks, in about a millisecond for so many bits."""


class DenseSearch:
    """Finds canonical plans to one goal in a small system."""

    def __init__(self, system: ReducedSystem, goal: NormalForm) -> None:
        self._names = system.names
        self._layout = StateCodes.dense(system.counts)
        masks = Masks(self._layout)
        self._steps = tuple(
            ShiftedStep(move, shifts_of(move, self._layout), self._layout, masks) for move in system.moves
        )
        self._goal = masks.of(goal)

    @staticmethod
    def suits(system: ReducedSystem, limits: PlanLimits) -> bool:
        """Return whether the system is small, its moves need few masks, and no search can expand too many states."""
        layout = StateCodes.dense(system.counts)
        if layout.size > min(_MAX_STATES, limits.expansions):
            return False
        masks = sum(stage.combinations for move in system.moves for stage in stages_of(move, layout))
        return masks * layout.size <= _MAX_BITS_OF_MASKS

    def answer(self, request: SearchRequest) -> Answer:
        """Return the canonical plan or why there is none; whole levels count as expanded."""
        levels = [1 << self._layout.code(request.start)]
        found = levels[0]
        while not levels[-1] & self._goal:
            raise_if_cancelled(request.should_continue)
            new = (self._after(levels[-1]) | found) ^ found
            if not new:
                return Unsolvable(found.bit_count())
            if len(levels) > request.limits.length:
                return LimitReached(Limit.LENGTH, found.bit_count())
            levels.append(new)
            found |= new
        return Solved(self._plan(levels), (found ^ levels[-1]).bit_count())

    def _plan(self, levels: list[int]) -> tuple[str, ...]:
        """Return the canonical plan to the goals of the last level."""
        kept = [levels[-1] & self._goal]
        for level in levels[-2:0:-1]:
            kept.append(self._before(kept[-1]) & level)
        names = []
        state = levels[0]
        for target in reversed(kept):
            step, state = next((step, moved) for step in self._steps if (moved := step.after(state) & target))
            names.append(self._names[step.index])
        return tuple(names)

    def _after(self, states: int) -> int:
        found = 0
        for step in self._steps:
            found |= step.after(states)
        return found

    def _before(self, states: int) -> int:
        found = 0
        for step in self._steps:
            found |= step.before(states)
        return found
