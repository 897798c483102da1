"""Suggestions for what canonical plans alone exclude: other shortest plans that have the operations.

Which of several shortest plans is canonical depends on the order of the operations in the file (semantics 4.2). A model
with drawn plans gets all of them (semantics 4.4).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from scbm.closing.decisions import Suggestion, SuggestionKind
from scbm.closing.reordered_operations import with_first
from scbm.closing.summaries import plan_in_words
from scbm.model import PlanSet
from scbm.planning import PlanLimits, Planner, Solved

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases.coverage import Obligation
    from scbm.model import BehaviorModel

_MAX_EXPANSIONS = 20_000
"""Maximum number of states that are expanded for one goal: a suggestion is no reason to wait."""


def suggest_other_plans(model: BehaviorModel, excluded: Sequence[Obligation]) -> Iterator[Suggestion]:
    """Yield a suggestion for each goal to which another shortest plan has operations that no canonical plan has.

    All plans are those from the nominal state.

    Args:
        model: the model.
        excluded: its obligations that the planner excludes.
    """
    if model.runs.plans is not PlanSet.CANONICAL or not excluded:
        return
    left = dict.fromkeys(obligation.subject for obligation in excluded)
    for plan in _plans(model):
        for name in plan.operations:
            left.pop(name, None)
    for plan in _plans(with_first(model, dict.fromkeys(left, 1))) if left else ():
        found = [name for name in left if name in plan.operations]
        if found:
            text = (
                f"another shortest plan to {plan.goal} is {plan_in_words(plan.operations, ' -> ')}: declare "
                "`runs: {plans: shortest}`, or add `--plans shortest`, so that runs get such plans, too"
            )
            about = tuple(obligation for obligation in excluded if obligation.subject in found)
            yield Suggestion(about, SuggestionKind.PLANS, text)
        for name in found:
            del left[name]


class _PlanOfGoal(NamedTuple):
    """A plan from the nominal state to a goal."""

    goal: str
    operations: tuple[str, ...]


def _plans(model: BehaviorModel) -> Iterator[_PlanOfGoal]:
    """Yield the canonical plan to each goal, as far as it is found soon."""
    planner = Planner(model)
    for name, goal in model.goals:
        answer = planner.plan(model.nominal_state, goal, PlanLimits(expansions=_MAX_EXPANSIONS))
        if isinstance(answer, Solved):
            yield _PlanOfGoal(name, answer.plan)
