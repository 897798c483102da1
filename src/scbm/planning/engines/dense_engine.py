"""The dense engine: a set of states is one integer, bit i for the state of code i, and a move is an AND and a shift.

The cost of each operation depends on the size of the whole system, not on the number of reachable states; but one
machine operation handles 30 states. So this is the fastest engine for small systems.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.planning.engines.engine import check_bytes, check_states
from scbm.planning.engines.masks import BitPlanes, Masks, ShiftedStep, codes_of, holds_bit, shifts_of, stages_of
from scbm.planning.engines.reduced_system import StateCodes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model.normal_form import NormalForm
    from scbm.planning.engines.engine import ExplorationLimits
    from scbm.planning.engines.masks import Shifts
    from scbm.planning.engines.reduced_system import ReducedSystem

_MAX_STATES = 1 << 24
_MAX_COMBINATIONS = 1 << 14
"""Maximum number of combinations of the variables of all stages; each may need a mask of its own."""

_MAX_WORK = 1 << 36
"""Maximum number of bits to process, for all masks and an estimated number of levels."""

_SETS_BESIDE_MASKS = 64
"""Number of sets that are allowed for beside the masks: visited states, the frontier, and the planes of distances."""


class DenseEngine:
    """Explores a system as a whole. Its memory is estimated before anything is allocated."""

    def __init__(self, system: ReducedSystem, limits: ExplorationLimits) -> None:
        self.layout = StateCodes.dense(system.counts)
        self.limits = limits
        self._system = system
        shifts = [shifts_of(step, self.layout) for step in system.moves]
        check_bytes(_estimated_bytes(_count(shifts), self.layout), limits)
        self.masks = Masks(self.layout)
        pairs = zip(system.moves, shifts, strict=True)
        self.steps = tuple(ShiftedStep(step, stages, self.layout, self.masks) for step, stages in pairs)

    @staticmethod
    def suits(system: ReducedSystem, limits: ExplorationLimits) -> bool:
        """Return whether the system is small enough to be explored as a whole, and its moves need few masks."""
        layout = StateCodes.dense(system.counts)
        combinations = sum(stage.combinations for step in system.moves for stage in stages_of(step, layout))
        if layout.size > _MAX_STATES or combinations > _MAX_COMBINATIONS:
            return False
        masks = _count([shifts_of(step, layout) for step in system.moves])
        levels = sum(system.counts)  # an estimate: all values of all variables, one after the other
        work = (combinations + masks * levels) * layout.size
        return work <= _MAX_WORK and _estimated_bytes(masks, layout) <= limits.bytes

    def reach(self) -> DenseStates:
        """Return all reachable states: apply each move to all states found so far until there are no new ones.

        The order of discovery does not matter here, so this needs fewer rounds than going level by level.
        """
        found = self._starts()
        before = -1
        while found != before:
            before = found
            for step in self.steps:
                found |= step.after(found)
        check_states(found.bit_count(), self.limits)
        return DenseStates(self, found)

    def _starts(self) -> int:
        starts = 0
        for region in self._system.starts:
            states = self.masks.of(region.where)
            for variable, values in enumerate(region.values):
                if states and len(values) < self.layout.counts[variable]:
                    states &= self.masks.among(variable, sum(1 << value for value in values))
            starts |= states
        return starts


class DenseStates:
    """A set of states that is closed under the moves."""

    def __init__(self, engine: DenseEngine, bits: int) -> None:
        self._engine = engine
        self._bits = bits
        self._bytes = bits.to_bytes(engine.layout.size // 8 + 1, "little")

    def __len__(self) -> int:
        return self._bits.bit_count()

    def __contains__(self, code: object) -> bool:
        return isinstance(code, int) and holds_bit(self._bytes, code)

    def __iter__(self) -> Iterator[int]:
        return codes_of(self._bytes)

    def first(self, condition: NormalForm) -> int | None:
        """Return the least code in which the form holds."""
        holding = self._bits & self._engine.masks.of(condition)
        return (holding & -holding).bit_length() - 1 if holding else None

    def distances(self, goal: NormalForm) -> DenseDistances:
        """Return the distances, computed backwards from the goal, level by level; earlier moves claim states first."""
        found = DenseDistances(self._engine)
        level = self._bits & self._engine.masks.of(goal)
        rest = self._bits ^ level
        distance = 0
        found.place(level, distance)
        while level:
            distance += 1
            level, rest = self._level_before(level, rest, found)
            found.place(level, distance)
        return found

    def _level_before(self, level: int, rest: int, found: DenseDistances) -> tuple[int, int]:
        """Return the states of `rest` that lead into the level, and the remaining ones."""
        before = rest
        for number, step in enumerate(self._engine.steps):
            if claimed := step.before(level) & rest:
                rest ^= claimed
                found.claim(claimed, number)
        return before ^ rest, rest


class DenseDistances:
    """Distances and first moves of all states, as bit planes: one set of states for each bit of the numbers."""

    def __init__(self, engine: DenseEngine) -> None:
        self._steps = engine.steps
        # Numbers are stored plus one, so that every state with a distance has a bit in some plane.
        self._distances = BitPlanes(engine.layout.size)
        self._moves = BitPlanes(engine.layout.size)

    def place(self, states: int, distance: int) -> None:
        """Give these states a distance."""
        self._distances.add(states, distance + 1)

    def claim(self, states: int, number: int) -> None:
        """Make the step of this number the first move of these states."""
        self._moves.add(states, number + 1)

    def distance(self, code: int) -> int | None:
        """Return the minimum number of moves to the goal; `None` if no path exists."""
        number = self._distances[code]
        return number - 1 if number else None

    def first_move(self, code: int) -> tuple[int, int] | None:
        """Return the first move of the canonical path and its successor; `None` at the goal or without a path."""
        number = self._moves[code]
        if not number:
            return None
        step = self._steps[number - 1]
        return step.index, step.target(code)


def _count(shifts: list[Shifts]) -> int:
    """Return the number of masks: one for each shift of each stage of each move."""
    return sum(len(stage) for stages in shifts for stage in stages)


def _estimated_bytes(masks: int, layout: StateCodes) -> int:
    """Return the memory of masks and sets; Python's integers have 30 bits in each four bytes."""
    return (masks + _SETS_BESIDE_MASKS) * (layout.size // 30 + 1) * 4
