"""The plans of walks through runs with any plans: what such a walk chooses, and then a canonical rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.planning import PlanCache, PlanLimits, Solved
from scbm.running.untimed.situations import world_bits

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.closing.runs.all_runs import AllRuns
    from scbm.running import AskPlan


class ChosenPlans:
    """Makes plans of the choices that a walk through runs with any plans has."""

    def __init__(self, runs: AllRuns) -> None:
        self._runs = runs
        self._names = tuple(operation.name for operation in runs.model.operations)
        self._canonical = PlanCache(runs.planner)
        self._limits = PlanLimits.of(runs.model)

    def plan(self, asked: AskPlan, choices: Iterable[int]) -> tuple[str, ...]:
        """Return a plan for a solvable question that takes each choice where several operations can follow.

        It goes on canonically after the last choice, or before one that there is not.
        """
        queues, left = self._runs.queues(asked.goal), iter(choices)
        queue = queues.of_answer(world_bits(self._runs.program, asked.state), ())
        names: list[str] = []
        while True:
            ways = queues.following(queue)
            number = 0 if len(ways) == 1 else next(left, len(ways))
            if number >= len(ways):
                break
            operation, following = ways[number]
            if operation < 0:
                return tuple(names)
            names.append(self._names[operation])
            queue = following
        planned = zip(self._runs.planned_names(asked.goal), queues.content(queue) or (), strict=True)
        rest = self._canonical.plan({**asked.state, **dict(planned)}, asked.goal, self._limits)
        return (*names, *(rest.plan if isinstance(rest, Solved) else ()))
