"""What a system is: variables, operations, transitions, goals. Immutable, without time and without I/O.

Everything here prints back to the notation that it is written in; `scbm.notation` reads that notation.
"""

from scbm.model.actions import Action, Add, Assign
from scbm.model.behavior import BehaviorModel
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
from scbm.model.durations import format_duration, format_moment
from scbm.model.initial_states import InitialStates
from scbm.model.operations import Operation
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
from scbm.model.requirements import AfterAlways, Always, Before, LeadsTo, Never, Requirement
from scbm.model.resources import Latency, LatencyShape, Outcome, Resource, Simulation
from scbm.model.state import State
from scbm.model.transitions import Transition
from scbm.model.values import Domain, Kind, Value, format_value
from scbm.model.variables import OperationState, PlanState, RequestState, Role, StateSpace, Variable

__all__ = [
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
    "Domain",
    "Equal",
    "FieldType",
    "Implies",
    "InitialStates",
    "Interval",
    "Kind",
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
    "PlanState",
    "Predicate",
    "Reading",
    "Reference",
    "Relation",
    "RequestState",
    "Requirement",
    "Resource",
    "Role",
    "Scalar",
    "ServiceCall",
    "ServiceChoice",
    "ServiceType",
    "Simulation",
    "State",
    "StateSpace",
    "Term",
    "TopicPair",
    "Transition",
    "Truth",
    "Value",
    "Variable",
    "conjunction",
    "format_duration",
    "format_moment",
    "format_value",
]
