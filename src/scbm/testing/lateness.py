"""How far a run over nodes was behind its own time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import format_duration
from scbm.trace import PlanAsked, PlanReceived

if TYPE_CHECKING:
    from collections.abc import Iterable
    from fractions import Fraction

    from scbm.model import BehaviorModel
    from scbm.trace import Record


def too_late(records: Iterable[Record], model: BehaviorModel, time_scale: Fraction) -> str | None:
    """Why a run does not say what the model does: its time was scaled beyond what the machine can do.

    That is so if a plan took half of the shortest deadline. `None` if nothing speaks for it.
    """
    deadlines_ns = [op.deadline_ns for op in model.operations if op.deadline_ns is not None]
    slowest_ns = slowest_plan_ns(records)
    if time_scale <= 1 or not deadlines_ns or 2 * slowest_ns < min(deadlines_ns):
        return None
    took = f"a plan took {slowest_ns / 1e9:.3g} s of the run, and the shortest deadline is"
    scale = f"the machine did not keep up with a time scale of {float(time_scale):g}"
    return f"{scale}: {took} {format_duration(min(deadlines_ns))}; try a smaller one"


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
