"""The checks of a model, in the order in which doubts are reported."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.closing.advice.guard_doubts import doubts_about_guards
from scbm.closing.advice.livelocks import doubts_about_livelocks
from scbm.closing.advice.plan_doubts import doubts_about_plans, explore_model
from scbm.closing.advice.unused_parts import doubts_about_resources, doubts_about_variables
from scbm.planning import explore

if TYPE_CHECKING:
    from scbm.closing.advice.doubts import Doubt
    from scbm.model import BehaviorModel


@dataclass(frozen=True, slots=True)
class Checked:
    """The result of a check.

    Attributes:
        doubts: the doubts, in the order of the checks.
        initial_states: the number of allowed initial states, or of those that were explored from.
        reachable: the number of planning states that are reachable from the nominal state.
        complete: whether these numbers are exact, and not cut off by a limit.
    """

    doubts: tuple[Doubt, ...]
    initial_states: int
    reachable: int
    complete: bool


def check_model(model: BehaviorModel) -> Checked:
    """Return all doubts about a model."""
    exploration = explore_model(model)
    guards = tuple(doubts_about_guards(model))
    reported = [doubt.path for doubt in guards]
    doubts = (
        *doubts_about_variables(model),
        *doubts_about_resources(model),
        *guards,
        # A guard that can never hold explains that its operation is never enabled, or its goal never reached.
        *(doubt for doubt in doubts_about_plans(model, exploration) if doubt.path not in reported),
        *doubts_about_livelocks(model, exploration),
    )
    task = exploration.planner.base_task
    nominal = explore(task, [task.pack(model.nominal_state)], len(exploration.reach.states) + 1)
    complete = exploration.reach.complete and exploration.all_starts and nominal.complete
    return Checked(doubts, len(exploration.starts), len(nominal.states), complete)
