"""What can influence a run: variables, and the changes from outside and measured values that can be enumerated."""

from __future__ import annotations

from itertools import product
from math import prod
from typing import TYPE_CHECKING

from scbm.model import Role, Truth
from scbm.planning.engines import Move, MovePart, TransitionSystem, relevant
from scbm.running.outside_changes import FreeMaker, OutsideChanges, TransitionMaker
from scbm.running.untimed.situations import TooManyRepliesError

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Sequence

    from scbm.cases.trace import Changes
    from scbm.model import BehaviorModel, Packing, Value
    from scbm.running import Program
    from scbm.running.outside_changes import Maker

_MAX_CHOICES = 4_096
"""Maximum number of combinations of values that one message can carry."""


class Relevance:
    """The variables of the running space that decide what can happen in a run; or all of them.

    Attributes:
        packing: the packing of the running space.
        names: the relevant variables, in the order of the space.
        mask: their bits.
    """

    def __init__(
        self, model: BehaviorModel, packing: Packing, *, also: Iterable[str] = (), keeps_all: bool = False
    ) -> None:
        """`also` are variables that decide, too: those that a goal reads that is none of the model's."""
        self.packing = packing
        self.names = relevant(_steps(model), (*_observed_names(model), *also)).names
        if keeps_all:
            self.names = packing.space.names
        self.mask = sum(packing[name].mask for name in self.names)


def _steps(model: BehaviorModel) -> TransitionSystem:
    """Return everything that changes variables in runs, each as a move of its own."""
    parts = [MovePart(transition.running_guard, transition.running_actions) for transition in model.transitions]
    parts += [MovePart(Truth(True), operation.timedout) for operation in model.operations]
    parts += [MovePart(transition.guard, transition.actions) for transition in model.environment]
    return TransitionSystem(model.running_space, tuple(Move(str(number), (part,)) for number, part in enumerate(parts)))


def _observed_names(model: BehaviorModel) -> Iterator[str]:
    """Yield the variables that goals read, those that automatic transitions change, and all that are not declared."""
    for _, goal in model.goals:
        yield from goal.reads()
    for transition in model.automatic_transitions:
        yield from (action.target for action in transition.running_actions)
    yield from (variable.name for variable in model.running_space if variable.role is not Role.DECLARED)


def relevant_changes(program: Program, relevance: Relevance) -> OutsideChanges:
    """Return the changes from outside of the variables that states keep. Raises `TooManyRepliesError`."""
    found: list[Maker] = []
    for maker in program.outside.makers:
        if isinstance(maker, FreeMaker):
            kept = maker.restricted(relevance.names)
            if kept.choices >= _MAX_CHOICES:
                raise TooManyRepliesError
            found += [kept] if kept.choices else []
        elif not isinstance(maker, TransitionMaker) or _acts_on(maker.name, program, relevance.names):
            found.append(maker)
    return OutsideChanges(found, relevance.mask)


def _acts_on(name: str, program: Program, names: Collection[str]) -> bool:
    transition = next(each for each in program.model.environment if each.name == name)
    return any(action.target in names for action in transition.actions)


def choices(values: Sequence[tuple[str, tuple[Value, ...]]]) -> Iterator[Changes]:
    """Yield each choice of values of some variables, the empty one first. Raises `TooManyRepliesError`."""
    if prod(len(known) + 1 for _, known in values) > _MAX_CHOICES:
        raise TooManyRepliesError
    for chosen in product(*((None, *known) for _, known in values)):
        yield tuple((name, value) for (name, _), value in zip(values, chosen, strict=True) if value is not None)
