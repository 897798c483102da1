"""What a system is: variables, operations, transitions, goals. Immutable, without time and without I/O.

Everything here prints back to the notation that it is written in; `scbm.files` reads that notation.
"""

from scbm.model.behavior import BehaviorModel, InitialStates
from scbm.model.bindings import (
    SET_BOOL,
    TRIGGER,
    Binding,
    FieldType,
    Interval,
    MeasuredTopic,
    MessageType,
    Reading,
    Scalar,
    ServiceCall,
    ServiceChoice,
    ServiceType,
    TopicPair,
)
from scbm.model.diagnostics import Diagnostic, InputError, Place, ScbmError, Severity
from scbm.model.durations import format_duration, format_moment
from scbm.model.operations import Action, Add, Assign, Operation, Transition
from scbm.model.packing import Packing
from scbm.model.predicates import (
    And,
    Constant,
    Equal,
    Implies,
    Member,
    Not,
    NotEqual,
    Or,
    Order,
    Predicate,
    Reference,
    Relation,
    Term,
    Truth,
    conjunction,
)
from scbm.model.requirements import FORMS, AfterAlways, Always, Before, LeadsTo, Never, Requirement, RequirementForm
from scbm.model.resources import Latency, LatencyShape, Outcome, Resource, Simulation
from scbm.model.slugs import Slug
from scbm.model.state import State
from scbm.model.values import Domain, Value, ValueKind, format_value
from scbm.model.variables import OperationState, PlanState, RequestState, Role, StateSpace, Variable

__all__ = [
    "FORMS",
    "SET_BOOL",
    "TRIGGER",
    "Action",
    "Add",
    "AfterAlways",
    "Always",
    "And",
    "Assign",
    "Before",
    "BehaviorModel",
    "Binding",
    "Constant",
    "Diagnostic",
    "Domain",
    "Equal",
    "FieldType",
    "Implies",
    "InitialStates",
    "InputError",
    "Interval",
    "Latency",
    "LatencyShape",
    "LeadsTo",
    "MeasuredTopic",
    "Member",
    "MessageType",
    "Never",
    "Not",
    "NotEqual",
    "Operation",
    "OperationState",
    "Or",
    "Order",
    "Outcome",
    "Packing",
    "Place",
    "PlanState",
    "Predicate",
    "Reading",
    "Reference",
    "Relation",
    "RequestState",
    "Requirement",
    "RequirementForm",
    "Resource",
    "Role",
    "Scalar",
    "ScbmError",
    "ServiceCall",
    "ServiceChoice",
    "ServiceType",
    "Severity",
    "Simulation",
    "Slug",
    "State",
    "StateSpace",
    "Term",
    "TopicPair",
    "Transition",
    "Truth",
    "Value",
    "ValueKind",
    "Variable",
    "conjunction",
    "format_duration",
    "format_moment",
    "format_value",
]
