"""The shape of a model file: which keys there are, which must be there, and what sort of YAML stands under them.

What the texts inside say is not checked here but in `builder`. The JSON Schema for editors is made of these types.
"""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from pydantic import Field, WithJsonSchema

from scbm.files.codec.binding_keys import RosFile
from scbm.files.codec.key_types import (
    SCALAR_SCHEMA,
    Duration,
    Durations,
    FileType,
    Name,
    Names,
    Predicate,
    Requirement,
    Shape,
    Value,
    list_of,
    scalar,
    scalar_or_list,
    scalar_or_mapping,
)
from scbm.files.language.quantities import DURATION_PATTERN

Actions: TypeAlias = Annotated[
    Any,
    list_of("a list of actions", "an action"),
    WithJsonSchema(
        {
            "type": "array",
            "items": {"type": "string"},
            "description": "`v <- value`, `v <- other`, and on integers `v += 1`, `v -= 1`; all at once.",
        }
    ),
]
Domain: TypeAlias = Annotated[
    Any,
    scalar_or_list("`bool`, a list of symbols such as `[open, closed]`, or a range such as `0..5`", "a symbol"),
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
    scalar_or_list("`any` or a list of values", "a value"),
    WithJsonSchema({"anyOf": [{"const": "any"}, {"type": "array", "items": SCALAR_SCHEMA, "minItems": 1}]}),
]
Probability: TypeAlias = Annotated[
    Any, scalar("a probability"), WithJsonSchema({"type": "number", "minimum": 0, "maximum": 1})
]


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


Latency: TypeAlias = Annotated[
    LatencyFile,
    scalar_or_mapping("a duration or a distribution such as `{uniform: [200 ms, 1 s]}`"),
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
    ros: RosFile = Field(default_factory=RosFile)
    """How it is reached when it is real."""


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


MODEL_SHAPE = Shape(
    "model",
    ModelFile,
    (
        (VariableFile, "a variable"),
        (ResourceFile, "a resource"),
        (SimulationFile, "the `simulation` of a resource"),
        (RosFile, "`ros` of a resource"),
        (OperationFile, "an operation"),
        (TransitionFile, "a transition"),
        (ModelFile, "the model"),
    ),
)
