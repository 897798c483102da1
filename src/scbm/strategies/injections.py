"""What the tester changes on the way."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING

from hypothesis import strategies as st

from scbm.cases import Condition, ConditionKind, Injection
from scbm.model import Constant, Equal, Reference, Role
from scbm.model.variables import CURRENT_NAME
from scbm.strategies.choices import one_of
from scbm.strategies.times import times

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hypothesis.strategies import DrawFn, SearchStrategy

    from scbm.model import BehaviorModel, Predicate

_MOST = 3

_HOLDS = st.none() | times(least_ms=1)

_CONDITIONS = (
    Condition(ConditionKind.FAILING),
    Condition(ConditionKind.DEAD),
    Condition(ConditionKind.OCCUPIED),
    Condition(ConditionKind.SLOWER, Fraction(3)),
)


def injections(model: BehaviorModel) -> SearchStrategy[tuple[Injection, ...]]:
    """Injections that give a variable a value, or a resource a condition; now, at a time, or during an operation.

    No two of them act on the same thing, so they do not contradict each other. Shrinks towards none.
    """
    kinds = _assignments(model) | _conditions(model) if model.resources else _assignments(model)
    return st.lists(kinds, max_size=_MOST, unique_by=lambda injection: _target(injection, model)).map(_numbered)


def _target(injection: Injection, model: BehaviorModel) -> str:
    """What an injection acts on. The states of operations count as one, as in a transition."""
    if injection.resource is not None:
        return f"resource {injection.resource}"
    name, _ = injection.assign[0]
    is_state = model.running_space[name].role in (Role.OPERATION_STATE, Role.CURRENT_STATE)
    return "the state of the operation" if is_state else f"variable {name}"


def _numbered(drawn: Sequence[Injection]) -> tuple[Injection, ...]:
    """With the names that injections have in a file that names none."""
    return tuple(replace(one, name=f"injection_{number}") for number, one in enumerate(drawn, start=1))


def _assignments(model: BehaviorModel) -> SearchStrategy[Injection]:
    targets = [variable for variable in model.running_space if variable.assignable]
    moments = _moments(model)

    @st.composite
    def assignment(draw: DrawFn) -> Injection:
        variable = draw(one_of(targets))
        value = draw(one_of(variable.assignable))
        holds = variable.role in (Role.DECLARED, Role.RESOURCE)
        hold_ns = draw(_HOLDS) if holds else None
        when, at_ns = draw(moments)
        return Injection("injection", ((variable.name, value),), when, at_ns, hold_ns)

    return assignment()


def _conditions(model: BehaviorModel) -> SearchStrategy[Injection]:
    moments = _moments(model)

    @st.composite
    def change(draw: DrawFn) -> Injection:
        resource = draw(one_of(model.resources))
        condition = draw(one_of(_CONDITIONS))
        when, at_ns = draw(moments)
        return Injection("injection", (), when, at_ns, draw(_HOLDS), resource.name, condition)

    return change()


def _moments(model: BehaviorModel) -> SearchStrategy[tuple[Predicate | None, int | None]]:
    """When an injection acts: a predicate, a time, both, or neither."""
    names = [operation.name for operation in model.operations]
    whens = st.none() | st.sampled_from(names).map(_is_current) if names else st.none()
    return st.tuples(whens, st.none() | times())


def _is_current(operation: str) -> Predicate:
    return Equal(Reference(CURRENT_NAME), Constant(operation))
