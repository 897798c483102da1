"""Injections: what a tester changes while a run goes on (paper, Section VI; semantics 7.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.cases.conditions import Condition
    from scbm.model import Predicate, Value


@dataclass(frozen=True, slots=True)
class Injection:
    """Acts once: at a time, when a predicate holds, or when both do; at once if neither is said.

    It assigns variables of the controller, or changes the condition of a resource.

    Attributes:
        name: what the trace calls it.
        assign: variables and their values, such as a model may assign.
        when: acts as soon as this holds.
        at_ns: acts not before this time of the run.
        hold_ns: so long afterwards it puts back what nothing else has changed since; `None` leaves it.
        resource: whose condition it changes, if it does.
        condition: what that becomes.
    """

    name: str
    assign: tuple[tuple[str, Value], ...] = ()
    when: Predicate | None = None
    at_ns: int | None = None
    hold_ns: int | None = None
    resource: str | None = None
    condition: Condition | None = None
