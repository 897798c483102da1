"""Injections: what a tester changes while a run goes on (paper, Section VI; semantics 7.2).

The condition of a simulated resource: what an injection can make of it (paper, Section VI; semantics 7.2).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.model import Predicate, Value


class ConditionKind(StrEnum):
    """How a resource treats requests.

    - `well`: as the model file and the case say.
    - `occupied`: busy with someone else; requests wait until it is well again.
    - `dead`: it forgets what it was doing, and gets no requests.
    - `failing`: requests that arrive from now on fail, if they are answered at all.
    - `slower`: requests that arrive from now on take a multiple of their time.
    """

    WELL = "well"
    OCCUPIED = "occupied"
    DEAD = "dead"
    FAILING = "failing"
    SLOWER = "slower"


@dataclass(frozen=True, slots=True)
class Condition:
    """A kind, and for `slower` the factor, which is at least 1 and of few decimals."""

    kind: ConditionKind = ConditionKind.WELL
    factor: Fraction = Fraction(1)

    def __str__(self) -> str:
        if self.kind is not ConditionKind.SLOWER:
            return self.kind.value
        return f"{float(self.factor):.15g} times slower"


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
