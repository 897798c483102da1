"""Suggestions for what canonical plans alone exclude: other shortest plans, by another order (decision 46).

Which of several shortest plans is canonical depends on the order of the operations in the file (semantics 4.2). A model
with drawn plans gets all of them (semantics 4.4).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from msgspec.structs import replace

from scbm.cases.coverage import Aspect
from scbm.closing.advice.suggestions import TriedVisits, forced_states_clause
from scbm.closing.decisions import Suggestion, SuggestionKind
from scbm.closing.summaries import plan_in_words
from scbm.model import RunPlans
from scbm.planning import PlanLimits, Planner, Solved, model_with_plans

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from scbm.cases.coverage import Obligation
    from scbm.model import BehaviorModel


_MAX_EXPANSIONS = 20_000
"""Maximum number of states that are expanded for one goal: a suggestion is no reason to wait."""


def suggest_other_plans(
    model: BehaviorModel, excluded: Sequence[Obligation], visits: Callable[[BehaviorModel], TriedVisits]
) -> Iterator[Suggestion]:
    """Yield a suggestion for each goal to which another shortest plan has operations that no canonical plan has.

    All plans are those from the nominal state.

    Args:
        model: the model.
        excluded: its obligations that the planner excludes.
        visits: returns what executed cases of a model visit that differs in the order of its operations.
    """
    if model.runs.plans is not RunPlans.CANONICAL or not excluded:
        return
    left = dict.fromkeys(obligation.subject for obligation in excluded)
    for plan in _plans(model):
        for name in plan.operations:
            left.pop(name, None)
    if not left:
        return
    reordered = with_first(model, dict.fromkeys(left, 1))
    plans = [plan for plan in _plans(reordered) if any(name in plan.operations for name in left)]
    tried = visits(reordered) if plans else TriedVisits()
    for plan in plans:
        found = [name for name in left if name in plan.operations]
        about = tuple(each for each in excluded if each.subject in found and _has(each, tried.freely))
        if about:
            forced = tuple(each for each in excluded if each.subject in found and each in tried.by_force)
            text = (
                f"another shortest plan to {plan.goal} is {plan_in_words(plan.operations, ' -> ')}: declare "
                "`runs: {plans: drawn}`, or add `--plans drawn`, so that runs get such plans, too"
            )
            text += forced_states_clause("cases with such plans", forced)
            yield Suggestion(about, SuggestionKind.PLANS, text, by_force=forced)
        for name in found:
            del left[name]


def _has(obligation: Obligation, visited: frozenset[Obligation]) -> bool:
    """Return whether cases visit an obligation whose operation is in a plan."""
    return obligation.aspect is Aspect.QUEUED or obligation in visited


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


def with_first(model: BehaviorModel, wanted: Mapping[str, int]) -> BehaviorModel:
    """Return the model with its operations in another order, and with canonical plans.

    The order of operations decides between plans of equal length and nothing else, so a canonical plan of the returned
    model is a shortest plan of `model`.

    Args:
        model: the model.
        wanted: weights by the names of operations; the greatest comes first, and equal ones keep their order.
    """
    operations = sorted(model.operations, key=lambda operation: -wanted.get(operation.name, 0))
    return model_with_plans(RunPlans.CANONICAL, replace(model, operations=tuple(operations)))
