"""Traces: the records of a run, what they mean as spans and sentences, and their text form.

Simulated and real runs leave the same records, and coverage, requirements and charts need nothing else. Only this
package interprets traces: `spans` has the durations and ends of operations, requests and faults, `sentences` has the
words for each record, and each record has its `severity`. The terminal, Perfetto, MCAP and the HTML page draw these.
"""

from typing import TYPE_CHECKING

from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.cases.trace.records import (
        NETWORK,
        SENT,
        AutomaticTaken,
        BecameCurrent,
        Changes,
        End,
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
        RecordSeverity,
        ReplyDropped,
        ReplyReceived,
        RequestCancelled,
        RequestSent,
        ResourceChanged,
        RunEnded,
        RunnerStarted,
        RunStarted,
        Trace,
        ends_of,
        ranges_of_goals,
        run_end,
        state_after,
    )
    from scbm.cases.trace.sentences import (
        Sentence,
        assignments,
        connection_sentence,
        differing,
        fate_of,
        fault_in,
        sentence_of,
    )
    from scbm.cases.trace.spans import (
        FaultSpan,
        OperationSpan,
        PlanningSpan,
        PlanSpan,
        RequestOutcome,
        RequestSpan,
        RunSpans,
        Span,
        spans_of,
    )
    from scbm.cases.trace.trace_text import FORMAT_VERSION, read_trace, records_json, trace_digest, write_trace

__all__ = [
    "FORMAT_VERSION",
    "NETWORK",
    "SENT",
    "AutomaticTaken",
    "BecameCurrent",
    "Changes",
    "End",
    "FaultSpan",
    "InjectionApplied",
    "LivelockedAtRest",
    "MeasurementReceived",
    "MeasurementRefused",
    "MessageDisturbed",
    "OperationSpan",
    "OperationStepped",
    "PlanAsked",
    "PlanDropped",
    "PlanReceived",
    "PlanSpan",
    "PlanningSpan",
    "PutBack",
    "Record",
    "RecordSeverity",
    "ReplyDropped",
    "ReplyReceived",
    "RequestCancelled",
    "RequestOutcome",
    "RequestSent",
    "RequestSpan",
    "ResourceChanged",
    "RunEnded",
    "RunSpans",
    "RunStarted",
    "RunnerStarted",
    "Sentence",
    "Span",
    "Trace",
    "assignments",
    "connection_sentence",
    "differing",
    "ends_of",
    "fate_of",
    "fault_in",
    "ranges_of_goals",
    "read_trace",
    "records_json",
    "run_end",
    "sentence_of",
    "spans_of",
    "state_after",
    "trace_digest",
    "write_trace",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "records": (
            "NETWORK SENT "
            "AutomaticTaken BecameCurrent Changes End InjectionApplied LivelockedAtRest MeasurementReceived "
            "MeasurementRefused MessageDisturbed OperationStepped PlanAsked PlanDropped PlanReceived PutBack Record "
            "RecordSeverity ReplyDropped ReplyReceived RequestCancelled RequestSent ResourceChanged RunEnded "
            "RunStarted RunnerStarted Trace ends_of ranges_of_goals run_end state_after"
        ),
        "sentences": "Sentence assignments connection_sentence differing fate_of fault_in sentence_of",
        "spans": "FaultSpan OperationSpan PlanningSpan PlanSpan RequestOutcome RequestSpan RunSpans Span spans_of",
        "trace_text": "FORMAT_VERSION read_trace records_json trace_digest write_trace",
    },
)
