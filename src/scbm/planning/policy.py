"""The canonical plans to one goal from any state: each state is explored once, however many are asked for.

First state by state, on demand; once there are many, all states of the world at once, if it is small enough.

Plans to one goal from all states of the world at once, where the world is small enough for that.

What `DistancesOnDemand` finds state by state, exploration finds for the whole world as one set, some hundred times
faster per state. It pays as soon as more than some ten thousand states are in question. Requests are at rest in all of
them, as they mostly are when a plan is asked for: that keeps the world small.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.model import Role
from scbm.planning.engines import DistancesOnDemand, Exceeded, ExplorationLimits, Region
from scbm.planning.engines.exploration import Distances, Exploration
from scbm.planning.plan_answers import (
    Answer,
    Limit,
    LimitReached,
    PlanLimits,
    Solved,
    Unsolvable,
    always,
    raise_if_cancelled,
)
from scbm.planning.plan_search import POLL_INTERVAL
from scbm.planning.planners import PlanProblem, canonical
from scbm.planning.planning_task import system_of

if TYPE_CHECKING:
    from scbm.planning.plan_answers import Wanted
    from scbm.planning.planners import PlanFunction
    from scbm.planning.planning_task import Problem, Task

_LIMITS = ExplorationLimits(states=1 << 24, bytes=1 << 29)


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
    if not exploration.explores_sets:
        return None
    reached = exploration.reached
    if isinstance(reached, Exceeded) or len(reached) > most:
        return None
    distances = exploration.distances(goal)
    return Everywhere(task, distances, len(reached)) if isinstance(distances, Distances) else None


_MAX_REMEMBERED = 1_000_000


_MAX_ON_DEMAND = 20_000
"""From so many states on it is tried to find the plans of the whole world at once."""


class Policy:
    """What `Planner.plan` answers for one goal, from any packed state; `expanded` is 0 where nothing was searched.

    Attributes:
        task: the packed task whose states are asked for (`task.pack`).
    """

    def __init__(
        self,
        problem: Problem,
        limits: PlanLimits,
        most: int | None = None,
        whole: int | None = None,
        search: PlanFunction = canonical,
    ) -> None:
        """Prepares the answers.

        Args:
            problem: the goal, and the task in which it can be told apart.
            limits: those of the answers.
            most: for so many states distances are worked out at most, beyond them each answer is searched for; `None`
                for as many as a search may expand.
            whole: so many states the world may have to be taken at once; `None` for as many as a search may expand.
            search: the planner. Distances give canonical plans, so they serve `canonical` alone; the answers of any
                other planner are cached one by one.
        """
        self.task = problem.task
        self._problem = problem
        self._search = search
        self._limits = limits
        # While no more states than a search may expand are known, no search can come to that limit.
        self._most = limits.expansions if most is None else min(most, limits.expansions)
        self._whole = limits.expansions if whole is None else whole
        self._distances = self._on_demand(min(self._most, _MAX_ON_DEMAND))
        self._everywhere: Everywhere | None = None
        self._has_tried_everywhere = self._most <= _MAX_ON_DEMAND
        self._answers: dict[int, Answer] = {}
        self._is_wanted: Wanted = always
        self._looks = 0

    def plan(self, state: int, is_wanted: Wanted = always) -> Answer:
        """The canonical plan from a packed state, or why there is none.

        Raises `UnwantedError` once `is_wanted` says no, which is asked now and then.
        """
        known = self._answers.get(state)
        if known is not None:
            return known
        self._is_wanted = is_wanted
        answer = self._answer(state)
        if len(self._answers) < _MAX_REMEMBERED:
            self._answers[state] = replace(answer, expanded=0)
        return answer

    def _on_demand(self, most: int) -> DistancesOnDemand:
        return DistancesOnDemand(self._successors, self._problem.is_goal, most)

    def _successors(self, state: int) -> tuple[tuple[int, int], ...]:
        """Those of the task, as long as anybody wants to know: what distances know is whole, whenever this raises."""
        self._looks += 1
        if not self._looks % POLL_INTERVAL:
            raise_if_cancelled(self._is_wanted)
        return self.task.successors(state)

    def _answer(self, state: int) -> Answer:
        if self._search is not canonical:
            return self._searched(state)
        if self._everywhere is not None:
            try:
                return self._checked(state, self._everywhere.plan(state), self._everywhere.count)
            except LookupError:
                pass  # a request is on its way
        if self._distances.know(state):
            plan = None if self._distances.distance(state) is None else self._path(state)
            return self._checked(state, plan, self._distances.lost)
        if self._has_tried_everywhere:
            return self._searched(state)
        self._has_tried_everywhere = True
        self._everywhere = plans_everywhere(self._problem, self._whole)
        self._distances = self._on_demand(self._most)
        return self._answer(state)

    def _checked(self, state: int, plan: tuple[str, ...] | None, lost: int) -> Answer:
        """The answer, where at most so many states lead to no goal."""
        if plan is None:
            # A search would see lost states only. If they may lie too deep for it, it has to say so itself.
            return Unsolvable(0) if lost <= self._limits.length else self._searched(state)
        return Solved(plan, 0) if len(plan) <= self._limits.length else LimitReached(Limit.LENGTH, 0)

    def _searched(self, state: int) -> Answer:
        return self._search(PlanProblem(self.task, state, self._problem.is_goal, self._is_wanted), self._limits)

    def _path(self, state: int) -> tuple[str, ...]:
        names = []
        while (step := self._distances.first_move(state)) is not None:
            operation, state = step
            names.append(self.task.operations[operation])
        return tuple(names)
