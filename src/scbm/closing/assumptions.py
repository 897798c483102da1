"""What a proof assumes, in plain words: which runs it is about, and what changes in them (semantics 9.3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model.sources import inputs, published_by, still
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
    yield "Each run starts in an allowed initial state, and pursues one goal of the model."
    if not all(certificate.is_for_any_plan for certificate in certificates):
        yield f"Plans are those of the planner {DEFAULT_PLANNER}, where all runs were explored."
    free = inputs(model)
    if free:
        yield f"Inputs change to any value, whenever the runner is settled: {', '.join(free)}."
    for resource in model.resources:
        published = published_by(resource, model)
        if published:
            yield f"The resource {resource.name} changes these unasked: {', '.join(published)}."
    if not free and not any(published_by(resource, model) for resource in model.resources):
        yield "Only the model and replies to its requests change variables."
    unchanged = still(model)
    if unchanged:
        yield f"Nothing changes these: {', '.join(unchanged)}."
