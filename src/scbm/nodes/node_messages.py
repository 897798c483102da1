"""The messages between the nodes of a cell, encoded as JSON (docs/reference/node-protocol.md).

A peer may be any program: data that is not a message of this version is refused with a reason.
"""

from __future__ import annotations

from typing import Annotated, TypeAlias

from msgspec import Meta
from msgspec.json import Encoder

from scbm.model.json_reader import (
    Count,
    JsonError,
    JsonRecord,
    LongText,
    Names,
    Text,
    Values,
    one_of,
    quoted,
    read_json_object,
    read_record,
)
from scbm.nodes.buses.bus import UnmatchedKind
from scbm.testing.event_logs.event_records import (
    EventRecord,
    Factor,
    NoteRecord,
    OptionsRecord,
    OutcomeWord,
    Travel,
)
from scbm.testing.real_drivers import GoalFate

VERSION = 7
"""Incremented with every change that older nodes cannot parse."""

_MAX_CHARACTERS = 8_000_000


class Trouble(JsonRecord, frozen=True):
    """A reason why a node cannot take part in a run: its kind, and a sentence."""

    kind: Annotated[str, one_of(UnmatchedKind)]
    words: LongText


class _Message(JsonRecord, tag_field="kind", frozen=True):
    """A message between nodes."""

    @property
    def kind(self) -> str:
        """The name of its class on the wire."""
        return str(self.__struct_config__.tag)


class Status(_Message, tag="status", frozen=True):
    """The status of a node. If two nodes exclude each other in a cell, the older one stays.

    Attributes:
        role: `controller`, `resources` or `tester`.
        node: its unique id.
        version: `VERSION`.
        model, digest: the name and the digest of its model.
        resources: the resources that it simulates; of a controller, those that real drivers carry out.
        troubles: the reasons why it cannot take part in a run.
        since_ns: its start, in nanoseconds since 1970.
        words: its process and machine, for people.
    """

    role: Text
    node: Text
    version: Count
    model: Text
    digest: Text
    resources: Names
    troubles: Annotated[tuple[Trouble, ...], Meta(max_length=10_000)]
    since_ns: Count
    words: Text


# from the tester to controller and resources


class Prepare(_Message, tag="prepare", frozen=True):
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

    run: Text
    nodes: Names
    case: str
    options: OptionsRecord
    time_scale: Factor
    is_relayed: bool
    tester: Text
    real: Names


class Go(_Message, tag="go", frozen=True):
    """The run begins."""

    run: Text


class Note(_Message, tag="note", frozen=True):
    """An addition to the trace: a record without its time."""

    run: Text
    note: NoteRecord


class Abandon(_Message, tag="abandon", frozen=True):
    """The tester has cancelled the run."""

    run: Text


# from controller and resources to the tester


class Prepared(_Message, tag="prepared", frozen=True):
    """A node is ready for the run."""

    run: Text
    node: Text


class Forgot(_Message, tag="forgot", frozen=True):
    """A node does not know a run, of which it received a message; or a controller leaves before it began the run."""

    run: Text
    node: Text


class Refused(_Message, tag="refused", frozen=True):
    """A node cannot take part in the run."""

    run: Text
    node: Text
    why: LongText


class Busy(_Message, tag="busy", frozen=True):
    """A node serves another tester, with this name for people, since `for_ns`."""

    run: Text
    node: Text
    tester: Text
    for_ns: Count


class Stepped(_Message, tag="step", frozen=True):
    """An event came to the runner, or a note to the trace; `number` counts them from 1."""

    run: Text
    number: Count
    at_ns: Count
    event: EventRecord


class Ended(_Message, tag="ended", frozen=True):
    """The run ended with its last step; `trace` is the digest of its trace as the controller has it.

    `planner` is the name and the version of the planner of the controller.
    """

    run: Text
    steps: Count
    trace: Text
    planner: Text


class GoalChanged(_Message, tag="goal", frozen=True):
    """Something became of a goal of an action at a real driver, maybe after its run."""

    run: Text
    resource: Text
    fate: Annotated[str, one_of(GoalFate)]


class Answering(_Message, tag="answering", frozen=True):
    """A simulated resource is about to answer, and asks how the reply travels; `job` counts its answers."""

    run: Text
    request: Count
    resource: Text
    job: Count


# from the tester to simulated resources


class React(_Message, tag="react", frozen=True):
    """The fate of a request: see `cases.Reaction`. `copies` has the delay of each copy that arrives."""

    run: Text
    request: Count
    resource: Text
    outcome: OutcomeWord
    latency_ns: Count
    measured: Values | None
    copies: Travel


class Fate(_Message, tag="fate", frozen=True):
    """How a cancellation (`job` is 0) or a reply travels."""

    run: Text
    request: Count
    resource: Text
    job: Count
    copies: Travel


class Become(_Message, tag="become", frozen=True):
    """The condition of a resource changes; `factor` is a fraction."""

    run: Text
    resource: Text
    condition: Text
    factor: Factor


class RestartResource(_Message, tag="restart", frozen=True):
    """A resource goes down, or comes up again."""

    run: Text
    resource: Text
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
    | GoalChanged
    | Answering
    | React
    | Fate
    | Become
    | RestartResource
)


_ENCODER = Encoder()


def encode(message: Message) -> str:
    """Return the message as JSON."""
    return _ENCODER.encode(message).decode()


def decode(text: object) -> Message:
    """Return the message that a text is; raise `JsonError`."""
    data = read_object(text)
    kind = data.get("kind")
    message: Message = read_record(data, Message, quoted(kind) if isinstance(kind, str) else "a message")
    return message


def read_object(text: object, max_characters: int = _MAX_CHARACTERS) -> dict[str, object]:
    """Return the JSON object that a text is; raise `JsonError`."""
    if not isinstance(text, str):
        raise JsonError("a message is a text")
    return read_json_object(text, max_characters)
