"""Changes from outside that no maker can make, as a case lists them (semantics 7.2), and why."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.trace import assignments
from scbm.model import format_moment, format_value
from scbm.model.predicates import conjuncts
from scbm.model.sources import free_groups

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.cases.trace import Changes
    from scbm.model import Action, BehaviorModel, EnvironmentTransition, Predicate, Value

_MAX_SHOWN = 3
"""Maximum number of makers of one variable that a message goes through."""

_MAX_VALUES = 8
"""Maximum number of values that a message lists."""


class ImpossibleChange(Struct, frozen=True):
    """A change that no maker could make at its moment.

    Attributes:
        at_ns: the time of the run.
        changes: the variables with their new values; empty if its transition cannot act, and the case says no values.
        by: the environment transition that it names; empty if it names none.
        reason: why no maker can make it, and what holds instead.
    """

    at_ns: int
    changes: Changes
    by: str
    reason: str

    def __str__(self) -> str:
        return f"{self._what} is impossible at {format_moment(self.at_ns)}: {self.reason}"

    @property
    def never_came(self) -> str:
        """The same as a clause about a change that waited from its time on, until the end of its case."""
        return f"{self._what} was impossible at each settled moment from {format_moment(self.at_ns)} on: {self.reason}"

    @property
    def _what(self) -> str:
        by = f"by {self.by}" if self.by else "from outside"
        return f"{assignments(self.changes)} {by}" if self.changes else f"a change {by}"


def why_impossible(
    model: BehaviorModel, state: Mapping[str, Value], changes: Changes, by: str, *, is_settled: bool
) -> str:
    """Return why no maker can make a change, as a clause.

    Args:
        model: the model.
        state: the values of all variables at that moment.
        changes: the variables with their new values.
        by: the environment transition that has to make it; empty for anyone.
        is_settled: whether the runner is settled.
    """
    if not is_settled:
        return "automatic transitions repeat without end, so the runner is not settled"
    transitions = {each.name: each for each in model.environment}
    if by:
        return _why_not(transitions[by], state, changes) if by in transitions else f"no environment transition is {by}"
    reasons = (_why_no_maker(model, state, name, value, changes) for name, value in changes if state[name] != value)
    return "; ".join(dict.fromkeys(reasons))


def _why_no_maker(model: BehaviorModel, state: Mapping[str, Value], name: str, value: Value, changes: Changes) -> str:
    """Return why no maker gives a variable a value."""
    assigning = [each for each in model.environment if any(action.target == name for action in each.actions)]
    able = [each for each in assigning if not any(_makes_another(action, name, value) for action in each.actions)]
    if able:
        return "; ".join(f"{each.name}: {_why_not(each, state, changes)}" for each in able[:_MAX_SHOWN])
    if assigning:
        return f"no environment transition makes {name} {format_value(value)}"
    for group in free_groups(model):
        known = dict(group.values).get(name)
        if known is not None and value not in known:
            return f"{group.name} gives {name} only {values_in_words(known)}"
    measuring = [resource.name for resource in model.resources if name in resource.measures]
    if measuring:
        return f"{measuring[0]} sends {name} only in replies"
    return f"nothing outside the model changes {name}"


def values_in_words(values: Sequence[Value]) -> str:
    """Return values as `3, 4`; of many the first ones, and how many more there are."""
    shown = ", ".join(map(format_value, values[:_MAX_VALUES]))
    return f"{shown} and {len(values) - _MAX_VALUES} more" if len(values) > _MAX_VALUES else shown


def _makes_another(action: Action, name: str, value: Value) -> bool:
    """Return whether an action gives a variable another value, whatever the state is."""
    return action.target == name and not action.reads() and action.value({}) != value


def _why_not(transition: EnvironmentTransition, state: Mapping[str, Value], changes: Changes) -> str:
    """Return why an environment transition does not make changes in a state."""
    lacking = [part for part in conjuncts(transition.guard) if not part.holds(state)]
    if lacking:
        values = assignments(tuple((name, state[name]) for name in dict.fromkeys(_read(lacking))))
        return f"its guard needs {' && '.join(map(str, lacking))}, and {values}"
    made = tuple((action.target, action.value(state)) for action in transition.actions)
    missed = [(name, value) for name, value in changes if name not in dict(made) and state[name] != value]
    if missed:
        return f"its actions do not change {', '.join(name for name, _ in missed)}"
    return f"its actions make {assignments(made)}"


def _read(predicates: list[Predicate]) -> Iterator[str]:
    for predicate in predicates:
        yield from predicate.reads()
