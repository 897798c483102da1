"""The answers of the planner, each asked for once."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.planning import Planner

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.planning import Answer


class Plans:
    """The plans of a model to one goal, from values of some of its variables; the others make no difference."""

    def __init__(self, model: BehaviorModel, goal: Predicate) -> None:
        self._planner = Planner(model)
        self._world = tuple(model.space.names)
        self._nominal = model.nominal_state
        self._goal = goal
        self._answers: dict[tuple[Value | None, ...], Answer] = {}

    def answer(self, values: Mapping[str, Value]) -> Answer:
        """The planner's answer for these values; the runner's variables are at rest for it (semantics 4.1)."""
        key = tuple(values.get(name) for name in self._world)
        if key not in self._answers:
            self._answers[key] = self._planner.plan({**self._nominal, **values}, self._goal)
        return self._answers[key]
