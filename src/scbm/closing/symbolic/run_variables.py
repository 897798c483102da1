"""The variables of situations in the order of their bits: those of the runner, then related ones near each other."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.closing.symbolic.run_space import RunVariable
from scbm.model import Role
from scbm.planning.planning_task import Task
from scbm.proofcheck import GOAL, PHASE, SetPhase, predicted_name, request_name
from scbm.running import Program
from scbm.running.untimed.relevance import Relevance

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import BehaviorModel, Operation, Transition

_NEAR = 8
"""So many variables before a place count for the choice of the next one."""
_LESS = 0.8
"""One variable farther away counts so much less."""


def predicted_variables(model: BehaviorModel) -> tuple[str, ...]:
    """Return the variables of the world on which plans to any of the goals depend, in the order of the model."""
    read = [name for _, goal in model.goals for name in goal.reads()]
    return tuple(v.name for v in Task(model, read).packing.space if not v.role.is_runner)


def planned_names(operation: Operation) -> Iterator[str]:
    """Yield the variables that the planner reads and changes for an operation."""
    for part in (operation.pre, operation.post):
        yield from part.g.reads()
        for action in part.a:
            yield from (*action.reads(), action.target)


def run_variables(model: BehaviorModel, also: Sequence[str] = ()) -> tuple[RunVariable, ...]:
    """Return the variables of situations: those of the runner first, then those of the world.

    Variables that occur together stand together, each with its predicted value and its request behind it. `also` are
    variables that requirements read.
    """
    space = model.running_space
    predicted = dict.fromkeys(predicted_variables(model))
    relevant = Relevance(model, Program(model).packing, also=also).names
    read = dict.fromkeys((*relevant, *predicted, *model.initial_states.reads()))
    names = [v.name for v in space if v.name in read and v.role is not Role.OPERATION_STATE]
    requests = {resource.request_state: request_name(resource.name) for resource in model.resources}
    found = [RunVariable(PHASE, tuple(phase.value for phase in SetPhase))]
    found.append(RunVariable(GOAL, tuple(name for name, _ in model.goals)))
    runner = [name for name in names if space[name].role.is_runner]
    for name in (*runner, *_together([name for name in names if name not in runner], model)):
        found.append(RunVariable(name, space[name].domain.values))
        if name in predicted:
            found.append(RunVariable(predicted_name(name), space[name].domain.values))
        if name in requests:
            found.append(RunVariable(requests[name], (False, True)))
    return tuple(found)


def _together(names: Sequence[str], model: BehaviorModel) -> list[str]:
    """Return variables in an order in which those that occur together are near each other: always the nearest next."""
    weights: dict[str, dict[str, int]] = {name: {} for name in names}
    for group in _groups(model):
        kept = [name for name in dict.fromkeys(group) if name in weights]
        for name in kept:
            for other in kept:
                weights[name][other] = weights[name].get(other, 0) + 1
    left, order = dict.fromkeys(names), list[str]()
    while left:
        near = order[: -_NEAR - 1 : -1]

        def nearness(name: str, near: Sequence[str] = near) -> float:
            if not near:
                return -sum(weights[name].values())
            return sum(weights[name].get(other, 0) * _LESS**distance for distance, other in enumerate(near))

        order.append(max(left, key=nearness))
        del left[order[-1]]
    return order


def _groups(model: BehaviorModel) -> Iterator[list[str]]:
    """Yield the variables that occur together: in an operation, in an automatic transition, in a request."""
    for operation in model.operations:
        parts = [part for part in (operation.pre, operation.post, operation.failed) if part is not None]
        read = [name for part in parts for name in _names(part)]
        yield [*read, *(action.target for action in operation.timedout)]
    for transition in model.automatic_transitions:
        yield _names(transition)
    for resource in model.resources:
        yield [resource.trigger, resource.request_state, *resource.measures]


def _names(transition: Transition) -> list[str]:
    actions = transition.running_actions
    read = (*transition.running_guard.reads(), *(name for action in actions for name in action.reads()))
    return [*read, *(action.target for action in actions)]
