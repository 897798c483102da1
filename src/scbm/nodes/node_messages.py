"""The messages between the nodes of a cell, encoded as JSON (docs/reference/node-protocol.md).

A peer may be any program: data that is not a message of this version is refused with a reason.
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, fields
from fractions import Fraction
from functools import cache
from typing import Annotated, Any, ClassVar, TypeAlias, get_args, get_type_hints

from msgspec import Meta

from scbm.model.json_reader import JsonError, convert_json, read_json_object

VERSION = 5
"""Incremented with every change that older nodes cannot parse."""

_MAX_CHARACTERS = 8_000_000
Count: TypeAlias = Annotated[int, Meta(ge=0, le=2**63 - 1)]
"""A whole number from 0 on that a clock can hold."""

_FRACTION = re.compile(r"[1-9]\d{0,17}(/[1-9]\d{0,17})?", re.ASCII)


class NotAMessageError(ValueError):
    """The received data is not a message; the text says why."""


@dataclass(frozen=True, slots=True)
class Status:
    """The status of a node. If two nodes exclude each other in a cell, the older one stays.

    Attributes:
        role: `controller`, `resources` or `tester`.
        node: its unique id.
        version: `VERSION`.
        model, digest: the name and the digest of its model.
        resources: the resources that it simulates; of a controller, those that real drivers carry out.
        troubles: the reasons why it cannot take part in a run.
        mismatched: the troubles that waiting does not solve: a driver does not match its binding.
        since_ns: its start, in nanoseconds since 1970.
        words: its process and machine, for people.
    """

    kind: ClassVar[str] = "status"
    role: str
    node: str
    version: Count
    model: str
    digest: str
    resources: tuple[str, ...]
    troubles: tuple[str, ...]
    mismatched: tuple[str, ...]
    since_ns: Count
    words: str


# from the tester to controller and resources


@dataclass(frozen=True, slots=True)
class Prepare:
    """Prepare a run, and abandon any earlier one.

    Attributes:
        run: its unique id.
        nodes: the ids of the nodes that must confirm.
        case: the case as YAML.
        options: the options of the runner, by name.
        time_scale: a fraction: seconds of the run for each second of the wall clock.
        is_relayed: whether the tester decides how messages of resources travel.
        tester: the process and machine of the tester, for people.
        real: the resources that real drivers carry out; the run does not wait for nodes that simulate them too.
    """

    kind: ClassVar[str] = "prepare"
    run: str
    nodes: tuple[str, ...]
    case: str
    options: dict[str, Any]
    time_scale: str
    is_relayed: bool
    tester: str
    real: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Go:
    """The run begins."""

    kind: ClassVar[str] = "go"
    run: str


@dataclass(frozen=True, slots=True)
class Note:
    """An addition to the trace: a record without its time."""

    kind: ClassVar[str] = "note"
    run: str
    note: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Abandon:
    """The tester has cancelled the run."""

    kind: ClassVar[str] = "abandon"
    run: str


# from controller and resources to the tester


@dataclass(frozen=True, slots=True)
class Prepared:
    """A node is ready for the run."""

    kind: ClassVar[str] = "prepared"
    run: str
    node: str


@dataclass(frozen=True, slots=True)
class Forgot:
    """A node does not know a run, of which it received a message; or a controller leaves before it began the run."""

    kind: ClassVar[str] = "forgot"
    run: str
    node: str


@dataclass(frozen=True, slots=True)
class Refused:
    """A node cannot take part in the run."""

    kind: ClassVar[str] = "refused"
    run: str
    node: str
    why: str


@dataclass(frozen=True, slots=True)
class Busy:
    """A node serves another tester, with this name for people, since `for_ns`."""

    kind: ClassVar[str] = "busy"
    run: str
    node: str
    tester: str
    for_ns: Count


@dataclass(frozen=True, slots=True)
class Stepped:
    """An event came to the runner, or a note to the trace; `number` counts them from 1."""

    kind: ClassVar[str] = "step"
    run: str
    number: Count
    at_ns: Count
    event: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Ended:
    """The run ended with its last step; `trace` is the digest of its trace as the controller has it.

    `planner` is the name and the version of the planner of the controller.
    """

    kind: ClassVar[str] = "ended"
    run: str
    steps: Count
    trace: str
    planner: str


@dataclass(frozen=True, slots=True)
class Answering:
    """A simulated resource is about to answer, and asks how the reply travels; `job` counts its answers."""

    kind: ClassVar[str] = "answering"
    run: str
    request: Count
    resource: str
    job: Count


# from the tester to simulated resources


@dataclass(frozen=True, slots=True)
class React:
    """The fate of a request: see `cases.Reaction`. `copies` has the delay of each copy that arrives."""

    kind: ClassVar[str] = "react"
    run: str
    request: Count
    resource: str
    outcome: str
    latency_ns: Count
    measured: dict[str, Any] | None
    copies: tuple[Count, ...]


@dataclass(frozen=True, slots=True)
class Fate:
    """How a cancellation (`job` is 0) or a reply travels."""

    kind: ClassVar[str] = "fate"
    run: str
    request: Count
    resource: str
    job: Count
    copies: tuple[Count, ...]


@dataclass(frozen=True, slots=True)
class Become:
    """The condition of a resource changes; `factor` is a fraction."""

    kind: ClassVar[str] = "become"
    run: str
    resource: str
    condition: str
    factor: str


@dataclass(frozen=True, slots=True)
class RestartResource:
    """A resource goes down, or comes up again."""

    kind: ClassVar[str] = "restart"
    run: str
    resource: str
    is_down: bool


Message: TypeAlias = (
    Status
    | Prepare
    | Go
    | Note
    | Abandon
    | Prepared
    | Forgot
    | Refused
    | Busy
    | Stepped
    | Ended
    | Answering
    | React
    | Fate
    | Become
    | RestartResource
)


def encode(message: Message) -> str:
    """Return the message as JSON."""
    written = {field.name: getattr(message, field.name) for field in fields(message)}
    return json.dumps({"kind": message.kind, **written}, ensure_ascii=False, separators=(",", ":"))


def decode(text: object) -> Message:
    """Return the message that a text is; raise `NotAMessageError`."""
    data = read_object(text)
    kind = data.pop("kind", None)
    shape = _shapes().get(kind) if isinstance(kind, str) else None
    if shape is None:
        raise NotAMessageError(f"`{str(kind)[:40]}` is no kind of message")
    made, types = shape
    if data.keys() != types.keys():
        raise NotAMessageError(f"a `{kind}` has the fields {', '.join(types)}")
    values = {name: _field(data[name], name, type_, kind) for name, type_ in types.items()}
    message: Message = made(**values)
    return message


def _field(value: object, name: str, type_: Any, kind: object) -> object:  # noqa: ANN401 - a type of any kind
    try:
        return convert_json(value, type_)
    except JsonError as error:
        raise NotAMessageError(f"`{name}` of a `{kind}` is of the wrong type: {error.message}") from None


def read_object(text: object) -> dict[str, Any]:
    """Return the JSON object that a text is; raise `NotAMessageError`."""
    if not isinstance(text, str):
        raise NotAMessageError("a message is a text")
    try:
        return read_json_object(text, _MAX_CHARACTERS)
    except JsonError as error:
        raise NotAMessageError(error.message) from None


def read_fraction(text: str) -> Fraction:
    """Return the fraction greater than 0 that a field says; raise `NotAMessageError`."""
    if not _FRACTION.fullmatch(text):
        raise NotAMessageError(f"`{text[:40]}` is not a fraction greater than 0")
    return Fraction(text)


@cache
def _shapes() -> dict[str, tuple[Any, dict[str, Any]]]:
    """Return the class of each kind of message, and the types of its fields."""
    shapes = {}
    for message in get_args(Message):
        types = get_type_hints(message, include_extras=True)
        shapes[message.kind] = (message, {field.name: types[field.name] for field in fields(message)})
    return shapes
