"""The planning part of a model as PDDL: the bridge to planners that are other programs.

Each value of a relevant variable is a proposition. An operation is one action, or several where its effects depend on
values of the state: comparisons, counters and guards become conditions over values, which are finite.
"""

from __future__ import annotations

import re
from itertools import product
from math import prod
from typing import TYPE_CHECKING, assert_never

from msgspec import Struct

from scbm.model import format_value
from scbm.model.normal_form import AllOf, AnyOf, OneOf, Pair, all_of, allowed_values, indices_of, normal_form, one_of
from scbm.planning.engines import narrowed, relevant
from scbm.planning.engines.joint_moves import joint_moves
from scbm.planning.planning_task import system_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.model.normal_form import NormalForm
    from scbm.planning.engines.joint_moves import JointMove

MAX_CASES = 32
"""An operation is divided by the old values of the variables that it sets into so many actions at most."""

_NEVER = "never"
"""A proposition that never holds, as the goal of a problem whose goal cannot hold."""


class PddlAction(Struct, frozen=True):
    """One action: an operation, with the values that it depends on."""

    name: str
    operation: str
    condition: NormalForm
    effects: tuple[str, ...]


class PddlDomain:
    """The operations of a model in PDDL, with the variables that they and some goals depend on.

    Attributes:
        operations: the operation of each action, by the name of the action.
    """

    def __init__(self, model: BehaviorModel, goals: Sequence[Predicate], most_cases: int = MAX_CASES) -> None:
        """Take the model, the goals of its problems, and the maximum number of actions for an operation.

        An operation that is not divided removes values that may not hold, which some planners read as conditional
        effects.
        """
        system = system_of(model)
        self._model = model
        self._most_cases = most_cases
        self._space = relevant(system, [name for goal in goals for name in goal.reads()])
        names = _UniqueNames([_NEVER])
        self._facts = [
            [names.make(f"{variable.name}-{format_value(value)}") for value in variable.domain.values]
            for variable in self._space
        ]
        actions = _UniqueNames()
        moves = joint_moves(narrowed(system, self._space))
        self._actions = [
            action for move in moves for action in self._divided(move, model.operations[move.index].name, actions)
        ]
        self.operations = {action.name: action.operation for action in self._actions}

    @property
    def text(self) -> str:
        """The domain as PDDL."""
        predicates = [f"({fact})" for facts in self._facts for fact in facts]
        return (
            f"(define (domain {_identifier(self._model.name)})\n"
            "  (:requirements :strips :negative-preconditions :disjunctive-preconditions)\n"
            f"  (:predicates ({_NEVER})\n    {_lines(predicates, 4)})\n"
            + "".join(self._action_text(action) for action in self._actions)
            + ")\n"
        )

    def problem(self, name: str, state: Mapping[str, Value], goal: Predicate) -> str:
        """Return a problem of the domain as PDDL; `state` has a value for each variable of the world."""
        facts = [
            f"({facts[variable.domain.index(variable.initial if variable.role.is_runner else state[variable.name])]})"
            for variable, facts in zip(self._space, self._facts, strict=True)
        ]
        condition = normal_form(goal, self._space)
        shown = f"({_NEVER})" if condition is False else self._condition(condition)
        return (
            f"(define (problem {_identifier(name)})\n"
            f"  (:domain {_identifier(self._model.name)})\n"
            f"  (:init\n    {_lines(facts, 4)})\n"
            f"  (:goal {shown}))\n"
        )

    # actions

    def _divided(self, move: JointMove, operation: str, names: _UniqueNames) -> Iterator[PddlAction]:
        """Yield the actions of an operation: one for each combination of the values that its effects depend on."""
        if move.guard is False:
            return
        needed = dict.fromkeys(w.source for w in move.writes if len({*w.indices}) > 1 or None in w.indices)
        wanted = dict.fromkeys([*needed, *(write.target for write in move.writes)])
        values = {variable: self._possible(move.guard, variable) for variable in wanted}
        divided = wanted if prod(map(len, values.values())) <= self._most_cases else needed
        several = prod(len(values[variable]) for variable in divided) > 1
        for chosen in product(*(values[variable] for variable in divided)):
            case = dict(zip(divided, chosen, strict=True))
            literals = [one_of(v, 1 << index, len(self._facts[v])) for v, index in case.items()]
            condition = all_of([move.guard, *literals])
            effects = None if condition is False else self._effects(move, case)
            if effects:
                shown = "-".join(self._facts[v][i] for v, i in case.items() if len(values[v]) > 1)
                yield PddlAction(
                    names.make(f"{operation}--{shown}" if several else operation), operation, condition, effects
                )

    def _possible(self, guard: NormalForm, variable: int) -> tuple[int, ...]:
        return indices_of(allowed_values(guard, variable) & (1 << len(self._facts[variable])) - 1)

    def _effects(self, move: JointMove, case: Mapping[int, int]) -> tuple[str, ...] | None:
        """Return what an operation adds and removes where some variables have these values; `None` if it cannot be."""
        effects = []
        for write in move.writes:
            new = write.indices[case.get(write.source, 0)]
            if new is None:
                return None
            facts, old = self._facts[write.target], case.get(write.target)
            if new == old:
                continue
            removed = [facts[old]] if old is not None else [fact for index, fact in enumerate(facts) if index != new]
            effects += [f"({facts[new]})", *(f"(not ({fact}))" for fact in removed)]
        return tuple(effects)

    def _action_text(self, action: PddlAction) -> str:
        return (
            f"  (:action {action.name}\n"
            "    :parameters ()\n"
            f"    :precondition {self._condition(action.condition)}\n"
            f"    :effect (and {' '.join(action.effects)}))\n"
        )

    # conditions

    def _condition(self, form: NormalForm) -> str:
        match form:
            case bool():
                return "(and )" if form else f"({_NEVER})"
            case OneOf(variable, allowed, _):
                return self._among(variable, allowed)
            case Pair():
                rows = ((left, form.row(left)) for left in range(len(form.left_values)))
                parts = [
                    f"(and {self._among(form.left, 1 << left)} {self._among(form.right, row)})"
                    for left, row in rows
                    if row
                ]
                return _joined("or", parts) if parts else f"({_NEVER})"
            case AllOf(parts):
                return _joined("and", [self._condition(part) for part in parts])
            case AnyOf(parts):
                return _joined("or", [self._condition(part) for part in parts])
            case _:
                assert_never(form)

    def _among(self, variable: int, allowed: int) -> str:
        facts = self._facts[variable]
        chosen = [facts[index] for index in indices_of(allowed)]
        if len(chosen) == len(facts) - 1 and len(facts) > 2:  # noqa: PLR2004 - of two values, the other one is shorter
            (other,) = (fact for fact in facts if fact not in chosen)
            return f"(not ({other}))"
        return _joined("or", [f"({fact})" for fact in chosen])


def _joined(word: str, parts: Sequence[str]) -> str:
    return parts[0] if len(parts) == 1 else f"({word} {' '.join(parts)})"


def _lines(words: Sequence[str], indent: int) -> str:
    return f"\n{' ' * indent}".join(words)


def _identifier(text: str) -> str:
    """Return a text as a name of PDDL, which knows no capitals."""
    name = re.sub(r"[^a-z0-9_-]+", "_", text.lower()).strip("_")
    return name if name[:1].isalpha() else f"x{name}"


class _UniqueNames:
    """Makes names of PDDL that differ from each other."""

    def __init__(self, taken: Sequence[str] = ()) -> None:
        self._taken = dict.fromkeys(taken)

    def make(self, text: str) -> str:
        """Return a name that was not returned before."""
        base = name = _identifier(text)
        number = 1
        while name in self._taken:
            number += 1
            name = f"{base}_{number}"
        self._taken[name] = None
        return name
