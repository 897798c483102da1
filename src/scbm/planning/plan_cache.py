"""A cache of plans for callers that plan often: a run that replans, a campaign, all runs of a model.

Each answer is searched for once. Once the searches for a goal have expanded many states, the distances of all states
around are computed together (`Policy`), for at most a few times the number of states that the searches expanded. So one
request costs one search, and a thousand requests cost much less than a thousand searches.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.planning.plan_answers import PlanLimits, always

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.model import Predicate, Value
    from scbm.planning.plan_answers import Answer, ShouldContinue
    from scbm.planning.planner import Planner
    from scbm.planning.policy import Policy

_DEFAULT_LIMITS = PlanLimits()
_FIRST_BUDGET = 20_000
_GROWTH = 4


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
        """Return the canonical plan from a state of the world to a goal, or why there is none.

        Raises `SearchCancelledError` once `should_continue` returns `False`; nothing is cached then.
        """
        key = (goal, limits)
        if key not in self._goals:
            self._goals[key] = _CachedPlans(
                self._planner.policy(goal, limits, most=0), self._first_budget, self._first_budget
            )
        cached = self._goals[key]
        answer = cached.policy.plan(cached.policy.task.pack(state), should_continue)
        cached.budget -= answer.expanded
        if cached.budget < 0:
            cached.size = cached.size * _GROWTH + 1
            cached.budget = cached.size
            cached.policy = self._planner.policy(goal, limits, most=cached.size)
        return answer


@dataclass(slots=True)
class _CachedPlans:
    """The cached answers for one goal.

    Attributes:
        policy: the answers so far.
        size: the number of states whose distances may be computed.
        budget: the number of states that searches may still expand before more distances are computed.
    """

    policy: Policy
    budget: int
    size: int
