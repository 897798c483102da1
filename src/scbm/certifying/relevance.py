"""Which variables a `RunsArgument` may leave out: those that nothing which happens depends on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.certifying.flaws import Flaw
from scbm.certifying.transitions import Part, may_leave, parts_of
from scbm.model import Role
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, PLAN_STATE

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import BehaviorModel


def check_variables(variables: Sequence[str], model: BehaviorModel) -> Iterator[Flaw]:
    """Everything by which a variable that is not among `variables` could influence what happens."""
    space = model.running_space
    possible = [variable.name for variable in space if variable.role is not Role.OPERATION_STATE]
    if list(variables) != [name for name in possible if name in variables]:
        yield Flaw(
            "the variables", "they are not some of the model without `<operation>.state`, each once and in order"
        )
        return
    left_out = [name for name in possible if name not in variables]
    for name, reason in _uses(variables, model):
        if name in left_out:
            yield Flaw(f"variable {name}", f"it is left out, but {reason}")


def _uses(kept: Sequence[str], model: BehaviorModel) -> Iterator[tuple[str, str]]:
    """Each variable that matters, with the reason."""
    for resource in model.resources:
        for name in (resource.trigger, resource.request_state):
            yield name, "requests are sent by it"
    for name in (CURRENT_NAME, CURRENT_STATE, PLAN_STATE):
        yield name, "the runner keeps it"
    for goal, predicate in model.goals:
        for name in predicate.reads():
            yield name, f"the goal {goal} reads it"
    for part in parts_of(model):
        yield from _uses_of_part(part, kept, model)


def _uses_of_part(part: Part, kept: Sequence[str], model: BehaviorModel) -> Iterator[tuple[str, str]]:
    for name in part.guard.reads():
        yield name, f"the guard of {part.what} reads it"
    for action in part.actions:
        if part.is_automatic:
            yield action.target, f"{part.what} is taken only if it changes something: {action}"
        if may_leave(action, model.running_space):
            yield action.target, f"{part.what} is taken only if this fits: {action}"
        if action.target in kept:
            for name in action.reads():
                yield name, f"{part.what} reads it: {action}"
