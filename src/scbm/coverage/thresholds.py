"""How much has to be visited, of everything or of one kind."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING

from scbm.coverage.obligations import STATE_ASPECTS, Aspect

if TYPE_CHECKING:
    from scbm.coverage.coverage import Coverage
    from scbm.coverage.figures import Figure

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
