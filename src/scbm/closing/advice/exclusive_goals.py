"""A note of `scbm check`: goals that runs without faults may put out of reach for good (semantics 7.12)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.closing.advice.doubts import Doubt
from scbm.closing.summaries import listed
from scbm.model import Severity, Slug
from scbm.testing.continuations.reachable_goals import ReachableGoals, UnknownReachabilityError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel

_MOST_SITUATIONS = 200
"""Maximum number of situations of one search: milliseconds. Of larger models nothing is said."""

_MOST_TRANSITIONS = 1_000
"""Maximum number of transitions of a model, as all of them are compiled for the search."""

_MOST_PAIRS = 100
"""Maximum number of searches, one for each goal and state at rest."""


def doubts_about_exclusive_goals(model: BehaviorModel) -> Iterator[Doubt]:
    """Yield a note about the goals of which `non_blocking` asks nothing, as runs without faults may exclude them."""
    reachable = ReachableGoals(model, most=_MOST_SITUATIONS)
    is_small = len(model.transitions) <= _MOST_TRANSITIONS
    if len(model.goals) < 2 or reachable.unjudged is not None or not is_small:  # noqa: PLR2004 - one excludes none
        return
    try:
        excluded = reachable.excluded_by_plain_runs(_MOST_PAIRS)
    except UnknownReachabilityError:
        return
    asked = [name for name in excluded.goals if name not in model.reachable_again] if excluded is not None else []
    if excluded is not None and asked:
        kept = f" (nothing that follows changes {listed(excluded.latch)})" if excluded.latch else ""
        message = (
            f"runs without faults may put {listed(asked)} out of reach for good{kept}, so `non_blocking` does not ask "
            f"for {'it' if len(asked) == 1 else 'them'}"
        )
        remedy = f"if no run may do that, mend it, and write `reachable_again: [{', '.join(asked)}]`"
        yield Doubt(Slug.GOALS_EXCLUDE, message, ("goals", asked[0]), remedy, Severity.NOTE)
