"""A mutant with the variables of the original model, so that packed states mean the same in both."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.model import Operation, Transition
from scbm.model.predicates import FALSE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import Action, BehaviorModel, EnvironmentTransition, Resource, Variable


class IncomparableError(Exception):
    """A mutant changes more than the comparison of runs can compare; the text says what, as a clause."""


def comparable(original: BehaviorModel, mutant: BehaviorModel) -> BehaviorModel:
    """Return a mutant with its operations in the order of the original, for its runner; its planner needs the mutant.

    An operation that the mutant does not have takes part with a guard that never holds: it is in no plan.

    Raises:
        IncomparableError: the mutant has other variables, goals, resources or initial states, or more operations.
    """
    if list(map(_shape, original.variables)) != list(map(_shape, mutant.variables)):
        raise IncomparableError("the mutant has other variables")
    if list(map(_constant_part, original.resources)) != list(map(_constant_part, mutant.resources)):
        raise IncomparableError("the mutant has other resources")
    for name in ("goals", "initial_states", "runs", "planner"):
        if getattr(original, name) != getattr(mutant, name):
            raise IncomparableError(f"the mutant has other `{name}`")
    own = {operation.name: operation for operation in mutant.operations}
    known = dict.fromkeys(operation.name for operation in original.operations)
    if any(name not in known for name in own):
        raise IncomparableError("the mutant has more operations")
    return replace(mutant, operations=tuple(own.get(name) or _never_planned(name) for name in known))


def _shape(variable: Variable) -> Variable:
    first = variable.domain.values[0]
    return replace(variable, initial=first, random=(first,))


def _constant_part(resource: Resource) -> Resource:
    """Return a resource without what mutants change of it; bindings make no difference to runs."""
    return replace(resource, request=(), binding=None)


def _never_planned(name: str) -> Operation:
    return Operation(name, Transition(f"start_{name}", FALSE), Transition(f"complete_{name}", FALSE))


def changed_names(original: BehaviorModel, mutant: BehaviorModel) -> tuple[str, ...]:
    """Return the variables that the changed parts of two comparable models read or assign."""
    names: dict[str, None] = {}
    for before, after in zip(original.operations, mutant.operations, strict=True):
        if before != after:
            names |= dict.fromkeys((*_names_of_operation(before), *_names_of_operation(after)))
    for one, other in ((original, mutant), (mutant, original)):
        for transition in one.automatic_transitions:
            if transition not in other.automatic_transitions:
                names |= dict.fromkeys(_names_of(transition))
        for each in one.environment:
            if each not in other.environment:
                names |= dict.fromkeys(_names_of_environment(each))
    return tuple(names)


def _names_of_operation(operation: Operation) -> Iterator[str]:
    for transition in (operation.pre, operation.post, operation.failed):
        if transition is not None:
            yield from _names_of(transition)
    yield from _names_of_actions(operation.timedout)


def _names_of(transition: Transition) -> Iterator[str]:
    yield from transition.g.reads()
    yield from transition.gr.reads()
    yield from _names_of_actions(transition.running_actions)


def _names_of_environment(transition: EnvironmentTransition) -> Iterator[str]:
    yield from transition.guard.reads()
    yield from _names_of_actions(transition.actions)


def _names_of_actions(actions: tuple[Action, ...]) -> Iterator[str]:
    for action in actions:
        yield action.target
        yield from action.reads()
