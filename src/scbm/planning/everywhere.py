"""Plans to one goal from all states of the world at once, where the world is small enough for that.

What `DistancesOnDemand` finds state by state, exploration finds for the whole world as one set, some hundred times
faster per state. It pays as soon as more than some ten thousand states are in question. Requests are at rest in all of
them, as they mostly are when a plan is asked for: that keeps the world small.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.exploring import Exceeded, Limits, Region
from scbm.exploring.exploration import Distances, EngineKind, Exploration
from scbm.model import Role
from scbm.planning.system import system_of

if TYPE_CHECKING:
    from scbm.planning.problem import Problem
    from scbm.planning.task import Task

_LIMITS = Limits(states=1 << 24, bytes=1 << 29)


class Everywhere:
    """The plans to a goal from every state of a task in which requests are at rest, and from where these lead.

    Attributes:
        count: how many states there are.
    """

    def __init__(self, task: Task, distances: Distances, count: int) -> None:
        self.count = count
        self._task = task
        self._distances = distances

    def plan(self, state: int) -> tuple[str, ...] | None:
        """The canonical plan from a packed state; `None` if there is none. Raises `LookupError` for any other state."""
        return self._distances.plan(self._task.packing.values(state))


def plans_everywhere(problem: Problem, most: int) -> Everywhere | None:
    """The plans from all states of a task; `None` if there are more than `most`, or too many for the memory."""
    model, task, goal = problem.model, problem.task, problem.goal
    rest = {variable.name: (variable.initial,) for variable in model.running_space}
    free = {v.name: v.domain.values for v in task.packing.space if v.role is Role.DECLARED}
    exploration = Exploration(system_of(model), [Region(rest | free)], goal.reads(), _LIMITS)
    if exploration.engine is not EngineKind.DENSE:
        return None
    reached = exploration.reached
    if isinstance(reached, Exceeded) or len(reached) > most:
        return None
    distances = exploration.distances(goal)
    return Everywhere(task, distances, len(reached)) if isinstance(distances, Distances) else None
