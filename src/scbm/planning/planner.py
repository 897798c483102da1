"""The planner of a model, and a cache of plans for callers that plan often.

The planner keeps its packed tasks for later problems. The cache serves a run that replans, a campaign, and all runs of
a model: each answer is searched for once. Once the searches for a goal have expanded many states, the distances of all
states around are computed together (`Policy`), for at most a few times the number of states that the searches expanded.
So one request costs one search, and a thousand requests cost much less than a thousand searches.
"""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING, Protocol

from msgspec import Struct, field

from scbm.model import Diagnostic, InputError, Place, PlannerIdentity, Slug
from scbm.planning.plan_answers import Answer, PlanLimits, PlanValidator, Solved, always
from scbm.planning.planners import DEFAULT_PLANNER, PLANNERS
from scbm.planning.planning_task import PlanProblem, Problem, Task
from scbm.planning.policy import Policy

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scbm.cases import Case, RecordedPlan
    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.planning.plan_answers import PlanFlaw, ShouldContinue


_DEFAULT_LIMITS = PlanLimits()


_BRIEF_SEARCHES = 10
"""The first states from which runs ask for plans: often there are no more, and the world has thousands of states."""


class Planner:
    """Finds plans for one model. Answers depend on the problem alone, never on earlier calls.

    Every plan of a run, a test, `scbm plan` and a proof comes from here: the entry of `PLANNERS` finds it, and each
    plan is replayed before it is used.

    Attributes:
        model: the model.
        name: the name of the planner.
        entry: the entry of that name.
        base_task: the packed task with the variables that decide which operations are enabled, whatever the goal.
    """

    def __init__(self, model: BehaviorModel, name: str = DEFAULT_PLANNER) -> None:
        """Pack the model; `name` is an entry of `PLANNERS`."""
        self.model = model
        self.name = name
        self.entry = PLANNERS[name]
        self._validator = PlanValidator(model)
        self.base_task = Task(model)
        self._tasks: dict[tuple[str, ...], Task] = {}
        self._problems: dict[Predicate, Problem] = {}
        self._policies: dict[tuple[Predicate, PlanLimits, int], Policy] = {}

    @staticmethod
    def of(model: BehaviorModel) -> Planner:
        """Return the planner that the model names, or the default one."""
        return Planner(model, model.planner.name or DEFAULT_PLANNER)

    def with_goals_of(self, model: BehaviorModel) -> Planner:
        """Return a planner of a model that differs in its goals alone; both share tasks, which cache successors."""
        planner = copy(self)
        planner.model, planner._problems, planner._policies = model, {}, {}  # noqa: SLF001 - of a copy
        return planner

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
            InputError: an external planner returned a plan that is not valid.
        """
        problem = self.problem(goal)
        start = problem.task.pack(state)
        answer = self.entry.search(PlanProblem(problem, start, should_continue), limits)
        self.validate(state, goal, answer)
        return answer

    @property
    def identity(self) -> PlannerIdentity:
        """The planner as traces, cases and stores record it, with the limits that its model sets."""
        choice = self.model.planner
        return PlannerIdentity(self.name, self.entry.whole_version, choice.max_length, choice.max_expanded)

    def find_flaw(self, state: Mapping[str, Value], goal: Predicate, plan: Sequence[str]) -> PlanFlaw | None:
        """Return the first flaw of a plan from `state` to `goal`; `None` if the plan is valid."""
        return self._validator.find_flaw(state, goal, plan)

    def validate(self, state: Mapping[str, Value], goal: Predicate, answer: Answer) -> None:
        """Replay the plan of an answer; raise an error that names the planner if the plan is not valid.

        The error is an `InputError` where another program planned, otherwise an `AssertionError`: a fault of `scbm`.
        """
        flaw = self.find_flaw(state, goal, answer.plan) if isinstance(answer, Solved) else None
        if flaw is None:
            return
        message = f"the plan of the planner {self.identity} has a flaw at step {flaw.step + 1}"
        if not self.entry.is_external:
            raise AssertionError(f"{message}: {flaw.reason}")
        remedy = "choose another planner, and report this to the authors of the program"
        place = Place(f"planner {self.name}")
        raise InputError([Diagnostic(Slug.PLANNER_FAILED, f"{message}: {flaw.reason}", place, remedy)])

    def policy(
        self, goal: Predicate, limits: PlanLimits = _DEFAULT_LIMITS, most: int | None = None, whole: int | None = None
    ) -> Policy:
        """Return the answers for one goal and any state; made for many states.

        For `most` and `whole` see `Policy`.
        """
        return Policy(self.problem(goal), limits, most, whole, self.entry.search)

    def shared_policy(self, goal: Predicate, limits: PlanLimits, whole: int) -> Policy:
        """Return the answers for one goal to explore runs; the same ones for the same limits, with what they know."""
        key = goal, limits, whole
        if key not in self._policies:
            self._policies[key] = self.policy(goal, limits, whole=whole)
            self._policies[key].brief_searches = _BRIEF_SEARCHES
        return self._policies[key]

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


_FIRST_BUDGET = 20_000
_GROWTH = 4

_MAX_VALIDATED = 200_000
"""Maximum number of states to plan from, for each goal, whose valid plans are remembered."""


def recorded_answer(
    case: Case, ask: int, planner: Planner, state: Mapping[str, Value], goal: Predicate
) -> RecordedPlan:
    """Return the answer that a case has to question `ask` of its run, from 1; the planner is not asked.

    Raises `InputError` if the case has no such answer, or its plan is not valid in this state: the model was changed.
    """
    message = None
    if ask > len(case.plans):
        message = f"the run asks for {ask} plans, and the case has {len(case.plans)}"
    else:
        answer = case.plans[ask - 1]
        flaw = planner.find_flaw(state, goal, answer.plan) if answer.status == Solved.status else None
        if flaw is None:
            return answer
        message = f"plan {ask} of the case has a flaw at step {flaw.step + 1}: {flaw.reason}"
    remedy = "the model or the case was changed since then; without `plans:` the planner is asked"
    raise InputError([Diagnostic(Slug.REPLAY_DIFFERS, message, Place(case.name), remedy)])


class PlanSource(Protocol):
    """Answers the questions of runs for plans: each always alike, and as the planner of the model does."""

    def plan(self, state: Mapping[str, Value], goal: Predicate, limits: PlanLimits) -> Answer:
        """Return the plan from a state of the world to a goal, or why there is none. May raise `PlanRefusedError`."""
        ...


class PlanCache:
    """Returns the answers of `Planner.plan`; `expanded` counts the states that were expanded for this call."""

    def __init__(self, planner: Planner, first_budget: int = _FIRST_BUDGET) -> None:
        """Create an empty cache; searches for a goal expand `first_budget` states before its distances are computed."""
        self._planner = planner
        self._first_budget = first_budget
        self._goals: dict[tuple[Predicate, PlanLimits], _CachedPlans] = {}

    def plan(
        self,
        state: Mapping[str, Value],
        goal: Predicate,
        limits: PlanLimits = _DEFAULT_LIMITS,
        should_continue: ShouldContinue = always,
    ) -> Answer:
        """Return the planner's plan from a state of the world to a goal, or why there is none.

        Raises `SearchCancelledError` once `should_continue` returns `False`; nothing is cached then.
        """
        cached = self._cached(goal, limits)
        start = cached.policy.task.pack(state)
        answer = self.packed_plan(start, goal, limits, should_continue)
        if start not in cached.validated:
            self._planner.validate(state, goal, answer)
            if len(cached.validated) < _MAX_VALIDATED:
                cached.validated[start] = None
        return answer

    def packed_plan(
        self, start: int, goal: Predicate, limits: PlanLimits, should_continue: ShouldContinue = always
    ) -> Answer:
        """Return the planner's plan from a packed state of the task for the goal, not replayed, or why there is none.

        Raises `SearchCancelledError` once `should_continue` returns `False`; nothing is cached then.
        """
        cached = self._cached(goal, limits)
        answer = cached.policy.plan(start, should_continue)
        cached.budget -= answer.expanded
        if cached.budget < 0 and self._planner.name == DEFAULT_PLANNER:
            cached.size = cached.size * _GROWTH + 1
            cached.budget = cached.size
            cached.policy = self._planner.policy(goal, limits, most=cached.size)
        return answer

    def _cached(self, goal: Predicate, limits: PlanLimits) -> _CachedPlans:
        key = (goal, limits)
        if key not in self._goals:
            self._goals[key] = _CachedPlans(
                self._planner.policy(goal, limits, most=0), self._first_budget, self._first_budget
            )
        return self._goals[key]


class _CachedPlans(Struct):
    """The cached answers for one goal.

    Attributes:
        policy: the answers so far.
        size: the number of states whose distances may be computed.
        budget: the number of states that searches may still expand before more distances are computed.
        validated: the packed states to plan from whose plans were replayed; later answers are the same.
    """

    policy: Policy
    budget: int
    size: int
    validated: dict[int, None] = field(default_factory=dict)
