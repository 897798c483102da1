"""Test cases: the inputs that decide a run, and the results expected of it (paper, Section VI; semantics 7).

Cases are immutable values; this package reads no clock, draws nothing at random and does no I/O. `files` reads and
writes cases, `running` runs them in simulation, `testing` draws, judges and shrinks them.
"""

from typing import TYPE_CHECKING

from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.cases.case import (
        AT_ONCE,
        LOST,
        Case,
        CaseGoal,
        CaseLimits,
        Delivery,
        Expectations,
        Origin,
        OutcomeRule,
        Reaction,
        RecordedGoal,
        RecordedPlan,
        RecordedRun,
    )
    from scbm.cases.injections import (
        CONDITIONS,
        Condition,
        ConditionKind,
        EnvironmentChange,
        Injection,
        Intake,
        condition_kind,
    )
    from scbm.cases.network import Network
    from scbm.cases.network_faults import (
        NETWORK_FAULTS,
        AnyNetworkFault,
        FaultAction,
        FaultWindow,
        MessageInTransit,
        NetworkFault,
        Partition,
        Restart,
        ShareFault,
        TimeFault,
        WindowFault,
    )

__all__ = [
    "AT_ONCE",
    "CONDITIONS",
    "LOST",
    "NETWORK_FAULTS",
    "AnyNetworkFault",
    "Case",
    "CaseGoal",
    "CaseLimits",
    "Condition",
    "ConditionKind",
    "Delivery",
    "EnvironmentChange",
    "Expectations",
    "FaultAction",
    "FaultWindow",
    "Injection",
    "Intake",
    "MessageInTransit",
    "Network",
    "NetworkFault",
    "Origin",
    "OutcomeRule",
    "Partition",
    "Reaction",
    "RecordedGoal",
    "RecordedPlan",
    "RecordedRun",
    "Restart",
    "ShareFault",
    "TimeFault",
    "WindowFault",
    "condition_kind",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "case": (
            "AT_ONCE LOST Case CaseGoal CaseLimits Delivery Expectations Origin OutcomeRule Reaction "
            "RecordedGoal RecordedPlan RecordedRun"
        ),
        "injections": "CONDITIONS Condition ConditionKind EnvironmentChange Injection Intake condition_kind",
        "network": "Network",
        "network_faults": (
            "NETWORK_FAULTS AnyNetworkFault FaultAction FaultWindow MessageInTransit NetworkFault Partition "
            "Restart ShareFault TimeFault WindowFault"
        ),
    },
)
