"""What a system is: variables, operations, transitions, goals. Immutable, without time and without I/O.

Everything here prints back to the notation that it is written in; `scbm.notation` reads that notation.
"""

from scbm.model.actions import Action, Add, Assign
from scbm.model.behavior import BehaviorModel
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
    "Action",
    "Add",
    "AfterAlways",
    "Always",
    "And",
    "Assign",
    "Before",
    "BehaviorModel",
    "Constant",
    "Domain",
    "Equal",
    "Implies",
    "InitialStates",
    "Kind",
    "Latency",
    "LatencyShape",
    "LeadsTo",
    "Member",
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
    "Reference",
    "Relation",
    "RequestState",
    "Requirement",
    "Resource",
    "Role",
    "Simulation",
    "State",
    "StateSpace",
    "Term",
    "Transition",
    "Truth",
    "Value",
    "Variable",
    "conjunction",
    "format_duration",
    "format_moment",
    "format_value",
]
