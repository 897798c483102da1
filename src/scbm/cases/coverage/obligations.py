"""What the tests of a model must visit (paper, Section V; semantics 8.1 and 8.2).

How much of something was visited. A figure is a value; it never rounds up to all or down to nothing.

How much has to be visited, of everything or of one kind.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from fractions import Fraction
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.cases.coverage.visits import Coverage
    from scbm.model import BehaviorModel

_SMALLEST = 0.01
"""The last digit that is shown, in per cent."""


@dataclass(frozen=True, slots=True)
class Figure:
    """`visited` of `of`."""

    visited: int
    of: int

    @property
    def percent(self) -> float | None:
        """With two digits behind the point; `None` if there is nothing to measure (semantics 8.3)."""
        if not self.of:
            return None
        if self.visited in (0, self.of):
            return 100.0 * (self.visited == self.of)
        rounded = round(100 * self.visited / self.of, 2)
        return min(max(rounded, _SMALLEST), 100 - _SMALLEST)

    @property
    def is_complete(self) -> bool:
        """Whether all was visited."""
        return self.visited == self.of

    def __str__(self) -> str:
        return "not measurable" if self.percent is None else f"{self.percent:.2f} %"


class Aspect(StrEnum):
    """What of an operation or of an automatic transition must be visited."""

    DISABLED = "disabled"
    EXECUTING = "executing"
    TIMEDOUT = "timedout"
    FAILED = "failed"
    COMPLETED = "completed"
    TAKEN = "taken"
    QUEUED = "queued"


STATE_ASPECTS = (Aspect.DISABLED, Aspect.EXECUTING, Aspect.FAILED, Aspect.TIMEDOUT, Aspect.COMPLETED)
"""The five states of an operation, in the order of the paper's report."""


@dataclass(frozen=True, slots=True)
class Obligation:
    """One aspect of one operation, or the taking of one automatic transition."""

    subject: str
    aspect: Aspect

    @property
    def counts(self) -> bool:
        """Whether it is in the paper's figure; *queued* is reported beside it."""
        return self.aspect is not Aspect.QUEUED

    def __str__(self) -> str:
        return f"automatic/{self.subject}" if self.aspect is Aspect.TAKEN else f"{self.subject}/{self.aspect}"


class Obligations:
    """All obligations of a model, in a fixed order. Obligation i is bit i wherever sets of them are integers."""

    def __init__(self, obligations: Iterable[Obligation]) -> None:
        self.all = tuple(obligations)
        self._bits = {obligation: 1 << index for index, obligation in enumerate(self.all)}
        self._bits_by_name = {(o.subject, o.aspect): bit for o, bit in self._bits.items()}

    @staticmethod
    def of(model: BehaviorModel) -> Obligations:
        """Five for each operation, one for each automatic transition, and *queued* for each operation."""
        operations = [operation.name for operation in model.operations]
        return Obligations(
            (
                *(Obligation(name, aspect) for name in operations for aspect in STATE_ASPECTS),
                *(Obligation(transition.name, Aspect.TAKEN) for transition in model.automatic_transitions),
                *(Obligation(name, Aspect.QUEUED) for name in operations),
            )
        )

    def __iter__(self) -> Iterator[Obligation]:
        return iter(self.all)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Obligations) and self.all == other.all

    def __hash__(self) -> int:
        return hash(self.all)

    def bit(self, obligation: Obligation) -> int:
        """The bit of an obligation; 0 if it is none of this model."""
        return self._bits.get(obligation, 0)

    def bit_of(self, subject: str, aspect: Aspect) -> int:
        """The same, by the parts of its name."""
        return self._bits_by_name.get((subject, aspect), 0)

    def mask(self, *aspects: Aspect) -> int:
        """The bits of all obligations of some aspects."""
        return sum(bit for obligation, bit in self._bits.items() if obligation.aspect in aspects)

    @property
    def counted(self) -> int:
        """The bits of all obligations in the paper's figure."""
        return sum(bit for obligation, bit in self._bits.items() if obligation.counts)

    def figure(self, bits: int) -> Figure:
        """The paper's figure of a set: visited of all obligations that count."""
        counted = self.counted
        return Figure((bits & counted).bit_count(), counted.bit_count())

    def names(self, bits: int) -> tuple[str, ...]:
        """The names of the obligations in a set."""
        return tuple(str(obligation) for obligation, bit in self._bits.items() if bits & bit)


KINDS = {"all": None, **{aspect.value: aspect for aspect in STATE_ASPECTS}, "automatic": Aspect.TAKEN,
         "queued": Aspect.QUEUED}  # fmt: skip
"""What a threshold can be for, by the words of people; `all` is the paper's figure."""


@dataclass(frozen=True, slots=True)
class Threshold:
    """So many per cent of one kind have to be visited.

    Attributes:
        percent: from 0 to 100.
        kind: one of `KINDS`.
    """

    percent: float
    kind: str = "all"

    def figure(self, coverage: Coverage) -> Figure:
        """The figure that it is about."""
        aspect = KINDS[self.kind]
        return coverage.figure if aspect is None else coverage.figure_of(aspect)

    def is_met(self, coverage: Coverage) -> bool:
        """Whether so much was visited; nothing to visit meets no threshold, as nothing is measured then."""
        figure = self.figure(coverage)
        wanted = Fraction(str(self.percent)) * figure.of  # what was written, and not the binary fraction beside it
        return bool(figure.of) and 100 * figure.visited >= wanted
