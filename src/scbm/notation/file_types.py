"""The shape of a model file: which keys there are, which must be there, and what sort of YAML stands under them.

What the texts inside say is not checked here but in `builder`. The JSON Schema for editors is made of these types.
"""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidatorFunctionWrapHandler,
    WithJsonSchema,
    WrapValidator,
)
from pydantic_core import PydanticCustomError

from scbm.errors import Slug
from scbm.notation.durations import DURATION_PATTERN

_PREDICATE_HELP = (
    "A predicate: `==`, `!=`, `&&`, `||`, `!`, `->`, `in {a, b}`, `<` and its like on integers, `true`, `false`. "
    "A list is the conjunction of its elements."
)
_SCALAR_SCHEMA = {"type": ["boolean", "integer", "string"]}


def _found(value: object) -> str:
    match value:
        case None:
            return "nothing"
        case dict():
            return "a mapping"
        case list():
            return "a list"
        case _:
            return f"`{str(value).lower() if isinstance(value, bool) else str(value)[:40]}`"


def wrong_shape(expected: str, value: object, remedy: str | None = None) -> PydanticCustomError:
    """What to raise where something else was expected."""
    context = {"expected": expected, "found": _found(value), "remedy": remedy}
    return PydanticCustomError(Slug.WRONG_SHAPE.value, "expected {expected}, found {found}", context)


def _scalar(expected: str) -> BeforeValidator:
    def check(value: object) -> object:
        if value is None or isinstance(value, (dict, list)):
            raise wrong_shape(expected, value)
        return value

    return BeforeValidator(check)


def _scalar_or_list(expected: str, expected_element: str) -> BeforeValidator:
    elements = TypeAdapter(list[Annotated[Any, _scalar(expected_element)]])

    def check(value: object) -> object:
        if value is None or isinstance(value, dict):
            raise wrong_shape(expected, value)
        return elements.validate_python(value) if isinstance(value, list) else value

    return BeforeValidator(check)


def _list(expected: str, expected_element: str) -> BeforeValidator:
    elements = TypeAdapter(list[Annotated[Any, _scalar(expected_element)]])

    def check(value: object) -> object:
        if not isinstance(value, list):
            remedy = f"write `[{value}]`" if isinstance(value, str) else None
            raise wrong_shape(expected, value, remedy)
        return elements.validate_python(value)

    return BeforeValidator(check)


def _text_schema(description: str, **more: object) -> WithJsonSchema:
    return WithJsonSchema({"type": "string", "description": description, **more})


Name: TypeAlias = Annotated[Any, _scalar("a name"), WithJsonSchema({"type": "string"})]
Value: TypeAlias = Annotated[Any, _scalar("a value"), WithJsonSchema(_SCALAR_SCHEMA)]
Predicate: TypeAlias = Annotated[
    Any,
    _scalar_or_list("a predicate", "a predicate"),
    WithJsonSchema(
        {
            "description": _PREDICATE_HELP,
            "anyOf": [
                {"type": ["string", "boolean"]},
                {"type": "array", "items": {"type": ["string", "boolean"]}},
            ],
        }
    ),
]
Requirement: TypeAlias = Annotated[
    Any,
    _scalar("a requirement"),
    _text_schema("`always p`, `never p`, `p leads to q [within d]`, `p before q`, or `after p always q until r`."),
]
Actions: TypeAlias = Annotated[
    Any,
    _list("a list of actions", "an action"),
    WithJsonSchema(
        {
            "type": "array",
            "items": {"type": "string"},
            "description": "`v <- value`, `v <- other`, and on integers `v += 1`, `v -= 1`; all at once.",
        }
    ),
]
Names: TypeAlias = Annotated[
    Any, _list("a list of names", "a name"), WithJsonSchema({"type": "array", "items": {"type": "string"}})
]
Domain: TypeAlias = Annotated[
    Any,
    _scalar_or_list("`bool`, a list of symbols such as `[open, closed]`, or a range such as `0..5`", "a symbol"),
    WithJsonSchema(
        {
            "description": "`bool`, a list of symbols, or an integer range `lo..hi`.",
            "anyOf": [
                {"const": "bool"},
                {"type": "string", "pattern": r"^-?\d+\s*\.\.\s*-?\d+$"},
                {"type": "array", "items": {"type": "string"}, "minItems": 1, "uniqueItems": True},
            ],
        }
    ),
]
Values: TypeAlias = Annotated[
    Any,
    _scalar_or_list("`any` or a list of values", "a value"),
    WithJsonSchema({"anyOf": [{"const": "any"}, {"type": "array", "items": _SCALAR_SCHEMA, "minItems": 1}]}),
]
Duration: TypeAlias = Annotated[
    Any,
    _scalar("a duration such as `10 s`"),
    _text_schema("A number with a unit: `10 s`, `500 ms`, `2 minutes`.", pattern=DURATION_PATTERN),
]
Durations: TypeAlias = Annotated[
    Any,
    _list("a list of durations", "a duration such as `10 s`"),
    WithJsonSchema({"type": "array", "items": {"type": "string", "pattern": DURATION_PATTERN}}),
]
Probability: TypeAlias = Annotated[
    Any, _scalar("a probability"), WithJsonSchema({"type": "number", "minimum": 0, "maximum": 1})
]


class FileType(BaseModel):
    """A mapping with known keys."""

    model_config = ConfigDict(extra="forbid", use_attribute_docstrings=True)


class VariableFile(FileType):
    """A variable with a finite domain."""

    domain: Domain
    initial: Value
    """The nominal initial value."""
    random: Values = None
    """What random initial states draw from: `any` or a list; the nominal value if this is missing."""


class LatencyFile(FileType):
    """A distribution of latencies."""

    fixed: Duration = None
    """Always this."""
    uniform: Durations = None
    """`[lowest, highest]`, all between alike."""
    triangular: Durations = None
    """`[lowest, most likely, highest]`."""


def _latency(value: object, check: ValidatorFunctionWrapHandler) -> object:
    if value is None or isinstance(value, list):
        raise wrong_shape("a duration or a distribution such as `{uniform: [200 ms, 1 s]}`", value)
    return check(value) if isinstance(value, dict) else value


Latency: TypeAlias = Annotated[
    LatencyFile,
    WrapValidator(_latency),
    WithJsonSchema(
        {
            "description": "A duration, or `{fixed: d}`, `{uniform: [low, high]}`, `{triangular: [low, mode, high]}`.",
            "anyOf": [
                {"type": "string", "pattern": DURATION_PATTERN},
                {
                    "type": "object",
                    "minProperties": 1,
                    "maxProperties": 1,
                    "additionalProperties": False,
                    "properties": {
                        "fixed": {"type": "string", "pattern": DURATION_PATTERN},
                        "uniform": {
                            "type": "array",
                            "items": {"type": "string", "pattern": DURATION_PATTERN},
                            "minItems": 2,
                            "maxItems": 2,
                        },
                        "triangular": {
                            "type": "array",
                            "items": {"type": "string", "pattern": DURATION_PATTERN},
                            "minItems": 3,
                            "maxItems": 3,
                        },
                    },
                },
            ],
        }
    ),
]


class OutcomesFile(FileType):
    """How probable each outcome of a request is; together 1."""

    succeed: Probability = 0
    fail: Probability = 0
    timeout: Probability = 0
    """No reply at all."""


class SimulationFile(FileType):
    """How a simulated resource behaves."""

    latency: Latency = Field(default_factory=LatencyFile)
    outcomes: OutcomesFile = Field(default_factory=OutcomesFile)
    measured: dict[str, Values] = Field(default_factory=dict)
    """For each measured variable, the values that a successful reply draws from."""


class ResourceFile(FileType):
    """What requests are sent to. It owns `<name>_req_trigger` and `<name>_req_state`."""

    request: Names = Field(default_factory=list)
    """The variables whose values a request carries."""
    measures: Names = Field(default_factory=list)
    """The variables whose values a reply may carry."""
    simulation: SimulationFile = Field(default_factory=SimulationFile)


class AutomaticFile(FileType):
    """A running transition `g / gr / a / ar` whose name is its key."""

    g: Predicate
    """The guard that planner and runner see."""
    gr: Predicate = True
    """The guard that only the runner adds."""
    a: Actions = Field(default_factory=list)
    """The actions that planner and runner take."""
    ar: Actions = Field(default_factory=list)
    """The actions that only the runner adds."""


class TransitionFile(AutomaticFile):
    """A running transition `g / gr / a / ar`."""

    name: Name = None
    """What reports call it."""


class OperationFile(FileType):
    """A task that takes time."""

    deadline: Duration = None
    """How long it may execute before it is timed out; for ever, if this is missing."""
    pre: TransitionFile
    """Taken when the operation starts."""
    post: TransitionFile
    """Taken when the operation completes."""
    failed: TransitionFile = None  # type: ignore[assignment] # only the shape of what is there is ever looked at
    """Fails the operation while it executes."""
    timedout: Actions = Field(default_factory=list)
    """Taken when the deadline passes."""
    disabled_deadline: Duration = None
    """How long it may be disabled before a new plan is asked for; for ever, if this is missing."""


class ModelFile(FileType):
    """A behavior model."""

    behavior_model: Name
    """The name of the model."""
    variables: dict[str, VariableFile]
    resources: dict[str, ResourceFile] = Field(default_factory=dict)
    operations: dict[str, OperationFile]
    """What can be planned. Their order decides between plans of one length."""
    automatic_transitions: dict[str, AutomaticFile] = Field(default_factory=dict)
    """Taken as soon as they can be, the first one first."""
    initial_states: Predicate = True
    """What every initial state satisfies."""
    goals: dict[str, Predicate] = Field(default_factory=dict)
    requirements: dict[str, Requirement] = Field(default_factory=dict)
    """What must hold during every run."""
