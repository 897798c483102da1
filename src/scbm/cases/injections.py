"""Injections: changes that a tester makes during a run (paper, Section VI; semantics 7.2).

An injection assigns variables, or changes the condition of a simulated resource.
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

    - `well`: as the model file and the case define.
    - `occupied`: another user has it; requests wait until it is well again.
    - `dead`: it drops its current request and receives no others.
    - `failing`: each request that arrives from now on fails, unless it gets no reply at all.
    - `slower`: each request that arrives from now on takes a multiple of its time.
    """

    WELL = "well"
    OCCUPIED = "occupied"
    DEAD = "dead"
    FAILING = "failing"
    SLOWER = "slower"


@dataclass(frozen=True, slots=True)
class Condition:
    """The condition of a resource: its kind, and for `slower` the factor: at least 1, with at most 15 digits."""

    kind: ConditionKind = ConditionKind.WELL
    factor: Fraction = Fraction(1)

    def __str__(self) -> str:
        if self.kind is not ConditionKind.SLOWER:
            return self.kind.value
        return f"{float(self.factor):.15g} times slower"


@dataclass(frozen=True, slots=True)
class Injection:
    """One change during a run; without `when` and `at_ns` it acts at the start.

    Attributes:
        name: its name in the trace.
        assign: the variables that it assigns, each with its value; those that a model may assign.
        when: the predicate that must hold for the injection to act.
        at_ns: the earliest time of the run at which it acts.
        hold_ns: the time after which it restores the variables that nothing else has changed; `None` never restores.
        resource: the resource whose condition it changes, if it changes one.
        condition: the new condition of that resource.
    """

    name: str
    assign: tuple[tuple[str, Value], ...] = ()
    when: Predicate | None = None
    at_ns: int | None = None
    hold_ns: int | None = None
    resource: str | None = None
    condition: Condition | None = None
