"""Questions about all states that are reachable from some regions; the answers are yes, no and unknown.

The delete relaxation first gives the values that variables can ever have, and a predicate that fails under these values
is answered without a search. The shape of the remaining system and the limits alone decide which engine explores it,
so the choice is the same on every machine. To add an engine: a class with the methods of `Engine`, and an entry in
`ENGINES`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import TYPE_CHECKING

from scbm.planning.engines.dense_engine import DenseEngine
from scbm.planning.engines.engine import Exceeded, ExplorationLimits, LimitExceededError, check_states
from scbm.planning.engines.hash_engine import HashedEngine
from scbm.planning.engines.reached import Distances, Reached
from scbm.planning.engines.reduced_system import StateCodes, reduce_system

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.model import Predicate, StateSpace, Value
    from scbm.planning.engines.engine import Engine
    from scbm.planning.engines.reduced_system import ReducedSystem
    from scbm.planning.engines.transition_system import Region, TransitionSystem

_MAX_BITS = 63
"""Maximum number of bits of a code in an array."""


@dataclass(frozen=True, slots=True)
class EngineEntry:
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


@dataclass(frozen=True, slots=True)
class Found:
    """The predicate holds in a reachable state.

    Attributes:
        state: the first such state, ordered by the value of the last variable, then of the one before it, and so on;
            with
            the relevant variables.
    """

    state: Mapping[str, Value]


@dataclass(frozen=True, slots=True)
class Unreachable:
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
