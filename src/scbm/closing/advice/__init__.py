"""Advice: doubts about a model that loads, and suggestions that make uncoverable obligations coverable.

Checks read a model like planner and runner do, without running cases. A check that meets its limit says so.
"""

from typing import TYPE_CHECKING

from scbm.model.lazy_exports import lazy_exports
from scbm.model.satisfiability import is_satisfiable

if TYPE_CHECKING:
    from scbm.closing.advice.doubts import Doubt
    from scbm.closing.advice.model_check import Checked, check_model
    from scbm.closing.advice.plan_doubts import THOROUGH, CheckLimits

__all__ = ["THOROUGH", "CheckLimits", "Checked", "Doubt", "check_model", "is_satisfiable"]

__getattr__ = lazy_exports(
    __name__,
    {
        "doubts": "Doubt",
        "model_check": "Checked check_model",
        "plan_doubts": "THOROUGH CheckLimits",
    },
)
