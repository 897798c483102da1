"""Advice: doubts about a model that loads, and suggestions that make uncoverable obligations coverable.

Checks read a model like planner and runner do, without running cases. A check that meets its limit says so.
"""

from scbm.closing.advice.doubts import Doubt
from scbm.closing.advice.model_check import Checked, check_model
from scbm.closing.advice.plan_doubts import THOROUGH, CheckLimits
from scbm.model.satisfiability import is_satisfiable

__all__ = ["THOROUGH", "CheckLimits", "Checked", "Doubt", "check_model", "is_satisfiable"]
