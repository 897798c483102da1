"""The answers of a planner to who asks often: a run that fails and plans again, a campaign, all runs of a model.

An answer is searched for once. When the searches for a goal have looked at many states, its distances are worked out
for all states around at once (`Policy`), for at most a few times the states that searches have looked at: what is
asked once costs what it did, and what is asked a thousand times does not cost a thousand searches.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.planning.plan_answers import PlanLimits, always

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.model import Predicate, Value
    from scbm.planning.plan_answers import Answer, Wanted
    from scbm.planning.planner import Planner
    from scbm.planning.policy import Policy

_DEFAULT_LIMITS = PlanLimits()
_FIRST_BUDGET = 20_000
_GROWTH = 4


class PlanCache:
    """What `Planner.plan` answers, but for `expanded`, which tells what was looked at for this answer."""

    def __init__(self, planner: Planner, first_budget: int = _FIRST_BUDGET) -> None:
        """`first_budget`: so many states may searches for a goal look at before its distances are worked out."""
        self._planner = planner
        self._first_budget = first_budget
        self._goals: dict[tuple[Predicate, PlanLimits], _CachedPlans] = {}

    def plan(
        self,
        state: Mapping[str, Value],
        goal: Predicate,
        limits: PlanLimits = _DEFAULT_LIMITS,
        is_wanted: Wanted = always,
    ) -> Answer:
        """The canonical plan from a state of the world to a goal, or why there is none.

        Raises `UnwantedError` once `is_wanted` says no, which is asked now and then. Nothing is remembered of that.
        """
        key = (goal, limits)
        if key not in self._goals:
            self._goals[key] = _CachedPlans(
                self._planner.policy(goal, limits, most=0), self._first_budget, self._first_budget
            )
        remembered = self._goals[key]
        answer = remembered.policy.plan(remembered.policy.task.pack(state), is_wanted)
        remembered.budget -= answer.expanded
        if remembered.budget < 0:
            remembered.size = remembered.size * _GROWTH + 1
            remembered.budget = remembered.size
            remembered.policy = self._planner.policy(goal, limits, most=remembered.size)
        return answer


@dataclass(slots=True)
class _CachedPlans:
    """What is known of one goal.

    Attributes:
        policy: its answers so far.
        size: so many states its distances may be worked out for.
        budget: so many states may still be looked at before they are worked out for more.
    """

    policy: Policy
    budget: int
    size: int
