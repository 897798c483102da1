"""Variables: declared ones, those of resources, and those of the runner (semantics 1); and states of them.

A state has one value for every variable (paper, Section II). It is immutable and hashable.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import Enum, StrEnum
from functools import lru_cache
from typing import TYPE_CHECKING, assert_never

from msgspec import Struct

from scbm.model.values import Domain, Value, format_value

if TYPE_CHECKING:
    from collections.abc import Iterable


class OperationState(StrEnum):
    """The states of an operation while it runs (paper, Figure 4)."""

    INITIAL = "initial"
    DISABLED = "disabled"
    EXECUTING = "executing"
    TIMEDOUT = "timedout"
    FAILED = "failed"
    COMPLETED = "completed"

    __hash__ = str.__hash__  # of equal value, and without a call of Python for each lookup


class RequestState(StrEnum):
    """The states of a request to a resource."""

    INITIAL = "initial"
    EXECUTING = "executing"
    SUCCEEDED = "succeeded"
    FAILED = "failed"


class PlanState(StrEnum):
    """The states of the runner with respect to its goal."""

    IDLE = "idle"
    PLANNING = "planning"
    EXECUTING = "executing"
    COMPLETED = "completed"
    UNSOLVABLE = "unsolvable"
    ABORTED = "aborted"

    __hash__ = str.__hash__  # of equal value, and without a call of Python for each lookup


NO_OPERATION = "none"
"""The value of `current.name` while no operation is current."""

CURRENT_NAME = "current.name"
CURRENT_STATE = "current.state"
PLAN_STATE = "plan.state"


class Role(Enum):
    """The owner of a variable."""

    DECLARED = "declared in the model file"
    RESOURCE = "owned by a resource"
    OPERATION_STATE = "the state of an operation, kept by the runner"
    CURRENT_NAME = "the operation at the head of the queue, kept by the runner"
    CURRENT_STATE = "the state of the operation at the head of the queue, kept by the runner"
    PLAN_STATE = "what the runner does for its goal, kept by the runner"

    @property
    def is_runner(self) -> bool:
        """Whether the runner owns the variable, so that planning never changes it."""
        return self not in (Role.DECLARED, Role.RESOURCE)


class VariableSource(StrEnum):
    """The source of a variable, as a model file can declare it (semantics 9.1)."""

    INPUT = "input"
    """The environment changes it, and perhaps the model too."""
    STATE = "state"
    """The model changes it; nothing else does."""
    CONSTANT = "constant"
    """Nothing changes it."""


class Variable(Struct, frozen=True):
    """One variable.

    Attributes:
        name: an identifier; `.` is allowed inside.
        domain: its values.
        initial: the nominal value.
        random: the values that random initial states draw from; `(initial,)` by default.
        role: its owner.
        source: what the model file declares about who changes it; `None` if it declares nothing.
    """

    name: str
    domain: Domain
    initial: Value
    random: tuple[Value, ...]
    role: Role = Role.DECLARED
    source: VariableSource | None = None

    @property
    def assignable(self) -> tuple[Value, ...]:
        """The values that a model may assign to the variable (semantics 1.3); empty if it may not assign any."""
        match self.role:
            case Role.DECLARED | Role.RESOURCE:
                return self.domain.values
            case Role.OPERATION_STATE | Role.CURRENT_STATE:
                return (OperationState.FAILED.value,)
            case Role.PLAN_STATE:
                return (PlanState.ABORTED.value,)
            case Role.CURRENT_NAME:
                return ()
            case _:
                assert_never(self.role)


def _fixed(name: str, values: Iterable[str], initial: str, role: Role) -> Variable:
    return Variable(name, Domain(tuple(values)), initial, (initial,), role)


_MAX_NAMES = 10_000
"""Checking a proof asks for the same few names in each step."""


@lru_cache(_MAX_NAMES)
def trigger_name(resource: str) -> str:
    """Return the name of the variable that triggers a request."""
    return f"{resource}_req_trigger"


@lru_cache(_MAX_NAMES)
def request_state_name(resource: str) -> str:
    """Return the name of the variable with the state of the request."""
    return f"{resource}_req_state"


@lru_cache(_MAX_NAMES)
def operation_state_name(operation: str) -> str:
    """Return the name of the variable with the state of the operation."""
    return f"{operation}.state"


def resource_variables(resource: str) -> tuple[Variable, Variable]:
    """Return the two variables that a resource owns (semantics 6.1)."""
    states = [state.value for state in RequestState]
    return (
        Variable(trigger_name(resource), Domain.boolean(), False, (False,), Role.RESOURCE),
        _fixed(request_state_name(resource), states, RequestState.INITIAL.value, Role.RESOURCE),
    )


def runner_variables(operations: Iterable[str]) -> tuple[Variable, ...]:
    """Return the variables of the runner (semantics 1.3)."""
    names = tuple(operations)
    states = tuple(state.value for state in OperationState)
    plan_states = tuple(state.value for state in PlanState)
    initial = OperationState.INITIAL.value
    return (
        *(_fixed(operation_state_name(name), states, initial, Role.OPERATION_STATE) for name in names),
        _fixed(CURRENT_NAME, (NO_OPERATION, *names), NO_OPERATION, Role.CURRENT_NAME),
        _fixed(CURRENT_STATE, states, initial, Role.CURRENT_STATE),
        _fixed(PLAN_STATE, plan_states, PlanState.IDLE.value, Role.PLAN_STATE),
    )


class StateSpace:
    """The variables of a model, in order and by name. Immutable.

    Attributes:
        variables: the variables, in order.
        all_values: for each variable the indices of all its values, as bits.
    """

    __slots__ = ("_by_name", "all_values", "variables")

    def __init__(self, variables: Iterable[Variable]) -> None:
        self.variables = tuple(variables)
        self.all_values = tuple((1 << len(variable.domain)) - 1 for variable in self.variables)
        self._by_name = {variable.name: index for index, variable in enumerate(self.variables)}

    def __getitem__(self, name: str) -> Variable:
        return self.variables[self._by_name[name]]

    def __contains__(self, name: object) -> bool:
        return name in self._by_name

    def __iter__(self) -> Iterator[Variable]:
        return iter(self.variables)

    def __len__(self) -> int:
        return len(self.variables)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, StateSpace) and self.variables == other.variables

    def __hash__(self) -> int:
        return hash(self.variables)

    def __repr__(self) -> str:
        return f"StateSpace({', '.join(self._by_name)})"

    def position(self, name: str) -> int:
        """Return the place of the variable in the order."""
        return self._by_name[name]

    @property
    def names(self) -> tuple[str, ...]:
        """All names, in order."""
        return tuple(self._by_name)


class State(Mapping[str, Value]):
    """A mapping from the name of each variable of a space to a value of its domain."""

    __slots__ = ("_values", "space")

    def __init__(self, space: StateSpace, values: Mapping[str, Value]) -> None:
        """Raise `ValueError` for a variable without a value, and a value without a variable or outside its domain."""
        unknown = [name for name in values if name not in space]
        if unknown:
            raise ValueError(f"no such variable: {', '.join(unknown)}")
        missing = [name for name in space.names if name not in values]
        if missing:
            raise ValueError(f"no value for {', '.join(missing)}")
        for variable in space:
            if values[variable.name] not in variable.domain:
                raise ValueError(f"{variable.name} cannot be {format_value(values[variable.name])}")
        self.space = space
        self._values = tuple(values[name] for name in space.names)

    @staticmethod
    def nominal(space: StateSpace) -> State:
        """Return the state in which every variable has its nominal value."""
        return State(space, {variable.name: variable.initial for variable in space})

    def __getitem__(self, name: str) -> Value:
        return self._values[self.space.position(name)]

    def __iter__(self) -> Iterator[str]:
        return iter(self.space.names)

    def __len__(self) -> int:
        return len(self._values)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, State) and self.space == other.space and self._values == other._values

    def __hash__(self) -> int:
        return hash(self._values)

    def __str__(self) -> str:
        return ", ".join(f"{name}={format_value(value)}" for name, value in self.items())

    def __repr__(self) -> str:
        return f"State({self})"

    def replace(self, changes: Mapping[str, Value]) -> State:
        """Return the state with `changes`. Raises `ValueError` as `State(…)` does."""
        return State(self.space, {**self, **changes})
