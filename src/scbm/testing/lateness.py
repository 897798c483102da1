"""How far a run over nodes was behind its own time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.trace import PlanAsked, PlanReceived

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.trace import Record


def slowest_plan_ns(records: Iterable[Record]) -> int:
    """The longest that a run waited for a plan, in time of the run. In simulation a plan takes no time."""
    asked_ns: dict[int, int] = {}
    slowest_ns = 0
    for record in records:
        if isinstance(record, PlanAsked):
            asked_ns[record.ask] = record.at_ns
        elif isinstance(record, PlanReceived):
            slowest_ns = max(slowest_ns, record.at_ns - asked_ns[record.ask])
    return slowest_ns
