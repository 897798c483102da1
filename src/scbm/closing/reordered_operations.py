"""Models with their operations in another order, whose canonical plans are other shortest plans (decision 46)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.model import PlanSet
from scbm.planning import model_with_plans

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.model import BehaviorModel


def with_first(model: BehaviorModel, wanted: Mapping[str, int]) -> BehaviorModel:
    """Return the model with its operations in another order, and with canonical plans.

    The order of operations decides between plans of equal length and nothing else, so a canonical plan of the returned
    model is a shortest plan of `model`.

    Args:
        model: the model.
        wanted: weights by the names of operations; the greatest comes first, and equal ones keep their order.
    """
    operations = sorted(model.operations, key=lambda operation: -wanted.get(operation.name, 0))
    return model_with_plans(PlanSet.CANONICAL, replace(model, operations=tuple(operations)))
