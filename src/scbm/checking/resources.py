"""Simulated resources that fail or do not answer, where the model has nothing for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.checking.doubts import Doubt
from scbm.errors import Slug
from scbm.model import Assign, Constant, Outcome

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel, Operation, Resource


def doubts_about_resources(model: BehaviorModel) -> Iterator[Doubt]:
    """Failures that nothing looks at, and replies that are awaited for ever."""
    for resource in model.resources:
        outcomes = dict(resource.simulation.outcomes)
        users = [operation for operation in model.operations if _asks(operation, resource)]
        path = ("resources", resource.name, "simulation", "outcomes")
        if outcomes.get(Outcome.FAIL) and users and resource.request_state not in _watched(model):
            message = (
                f"{resource.name} can fail, and no `failed` or automatic transition reads {resource.request_state}"
            )
            remedy = f"add an automatic transition with `g: {resource.request_state} == failed && …`"
            yield Doubt(Slug.FAILURE_UNNOTICED, message, (*path, "fail"), remedy)
        timeless = [operation.name for operation in users if operation.deadline_ns is None]
        if outcomes.get(Outcome.TIMEOUT) and timeless:
            message = f"{resource.name} may not answer, and {', '.join(timeless)} would wait for ever"
            yield Doubt(Slug.NO_DEADLINE, message, (*path, "timeout"), "give them a `deadline`")


def _asks(operation: Operation, resource: Resource) -> bool:
    """Whether the operation sends a request to the resource when it starts."""
    return Assign(resource.trigger, Constant(True)) in operation.pre.running_actions


def _watched(model: BehaviorModel) -> frozenset[str]:
    """The variables that transitions which can fail an operation, or do anything else by themselves, read."""
    failing = [operation.failed for operation in model.operations if operation.failed is not None]
    guards = [transition.running_guard for transition in (*failing, *model.automatic_transitions)]
    return frozenset(name for guard in guards for name in guard.reads())
