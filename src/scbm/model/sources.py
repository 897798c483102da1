"""Who changes a variable (semantics 9.1): the model, a resource with its replies or unasked, or the environment.

A source is declared, or inferred on the cautious side: what is read and changed by nothing else is an input, and so is
what only automatic transitions assign. Resources that publish, and the environment, change variables at settled
moments, whether the model asks for it or not.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from scbm.model.predicates import Constant
from scbm.model.variables import VariableSource

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model.behavior import BehaviorModel
    from scbm.model.operations import Action
    from scbm.model.resources import Resource

OutsideGroup: TypeAlias = "tuple[str, ...]"
"""Variables that something outside the model changes, all or some of them at one moment."""


def is_triggered(resource: Resource, model: BehaviorModel) -> bool:
    """Return whether an action of the model can trigger a request to a resource."""
    off = Constant(False)
    return any(action.target == resource.trigger and getattr(action, "source", None) != off for action in model.actions)


def replied(model: BehaviorModel) -> tuple[str, ...]:
    """Return the variables that a reply can change, in the order of the resources."""
    triggered = (resource for resource in model.resources if is_triggered(resource, model))
    return tuple(dict.fromkeys(name for resource in triggered for name in resource.measures))


def published_by(resource: Resource, model: BehaviorModel) -> OutsideGroup:
    """Return the variables that a resource can change unasked.

    Those that it publishes, that it measures though it gets no requests, or that are bound to a topic.
    """
    unasked = () if is_triggered(resource, model) else resource.measures
    topics = () if resource.binding is None else resource.binding.measured
    return tuple(dict.fromkeys((*resource.publishes, *unasked, *(topic.reading.variable for topic in topics))))


def inputs(model: BehaviorModel) -> tuple[str, ...]:
    """Return the variables that the environment changes, declared or inferred, in the order of the model."""
    known = dict.fromkeys((*replied(model), *(name for r in model.resources for name in published_by(r, model))))
    known |= dict.fromkeys(action.target for action in _actions_of_operations(model))
    read = dict.fromkeys(_read(model))
    found = []
    for variable in model.variables:
        is_free = variable.source is None and variable.name in read and variable.name not in known
        if variable.source is VariableSource.INPUT or is_free:
            found.append(variable.name)
    return tuple(found)


def undeclared(model: BehaviorModel) -> tuple[str, ...]:
    """Return the inputs that automatic transitions assign, and of which the model does not say whether they are."""
    assigned = dict.fromkeys(a.target for t in model.automatic_transitions for a in t.running_actions)
    by_name = {variable.name: variable for variable in model.variables}
    return tuple(name for name in inputs(model) if name in assigned and by_name[name].source is None)


def still(model: BehaviorModel) -> tuple[str, ...]:
    """Return the variables that the course of a run can depend on and that nothing changes."""
    changed = dict.fromkeys((*replied(model), *changed_from_outside(model), *(a.target for a in model.actions)))
    read = dict.fromkeys(_read(model))
    return tuple(v.name for v in model.variables if v.name in read and v.name not in changed)


def outside_groups(model: BehaviorModel) -> tuple[OutsideGroup, ...]:
    """Return what changes from outside at settled moments: one group for each input and each resource that publishes.

    A message of a resource can carry several values at once.
    """
    groups: list[OutsideGroup] = [(name,) for name in inputs(model)]
    groups += [group for resource in model.resources if (group := published_by(resource, model))]
    return tuple(groups)


def changed_from_outside(model: BehaviorModel) -> tuple[str, ...]:
    """Return the variables that change from outside at settled moments, each once."""
    return tuple(dict.fromkeys(name for group in outside_groups(model) for name in group))


def _actions_of_operations(model: BehaviorModel) -> Iterator[Action]:
    for operation in model.operations:
        for transition in (operation.pre, operation.post, operation.failed):
            if transition is not None:
                yield from transition.running_actions
        yield from operation.timedout


def _read(model: BehaviorModel) -> Iterator[str]:
    """Yield the variables on which the course of a run can depend."""
    for transition in model.transitions:
        yield from transition.running_guard.reads()
    for action in model.actions:
        yield from action.reads()
    for _, goal in model.goals:
        yield from goal.reads()
