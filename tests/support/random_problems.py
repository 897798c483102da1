"""Random planning problems with numbers, small enough for a slow reference; plans have up to some ten operations.

All chance comes from `Random(...).random()`, so problem `number` is the same in every version of Python.
"""

from __future__ import annotations

from dataclasses import dataclass
from random import Random
from typing import TYPE_CHECKING, TypeVar

from msgspec.structs import replace

from scbm.model import (
    Action,
    Add,
    And,
    Assign,
    BehaviorModel,
    Constant,
    Domain,
    Equal,
    Implies,
    Member,
    Not,
    NotEqual,
    Operation,
    Or,
    Order,
    Predicate,
    Reference,
    Relation,
    State,
    Transition,
    Truth,
    ValueKind,
    Variable,
)
from support.reference import step, world

if TYPE_CHECKING:
    from collections.abc import Sequence

T = TypeVar("T")

_DOMAINS = (
    Domain.boolean(),
    Domain.symbols("home", "box", "agv"),
    Domain.symbols("home", "box", "agv", "rack"),
    Domain.integers(0, 3),
    Domain.integers(-1, 2),
)

_WALK = 60
"""Number of steps of the walk to a goal."""


@dataclass(frozen=True)
class RandomProblem:
    """A model, a state to plan from, and a goal."""

    model: BehaviorModel
    start: State
    goal: Predicate


def random_problem(number: int) -> RandomProblem:
    """Return problem `number`, the same everywhere."""
    return _Author(Random(f"scbm problem {number}")).problem(number)


class _Author:
    """Writes one problem; every choice is made of `random()` alone."""

    def __init__(self, random: Random) -> None:
        self._random = random
        self._space: tuple[Variable, ...] = ()

    def problem(self, number: int) -> RandomProblem:
        domains = [self._pick(_DOMAINS) for _ in range(self._between(4, 6))]
        self._space = tuple(
            Variable(f"v{index}", domain, domain.values[0], (domain.values[0],)) for index, domain in enumerate(domains)
        )
        operations = tuple(map(self._operation, range(self._between(4, 12))))
        model = BehaviorModel(f"problem_{number}", self._space, operations)
        start = State(model.space, {v.name: self._pick(v.domain.values) for v in self._space})
        goal = self._goal(model, start)
        return RandomProblem(replace(model, goals=(("wanted", goal),)), start, goal)

    def _goal(self, model: BehaviorModel, start: State) -> Predicate:
        """Return a goal: mostly a part of the last new state of a random walk, so that it is reachable, and far."""
        if self._chance(0.3):
            return self._condition(self._between(3, 5))
        now = last = world(model, start)
        seen = {now: None}
        for _ in range(_WALK):
            enabled = [after for each in model.operations if (after := step(model, each.name, now)) is not None]
            if not enabled:
                break
            now = self._pick([after for after in enabled if after not in seen] or enabled)
            last = last if now in seen else now
            seen[now] = None
        parts = tuple(Equal(Reference(v.name), Constant(last[v.name])) for v in self._space if self._chance(0.8))
        return And(parts) if len(parts) > 1 else self._condition(2)

    def _operation(self, index: int) -> Operation:
        """Return an operation that sets variables, mostly those that it reads, so that plans get long."""
        pre = Transition(f"start_o{index}", self._condition(self._between(1, 3)), a=self._actions(0, 1))
        holds = self._condition(1) if self._chance(0.2) else Truth(True)
        return Operation(f"o{index}", pre, Transition(f"complete_o{index}", holds, a=self._actions(1, 2)))

    def _condition(self, parts: int) -> Predicate:
        if not parts:
            return Truth(True)
        found = tuple(self._part() for _ in range(parts))
        return found[0] if parts == 1 else And(found)

    def _part(self) -> Predicate:
        roll = self._between(0, 9)
        if roll < 6:
            return self._literal()
        if roll == 6:
            return Or((self._literal(), self._literal()))
        if roll == 7:
            return Not(And((self._literal(), self._literal())))
        return Implies(self._literal(), self._literal()) if roll == 8 else Not(self._literal())

    def _literal(self) -> Predicate:
        variable = self._pick(self._space)
        left, values = Reference(variable.name), variable.domain.values
        same = [other for other in self._space if other.domain == variable.domain and other != variable]
        if same and self._chance(0.2):
            return (Equal if self._chance(0.5) else NotEqual)(left, Reference(self._pick(same).name))
        if variable.domain.kind is ValueKind.INTEGER and self._chance(0.4):
            return Order(left, self._pick(tuple(Relation)), Constant(self._pick(values)))
        if self._chance(0.15):
            return Member(left, tuple(Constant(value) for value in values[: self._between(1, len(values) - 1)]))
        return (Equal if self._chance(0.8) else NotEqual)(left, Constant(self._pick(values)))

    def _actions(self, least: int, most: int) -> tuple[Action, ...]:
        left = list(self._space)
        targets = [left.pop(int(self._random.random() * len(left))) for _ in range(self._between(least, most))]
        return tuple(map(self._action, targets))

    def _action(self, target: Variable) -> Action:
        same = [other for other in self._space if other.domain == target.domain and other != target]
        if target.domain.kind is ValueKind.INTEGER and self._chance(0.7):
            return Add(target.name, 1 if self._chance(0.6) else -1)
        if same and self._chance(0.2):
            return Assign(target.name, Reference(self._pick(same).name))
        return Assign(target.name, Constant(self._pick(target.domain.values)))

    def _chance(self, share: float) -> bool:
        return self._random.random() < share

    def _between(self, low: int, high: int) -> int:
        return low + int(self._random.random() * (high - low + 1))

    def _pick(self, options: Sequence[T]) -> T:
        return options[int(self._random.random() * len(options))]
