"""Enumerates the values of variables that satisfy a predicate, by backtracking over partial valuations."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from scbm.model import And, Implies, Not, Or, Truth

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from scbm.model import Predicate, Value

    Choices: TypeAlias = Mapping[str, tuple[Value, ...]]

MAX_STEPS = 100_000
"""Maximum number of valuations, complete or partial, that one question may try."""


class TooManyStepsError(Exception):
    """The answer was not found within the maximum number of valuations."""


def valuations(predicate: Predicate, choices: Choices, most_steps: int) -> Iterator[dict[str, Value]]:
    """Yield every valuation of the variables for which the predicate holds.

    Args:
        predicate: reads no variables but those in `choices`.
        choices: the values of each variable. What comes first is varied last.
        most_steps: the maximum number of valuations, complete or partial, that are evaluated.

    Raises:
        TooManyStepsError: the enumeration needs more valuations than `most_steps`.
    """
    names = tuple(choices)
    stack: list[dict[str, Value]] = [{}]
    steps = 0
    while stack:
        known = stack.pop()
        steps += 1
        if steps > most_steps:
            raise TooManyStepsError
        if truth(predicate, known) is False:
            continue
        if len(known) == len(names):
            yield known
            continue
        name = names[len(known)]
        stack.extend({**known, name: value} for value in reversed(choices[name]))


def is_satisfiable(predicate: Predicate, choices: Choices) -> bool:
    """Return whether a valuation of the variables satisfies the predicate. Raises `TooManyStepsError`."""
    read = {name: choices[name] for name in predicate.reads()}
    return any(True for _ in valuations(predicate, read, MAX_STEPS))


def truth(predicate: Predicate, known: Mapping[str, Value]) -> bool | None:
    """Return the truth of a predicate when only some variables are known; `None` if that is open."""
    match predicate:
        case Truth(value):
            return value
        case Not(operand):
            return _negated(truth(operand, known))
        case And(operands):
            return _negated(_any([_negated(truth(operand, known)) for operand in operands]))
        case Or(operands):
            return _any([truth(operand, known) for operand in operands])
        case Implies(condition, consequence):
            return _any([_negated(truth(condition, known)), truth(consequence, known)])
        case _:
            return predicate.holds(known) if all(name in known for name in predicate.reads()) else None


def _negated(value: bool | None) -> bool | None:  # noqa: FBT001 - a truth value of three
    return None if value is None else not value


def _any(values: list[bool | None]) -> bool | None:
    if True in values:
        return True
    return None if None in values else False
