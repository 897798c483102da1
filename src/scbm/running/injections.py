"""Injections: what a tester changes while a run goes on (paper, Section VI; semantics 7.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.model import Predicate, Value


@dataclass(frozen=True, slots=True)
class Injection:
    """Assigns variables once: at a time, when a predicate holds, or when both do; at once if neither is said.

    Attributes:
        name: what the trace calls it.
        assign: variables and their values, such as a model may assign.
        when: acts as soon as this holds.
        at_ns: acts not before this time.
        hold_ns: so long afterwards it puts back what nothing else has changed since; `None` leaves it.
    """

    name: str
    assign: tuple[tuple[str, Value], ...]
    when: Predicate | None = None
    at_ns: int | None = None
    hold_ns: int | None = None
