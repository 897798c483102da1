"""The assumptions of a proof as sentences: its runs, and the variables that change in them (semantics 9.3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.cases.coverage.statuses import Decision
from scbm.model import FIRST_PLANNER, GoalOrder, RunPlans, format_value
from scbm.model.sources import inputs, moved, outside_groups, published_by, still

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from scbm.model import BehaviorModel


def assumptions(
    model: BehaviorModel,
    decisions: Collection[Decision],
    goals: GoalOrder | None = None,
    planner: str = FIRST_PLANNER.name,
) -> tuple[str, ...]:
    """Return what the proofs of a model assume, one sentence each.

    Args:
        model: the model.
        decisions: the statuses that are proved; without `UNCOVERABLE` and `EXCLUDED` nothing is assumed.
        goals: the runs that the proofs are about; `None` for those that the model declares.
        planner: the planner whose plans proofs of what is excluded are about.
    """
    if Decision.UNCOVERABLE not in decisions and Decision.EXCLUDED not in decisions:
        return ()
    return tuple(_sentences(model, decisions, goals or model.runs.goals, planner))


def _sentences(model: BehaviorModel, decisions: Collection[Decision], goals: GoalOrder, planner: str) -> Iterator[str]:
    if goals is GoalOrder.SINGLE:
        yield "Each run starts in an allowed initial state, and pursues one goal of the model."
    else:
        yield "Goals of the model follow each other in any order, from an allowed initial state on."
    if Decision.EXCLUDED not in decisions or model.runs.plans is RunPlans.DRAWN:
        yield "A plan is any sequence of operations that leads to the goal by the planner's rules."
    elif Decision.UNCOVERABLE not in decisions:
        yield f"Plans are those of the planner {planner}."
    else:
        yield f"Exclusions by the planner assume plans of the planner {planner}; all other proofs hold for any plans."
    yield from _changes_from_outside(model)
    if not outside_groups(model):
        yield "Only the model and replies to its requests change variables."
    for resource in model.resources:
        for name in (name for name, values in resource.values if len(values) < len(model.space[name].domain)):
            sent = ", ".join(map(format_value, resource.sends(model.space[name])))
            yield f"The resource {resource.name} sends only these for {name}: {sent}."
    unchanged = still(model)
    if unchanged:
        yield f"Nothing changes these: {', '.join(unchanged)}."


def _changes_from_outside(model: BehaviorModel) -> Iterator[str]:
    guarded = dict.fromkeys(moved(model))
    free = [name for name in inputs(model) if name not in guarded]
    if free:
        yield f"Inputs change to any value, whenever the runner is settled: {', '.join(free)}."
    if guarded:
        yield f"From outside the model, only environment transitions change these: {', '.join(guarded)}."
    for resource in model.resources:
        published = [name for name in published_by(resource, model) if name not in guarded]
        if published:
            yield f"The resource {resource.name} may change these without a request: {', '.join(published)}."
    shared = [resource.name for resource in model.resources if resource.shared]
    if shared:
        yield f"Other users may occupy these resources while no request to them is in flight: {', '.join(shared)}."
