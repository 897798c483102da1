"""The plans of the cases that closing tries: each is searched for once, and all searches share a budget of states.

Where runs are many, so are the plans of their cases, and a canonical plan of a large model takes seconds. So these
cases get the plans that the first part of the search finds, which takes a fraction of a second. A question that it
does not answer is refused, and never searched for again. A run that asks it is cut before (`bounded`). So every run
that is kept is the run that other commands give for the saved case, without any limit of closing.
"""

from __future__ import annotations

from contextlib import contextmanager
from enum import Enum
from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.model import RunPlans
from scbm.model.requirements import BuiltIn
from scbm.planning import PlanCache, Planner, PlanProblem, PlanRefusedError, model_with_plans
from scbm.planning.plan_answers import always

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.planning import Answer, PlanLimits
    from scbm.planning.plan_answers import ShouldContinue


class PlanEffort(Enum):
    """How long a plan is searched for."""

    ALL = "the whole search, and distances for many plans"
    WHOLE = "the whole search while its budget lasts, then its first part"
    BRIEF = "the first part of the search"


_WHOLE_STATES = 1_000_000
"""Budget of whole searches, which take some ten seconds for so many states; a search that has begun is finished."""

_CUT_STATES = 25_000
"""About as many states are expanded by a brief search that finds no answer."""


class CasePlans:
    """The answers of a planner to the questions of cases.

    Attributes:
        refused: how often a question was refused for the first time, or for want of budget.
        expanded: the number of states that were expanded under an effort other than `ALL`.
    """

    def __init__(self, model: BehaviorModel) -> None:
        self.refused = 0
        self.expanded = 0
        self._planner = Planner.of(model)
        self._cache = PlanCache(self._planner)
        self._effort = PlanEffort.ALL
        self._budget = 0
        self._whole = _WHOLE_STATES
        self._known: dict[tuple[Predicate, int], Answer | None] = {}

    @property
    def are_limited(self) -> bool:
        """Whether an effort other than `ALL` changes anything: only some planners have a brief search."""
        return self._planner.entry.brief is not None

    @contextmanager
    def effort(self, effort: PlanEffort, budget: int | None = None) -> Iterator[None]:
        """Search with another effort in a block; `budget` is the number of states for brief searches, if it is new."""
        before = self._effort, self._budget
        self._effort, self._budget = effort, self._budget if budget is None else budget
        try:
            yield
        finally:
            self._effort, self._budget = before

    def plan(
        self,
        state: Mapping[str, Value],
        goal: Predicate,
        limits: PlanLimits,
        should_continue: ShouldContinue = always,
    ) -> Answer:
        """Return the answer of the planner. Raises `PlanRefusedError` where it takes more than the effort allows."""
        if not self.are_limited:
            return self._cache.plan(state, goal, limits, should_continue)
        key = goal, self._planner.task(goal).pack(state)
        answer = self._known.get(key)
        if answer is None and (key not in self._known or self._searches_more):
            answer = self._known[key] = self._searched(key, state, limits, should_continue)
            self.refused += answer is None
        if answer is None:
            raise PlanRefusedError
        return answer

    @property
    def _searches_more(self) -> bool:
        """Whether a question that was refused is searched for with more effort now."""
        return self._effort is PlanEffort.ALL or (self._effort is PlanEffort.WHOLE and self._whole > 0)

    def _searched(
        self,
        key: tuple[Predicate, int],
        state: Mapping[str, Value],
        limits: PlanLimits,
        should_continue: ShouldContinue,
    ) -> Answer | None:
        goal, packed = key
        if self._effort is PlanEffort.ALL:
            return self._cache.plan(state, goal, limits, should_continue)
        answer = None
        if key not in self._known:
            answer = self._brief_answer(PlanProblem(self._planner.problem(goal), packed, should_continue), limits)
        if answer is None and self._searches_more:
            answer = self._planner.plan(state, goal, limits, should_continue)
            self._whole -= answer.expanded
            self.expanded += answer.expanded
        elif answer is not None:
            self._planner.validate(state, goal, answer)
        return answer

    def _brief_answer(self, problem: PlanProblem, limits: PlanLimits) -> Answer | None:
        """Return the answer of the brief search if it is that of the whole search, and the budget allows it."""
        brief = self._planner.entry.brief
        if self._budget <= 0:
            self.refused += 1
            raise PlanRefusedError  # and another budget may pay for the search later
        if brief is None:
            return None
        answer = brief(problem, limits)
        expanded = _CUT_STATES if answer is None else answer.expanded
        self._budget -= expanded
        self.expanded += expanded
        return answer


def with_canonical_plans(model: BehaviorModel) -> BehaviorModel:
    """Return the model with canonical plans; what cases with drawn plans are not judged by is off."""
    if model.runs.plans is RunPlans.CANONICAL:
        return model
    off = (*model.requirements_off, (BuiltIn.NON_BLOCKING.value, "plans are drawn"))
    return replace(model_with_plans(RunPlans.CANONICAL, model), requirements_off=off)
