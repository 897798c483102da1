"""The planner: a model with its packed tasks, which later problems find ready."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.planning.plan_answers import Answer, PlanLimits, always
from scbm.planning.planners import DEFAULT_PLANNER, PLANNERS, PlanProblem
from scbm.planning.planning_task import Problem, Task
from scbm.planning.policy import Policy

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.planning.plan_answers import Wanted

_DEFAULT_LIMITS = PlanLimits()


class Planner:
    """Finds plans for one model. Answers depend on the problem alone, never on what was asked before.

    Every plan of a run, a test, `scbm plan` and a proof comes from here: the entry of `PLANNERS` finds it.

    Attributes:
        model: the model.
        base_task: the packed task in which operations can be told apart, whatever the goal.
    """

    def __init__(self, model: BehaviorModel, name: str = DEFAULT_PLANNER) -> None:
        """Packs the model; `name` is an entry of `PLANNERS`."""
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
        is_wanted: Wanted = always,
    ) -> Answer:
        """Answers the planning problem (state, goal, model, limits).

        Args:
            state: a value for each variable of the world; the runner's own stand still, at rest (semantics 4.1).
            goal: a predicate over the variables of the model.
            limits: when to give up.
            is_wanted: asked now and then; once it says no, the search is stopped.

        Raises:
            UnwantedError: it was stopped.
        """
        problem = self.problem(goal)
        start = problem.task.pack(state)
        return self._search(PlanProblem(problem.task, start, problem.is_goal, is_wanted), limits)

    def policy(
        self, goal: Predicate, limits: PlanLimits = _DEFAULT_LIMITS, most: int | None = None, whole: int | None = None
    ) -> Policy:
        """The answers to all planning problems (any state, goal, model, limits); for many states of one goal.

        For `most` and `whole` see `Policy`.
        """
        return Policy(self.problem(goal), limits, most, whole, self._search)

    def task(self, goal: Predicate) -> Task:
        """The packed task in which a goal can be told apart."""
        return self.problem(goal).task

    def problem(self, goal: Predicate) -> Problem:
        """The goal, with the packed task in which it can be told apart."""
        if goal not in self._problems:
            task = self._task_for(tuple(name for name in goal.reads() if name not in self.base_task.packing.space))
            self._problems[goal] = Problem(self.model, goal, task, task.packing.test(goal))
        return self._problems[goal]

    def _task_for(self, more: tuple[str, ...]) -> Task:
        """The task that also tells the variables `more` apart."""
        if not more:
            return self.base_task
        key = tuple(sorted(more))
        if key not in self._tasks:
            self._tasks[key] = Task(self.model, more)
        return self._tasks[key]
