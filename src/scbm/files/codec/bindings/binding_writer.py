"""From a binding back to what stands under `ros` of a resource."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scbm.files.codec.common_parts import NAME
from scbm.files.yaml.yaml_writer import Quoted
from scbm.model import SET_BOOL, TRIGGER, FieldType, Reference, ServiceCall, ServiceChoice, TopicPair, format_value

if TYPE_CHECKING:
    from scbm.model import Binding, MeasuredTopic, Reading, Scalar, ServiceType


def written_binding(binding: Binding) -> dict[str, Any]:
    """The binding as a mapping, with every key that says more than its default."""
    written: dict[str, Any] = {}
    match binding.requests:
        case ServiceCall():
            written["service"] = _call(binding.requests)
        case ServiceChoice(variable, calls):
            written["services"] = {variable: {format_value(value): _call(call) for value, call in calls}}
        case TopicPair(request, reply):
            written["topics"] = {"request": request, "reply": reply}
    if binding.measured:
        written["measured"] = {measured.reading.variable: _measured(measured) for measured in binding.measured}
    return written


def _call(call: ServiceCall) -> dict[str, Any]:
    written: dict[str, Any] = {"name": call.name, "type": _type(call.type)}
    if call.request:
        written["request"] = {field: _argument(argument) for field, argument in call.request}
    if call.succeeded != (("success", True),) or ("success", FieldType.BOOL) not in call.type.response:
        written["succeeded"] = {field: _literal(value) for field, value in call.succeeded}
    if call.measured:
        written["measured"] = {reading.variable: _response(field, reading) for field, reading in call.measured}
    return written


def _type(kind: ServiceType) -> str | dict[str, Any]:
    if kind in (TRIGGER, SET_BOOL):
        return kind.name
    fields = {"request": kind.request, "response": kind.response}
    described = {key: {name: type_.value for name, type_ in part} for key, part in fields.items() if part}
    return {"name": kind.name, **described}


def _argument(argument: Scalar | Reference) -> Scalar:
    return argument.name if isinstance(argument, Reference) else _literal(argument)


def _literal(value: Scalar) -> Scalar:
    """A value; a text that is no plain word in quotes, as a driver may want any."""
    return Quoted(value) if isinstance(value, str) and not NAME.fullmatch(value) else value


def _response(field: str, reading: Reading) -> str | dict[str, Any]:
    how = _reading(reading)
    return {"field": field, **how} if how else field


def _measured(measured: MeasuredTopic) -> dict[str, Any]:
    reliability = {"best_effort": True} if measured.is_best_effort else {}
    return {"topic": measured.topic, "type": measured.type.value, **reliability, **_reading(measured.reading)}


def _reading(reading: Reading) -> dict[str, Any]:
    written: dict[str, Any] = {}
    if reading.ranges:
        written["ranges"] = {format_value(value): str(interval) for value, interval in reading.ranges}
    if reading.texts:
        written["values"] = {_literal(text): value for text, value in reading.texts}
    return written
