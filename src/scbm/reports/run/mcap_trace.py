"""A run as MCAP, for Foxglove and other viewers of robot recordings.

Messages are JSON, and each channel has the JSON Schema of its messages. A channel of a state has a message for the
first state and for each change; other channels have a message for each event. The `sequence` of a message is the index
of its record in the trace. `docs/how-to/view-traces.md` lists the topics.

The file is neither compressed nor dated: equal runs give equal bytes.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, BinaryIO, assert_never

from mcap.well_known import MessageEncoding, SchemaEncoding
from mcap.writer import CompressionType, Writer
from msgspec import Struct

import scbm
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
    RecordSeverity,
    ReplyDropped,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    ResourceChanged,
    RunEnded,
    RunnerStarted,
    RunStarted,
    fate_of,
)
from scbm.model import OperationState, PlanState, RequestState, ValueKind
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, PLAN_STATE, operation_state_name
from scbm.reports.run.event_lines import event_lines

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.cases.trace import Record
    from scbm.model import BehaviorModel, Domain, Value
    from scbm.testing import Execution

    Json = dict[str, Any]

_LEVELS = ("UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL")
"""The names of the levels of `foxglove.Log`; a level is an index into them."""

_LEVEL_OF = {severity: _LEVELS.index(severity.name) for severity in RecordSeverity}


class McapMessage(Struct, frozen=True):
    """One message.

    Attributes:
        topic: the topic of its channel.
        at_ns: its time.
        record: the index of its record in the trace.
        content: its content, as JSON.
    """

    topic: str
    at_ns: int
    record: int
    content: Json


def write_mcap(model: BehaviorModel, execution: Execution, stream: BinaryIO) -> int:
    """Write the run to `stream` and return the number of its messages."""
    writer = Writer(stream, compression=CompressionType.NONE)
    writer.start(profile="", library=f"scbm {scbm.__version__}")
    channels = {topic: _registered(writer, topic, schema) for topic, schema in _schemas(model, execution).items()}
    writer.add_metadata("scbm", _about(execution))
    messages = sorted(_messages(model, execution), key=lambda message: (message.at_ns, message.record))
    for message in messages:
        data = json.dumps(message.content, ensure_ascii=False, separators=(",", ":")).encode()
        writer.add_message(channels[message.topic], message.at_ns, data, message.at_ns, message.record)
    writer.finish()  # type: ignore[no-untyped-call]  # it has no annotation
    return len(messages)


def _registered(writer: Writer, topic: str, schema: Json) -> int:
    data = json.dumps(schema, ensure_ascii=False, separators=(",", ":")).encode()
    schema_id = writer.register_schema(schema["title"], SchemaEncoding.JSONSchema, data)
    return writer.register_channel(topic, MessageEncoding.JSON, schema_id)


def _about(execution: Execution) -> dict[str, str]:
    case, verdict = execution.case, execution.verdict
    return {
        "scbm": scbm.__version__,
        "model": execution.trace.model,
        "case": case.name,
        "goal": case.goal_names,
        "predicate": case.predicates,
        "verdict": verdict.end.value,
        "passed": json.dumps(verdict.passed),
        "failures": json.dumps([str(failure) for failure in verdict.failures], ensure_ascii=False),
        "simulated_ns": str(execution.ended_ns),
    }


# schemas


def _object(title: str, **properties: Json) -> Json:
    return {"title": title, "type": "object", "properties": properties, "required": list(properties)}


def _one_of(values: Iterable[str]) -> Json:
    return {"type": "string", "enum": list(values)}


_TEXT: Json = {"type": "string"}
_NUMBER: Json = {"type": "integer"}
_TEXTS: Json = {"type": "array", "items": _TEXT}
_VALUES: Json = {"type": "object", "additionalProperties": {"type": ["boolean", "integer", "string"]}}

_TIME: Json = {
    "type": "object",
    "title": "time",
    "properties": {
        "sec": {"type": "integer", "minimum": 0},
        "nsec": {"type": "integer", "minimum": 0, "maximum": 999_999_999},
    },
}
_LOG = _object(
    "foxglove.Log",
    timestamp=_TIME,
    level={"title": "foxglove.LogLevel", "oneOf": [{"title": name, "const": n} for n, name in enumerate(_LEVELS)]},
    message=_TEXT,
    name=_TEXT,
    file=_TEXT,
    line={"type": "integer", "minimum": 0},
)


def _schemas(model: BehaviorModel, execution: Execution) -> dict[str, Json]:
    """Return the schema of each topic, in order."""
    operation = _object("scbm.Operation", state=_one_of(OperationState))
    requirement = _object("scbm.Requirement", state=_one_of(("kept", "violated")), reason=_TEXT, values=_VALUES)
    requirements = (*model.requirements, *execution.case.requirements)
    return {
        "/events": _LOG,
        "/plan": _plan_schema(model),
        **{f"/operations/{each.name}": operation for each in model.operations},
        **{f"/resources/{each.name}": _resource_schema() for each in model.resources},
        **{f"/variables/{each.name}": _variable_schema(each.domain) for each in model.variables},
        **{f"/requirements/{each.name}": requirement for each in requirements},
        "/automatic": _object("scbm.Automatic", transition=_TEXT, failed=_TEXT, changes=_VALUES),
        "/injections": _object("scbm.Injection", injection=_TEXT, state=_TEXT, changes=_VALUES),
        "/network": _object("scbm.Network", request=_NUMBER, resource=_TEXT, message=_TEXT, fate=_TEXT),
    }


def _plan_schema(model: BehaviorModel) -> Json:
    names = ("none", *(operation.name for operation in model.operations))
    states = {"current_state": _one_of(OperationState), "state": _one_of(PlanState)}
    return _object("scbm.Plan", **states, current=_one_of(names), ask=_NUMBER, status=_TEXT, operations=_TEXTS)


def _resource_schema() -> Json:
    asked = {"request": _NUMBER, "payload": _VALUES}
    return _object("scbm.Resource", state=_one_of(RequestState), trigger={"type": "boolean"}, condition=_TEXT, **asked)


def _variable_schema(domain: Domain) -> Json:
    return _object(f"scbm.Variable {domain}", value=_value_schema(domain))


def _value_schema(domain: Domain) -> Json:
    match domain.kind:
        case ValueKind.BOOLEAN:
            return {"type": "boolean"}
        case ValueKind.INTEGER:
            return {"type": "integer", "minimum": domain.values[0], "maximum": domain.values[-1]}
        case ValueKind.SYMBOL:
            return _one_of(map(str, domain.values))
        case _:
            assert_never(domain.kind)


# messages


def _messages(model: BehaviorModel, execution: Execution) -> Iterator[McapMessage]:
    yield from _logged(model, execution)
    yield from _states(model, execution)
    yield from _events_of(execution)
    yield from _requirements_of(model, execution)


def _states(model: BehaviorModel, execution: Execution) -> Iterator[McapMessage]:
    """Yield the states of plan, operations, resources and variables at the start and after each change."""
    following = _FollowedRun(model)
    last: dict[str, Json] = {}
    for number, record in enumerate(execution.trace.records):
        for content in following.contents(record):
            for topic, value in content.items():
                if last.get(topic) != value:
                    last[topic] = value
                    yield McapMessage(topic, record.at_ns, number, value)


class _FollowedRun:
    """The content of each topic of a state, record after record."""

    def __init__(self, model: BehaviorModel) -> None:
        self._model = model
        self._state: dict[str, Value] = {}
        self._plan: Json = {"ask": 0, "status": "", "operations": []}
        self._asked = {resource.name: {"request": 0, "payload": {}} for resource in model.resources}
        self._conditions = {resource.name: "well" for resource in model.resources}
        self._topics = _topics(model)

    def contents(self, record: Record) -> Iterator[dict[str, Json]]:
        """Yield the contents of the topics that a record changes; all topics as the runner starts."""
        if isinstance(record, RunnerStarted):
            self._state.update(record.state)
            yield self._contents(dict.fromkeys(self._topics.values()))
        touched = {self._topics[name]: None for name, _ in record.changes}
        if isinstance(record, PlanReceived):
            self._plan = {"ask": record.ask, "status": record.status, "operations": list(record.plan)}
            touched["/plan"] = None
        elif isinstance(record, RequestSent):
            self._asked[record.resource] = {"request": record.request, "payload": dict(record.payload)}
            touched[f"/resources/{record.resource}"] = None
        elif isinstance(record, ResourceChanged):
            self._conditions[record.resource] = record.condition
            touched[f"/resources/{record.resource}"] = None
        self._state.update(record.changes)
        yield self._contents(touched)

    def _contents(self, topics: Iterable[str]) -> dict[str, Json]:
        return {topic: self._content(topic) for topic in topics}

    def _content(self, topic: str) -> Json:
        _, group, *rest = topic.split("/")
        if group == "plan":
            states = {"current_state": self._state[CURRENT_STATE], "state": self._state[PLAN_STATE]}
            return {**states, "current": self._state[CURRENT_NAME], **self._plan}
        name = rest[0]
        if group == "operations":
            return {"state": self._state[operation_state_name(name)]}
        if group == "variables":
            return {"value": self._state[name]}
        resource = next(resource for resource in self._model.resources if resource.name == name)
        states = {"state": self._state[resource.request_state], "trigger": self._state[resource.trigger]}
        return {**states, "condition": self._conditions[name], **self._asked[name]}


def _topics(model: BehaviorModel) -> dict[str, str]:
    """Return the topic of each variable."""
    return {
        **dict.fromkeys((PLAN_STATE, CURRENT_NAME, CURRENT_STATE), "/plan"),
        **{operation_state_name(operation.name): f"/operations/{operation.name}" for operation in model.operations},
        **{name: f"/resources/{each.name}" for each in model.resources for name in (each.request_state, each.trigger)},
        **{variable.name: f"/variables/{variable.name}" for variable in model.variables},
    }


def _events_of(execution: Execution) -> Iterator[McapMessage]:
    """Yield the events without a state: automatic transitions, injections, faults of the network."""
    for number, record in enumerate(execution.trace.records):
        event = _event(record)
        if event is not None:
            topic, content = event
            yield McapMessage(topic, record.at_ns, number, content)


def _event(record: Record) -> tuple[str, Json] | None:  # noqa: C901, PLR0911 - one for each kind of record with a topic
    """Return topic and content of the message about a record; `None` for records that topics of states show."""
    changes = dict(record.changes)
    match record:
        case AutomaticTaken():
            return "/automatic", {"transition": record.transition, "failed": record.failed or "", "changes": changes}
        case InjectionApplied():
            return "/injections", {"injection": record.injection, "state": "applied", "changes": changes}
        case PutBack():
            return "/injections", {"injection": record.injection, "state": "put back", "changes": changes}
        case ResourceChanged():
            state = f"{record.resource} is {record.condition}"
            return "/injections", {"injection": record.injection, "state": state, "changes": changes}
        case MessageDisturbed():
            of = {"request": record.request, "resource": record.resource}
            return "/network", {**of, "message": record.message, "fate": fate_of(record)}
        case ReplyDropped():
            of = {"request": record.request, "resource": ""}
            return "/network", {**of, "message": "reply", "fate": fate_of(record)}
        case MeasurementRefused():
            message = f"{record.variable} = {json.dumps(record.value)}"
            return "/network", {"request": 0, "resource": "", "message": message, "fate": fate_of(record)}
        case RunStarted() | RunEnded() | PlanAsked() | PlanReceived() | PlanDropped() | BecameCurrent():
            return None
        case OperationStepped() | RequestSent() | RequestCancelled() | ReplyReceived() | MeasurementReceived():
            return None
        case RunnerStarted() | LivelockedAtRest():
            return None
        case _:
            assert_never(record)


def _requirements_of(model: BehaviorModel, execution: Execution) -> Iterator[McapMessage]:
    """Yield for each requirement that it is kept at first, and its violation; nothing for a run that was lost."""
    for requirement in (*model.requirements, *execution.case.requirements) if execution.trace.records else ():
        kept: Json = {"state": "kept", "reason": "", "values": {}}
        yield McapMessage(f"/requirements/{requirement.name}", 0, 0, kept)
    for each in execution.violations:
        if each.is_built_in:
            continue  # the log has it; a requirement of the model may have the same name
        broken = {"state": "violated", "reason": each.reason, "values": dict(each.values)}
        yield McapMessage(f"/requirements/{each.requirement}", each.at_ns, each.record, broken)


def _logged(model: BehaviorModel, execution: Execution) -> Iterator[McapMessage]:
    """Yield the log of the run, line by line; all lines of one moment have the number of its last record."""
    numbers = {record.at_ns: number for number, record in enumerate(execution.trace.records)}
    for line in event_lines(model, execution):
        number = numbers[line.record.at_ns]
        content = _log(execution, line.at_ns, number, line.severity, line.text)
        yield McapMessage("/events", line.at_ns, number, content)
    at_ns, number = max(numbers.items(), default=(0, 0))  # a run that was lost has no records
    for failure in execution.verdict.failures:
        content = _log(execution, at_ns, number, RecordSeverity.ERROR, f"FAILED  {failure}")
        yield McapMessage("/events", at_ns, number, content)


def _log(execution: Execution, at_ns: int, record: int, severity: RecordSeverity, message: str) -> Json:
    seconds, nanoseconds = divmod(at_ns, 1_000_000_000)
    timestamp = {"sec": seconds, "nsec": nanoseconds}
    about = {"name": execution.case.name, "file": execution.trace.model, "line": record}
    return {"timestamp": timestamp, "level": _LEVEL_OF[severity], "message": message, **about}
