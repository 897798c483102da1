"""The runs that proofs explore: those of any plans first, then those of the planner, as the model declares them.

What no run visits whichever plans are chosen is uncoverable. What no run of the canonical planner visits, while others
may, is excluded by the planner.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.closing.runs.all_runs import AllRuns, RunScope
from scbm.model import PlanSet
from scbm.model.sources import outside_groups

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.closing.runs.all_runs import CloseLimits
    from scbm.model import BehaviorModel

_MAX_OF_ANY_PLANS = 100_000
"""Maximum number of situations of runs with any plans: mostly some times as many as with canonical ones."""


def explored_for_proofs(
    model: BehaviorModel, limits: CloseLimits, progress: Callable[[str], None], missing: int, known: AllRuns
) -> tuple[AllRuns, ...]:
    """Return the explored runs that prove something about what is missing, those of any plans first.

    Args:
        model: the model.
        limits: the limits of the exploration.
        progress: called with a description of each phase as it begins.
        missing: the obligations that are left to decide, as bits of `Visits`.
        known: the runs of a closed world with one goal each, all of them.

    Raises:
        KeyboardInterrupt: the user ended the exploration.
    """
    outside = outside_groups(model)
    scope = RunScope(outside, model.runs.goals, from_rest=bool(outside))
    found = []
    for plans in (PlanSet.ANY, PlanSet.CANONICAL):
        wanted = replace(scope, plans=plans)
        if not missing or (plans is PlanSet.CANONICAL and known.other_planner is not None):
            break
        most = limits.situations if plans is PlanSet.CANONICAL else min(limits.situations, _MAX_OF_ANY_PLANS)
        is_known = wanted == RunScope()
        runs = known if is_known else AllRuns(model, replace(limits, situations=most), progress, wanted, until=missing)
        if runs.is_interrupted:
            raise KeyboardInterrupt
        if runs.proves:
            found.append(runs)
            missing &= runs.visited | runs.cut_off
    return tuple(found)
