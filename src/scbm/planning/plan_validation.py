"""Whether a plan is one: replayed step by step on named states, without anything that made it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.model import BehaviorModel, Predicate, State, Value
from scbm.model.operations import apply

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


@dataclass(frozen=True, slots=True)
class PlanFlaw:
    """Why a plan is none.

    Attributes:
        step: the index of the operation that cannot be taken; the length of the plan if its end is no goal.
        reason: one sentence.
    """

    step: int
    reason: str


def find_flaw(
    model: BehaviorModel, state: Mapping[str, Value], goal: Predicate, plan: Sequence[str]
) -> PlanFlaw | None:
    """The first flaw of a plan from `state` to `goal`, or `None` if it is sound (semantics 3.3)."""
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
