"""What happened in a run: records, and how they are written to a file and read from one.

Knows the values of a model, not how it is run. Simulated and real runs leave the same records, and coverage,
requirements and pictures are made of them alone.
"""

from scbm.trace.ends import End
from scbm.trace.reader import read_trace
from scbm.trace.records import (
    AutomaticTaken,
    BecameCurrent,
    Changes,
    InjectionApplied,
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
    RunStarted,
    Trace,
)
from scbm.trace.states import state_after
from scbm.trace.writer import FORMAT_VERSION, records_json, write_trace

__all__ = [
    "FORMAT_VERSION",
    "AutomaticTaken",
    "BecameCurrent",
    "Changes",
    "End",
    "InjectionApplied",
    "MeasurementReceived",
    "MeasurementRefused",
    "MessageDisturbed",
    "OperationStepped",
    "PlanAsked",
    "PlanDropped",
    "PlanReceived",
    "PutBack",
    "Record",
    "ReplyDropped",
    "ReplyReceived",
    "RequestCancelled",
    "RequestSent",
    "ResourceChanged",
    "RunEnded",
    "RunStarted",
    "Trace",
    "read_trace",
    "records_json",
    "state_after",
    "write_trace",
]
