"""Reachable states by name: states as mappings from variables to values, and plans."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.planning.engines.engine import Exceeded, LimitExceededError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from scbm.model import Predicate, Value
    from scbm.planning.engines.engine import CodeDistances, States
    from scbm.planning.engines.reduced_system import ReducedSystem, StateCodes


class _Codes:
    """States with their codes."""

    def __init__(self, system: ReducedSystem, layout: StateCodes, states: States) -> None:
        self.system = system
        self.layout = layout
        self.states = states

    def code(self, state: Mapping[str, Value]) -> int | None:
        """Return the code of a reachable state; `None` for any other."""
        coordinates = self.system.coordinates(state)
        code = None if coordinates is None else self.layout.code(coordinates)
        return code if code in self.states else None

    def state(self, code: int) -> dict[str, Value]:
        return self.system.state(self.layout.coordinates(code))


class Reached:
    """All reachable states, the initial ones included."""

    def __init__(self, system: ReducedSystem, layout: StateCodes, states: States) -> None:
        self._codes = _Codes(system, layout, states)

    def __len__(self) -> int:
        """Return the number of states, which differ in relevant variables."""
        return len(self._codes.states)

    def __contains__(self, state: Mapping[str, Value]) -> bool:
        """Return whether a state is reachable; only the values of relevant variables are read."""
        return self._codes.code(state) is not None

    def __iter__(self) -> Iterator[dict[str, Value]]:
        """Yield the states, ordered by the value of the last variable, then of the one before it, and so on."""
        return map(self._codes.state, self._codes.states)

    def first(self, predicate: Predicate) -> dict[str, Value] | None:
        """Return the first state in which the predicate holds."""
        code = self._codes.states.first(self._codes.system.condition(predicate))
        return None if code is None else self._codes.state(code)

    def distances(self, goal: Predicate) -> Distances | Exceeded:
        """Return the distance of each state from the goal."""
        try:
            return Distances(self._codes, self._codes.states.distances(self._codes.system.condition(goal)))
        except LimitExceededError as error:
            return error.exceeded


class Distances:
    """The distance of each reachable state from a goal. Other states raise `LookupError`."""

    def __init__(self, codes: _Codes, found: CodeDistances) -> None:
        self._codes = codes
        self._found = found
        self._steps: dict[int, tuple[int, int] | None] = {}

    def distance(self, state: Mapping[str, Value]) -> int | None:
        """Return the minimum number of moves to the goal; `None` if no path exists."""
        return self._found.distance(self._code(state))

    def first_move(self, state: Mapping[str, Value]) -> str | None:
        """Return the first move, in order, that leads closer; `None` at the goal, and where no path exists."""
        step = self._found.first_move(self._code(state))
        return None if step is None else self._codes.system.names[step[0]]

    def plan(self, state: Mapping[str, Value]) -> tuple[str, ...] | None:
        """Return the canonical plan (semantics 4.2): the first of the shortest plans; `None` if there is none."""
        code = self._code(state)
        if self._found.distance(code) is None:
            return None
        names = []
        while (step := self._step(code)) is not None:
            move, code = step
            names.append(self._codes.system.names[move])
        return tuple(names)

    def _step(self, code: int) -> tuple[int, int] | None:
        """Return the first move and its successor; cached, as plans from many states have the same end."""
        if code not in self._steps:
            self._steps[code] = self._found.first_move(code)
        return self._steps[code]

    def _code(self, state: Mapping[str, Value]) -> int:
        code = self._codes.code(state)
        if code is None:
            raise LookupError("the state is not reached")
        return code
