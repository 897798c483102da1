"""Changes from outside that a case withholds, so that a run waits for them until its end (semantics 7.12 and 9.4).

Environment transitions act at their rates in drawn cases only, and free inputs move only where a case moves them. A
model that waits for a person who acknowledges a fault cannot recover in other cases, and that is not its fault.
"""

from __future__ import annotations

from itertools import islice, product
from typing import TYPE_CHECKING

from scbm.model import OperationState
from scbm.model.sources import free_groups
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.cases import Case
    from scbm.model import BehaviorModel, EnvironmentTransition, Value

_MOST = 10_000
"""Maximum number of combinations of values that are tried; more count as no change that helps."""


def waits_for_change(model: BehaviorModel, case: Case, state: Mapping[str, Value]) -> bool:
    """Return whether something outside could act in a state, or enable its operation, and the case does not let it.

    Args:
        model: the model.
        case: the case that was run.
        state: the values of all variables as the run ended, the runner's own included.
    """
    acts = case.environment is None and case.origin is not None
    if any(_is_enabled(each, state) for each in model.environment if each.rate is None or not acts):
        return True
    is_moved = case.environment is None and case.origin is not None and case.origin.moves_inputs
    return not is_moved and _would_be_enabled(model, state)


def is_change_withheld(model: BehaviorModel, state: Mapping[str, Value]) -> bool:
    """Return whether something outside could act in a state, or enable its operation, where nothing outside acts."""
    return any(_is_enabled(each, state) for each in model.environment) or _would_be_enabled(model, state)


def _is_enabled(transition: EnvironmentTransition, state: Mapping[str, Value]) -> bool:
    """Return whether a transition can be taken, and changes something."""
    return transition.guard.holds(state) and any(act.value(state) != state[act.target] for act in transition.actions)


def _would_be_enabled(model: BehaviorModel, state: Mapping[str, Value]) -> bool:
    """Return whether the current operation is disabled, and other values from outside would enable it."""
    if state[CURRENT_STATE] != OperationState.DISABLED.value:
        return False
    guard = model.operation(str(state[CURRENT_NAME])).pre.running_guard
    values = dict(pair for group in free_groups(model) for pair in group.values)
    names = [name for name in guard.reads() if name in values]
    choices = islice(product(*(values[name] for name in names)), _MOST)
    return any(guard.holds({**state, **dict(zip(names, chosen, strict=True))}) for chosen in choices)
