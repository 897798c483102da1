"""One record of each kind, for tests that no view of a run forgets a kind."""

from __future__ import annotations

from scbm.cases.trace import (
    AutomaticTaken,
    BecameCurrent,
    InjectionApplied,
    LivelockedAtRest,
    MeasurementReceived,
    MeasurementRefused,
    MessageDisturbed,
    OperationStepped,
    PlanAsked,
    PlanDropped,
    PlanReceived,
    PutBack,
    Record,
    ReplyDropped,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    ResourceChanged,
    RunEnded,
    RunnerStarted,
    RunStarted,
)
from scbm.model import BehaviorModel, OperationState

INITIAL, EXECUTING = OperationState.INITIAL, OperationState.EXECUTING


def record_of_each_kind(model: BehaviorModel) -> tuple[Record, ...]:
    """A run of a model in which everything happens; none of the records changes a variable."""
    resource, operation, variable = model.resources[0].name, model.operations[0].name, model.variables[0]
    state = tuple((each.name, each.initial) for each in model.running_space)
    return (
        RunnerStarted(0, state),
        InjectionApplied(0, "push", None, ()),
        RunStarted(0, "goal", "true", state),
        PlanAsked(0, 1, ()),
        PlanDropped(0, 7),
        PlanReceived(1, 1, "solved", (operation,), ()),
        BecameCurrent(1, operation, ()),
        OperationStepped(1, operation, INITIAL, EXECUTING, None, ()),
        RequestSent(2, 1, resource, ((variable.name, variable.initial),), ()),
        MessageDisturbed(2, 1, resource, "request", 2),
        RequestCancelled(3, 1, resource, ()),
        RequestSent(3, 2, resource, (), ()),
        ReplyDropped(4, 1, "late"),
        ReplyReceived(4, 2, resource, True, ()),
        MeasurementReceived(5, ()),
        MeasurementRefused(5, variable.name, variable.initial),
        ResourceChanged(6, "jam", resource, "dead"),
        PutBack(6, "push", ()),
        AutomaticTaken(7, "light", operation, ()),
        RunEnded(8, "goal", "reached", (), ()),
        LivelockedAtRest(8, ("light",)),
    )
