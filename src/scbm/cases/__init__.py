"""Test cases: everything that decides a run, and what is expected of it (paper, Section VI; semantics 7).

Immutable, without time, chance or I/O. `notation` reads and writes cases, `simulating` runs them, `testing` draws,
judges and shrinks them.
"""

from scbm.cases.case import Case, CaseLimits, Expectations, Origin, Recorded
from scbm.cases.injections import Condition, ConditionKind, Injection
from scbm.cases.network import Network, Partition, Restart
from scbm.cases.reactions import AT_ONCE, LOST, Delivery, Forced, Reaction

__all__ = [
    "AT_ONCE",
    "LOST",
    "Case",
    "CaseLimits",
    "Condition",
    "ConditionKind",
    "Delivery",
    "Expectations",
    "Forced",
    "Injection",
    "Network",
    "Origin",
    "Partition",
    "Reaction",
    "Recorded",
    "Restart",
]
