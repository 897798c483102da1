"""The dense engine: a set of states is one integer, bit i for the state with code i, and a move an AND and a shift.

Every operation costs as much as the box is large, however few states of it are reached; but it handles 30 of them at
once. So it is the fastest engine where the box is small.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.planning.engines.engine import check_bytes, check_states
from scbm.planning.engines.masks import BitPlanes, Masks, codes_of, holds_bit
from scbm.planning.engines.reduced_system import StateCodes
from scbm.planning.engines.shifts import ShiftedStep, shifts_of, stages_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model.normal_form import NormalForm
    from scbm.planning.engines.engine import ExplorationLimits
    from scbm.planning.engines.reduced_system import ReducedSystem
    from scbm.planning.engines.shifts import Shifts

_MAX_STATES = 1 << 24
_MAX_COMBINATIONS = 1 << 14
"""Ways in which the variables of all stages can be; each may need a mask of its own on the way to those of shifts."""

_MAX_WORK = 1 << 36
"""Bits to go through, for masks and for about as many levels as there may be."""

_SETS_BESIDE_MASKS = 64
"""So many sets are allowed for beside the masks: what is found, what is new, and the planes of distances."""


class DenseEngine:
    """Explores the box as a whole. Its memory is estimated before anything is made."""

    def __init__(self, box: ReducedSystem, limits: ExplorationLimits) -> None:
        self.layout = StateCodes.dense(box.counts)
        self.limits = limits
        self._box = box
        shifts = [shifts_of(step, self.layout) for step in box.steps]
        check_bytes(_estimated_bytes(_count(shifts), self.layout), limits)
        self.masks = Masks(self.layout)
        pairs = zip(box.steps, shifts, strict=True)
        self.steps = tuple(ShiftedStep(step, stages, self.layout, self.masks) for step, stages in pairs)

    @staticmethod
    def suits(box: ReducedSystem, limits: ExplorationLimits) -> bool:
        """Whether the box is small enough to be explored as a whole, and its moves are plain enough."""
        layout = StateCodes.dense(box.counts)
        combinations = sum(stage.combinations for step in box.steps for stage in stages_of(step, layout))
        if layout.size > _MAX_STATES or combinations > _MAX_COMBINATIONS:
            return False
        masks = _count([shifts_of(step, layout) for step in box.steps])
        levels = sum(box.counts)  # a guess: about the way through all values of all variables, one after the other
        work = (combinations + masks * levels) * layout.size
        return work <= _MAX_WORK and _estimated_bytes(masks, layout) <= limits.bytes

    def reach(self) -> DenseStates:
        """Takes each move from everything found so far, one after the other, until nothing is new.

        By which move a state is found makes no difference, so this needs fewer rounds than going level by level.
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
        for region in self._box.starts:
            states = self.masks.of(region.where)
            for variable, values in enumerate(region.values):
                if states and len(values) < self.layout.counts[variable]:
                    states &= self.masks.among(variable, sum(1 << value for value in values))
            starts |= states
        return starts


class DenseStates:
    """A set of states, closed under the moves."""

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
        """The lowest bit of those in which the condition holds."""
        holding = self._bits & self._engine.masks.of(condition)
        return (holding & -holding).bit_length() - 1 if holding else None

    def distances(self, goal: NormalForm) -> DenseDistances:
        """Backwards from the goal, level by level; of each level the moves claim states in their order."""
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
        """The states of `rest` that lead into the level, and those that do not."""
        before = rest
        for number, step in enumerate(self._engine.steps):
            if claimed := step.before(level) & rest:
                rest ^= claimed
                found.claim(claimed, number)
        return before ^ rest, rest


class DenseDistances:
    """Distances and first moves of all states, as planes: bit k of the numbers of all states is one set of states."""

    def __init__(self, engine: DenseEngine) -> None:
        self._steps = engine.steps
        # Every state that is placed has a one in some plane, so numbers are kept with one added to them.
        self._distances = BitPlanes(engine.layout.size)
        self._moves = BitPlanes(engine.layout.size)

    def place(self, states: int, distance: int) -> None:
        """These states are so far from the goal."""
        self._distances.add(states, distance + 1)

    def claim(self, states: int, number: int) -> None:
        """From these states the step of that number is the first one that leads closer."""
        self._moves.add(states, number + 1)

    def distance(self, code: int) -> int | None:
        """The fewest moves to the goal; `None` if there is no way."""
        number = self._distances[code]
        return number - 1 if number else None

    def first_move(self, code: int) -> tuple[int, int] | None:
        """The first move on the way, and where it leads; `None` at the goal, and where there is no way."""
        number = self._moves[code]
        if not number:
            return None
        step = self._steps[number - 1]
        return step.index, step.target(code)


def _count(shifts: list[Shifts]) -> int:
    """How many masks there are: one for each shift of each stage of each step."""
    return sum(len(stage) for stages in shifts for stage in stages)


def _estimated_bytes(masks: int, layout: StateCodes) -> int:
    """What masks and sets take; Python's integers have 30 bits in each four bytes."""
    return (masks + _SETS_BESIDE_MASKS) * (layout.size // 30 + 1) * 4
