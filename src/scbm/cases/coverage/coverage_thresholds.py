"""Thresholds: the least percentage of the obligations of one kind that is required (semantics 8.3)."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.coverage.obligations import STATE_ASPECTS, Aspect, Figure

if TYPE_CHECKING:
    from scbm.cases.coverage.visits import Coverage


KINDS = {"all": None, **{aspect.value: aspect for aspect in STATE_ASPECTS}, "automatic": Aspect.TAKEN,
         "queued": Aspect.QUEUED}  # fmt: skip
"""The kinds of a threshold that visits alone decide, by the names on the command line; `all` is the paper's figure."""


COVERABLE = "coverable"
"""The kind of a threshold for the figure of what can be covered, which depends on statuses."""


ASSERTED = "asserted"
"""The kind of a threshold for the figure of asserted obligations, which depends on results of mutants."""


LIFTED = "lifted"
"""The kind of a threshold for the figure of lifted obligations, which a model with parameters has."""


class Threshold(Struct, frozen=True):
    """The least percentage of the obligations of one kind that must be visited.

    Attributes:
        percent: from 0 to 100.
        kind: one of `KINDS`, `COVERABLE`, `ASSERTED`, or `LIFTED`.
    """

    percent: float
    kind: str = "all"

    def figure(
        self,
        coverage: Coverage,
        coverable: Figure | None = None,
        asserted: Figure | None = None,
        lifted: Figure | None = None,
    ) -> Figure:
        """Return the figure that is compared with the threshold.

        Args:
            coverage: the visits of the cases.
            coverable: the figure of what can be covered; by default everything can be covered.
            asserted: the figure of asserted obligations; by default nothing is known of any.
            lifted: the figure of lifted obligations; by default that of all, as in a model without parameters.
        """
        if self.kind == ASSERTED:
            return asserted or Figure(0, 0)
        if self.kind == COVERABLE:
            return coverable or coverage.figure
        if self.kind == LIFTED:
            return lifted or coverage.figure
        aspect = KINDS[self.kind]
        return coverage.figure if aspect is None else coverage.figure_of(aspect)

    def is_met(
        self,
        coverage: Coverage,
        coverable: Figure | None = None,
        asserted: Figure | None = None,
        lifted: Figure | None = None,
    ) -> bool:
        """Return whether a figure reaches the threshold; one of no obligations never does. See `figure`."""
        figure = self.figure(coverage, coverable, asserted, lifted)
        wanted = Fraction(str(self.percent)) * figure.of  # the decimal as written, not the nearest binary fraction
        return bool(figure.of) and 100 * figure.visited >= wanted
