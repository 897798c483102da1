"""The canonical plans to one goal from any state. Each state is explored once, however many are asked for.

At first distances are computed on demand, state by state (`DistancesOnDemand`). Beyond some ten thousand states the
policy tries to plan for all states of the world at once, which is some hundred times faster per state where the world
is small enough. Requests are at rest in all of these states, as they mostly are when a plan is needed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.model import Role
from scbm.planning.engines import DistancesOnDemand, Exceeded, ExplorationLimits, Region
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
from scbm.planning.planners import canonical, canonical_briefly
from scbm.planning.planning_task import PlanProblem, system_of

if TYPE_CHECKING:
    from scbm.planning.engines.exploration import Distances
    from scbm.planning.plan_answers import ShouldContinue
    from scbm.planning.planners import PlanFunction
    from scbm.planning.planning_task import Problem, Task

_LIMITS = ExplorationLimits(states=1 << 24, bytes=1 << 29)


class Everywhere:
    """The plans to a goal from every state of a task with requests at rest, and from all states reachable from these.

    Attributes:
        count: the number of states.
    """

    def __init__(self, task: Task, distances: Distances, count: int) -> None:
        self.count = count
        self._task = task
        self._distances = distances

    def plan(self, state: int) -> tuple[str, ...] | None:
        """Return the canonical plan from a packed state; `None` if there is none. Raises `LookupError` for others."""
        return self._distances.plan(self._task.packing.values(state))


def plans_everywhere(problem: Problem, most: int) -> Everywhere | None:
    """Return the plans from all states of a task; `None` if these are more than `most`, or need too much memory."""
    # Few models are large enough to need the engines, and every start of `scbm` would load them.
    from scbm.planning.engines.exploration import Distances, Exploration  # noqa: PLC0415

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


_MAX_CACHED = 1_000_000


_ON_DEMAND_WORK = 20
"""The successors of one state on demand take about as long as those of so many states of the whole world."""

_MAX_ON_DEMAND = 20_000
"""Number of states with distances on demand beyond which the policy tries to plan for the whole world at once."""

_SEARCH_WORK = 1 << 13
"""A search takes at least about as long as to expand so many states on demand."""


class Policy:
    """The answers of `Planner.plan` for one goal, from any packed state; `expanded` is 0 where nothing was searched.

    Attributes:
        task: the packed task of the states (`task.pack`).
        brief_searches: the number of states whose plans are searched for one by one at first, as long as each search
            is brief.
    """

    def __init__(
        self,
        problem: Problem,
        limits: PlanLimits,
        most: int | None = None,
        whole: int | None = None,
        search: PlanFunction = canonical,
    ) -> None:
        """Prepare the answers.

        Args:
            problem: the goal with its packed task.
            limits: the limits of each answer.
            most: the maximum number of states whose distances are computed; beyond it each answer is searched for.
                `None`
                for the number of states that a search may expand.
            whole: the maximum number of states of the world for planning from all of them at once; `None` for the
                number of
                states that a search may expand.
            search: the planner. Distances give canonical plans, so they serve `canonical` alone; the answers of any
                other planner are cached one by one.
        """
        self.task = problem.task
        self._problem = problem
        self._search = search
        self._limits = limits
        # With no more states than a search may expand, no search can reach that limit.
        self._most = limits.expansions if most is None else min(most, limits.expansions)
        self._whole = limits.expansions if whole is None else whole
        self._distances = self._on_demand(min(self._most, _MAX_ON_DEMAND))
        self._everywhere: Everywhere | None = None
        self._has_tried_everywhere = self._most <= _MAX_ON_DEMAND
        self._answers: dict[int, Answer] = {}
        self._should_continue: ShouldContinue = always
        self._polls = self._searched_states = self._patience = 0
        self.brief_searches = 0

    def plan(self, state: int, should_continue: ShouldContinue = always) -> Answer:
        """Return the canonical plan from a packed state, or why there is none.

        Raises `SearchCancelledError` once `should_continue` returns `False`.
        """
        known = self._answers.get(state)
        if known is not None:
            return known
        self._should_continue = should_continue
        answer = self._answer(state)
        if len(self._answers) < _MAX_CACHED:
            self._answers[state] = replace(answer, expanded=0)
        return answer

    @property
    def planned(self) -> int:
        """The number of states that were planned for; those on demand count more, as each takes so much longer."""
        everywhere = 0 if self._everywhere is None else self._everywhere.count
        return everywhere + self._searched_states + self._polls * _ON_DEMAND_WORK

    def _on_demand(self, most: int) -> DistancesOnDemand:
        return DistancesOnDemand(self._successors, self._problem.is_goal, most)

    def _successors(self, state: int) -> tuple[tuple[int, int], ...]:
        """Return the successors of a state; raise `SearchCancelledError` once the caller has cancelled."""
        self._polls += 1
        if not self._polls % POLL_INTERVAL:
            raise_if_cancelled(self._should_continue)
        return self.task.successors(state)

    def _answer(self, state: int) -> Answer:
        if self._search is not canonical:
            return self._searched(state)
        if self.brief_searches:
            answer = self._brief_answer(state)
            if answer is not None:
                return answer
        if self._everywhere is not None:
            try:
                return self._checked(state, self._everywhere.plan(state), self._everywhere.count)
            except LookupError:
                pass  # a request is in flight in this state
        if self._patience <= 0 and self._distances.know(state):
            plan = None if self._distances.distance(state) is None else self._path(state)
            return self._checked(state, plan, self._distances.lost)
        if self._has_tried_everywhere:
            return self._searched(state)
        self._has_tried_everywhere = True
        self._everywhere = plans_everywhere(self._problem, self._whole)
        self._distances = self._on_demand(self._most)
        if self._everywhere is None and self._most == self._limits.expansions:
            self._patience = self._most
        return self._answer(state)

    def _brief_answer(self, state: int) -> Answer | None:
        """Return the answer of a brief search; `None`, for all further states, too, if it does not find one."""
        answer = canonical_briefly(PlanProblem(self._problem, state, self._should_continue), self._limits)
        if answer is None or isinstance(answer, LimitReached):
            self.brief_searches = 0
            return None
        self.brief_searches -= 1
        self._searched_states += answer.expanded
        return answer

    def _checked(self, state: int, plan: tuple[str, ...] | None, lost: int) -> Answer:
        """Return the answer within the limit of length; at most `lost` states lead to no goal."""
        if plan is None:
            # A search would expand lost states only. Where they may be deeper than the limit, the search has to decide.
            return Unsolvable(0) if lost <= self._limits.length else self._searched(state)
        return Solved(plan, 0) if len(plan) <= self._limits.length else LimitReached(Limit.LENGTH, 0)

    def _searched(self, state: int) -> Answer:
        answer = self._search(PlanProblem(self._problem, state, self._should_continue), self._limits)
        if self._patience > 0:  # few searches take less time than to explore a large part of the world
            self._searched_states += answer.expanded
            self._patience -= max(answer.expanded, _SEARCH_WORK)
            if isinstance(answer, LimitReached) and answer.limit is Limit.EXPANSIONS:
                self._patience, self._distances = 0, self._on_demand(0)  # an exploration would exceed its limit, too
        return answer

    def _path(self, state: int) -> tuple[str, ...]:
        names = []
        while (step := self._distances.first_move(state)) is not None:
            operation, state = step
            names.append(self.task.operations[operation])
        return tuple(names)
