"""Test cases: the inputs that decide a run, and the results expected of it (paper, Section VI; semantics 7).

Cases are immutable values; this package reads no clock, draws nothing at random and does no I/O. `files` reads and
writes cases, `running` runs them in simulation, `testing` draws, judges and shrinks them.
"""

from scbm.cases.case import Case, CaseLimits, Expectations, Origin, RecordedRun
from scbm.cases.injections import CONDITIONS, Condition, ConditionKind, Injection, Intake, condition_kind
from scbm.cases.network import Network, Partition, Restart
from scbm.cases.reactions import AT_ONCE, LOST, Delivery, OutcomeRule, Reaction

__all__ = [
    "AT_ONCE",
    "CONDITIONS",
    "LOST",
    "Case",
    "CaseLimits",
    "Condition",
    "ConditionKind",
    "Delivery",
    "Expectations",
    "Injection",
    "Intake",
    "Network",
    "Origin",
    "OutcomeRule",
    "Partition",
    "Reaction",
    "RecordedRun",
    "Restart",
    "condition_kind",
]
