"""The operation runner: a state machine without I/O, clock or chance (semantics 5 and 6).

Events go in, each with the time; effects come out, and the next deadline. What drives it (virtual time, wall time,
DDS) and what plans for it are other rooms, which it does not know.
"""

from scbm.running.automatic import describe_cycle
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
