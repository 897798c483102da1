"""Which variables make a difference to runs. The others (commands that requests carry) multiply states for nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import Add, Assign, Reference, Role

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.model import Action, BehaviorModel, Packing, Predicate, StateSpace


class Relevance:
    """The variables of the running space that decide what can happen.

    Attributes:
        packing: of the running space.
        names: the variables, in the order of the space.
        mask: their bits.
    """

    def __init__(self, model: BehaviorModel, packing: Packing) -> None:
        found = frozenset(_closed(_first(model), list(_actions(model))))
        self.packing = packing
        self.names = tuple(variable.name for variable in packing.space if variable.name in found)
        self.mask = sum(packing[name].mask for name in self.names)


def _first(model: BehaviorModel) -> Iterator[str]:
    """What guards and goals read, what automatic transitions change, what can leave a domain, what is not declared."""
    for guard in _guards(model):
        yield from guard.reads()
    for transition in model.automatic_transitions:
        yield from (action.target for action in transition.running_actions)
    for action in _actions(model):
        if _may_leave(action, model.running_space):
            yield action.target
    for variable in model.running_space:
        if variable.role is not Role.DECLARED:
            yield variable.name


def _guards(model: BehaviorModel) -> Iterator[Predicate]:
    for operation in model.operations:
        yield from (operation.pre.running_guard, operation.post.running_guard)
        if operation.failed is not None:
            yield operation.failed.running_guard
    yield from (transition.running_guard for transition in model.automatic_transitions)
    yield from (goal for _, goal in model.goals)


def _actions(model: BehaviorModel) -> Iterator[Action]:
    for operation in model.operations:
        yield from (*operation.pre.running_actions, *operation.post.running_actions, *operation.timedout)
        if operation.failed is not None:
            yield from operation.failed.running_actions
    for transition in model.automatic_transitions:
        yield from transition.running_actions


def _may_leave(action: Action, space: StateSpace) -> bool:
    """Whether the action can leave its domain, so that it decides whether its transition can be taken."""
    if isinstance(action, Add):
        return True
    assert isinstance(action, Assign)  # noqa: S101 - for the reader: there are two kinds of actions
    if not isinstance(action.source, Reference):
        return False
    target = space[action.target].domain
    return any(value not in target for value in space[action.source.name].domain.values)


def _closed(first: Iterable[str], actions: list[Action]) -> dict[str, None]:
    """With everything that actions on these variables read."""
    found = dict.fromkeys(first)
    while True:
        read = [name for action in actions if action.target in found for name in action.reads() if name not in found]
        if not read:
            return found
        found |= dict.fromkeys(read)
