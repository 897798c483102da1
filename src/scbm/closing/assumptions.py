"""What a proof assumes, in plain words: which runs it is about, and what changes in them (semantics 9.3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import GoalOrder, format_value
from scbm.model.sources import inputs, moved, outside_groups, published_by, still
from scbm.planning import DEFAULT_PLANNER

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.model import BehaviorModel
    from scbm.proofcheck import Certificate


def assumptions(model: BehaviorModel, certificates: Iterable[Certificate]) -> tuple[str, ...]:
    """Return the assumptions of some certificates for a model, one sentence each; none without certificates."""
    known = tuple(certificates)
    return tuple(_sentences(model, known)) if known else ()


def _sentences(model: BehaviorModel, certificates: tuple[Certificate, ...]) -> Iterator[str]:
    if any(certificate.goals is GoalOrder.SINGLE for certificate in certificates):
        yield "Each run starts in an allowed initial state, and pursues one goal of the model."
    else:
        yield "Goals of the model follow each other in any order, from an allowed initial state on."
    if all(certificate.is_for_any_plan for certificate in certificates):
        yield "A plan is any sequence of operations that leads to the goal by the planner's rules."
    else:
        yield f"What is excluded by the planner assumes plans of the planner {DEFAULT_PLANNER}; all else, any plans."
    yield from _changes_from_outside(model)
    if not outside_groups(model):
        yield "Only the model and replies to its requests change variables."
    for resource in model.resources:
        for name, values in resource.values:
            yield f"The resource {resource.name} sends only these for {name}: {', '.join(map(format_value, values))}."
    unchanged = still(model)
    if unchanged:
        yield f"Nothing changes these: {', '.join(unchanged)}."


def _changes_from_outside(model: BehaviorModel) -> Iterator[str]:
    guarded = dict.fromkeys(moved(model))
    free = [name for name in inputs(model) if name not in guarded]
    if free:
        yield f"Inputs change to any value, whenever the runner is settled: {', '.join(free)}."
    if guarded:
        yield f"Of what is outside the model, only environment transitions change these: {', '.join(guarded)}."
    for resource in model.resources:
        published = [name for name in published_by(resource, model) if name not in guarded]
        if published:
            yield f"The resource {resource.name} changes these unasked: {', '.join(published)}."
    shared = [resource.name for resource in model.resources if resource.shared]
    if shared:
        yield f"Others use these resources, while no request to them is in flight: {', '.join(shared)}."
