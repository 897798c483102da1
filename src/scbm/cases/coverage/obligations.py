"""Coverage obligations and figures (paper, Section V; semantics 8.1 to 8.3).

Obligations are the states and transitions that the tests of a model must visit. A figure counts how many they visited;
its percentage never rounds up to 100 or down to 0.
"""

from __future__ import annotations

from enum import StrEnum
from functools import lru_cache
from typing import TYPE_CHECKING

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.model import BehaviorModel

_SMALLEST = 0.01
"""The smallest percentage other than 0: figures have two decimals."""


class Figure(Struct, frozen=True):
    """A number of visited obligations, `visited`, out of a total, `of`."""

    visited: int
    of: int

    @property
    def percent(self) -> float | None:
        """The percentage with two decimals; `None` if there is no obligation (semantics 8.3)."""
        if not self.of:
            return None
        if self.visited in (0, self.of):
            return 100.0 * (self.visited == self.of)
        rounded = round(100 * self.visited / self.of, 2)
        return min(max(rounded, _SMALLEST), 100 - _SMALLEST)

    @property
    def is_complete(self) -> bool:
        """Whether every obligation was visited."""
        return self.visited == self.of

    def __str__(self) -> str:
        return "not measurable" if self.percent is None else f"{self.percent:.2f} %"


class Aspect(StrEnum):
    """The aspect of an operation or of an automatic transition that must be visited."""

    DISABLED = "disabled"
    EXECUTING = "executing"
    TIMEDOUT = "timedout"
    FAILED = "failed"
    COMPLETED = "completed"
    TAKEN = "taken"
    QUEUED = "queued"

    __hash__ = str.__hash__  # of equal value, and without a call of Python for each lookup


STATE_ASPECTS = (Aspect.DISABLED, Aspect.EXECUTING, Aspect.FAILED, Aspect.TIMEDOUT, Aspect.COMPLETED)
"""The five states of an operation, in the order of the paper's report."""


class Obligation(Struct, frozen=True):
    """One aspect of one operation, or the taking of one automatic transition."""

    subject: str
    aspect: Aspect

    @property
    def counts(self) -> bool:
        """Whether the paper's figure counts it; it does not count *queued*."""
        return self.aspect is not Aspect.QUEUED

    def __str__(self) -> str:
        return f"automatic/{self.subject}" if self.aspect is Aspect.TAKEN else f"{self.subject}/{self.aspect}"


class Obligations:
    """All obligations of a model, in a fixed order; in a set that is an integer, bit i stands for obligation i."""

    def __init__(self, obligations: Iterable[Obligation]) -> None:
        self.all = tuple(obligations)
        self._bits = {obligation: 1 << index for index, obligation in enumerate(self.all)}
        self._bits_by_name = {(o.subject, o.aspect): bit for o, bit in self._bits.items()}

    @staticmethod
    def of(model: BehaviorModel) -> Obligations:
        """Return all obligations of `model`.

        Each operation has one for each of its five states and *queued*; each automatic transition has *taken*.
        """
        operations = tuple(operation.name for operation in model.operations)
        return _obligations(operations, tuple(transition.name for transition in model.automatic_transitions))

    def __iter__(self) -> Iterator[Obligation]:
        return iter(self.all)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Obligations) and self.all == other.all

    def __hash__(self) -> int:
        return hash(self.all)

    def bit(self, obligation: Obligation) -> int:
        """Return the bit of `obligation`; 0 if it is not an obligation of this model."""
        return self._bits.get(obligation, 0)

    def bit_of(self, subject: str, aspect: Aspect) -> int:
        """Return the bit of the obligation with this subject and aspect; 0 if there is none."""
        return self._bits_by_name.get((subject, aspect), 0)

    def mask(self, *aspects: Aspect) -> int:
        """Return the bits of all obligations with one of `aspects`."""
        return sum(bit for obligation, bit in self._bits.items() if obligation.aspect in aspects)

    @property
    def counted(self) -> int:
        """The bits of all obligations that the paper's figure counts."""
        return sum(bit for obligation, bit in self._bits.items() if obligation.counts)

    def figure(self, bits: int) -> Figure:
        """Return the paper's figure for the set of visited obligations `bits`."""
        counted = self.counted
        return Figure((bits & counted).bit_count(), counted.bit_count())

    def names(self, bits: int) -> tuple[str, ...]:
        """Return the names of the obligations in the set `bits`."""
        return tuple(str(obligation) for obligation, bit in self._bits.items() if bits & bit)


@lru_cache(maxsize=8)
def _obligations(operations: Sequence[str], automatic: Sequence[str]) -> Obligations:
    """Return the obligations of operations and automatic transitions; most models of a process have the same names."""
    return Obligations(
        (
            *(Obligation(name, aspect) for name in operations for aspect in STATE_ASPECTS),
            *(Obligation(name, Aspect.TAKEN) for name in automatic),
            *(Obligation(name, Aspect.QUEUED) for name in operations),
        )
    )
