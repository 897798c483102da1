"""What was reached, with names: states as mappings from variables to values, and plans."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.planning.engines.engine import Exceeded, LimitExceededError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from scbm.model import Predicate, Value
    from scbm.planning.engines.engine import CodeDistances, States
    from scbm.planning.engines.reduced_system import ReducedSystem, StateCodes


class _Codes:
    """States and their codes."""

    def __init__(self, box: ReducedSystem, layout: StateCodes, states: States) -> None:
        self.box = box
        self.layout = layout
        self.states = states

    def code(self, state: Mapping[str, Value]) -> int | None:
        """The code of a state that is reached; `None` of any other."""
        coordinates = self.box.coordinates(state)
        code = None if coordinates is None else self.layout.code(coordinates)
        return code if code in self.states else None

    def state(self, code: int) -> dict[str, Value]:
        return self.box.state(self.layout.coordinates(code))


class Reached:
    """All states that are reached: those at the start, and all that moves lead to from there."""

    def __init__(self, box: ReducedSystem, layout: StateCodes, states: States) -> None:
        self._codes = _Codes(box, layout, states)

    def __len__(self) -> int:
        """How many states there are, told apart by the variables that matter."""
        return len(self._codes.states)

    def __contains__(self, state: Mapping[str, Value]) -> bool:
        """Whether a state is reached; of its values only those of the variables that matter are looked at."""
        return self._codes.code(state) is not None

    def __iter__(self) -> Iterator[dict[str, Value]]:
        """The states, by the value of the last variable, then of the one before it, and so on."""
        return map(self._codes.state, self._codes.states)

    def first(self, predicate: Predicate) -> dict[str, Value] | None:
        """The first of the states in which the predicate holds."""
        code = self._codes.states.first(self._codes.box.condition(predicate))
        return None if code is None else self._codes.state(code)

    def distances(self, goal: Predicate) -> Distances | Exceeded:
        """How far each state is from the goal."""
        try:
            return Distances(self._codes, self._codes.states.distances(self._codes.box.condition(goal)))
        except LimitExceededError as error:
            return error.exceeded


class Distances:
    """How far each state that is reached is from a goal. Others raise `LookupError`."""

    def __init__(self, codes: _Codes, found: CodeDistances) -> None:
        self._codes = codes
        self._found = found
        self._steps: dict[int, tuple[int, int] | None] = {}

    def distance(self, state: Mapping[str, Value]) -> int | None:
        """The fewest moves that lead to the goal; `None` if there is no way."""
        return self._found.distance(self._code(state))

    def first_move(self, state: Mapping[str, Value]) -> str | None:
        """The first, in order, of the moves that lead closer; `None` at the goal, and where there is no way."""
        step = self._found.first_move(self._code(state))
        return None if step is None else self._codes.box.names[step[0]]

    def plan(self, state: Mapping[str, Value]) -> tuple[str, ...] | None:
        """The canonical plan (semantics 4.2): of the shortest ones the first; `None` if there is none."""
        code = self._code(state)
        if self._found.distance(code) is None:
            return None
        names = []
        while (step := self._step(code)) is not None:
            move, code = step
            names.append(self._codes.box.names[move])
        return tuple(names)

    def _step(self, code: int) -> tuple[int, int] | None:
        """The first move and where it leads; kept, as plans from many states end alike."""
        if code not in self._steps:
            self._steps[code] = self._found.first_move(code)
        return self._steps[code]

    def _code(self, state: Mapping[str, Value]) -> int:
        code = self._codes.code(state)
        if code is None:
            raise LookupError("the state is not reached")
        return code
