"""Which variables make a difference to runs. The others (commands that requests carry) multiply states for nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.exploring import Move, Part, System, relevant
from scbm.model import Role, Truth

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel, Packing


class Relevance:
    """The variables of the running space that decide what can happen.

    Attributes:
        packing: of the running space.
        names: the variables, in the order of the space.
        mask: their bits.
    """

    def __init__(self, model: BehaviorModel, packing: Packing) -> None:
        self.packing = packing
        self.names = relevant(_steps(model), _looked_at(model)).names
        self.mask = sum(packing[name].mask for name in self.names)


def _steps(model: BehaviorModel) -> System:
    """Everything that changes variables in runs, each step as a move of its own."""
    parts = [Part(transition.running_guard, transition.running_actions) for transition in model.transitions]
    parts += [Part(Truth(True), operation.timedout) for operation in model.operations]
    return System(model.running_space, tuple(Move(str(number), (part,)) for number, part in enumerate(parts)))


def _looked_at(model: BehaviorModel) -> Iterator[str]:
    """What goals read, what automatic transitions change, which has to be a change, and what is not declared."""
    for _, goal in model.goals:
        yield from goal.reads()
    for transition in model.automatic_transitions:
        yield from (action.target for action in transition.running_actions)
    yield from (variable.name for variable in model.running_space if variable.role is not Role.DECLARED)
