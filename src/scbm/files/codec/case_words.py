"""The words that case files use for outcomes, conditions and verdicts, and the keys of injections.

Apart from `case_types`, which takes long to make and is loaded only where a file is read.
"""

from __future__ import annotations

from scbm.cases import ConditionKind
from scbm.cases.trace import End
from scbm.model.resources import Outcome

ANY = "any"
"""The outcome of a request of which nothing is said."""

OUTCOME_WORDS = (*(outcome.value for outcome in Outcome), ANY)
CONDITION_WORDS = tuple(kind.value for kind in ConditionKind if kind is not ConditionKind.SLOWER)
VERDICT_WORDS = tuple(end.value for end in End if end is not End.LOST)
"""How a run can be expected to end, and be recorded; one that was lost has not ended."""

INJECTION_KEYS = ("name", "when", "at", "set", "resource", "becomes", "hold")
