"""The checks of a model: first those of its text, then those that explore it within limits."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.closing.advice.doubts import (
    Doubt,
    Unfinished,
    doubts_about_guards,
    doubts_about_requirements,
    doubts_about_resources,
    doubts_about_variables,
    doubts_about_waivers,
)
from scbm.closing.advice.exclusive_goals import doubts_about_exclusive_goals
from scbm.closing.advice.handshake_doubts import doubts_about_handshakes
from scbm.closing.advice.plan_doubts import CheckLimits, doubts_about_livelocks, doubts_about_plans, explore_model
from scbm.closing.advice.reply_doubts import doubts_about_replies
from scbm.closing.advice.request_doubts import doubts_about_requests
from scbm.planning import explore

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.closing.advice.plan_doubts import PlanningExploration
    from scbm.model import BehaviorModel


class Checked(Struct, frozen=True):
    """The result of a check.

    Attributes:
        doubts: the doubts, in the order of the checks.
        unfinished: what a limit ended, one clause each.
        initial_states: the number of allowed initial states, or of those that were explored from.
        reachable: the number of planning states that are reachable from the nominal state.
        complete: whether these numbers are exact, and not cut off by a limit.
    """

    doubts: tuple[Doubt, ...]
    unfinished: tuple[str, ...]
    initial_states: int
    reachable: int
    complete: bool


def _ignore(_: object) -> None:
    pass


def check_model(
    model: BehaviorModel,
    limits: CheckLimits = CheckLimits(),  # noqa: B008 - an immutable value
    found: Callable[[Doubt], None] = _ignore,
    progress: Callable[[str], None] = _ignore,
    today: str | None = None,
) -> Checked:
    """Return all doubts about a model that were found within the limits.

    Args:
        model: the model.
        limits: the limits of the exploration.
        found: called with each doubt at once, so that those of the text need not wait for the exploration.
        progress: called with a description of what is explored.
        today: the date of the check, such as `2026-11-23`; `None` checks no dates of waivers.
    """
    doubts: list[Doubt] = []
    unfinished: list[str] = []

    def note(result: Doubt | Unfinished) -> None:
        if isinstance(result, Unfinished):
            unfinished.append(result.clause)
        else:
            doubts.append(result)
            found(result)

    guards = tuple(doubts_about_guards(model))
    requests = chain(doubts_about_requests(model), doubts_about_handshakes(model))
    resources = chain(doubts_about_resources(model), doubts_about_replies(model), requests)
    waivers = () if today is None else doubts_about_waivers(model, today)
    texts = chain(waivers, doubts_about_variables(model), resources, guards, doubts_about_requirements(model))
    for doubt in texts:
        note(doubt)
    explained = [doubt.path for doubt in guards if isinstance(doubt, Doubt)]
    exploration = explore_model(model, limits, progress)
    for doubt in chain(doubts_about_plans(model, exploration), doubts_about_livelocks(model, exploration)):
        # A guard that can never hold explains that its operation is never enabled, or its goal never reached.
        if isinstance(doubt, Unfinished) or doubt.path not in explained:
            note(doubt)
    for doubt in doubts_about_exclusive_goals(model):
        note(doubt)
    reachable, is_exact = _reachable(model, exploration)
    complete = exploration.reach.complete and exploration.all_starts and is_exact
    return Checked(tuple(doubts), tuple(unfinished), len(exploration.starts), reachable, complete)


def _reachable(model: BehaviorModel, exploration: PlanningExploration) -> tuple[int, bool]:
    """Return the number of states that plans reach from the nominal state, and whether it is exact."""
    task, reach = exploration.task, exploration.reach
    nominal = task.pack(model.nominal_state)
    if tuple(map(task.pack, exploration.starts)) != (nominal,):
        reach = explore(task, [nominal], exploration.limits.states)
    return len(reach.states), reach.complete
