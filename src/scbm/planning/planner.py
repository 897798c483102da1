"""The planner of a model, which keeps its packed tasks for later problems."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.planning.plan_answers import Answer, PlanLimits, always
from scbm.planning.planners import DEFAULT_PLANNER, PLANNERS, PlanProblem
from scbm.planning.planning_task import Problem, Task
from scbm.planning.policy import Policy

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.planning.plan_answers import ShouldContinue

_DEFAULT_LIMITS = PlanLimits()


class Planner:
    """Finds plans for one model. Answers depend on the problem alone, never on earlier calls.

    Every plan of a run, a test, `scbm plan` and a proof comes from here: the entry of `PLANNERS` finds it.

    Attributes:
        model: the model.
        base_task: the packed task with the variables that decide which operations are enabled, whatever the goal.
    """

    def __init__(self, model: BehaviorModel, name: str = DEFAULT_PLANNER) -> None:
        """Pack the model; `name` is an entry of `PLANNERS`."""
        self.model = model
        self._search = PLANNERS[name]
        self.base_task = Task(model)
        self._tasks: dict[tuple[str, ...], Task] = {}
        self._problems: dict[Predicate, Problem] = {}

    def plan(
        self,
        state: Mapping[str, Value],
        goal: Predicate,
        limits: PlanLimits = _DEFAULT_LIMITS,
        should_continue: ShouldContinue = always,
    ) -> Answer:
        """Return the answer to the planning problem (state, goal, model, limits).

        Args:
            state: a value for each variable of the world; the runner's own variables are taken as at rest (semantics
                4.1).
            goal: a predicate over the variables of the model.
            limits: the limits of the search.
            should_continue: called at intervals; the search is cancelled once it returns `False`.

        Raises:
            SearchCancelledError: the search was cancelled.
        """
        problem = self.problem(goal)
        start = problem.task.pack(state)
        return self._search(PlanProblem(problem.task, start, problem.is_goal, should_continue), limits)

    def policy(
        self, goal: Predicate, limits: PlanLimits = _DEFAULT_LIMITS, most: int | None = None, whole: int | None = None
    ) -> Policy:
        """Return the answers for one goal and any state; made for many states.

        For `most` and `whole` see `Policy`.
        """
        return Policy(self.problem(goal), limits, most, whole, self._search)

    def task(self, goal: Predicate) -> Task:
        """Return the packed task with all variables that decide whether the goal holds."""
        return self.problem(goal).task

    def problem(self, goal: Predicate) -> Problem:
        """Return the goal with its packed task."""
        if goal not in self._problems:
            task = self._task_for(tuple(name for name in goal.reads() if name not in self.base_task.packing.space))
            self._problems[goal] = Problem(self.model, goal, task, task.packing.test(goal))
        return self._problems[goal]

    def _task_for(self, more: tuple[str, ...]) -> Task:
        """Return the task that packs the variables `more` besides those of the base task."""
        if not more:
            return self.base_task
        key = tuple(sorted(more))
        if key not in self._tasks:
            self._tasks[key] = Task(self.model, more)
        return self._tasks[key]
