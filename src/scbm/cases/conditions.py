"""The condition of a simulated resource: what an injection can make of it (paper, Section VI; semantics 7.2)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction


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
