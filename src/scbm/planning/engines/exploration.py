"""Explores the states that are reachable from some regions, with the first engine of `ENGINES` that suits.

The delete relaxation first gives the values that variables can ever have, and a predicate that fails under these values
is answered without a search. The shape of the remaining system and the limits alone decide which engine explores it,
so the choice is the same on every machine. Reached states are answered by name: as mappings from variables to values,
and plans. To add an engine: a class with the methods of `Engine`, and an entry in `ENGINES`.
"""

from __future__ import annotations

from functools import cached_property
from math import prod
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.planning.engines.dense_engine import DenseEngine
from scbm.planning.engines.engine import Exceeded, ExplorationLimits, LimitExceededError, check_states
from scbm.planning.engines.hash_engine import HashedEngine
from scbm.planning.engines.reduced_system import StateCodes, reduce_system

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from scbm.model import Predicate, StateSpace, Value
    from scbm.planning.engines.engine import CodeDistances, Engine, States
    from scbm.planning.engines.reduced_system import ReducedSystem
    from scbm.planning.engines.transition_system import Region, TransitionSystem


_MAX_BITS = 63
"""Maximum number of bits of a code in an array."""


class EngineEntry(Struct, frozen=True):
    """An engine, and the systems that it is made for.

    Attributes:
        suits: whether the engine is made for a system of this shape; answers depend on shape and limits alone.
        make: returns an engine for a system. Raises `LimitExceededError` if it would need too much memory at once.
        explores_sets: whether the engine works on sets of states, so that it pays to plan for all states together.
    """

    suits: Callable[[ReducedSystem, ExplorationLimits], bool]
    make: Callable[[ReducedSystem, ExplorationLimits], Engine]
    explores_sets: bool = False


def _fits_arrays(system: ReducedSystem, _: ExplorationLimits) -> bool:
    return StateCodes.fields(system.counts).size <= 1 << _MAX_BITS


def _array_engine(system: ReducedSystem, limits: ExplorationLimits) -> Engine:
    # It loads numpy, which takes longer than all other packages together, and few systems need it.
    from scbm.planning.engines.array_engine import ArrayEngine  # noqa: PLC0415

    return ArrayEngine(system, limits)


def _fits_always(_: ReducedSystem, __: ExplorationLimits) -> bool:
    return True


ENGINES: dict[str, EngineEntry] = {
    "dense": EngineEntry(DenseEngine.suits, DenseEngine, explores_sets=True),
    "arrays": EngineEntry(_fits_arrays, _array_engine),
    "hashed": EngineEntry(_fits_always, HashedEngine),
}
"""The engines by name, the fastest first: the first one that suits a system explores it."""


def suited(system: ReducedSystem, limits: ExplorationLimits) -> str:
    """Return the name of the engine for a system of this shape."""
    return next(name for name, entry in ENGINES.items() if entry.suits(system, limits))


__all__ = ["ENGINES", "Distances", "EngineEntry", "Exploration", "Found", "Reached", "Unreachable"]

_DEFAULT_LIMITS = ExplorationLimits()


class Found(Struct, frozen=True):
    """The predicate holds in a reachable state.

    Attributes:
        state: the first such state, ordered by the value of the last variable, then of the one before it, and so on;
            with
            the relevant variables.
    """

    state: Mapping[str, Value]


class Unreachable(Struct, frozen=True):
    """The predicate holds in no reachable state; this is proved."""


class Exploration:
    """All states that are reachable from some regions. Every answer is computed at the first request and cached.

    Predicates may read relevant variables only; others raise `KeyError`.

    Attributes:
        engine: the name of the engine that explores.
    """

    def __init__(
        self,
        system: TransitionSystem,
        starts: Sequence[Region],
        observed: Iterable[str] = (),
        limits: ExplorationLimits = _DEFAULT_LIMITS,
        engine: str | None = None,
    ) -> None:
        """Reduce the system, and explore nothing yet.

        Args:
            system: the system to explore.
            starts: the initial regions; `KeyError` for a value outside its domain.
            observed: variables that later questions read; they are relevant, whatever the moves make of them.
            limits: the limits of the exploration.
            engine: the name of an engine, to compare engines; by default the first one that suits.
        """
        self._reduced = reduce_system(system, starts, observed)
        self._limits = limits
        self.engine = engine or suited(self._reduced, limits)

    @property
    def explores_sets(self) -> bool:
        """Whether the engine works on sets of states, so that it pays to plan for all states together."""
        return ENGINES[self.engine].explores_sets

    @property
    def space(self) -> StateSpace:
        """The relevant variables, in order; states differ by these alone."""
        return self._reduced.space

    @cached_property
    def values(self) -> dict[str, tuple[Value, ...]]:
        """The values that each relevant variable can ever have; a superset of those in reachable states."""
        pairs = zip(self._reduced.space, self._reduced.values, strict=True)
        return {variable.name: tuple(variable.domain.values[i] for i in indices) for variable, indices in pairs}

    @cached_property
    def reached(self) -> Reached | Exceeded:
        """All reachable states."""
        try:
            check_states(self._combinations(), self._limits)
            engine = ENGINES[self.engine].make(self._reduced, self._limits)
            return Reached(self._reduced, engine.layout, engine.reach())
        except LimitExceededError as error:
            return error.exceeded

    def find(self, predicate: Predicate) -> Found | Unreachable | Exceeded:
        """Return whether the predicate holds in a reachable state, with the first such state."""
        if self._reduced.condition(predicate) is False:
            return Unreachable()
        if isinstance(self.reached, Exceeded):
            return self.reached
        state = self.reached.first(predicate)
        return Unreachable() if state is None else Found(state)

    def distances(self, goal: Predicate) -> Distances | Unreachable | Exceeded:
        """Return the distance of each reachable state from the goal; `Unreachable` if no state satisfies it."""
        found = self.find(goal)
        if not isinstance(found, Found):
            return found
        assert isinstance(self.reached, Reached)  # noqa: S101 - where else was it found
        return self.reached.distances(goal)

    def _combinations(self) -> int:
        """Return the maximum number of combinations of values in the regions."""
        return sum(prod(map(len, region.values)) for region in self._reduced.starts)


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
