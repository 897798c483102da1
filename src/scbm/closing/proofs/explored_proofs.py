"""The runs that proofs explore: those of any plans first, then those of the plans that the model declares.

What no run visits whichever plans are chosen is uncoverable. What no run visits under the declared plans (canonical or
shortest), while others may, is excluded by the planner.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.closing.runs.all_runs import AllRuns, RunScope
from scbm.model import PlanSet
from scbm.model.sources import outside_groups

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scbm.closing.runs.all_runs import CloseLimits
    from scbm.model import BehaviorModel

_MAX_OF_ANY_PLANS = 100_000
"""Maximum number of situations of runs with any plans: mostly some times as many as with canonical ones."""


def scope_of_proofs(model: BehaviorModel, plans: PlanSet = PlanSet.CANONICAL) -> RunScope:
    """Return which runs proofs about a model are about."""
    outside = outside_groups(model)
    return RunScope(outside, model.runs.goals, plans, from_rest=bool(outside))


def explored_for_proofs(
    model: BehaviorModel,
    limits: CloseLimits,
    progress: Callable[[str], None],
    missing: int,
    known: Sequence[AllRuns],
) -> tuple[AllRuns, ...]:
    """Return the explored runs that prove something about what is missing, those of any plans first.

    Args:
        model: the model.
        limits: the limits of the exploration.
        progress: called with a description of each phase as it begins.
        missing: the obligations that are left to decide, as bits of `Visits`.
        known: runs that were explored before, of which some may be those of proofs.

    Raises:
        KeyboardInterrupt: the user ended the exploration.
    """
    is_canonical = all(runs.other_planner is None for runs in known)
    canonical = next((runs for runs in known if runs.scope == scope_of_proofs(model)), None)
    if canonical is not None:
        missing &= ~(canonical.visited | canonical.cut_off)  # no proof is about these
    found = []
    for plans in (PlanSet.ANY, model.runs.plans):
        if not missing or (plans is not PlanSet.ANY and not is_canonical):
            break
        runs = canonical if plans is PlanSet.CANONICAL else None
        if runs is None:
            most = min(limits.situations, _MAX_OF_ANY_PLANS) if plans is PlanSet.ANY else limits.situations
            scope = scope_of_proofs(model, plans)
            runs = AllRuns(model, replace(limits, situations=most), progress, scope, until=missing)
        if runs.is_interrupted:
            raise KeyboardInterrupt
        if runs.proves:
            found.append(runs)
            missing &= runs.visited | runs.cut_off
    return tuple(found)
