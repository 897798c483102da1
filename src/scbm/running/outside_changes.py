"""What can change from outside in a settled state, and who makes each change (semantics 9.2, 9.4, 9.5).

A *maker* is an environment transition, an input, a resource that publishes values, or another user of a shared
resource. Everything in `scbm` that asks what may happen from outside asks here: drawing, the judgement of cases and of
injections, the graph of all runs, and mutants. The checker of certificates has rules of its own, on purpose.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property, reduce
from itertools import product
from math import prod
from operator import or_
from typing import TYPE_CHECKING, NamedTuple

from scbm.model.sources import FreeGroup, free_groups

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Sequence

    from scbm.cases.trace import Changes
    from scbm.model import BehaviorModel, Packing, Value
    from scbm.running.compiled_steps import CompiledStep, RequestLine


_MOST_STATES = 10_000
"""Maximum number of states that a search for several changes at one moment tries."""


class Maker(ABC):
    """Something outside the model that makes changes.

    Attributes:
        name: the environment transition, the input or the resource.
    """

    def __init__(self, name: str) -> None:
        self.name = name

    @abstractmethod
    def following(self, state: int, in_flight: Collection[int]) -> Iterator[int]:
        """Yield the states that its changes lead to from a packed state, in which the runner is settled.

        Args:
            state: the packed state.
            in_flight: the resources with a request of the controller in flight, by number.
        """

    def toward(self, state: int, target: int, in_flight: Collection[int]) -> Iterator[int]:
        """Yield those of these states that are nearer to a target: each variable that differs has the value there."""
        for after in self.following(state, in_flight):
            if after != state and not (after ^ state) & (after ^ target):
                yield after


class TransitionMaker(Maker):
    """An environment transition: it acts where its guard holds, as long as its actions stay in their domains.

    Attributes:
        targets: the variables that its actions assign.
    """

    def __init__(self, step: CompiledStep, targets: Collection[str]) -> None:
        super().__init__(step.name)
        self.targets = targets
        self._step = step

    def holds(self, state: int) -> bool:
        """Return whether its guard holds in a packed state."""
        return self._step.test(state)

    def following(self, state: int, in_flight: Collection[int]) -> Iterator[int]:  # noqa: ARG002 - of others
        """Yield the state after its actions, also if they change nothing."""
        after = self._step.update(state) if self._step.test(state) else None
        if after is not None:
            yield after


class FreeMaker(Maker):
    """An input, or a resource that publishes values: variables that change freely, some or all at one moment.

    Attributes:
        values: its variables, each with the values that it gives.
        mask: the bits of these variables.
    """

    def __init__(self, group: FreeGroup, packing: Packing) -> None:
        super().__init__(group.name)
        self.values = group.values
        self._packing = packing
        self._bits = tuple(
            (packing[name].mask, frozenset(map(packing[name].bits, values))) for name, values in group.values
        )
        self.mask = reduce(or_, (mask for mask, _ in self._bits), 0)

    def restricted(self, names: Collection[str]) -> FreeMaker:
        """Return what it changes of some variables."""
        kept = tuple((name, values) for name, values in self.values if name in names)
        return self if kept == self.values else FreeMaker(FreeGroup(self.name, kept), self._packing)

    def can_return(self, state: int) -> bool:
        """Return whether all values of its variables in a packed state are among those that it gives."""
        return all(state & mask in known for mask, known in self._bits)

    @property
    def choices(self) -> int:
        """The number of changes that it can make."""
        return prod(len(values) + 1 for _, values in self.values) - 1

    @cached_property
    def _choices(self) -> tuple[tuple[int, int], ...]:
        chosen = product(*((None, *values) for _, values in self.values))
        pairs = ([(n, v) for (n, _), v in zip(self.values, each, strict=True) if v is not None] for each in chosen)
        return tuple(self._packing.assignment(dict(each)) for each in pairs if each)

    def following(self, state: int, in_flight: Collection[int]) -> Iterator[int]:  # noqa: ARG002 - of others
        """Yield the state after each choice of values of some variables."""
        for keep, bits in self._choices:
            yield state & keep | bits

    def toward(self, state: int, target: int, in_flight: Collection[int]) -> Iterator[int]:  # noqa: ARG002 - of others
        """Yield the state with all of its values that the target has, without a look at all choices."""
        after = state
        for mask, known in self._bits:
            if (state ^ target) & mask and target & mask in known:
                after = after & ~mask | target & mask
        if after != state:
            yield after


class OtherUser(Maker):
    """Another user of a shared resource, who occupies and leaves it while no request to it is in flight."""

    def __init__(self, line: RequestLine) -> None:
        super().__init__(line.resource.name)
        self._line = line

    def following(self, state: int, in_flight: Collection[int]) -> Iterator[int]:
        """Yield the state in which the free resource is occupied, or the occupied one is left."""
        if self._line.number not in in_flight:
            yield from self._line.used_by_others(state)


class OutsideChange(NamedTuple):
    """One change from outside: who makes it, and the packed state after it."""

    maker: Maker
    after: int


class OutsideChanges:
    """All changes from outside of one model; false if nothing changes from outside.

    Attributes:
        makers: everything that makes changes: what changes freely, environment transitions, other users.
        kept: the bits of the variables that states keep.
    """

    def __init__(self, makers: Sequence[Maker], kept: int = -1) -> None:
        """Prepare the changes.

        Args:
            makers: who makes them.
            kept: the bits of the variables that states keep; a change of others alone makes no difference.
        """
        self.makers = tuple(makers)
        self.kept = kept

    def __bool__(self) -> bool:
        return bool(self.makers)

    def following(self, state: int, in_flight: Collection[int] = ()) -> Iterator[OutsideChange]:
        """Yield the changes that are possible in a settled packed state and make a difference.

        Args:
            state: the packed state.
            in_flight: the resources with a request of the controller in flight, by number.
        """
        kept = self.kept
        for maker in self.makers:
            for after in maker.following(state, in_flight):
                if (after ^ state) & kept:
                    yield OutsideChange(maker, after & kept)

    def maker_of(self, state: int, after: int, in_flight: Collection[int], by: str = "") -> Maker | None:
        """Return who can change a settled state into another one; `None` if no maker can at once.

        Args:
            state: the packed state.
            after: the packed state after the change.
            in_flight: as in `following`.
            by: the name of an environment transition, if only this one counts.
        """
        if by:
            return next(
                (each for each in self.transitions if each.name == by and after in each.following(state, ())), None
            )
        for maker in self.makers:
            if after in maker.toward(state, after, in_flight):
                return maker
        return None

    def parts(self, values: Changes) -> list[Changes]:
        """Return the parts of a change that several make, in its order.

        Variables of one resource that publishes are one part, and so are those that no environment transition assigns
        alone.
        """
        makers = [[name for name, _ in maker.values] for maker in self.free]
        makers += [list(maker.targets) for maker in self.transitions]
        shared = [tuple(name for name, _ in values if name in names) for names in makers]
        found: dict[tuple[str, ...], list[tuple[str, Value]]] = {}
        for name, value in values:
            together = min((names for names in shared if name in names), key=len, default=(name,))
            found.setdefault(together, []).append((name, value))
        return [tuple(part) for part in found.values()]

    def can_lead(self, state: int, target: int, in_flight: Collection[int], is_settled: Callable[[int], bool]) -> bool:
        """Return whether changes from outside can lead from one state to another at one moment (semantics 9.10).

        Several may follow each other, as long as the moment stays settled. The answer is no if the search is too long.

        Args:
            state: the packed state.
            target: the other packed state.
            in_flight: as in `following`.
            is_settled: whether no micro-step is left in a packed state.
        """
        seen, pending = {state: None}, [state]
        while pending and len(seen) <= _MOST_STATES:
            here = pending.pop()
            if here == target:
                return True
            if is_settled(here):
                nearer = (after for maker in self.makers for after in maker.toward(here, target, in_flight))
                new = dict.fromkeys(after for after in nearer if after not in seen)
                seen |= new
                pending += reversed(new)
        return False

    @property
    def transitions(self) -> tuple[TransitionMaker, ...]:
        """The environment transitions, in the order of the model."""
        return tuple(maker for maker in self.makers if isinstance(maker, TransitionMaker))

    @property
    def free(self) -> tuple[FreeMaker, ...]:
        """What changes variables freely."""
        return tuple(maker for maker in self.makers if isinstance(maker, FreeMaker))


def free_makers(model: BehaviorModel, packing: Packing) -> tuple[FreeMaker, ...]:
    """Return what changes variables freely: one maker for each input, and one for each resource that publishes."""
    return tuple(FreeMaker(group, packing) for group in free_groups(model))
