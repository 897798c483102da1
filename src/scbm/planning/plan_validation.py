"""Validation of plans: replay a plan step by step on named states, independent of the planner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.model import BehaviorModel, Predicate, State, Value
from scbm.model.operations import apply

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


@dataclass(frozen=True, slots=True)
class PlanFlaw:
    """Why a plan is invalid.

    Attributes:
        step: the index of the operation that is not enabled; the length of the plan if the goal does not hold at its
            end.
        reason: one sentence.
    """

    step: int
    reason: str


def find_flaw(
    model: BehaviorModel, state: Mapping[str, Value], goal: Predicate, plan: Sequence[str]
) -> PlanFlaw | None:
    """Return the first flaw of a plan from `state` to `goal`; `None` if the plan is valid (semantics 3.3)."""
    known = {v.name: v.initial if v.role.is_runner else state[v.name] for v in model.running_space}
    now = State(model.running_space, known)
    for step, name in enumerate(plan):
        operation = model.operation(name)
        if not operation.pre.g.holds(now):
            return PlanFlaw(step, f"the precondition of {name} does not hold: {operation.pre.g}")
        between = apply(operation.pre.a, now)
        if between is None:
            return PlanFlaw(step, f"starting {name} leaves a domain")
        if not operation.post.g.holds(between):
            return PlanFlaw(step, f"the postcondition of {name} does not hold: {operation.post.g}")
        after = apply(operation.post.a, between)
        if after is None:
            return PlanFlaw(step, f"completing {name} leaves a domain")
        now = after
    return None if goal.holds(now) else PlanFlaw(len(plan), f"the goal does not hold at the end: {goal}")
