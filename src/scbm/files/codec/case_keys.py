"""The shape of a case file: which keys there are, which must be there, and what sort of YAML stands under them.

What the texts inside say is not checked here but in the builders. The JSON Schema for editors is made of these types.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from pydantic import (
    Field,
    TypeAdapter,
    ValidatorFunctionWrapHandler,
    WithJsonSchema,
    WrapValidator,
)

from scbm.files.codec.case_words import ANY, CONDITION_WORDS, OUTCOME_WORDS, VERDICT_WORDS
from scbm.files.codec.key_types import (
    Duration,
    Editors,
    FileType,
    Name,
    Names,
    Predicate,
    Requirement,
    Shape,
    Value,
    scalar,
    scalar_or_list,
    scalar_or_mapping,
    text_schema,
    wrong_shape,
)
from scbm.files.language.quantities import DURATION_PATTERN

if TYPE_CHECKING:
    from pydantic.json_schema import JsonSchemaValue


def _words(words: tuple[str, ...]) -> JsonSchemaValue:
    return {"enum": list(words)}


Outcome_: TypeAlias = Annotated[Any, scalar("an outcome such as `fail`"), WithJsonSchema(_words(OUTCOME_WORDS))]
Verdict: TypeAlias = Annotated[Any, scalar("a verdict such as `reached`"), WithJsonSchema(_words(VERDICT_WORDS))]
Count: TypeAlias = Annotated[Any, scalar("a whole number"), WithJsonSchema({"type": "integer", "minimum": 1})]
Seed: TypeAlias = Annotated[Any, scalar("a whole number"), WithJsonSchema({"type": "integer"})]
Factor: TypeAlias = Annotated[Any, scalar("a number such as `3`"), WithJsonSchema({"type": "number", "minimum": 1})]
Digest: TypeAlias = Annotated[
    Any, scalar("the SHA-256 of a trace"), WithJsonSchema({"type": ["string", "number"], "pattern": "^[0-9a-f]{64}$"})
]
ModelPath: TypeAlias = Annotated[
    Any,
    scalar("the path of a model file"),
    text_schema("The model file, seen from the directory of this file."),
]
Goal: TypeAlias = Annotated[
    Any,
    scalar_or_list("the name of a goal, or a predicate", "a predicate"),
    WithJsonSchema({"anyOf": [{"type": ["string", "boolean"]}, {"type": "array", "items": {"type": "string"}}]}),
]
Share: TypeAlias = Annotated[
    Any,
    scalar("a share such as `2 %`"),
    WithJsonSchema(
        {
            "description": "A share in per cent, or a number from 0 to 1: `2 %`, `0.02`.",
            "anyOf": [
                {"type": "string", "pattern": r"^\d+(\.\d+)?\s*%$"},
                {"type": "number", "minimum": 0, "maximum": 1},
            ],
        }
    ),
]
Delivery: TypeAlias = Annotated[
    Any,
    scalar_or_list("`lost`, a duration, or a list of durations", "a duration such as `10 ms`"),
    WithJsonSchema(
        {
            "description": "`lost`, how long it is under way, or that of each copy that arrives.",
            "anyOf": [
                {"const": "lost"},
                {"type": "string", "pattern": DURATION_PATTERN},
                {"type": "array", "items": {"type": "string", "pattern": DURATION_PATTERN}},
            ],
        }
    ),
]


class OutcomeFile(FileType):
    """What happens to a request, or to several."""

    outcome: Outcome_ = ANY
    """`succeed`, `fail`, `timeout` (no reply), or `any` (nothing is said)."""
    after: Duration = None
    """The time from the arrival of the request to the reply."""
    measured: dict[str, Value] = Field(default_factory=dict)
    """What a successful reply measures."""
    times: Count = 1
    """For so many requests; in a list only."""
    from_: Annotated[Count, Field(alias="from")] = 1
    """From this request on, counted from 1, for ever."""
    request: Delivery = None
    """How the request travels."""
    reply: Delivery = None
    """How the reply travels."""
    cancel: Delivery = None
    """How the cancellation travels."""


_RULE = "an outcome such as `fail`, a mapping such as `{outcome: fail, after: 2 s}`, or a list of them"
_ELEMENT = "an outcome such as `fail`, or a mapping such as `{outcome: fail, after: 2 s}`"


def _element(value: object, check: ValidatorFunctionWrapHandler) -> object:
    if value is None or isinstance(value, list):
        raise wrong_shape(_ELEMENT, value)
    return check(value) if isinstance(value, dict) else value


_ELEMENTS = TypeAdapter(list[Annotated[OutcomeFile, WrapValidator(_element)]])


def _rule(value: object, check: ValidatorFunctionWrapHandler) -> object:
    if value is None:
        raise wrong_shape(_RULE, value)
    if isinstance(value, list):
        return _ELEMENTS.validate_python(value)
    return check(value) if isinstance(value, dict) else value


def _rule_schema(mapping: JsonSchemaValue) -> JsonSchemaValue:
    element = [_words(OUTCOME_WORDS), mapping]
    return {"anyOf": [*element, {"type": "array", "items": {"anyOf": element}}]}


Rule: TypeAlias = Annotated[OutcomeFile, WrapValidator(_rule), Editors(_rule_schema)]


class ConditionFile(FileType):
    """A condition of a resource that has a number."""

    slower: Factor
    """Requests take so many times their time; at least 1."""


Condition_: TypeAlias = Annotated[
    ConditionFile,
    scalar_or_mapping("a condition such as `dead`, or `{slower: 3}`"),
    Editors(lambda mapping: {"anyOf": [_words(CONDITION_WORDS), mapping]}),
]


class InjectionFile(FileType):
    """What the tester changes on the way: it has `set`, or `resource` and `becomes`. It acts once."""

    name: Name = None
    """What the trace calls it; `injection_1`, … if this is missing."""
    when: Predicate = True
    """It acts as soon as this holds."""
    at: Duration = None
    """It acts not before this time of the run."""
    set: dict[str, Value] = Field(default_factory=dict)
    """Variables of the controller and their values, such as an automatic transition may assign."""
    resource: Name = None
    """The resource that it acts on."""
    becomes: Condition_ = None  # type: ignore[assignment] # only the shape of what is there is ever looked at
    """What that becomes: `occupied`, `dead`, `failing`, `{slower: 3}`, `well`."""
    hold: Duration = None
    """So long afterwards it puts back what nothing else has changed since."""


class PartitionFile(FileType):
    """A time in which no messages arrive."""

    at: Duration
    """When it begins, in time of the run."""
    for_: Annotated[Duration, Field(alias="for")]
    """How long it lasts."""
    resource: Name = None
    """Which resource is cut off; all of them, if this is missing."""


class RestartFile(FileType):
    """A time in which a resource is down; then it knows nothing of earlier requests."""

    resource: Name
    at: Duration
    """When it goes down, in time of the run."""
    for_: Annotated[Duration, Field(alias="for")] = "0 s"
    """How long it is down."""


class NetworkFile(FileType):
    """Faults of the network between runner and resources."""

    latency: Duration = "0 s"
    """How long each message is under way."""
    jitter: Duration = "0 s"
    """Up to so much longer, all values between alike."""
    loss: Share = 0
    """How probable it is that a message does not arrive."""
    duplication: Share = 0
    """How probable it is that it arrives twice."""
    reordering: Share = 0
    """How probable it is that it is held back, so that later messages overtake it."""
    held_back: Duration = "100 ms"
    """How long it is held back at most."""
    partitions: list[PartitionFile] = Field(default_factory=list)
    """When messages do not arrive at all."""
    restarts: list[RestartFile] = Field(default_factory=list)
    """When resources are down and forget."""


class LimitsFile(FileType):
    """When the run is given up."""

    time: Duration = None
    """How long the goal may be pursued."""
    plans: Count = None
    """How many plans may be asked for."""


class ExpectationsFile(FileType):
    """What must come of the run."""

    verdict: Verdict = None
    """How it ends."""
    plan: Names = Field(default_factory=list)
    """The operations of the first plan, all of them."""
    order: Names = Field(default_factory=list)
    """Operations that complete in this order; others may complete between them."""
    final: Predicate = True
    """What holds at the end."""
    visits: Names = Field(default_factory=list)
    """Obligations that the run visits, such as `scan/timedout`, `scan/queued`, `automatic/clear`."""


class DrawnFile(FileType):
    """Where that is drawn from which the case leaves open."""

    seed: Seed
    case: Count = 1
    """Which case of the campaign with this seed."""


class RecordedFile(FileType):
    """What came of the run that the case was saved from."""

    end: Verdict
    """How it ended."""
    trace: Digest
    """The SHA-256 of its trace, in hexadecimal digits."""


class CaseFile(FileType):
    """A test case."""

    case: Name
    """The name of the case."""
    model: ModelPath = None
    goal: Goal
    """The name of a goal of the model, or a predicate over the world."""
    initial: dict[str, Value] = Field(default_factory=dict)
    """The variables that differ from the nominal state."""
    outcomes: dict[str, Rule] = Field(default_factory=dict)
    """What happens to the requests of a resource, or to those that are sent while an operation is the current one."""
    injections: list[InjectionFile] = Field(default_factory=list)
    """What the tester changes on the way."""
    network: NetworkFile = Field(default_factory=NetworkFile)
    limits: LimitsFile = Field(default_factory=LimitsFile)
    requirements: dict[str, Requirement] = Field(default_factory=dict)
    """More requirements, which hold for this case."""
    expect: ExpectationsFile = Field(default_factory=ExpectationsFile)
    drawn: DrawnFile = None  # type: ignore[assignment] # only the shape of what is there is ever looked at
    """What the case leaves open is drawn from these streams; it is plain, if this is missing."""
    recorded: RecordedFile = None  # type: ignore[assignment] # the same


CASE_SHAPE = Shape(
    "case",
    CaseFile,
    (
        (OutcomeFile, "an outcome"),
        (InjectionFile, "an injection"),
        (PartitionFile, "a partition"),
        (NetworkFile, "the network"),
        (LimitsFile, "the limits"),
        (ExpectationsFile, "what the case expects"),
        (DrawnFile, "`drawn`"),
        (RecordedFile, "`recorded`"),
        (CaseFile, "the case"),
    ),
)

NETWORK_SHAPE = Shape("network", NetworkFile, ((PartitionFile, "a partition"), (RestartFile, "a restart")))
