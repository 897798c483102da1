"""The operation runner: a state machine without I/O, clock or randomness (semantics 5 and 6).

A caller passes events, each with its time, and gets effects and the next deadline. The runner imports neither the
packages that drive it (simulation, nodes) nor the planner: a request for a plan is an effect.
"""

from typing import TYPE_CHECKING

from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.running.events import (
        AskPlan,
        CancelRequest,
        ChangeResource,
        Effect,
        Event,
        GoalGiven,
        InjectionGiven,
        Measured,
        PlanAnswered,
        PlanStatus,
        ReplyArrived,
        RunFinished,
        RunnerOptions,
        SendRequest,
        TimePassed,
        records_of,
    )
    from scbm.running.micro_steps import describe_cycle
    from scbm.running.program import Program
    from scbm.running.runner import Runner

__all__ = [
    "AskPlan",
    "CancelRequest",
    "ChangeResource",
    "Effect",
    "Event",
    "GoalGiven",
    "InjectionGiven",
    "Measured",
    "PlanAnswered",
    "PlanStatus",
    "Program",
    "ReplyArrived",
    "RunFinished",
    "Runner",
    "RunnerOptions",
    "SendRequest",
    "TimePassed",
    "describe_cycle",
    "records_of",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "events": (
            "AskPlan CancelRequest ChangeResource Effect Event GoalGiven InjectionGiven Measured PlanAnswered "
            "PlanStatus ReplyArrived RunFinished RunnerOptions SendRequest TimePassed records_of"
        ),
        "micro_steps": "describe_cycle",
        "program": "Program",
        "runner": "Runner",
    },
)
