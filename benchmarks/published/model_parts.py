"""Short functions for the parts of models: guards, effects and operations as a planning problem states them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import (
    Assign,
    BehaviorModel,
    Constant,
    Domain,
    Equal,
    Operation,
    Reference,
    Transition,
    Truth,
    Variable,
    conjunction,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from scbm.model import Action, Predicate, Value

GOAL = "goal"
"""The name of the goal of every model here."""


def symbol(name: str, values: Iterable[str], initial: str) -> Variable:
    """Return a variable over symbols."""
    return Variable(name, Domain(tuple(values)), initial, (initial,))


def flag(name: str, *, initial: bool) -> Variable:
    """Return a boolean variable."""
    return Variable(name, Domain.boolean(), initial, (initial,))


def number(name: str, high: int) -> Variable:
    """Return a variable that counts from 0 to `high`."""
    return Variable(name, Domain.integers(0, high), 0, (0,))


def all_equal(values: Mapping[str, Value]) -> Predicate:
    """Return the conjunction of `variable == value`."""
    return conjunction(Equal(Reference(name), Constant(value)) for name, value in values.items())


def assigned(values: Mapping[str, Value]) -> tuple[Action, ...]:
    """Return `variable <- value` for each variable."""
    return tuple(Assign(name, Constant(value)) for name, value in values.items())


def operation(name: str, guard: Mapping[str, Value], effect: Mapping[str, Value]) -> Operation:
    """Return an operation that completes at once, as an action of STRIPS: a conjunction of values, and assignments."""
    return free_operation(name, all_equal(guard), assigned(effect))


def free_operation(name: str, guard: Predicate, actions: tuple[Action, ...]) -> Operation:
    """Return an operation that completes at once."""
    return Operation(name, Transition(f"start_{name}", guard), Transition(f"complete_{name}", Truth(True), a=actions))


def planning_model(
    name: str, variables: Iterable[Variable], operations: Iterable[Operation], goal: Mapping[str, Value]
) -> BehaviorModel:
    """Return a model with one goal: the values of some variables."""
    return BehaviorModel(name, tuple(variables), tuple(operations), goals=((GOAL, all_equal(goal)),))
