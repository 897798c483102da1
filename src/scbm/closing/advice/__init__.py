"""Doubts about a model that loads: what can never happen, what goes round, what leaves a domain.

Looks at a model as planner and runner do, without running cases. What it cannot decide within its limits it says.
"""

from scbm.closing.advice.doubts import Doubt
from scbm.closing.advice.model_check import Checked, check_model
from scbm.model.satisfiability import is_satisfiable

__all__ = ["Checked", "Doubt", "check_model", "is_satisfiable"]
