"""What the tests did with the edges of a picture: the status of the obligation that a run visits with an edge."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct, field

from scbm.cases.coverage import Coverage, Decision, Obligation, Obligations, ObligationStatus, visitors_of_each
from scbm.model.visible_text import counted
from scbm.reports.cover_advice import CampaignKind
from scbm.reports.figure_table import FORCED_MARK, STATUS_MARKS
from scbm.reports.missed_reasons import Missed, missed_reasons

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from scbm.closing.proved_statuses import StatusEvidence
    from scbm.model import BehaviorModel
    from scbm.store import History


class Paint(NamedTuple):
    """How a status is shown beside its colour, which has the name of the paint.

    Attributes:
        mark: the character beside names.
        dashes: the pattern of the lines of operations.
        dots: the pattern of the lines of automatic transitions.
        words: what the legend says.
    """

    mark: str
    dashes: str
    dots: str
    words: str


_PROVED = ("10 3 2 3", "1.5 3 1.5 8")
NO_PAINT = Paint("", "", "1.5 4", "")
PAINTS = {
    "missed": Paint(STATUS_MARKS[Decision.UNDECIDED], "6 4", "1.5 9", "missing"),
    "forced": Paint(FORCED_MARK, "14 3", "1.5 6", "visited in forced states only"),
    "waived": Paint(STATUS_MARKS[Decision.WAIVED], *_PROVED, "waived"),
    "excluded": Paint(STATUS_MARKS[Decision.EXCLUDED], *_PROVED, "proved: excluded by the planner"),
    "uncoverable": Paint(STATUS_MARKS[Decision.UNCOVERABLE], *_PROVED, "proved: uncoverable"),
    "visited": Paint(STATUS_MARKS[Decision.COVERED], "", "1.5 4", "covered"),
}
"""The paints by their names, that of the worst status first."""

_FEW = 5
"""Maximum number of cases or variables that are named."""


def few(names: Sequence[str]) -> str:
    """Return the first names, and how many others there are."""
    return ", ".join(names[:_FEW]) + (f" and {len(names) - _FEW} more" if len(names) > _FEW else "")


class EdgeStatuses(Struct, frozen=True):
    """The statuses that edges are painted with; empty without a store and without certificates.

    Attributes:
        known: the statuses of obligations.
        visitors: the cases that visit each obligation.
        missed: the missed obligations with their reasons.
    """

    known: Mapping[Obligation, ObligationStatus] = field(default_factory=dict)
    visitors: Mapping[Obligation, Sequence[str]] = field(default_factory=dict)
    missed: Mapping[Obligation, Missed] = field(default_factory=dict)

    @staticmethod
    def of_store(history: History) -> EdgeStatuses:
        """Return the statuses of a store, with the evidence that the command line has found for it."""
        missed = missed_reasons(history, history.source.path, CampaignKind.of_store(history))
        visitors = (tuple(history.labels[index] for index in each) for each in visitors_of_each(history.coverage))
        by_obligation = dict(zip(history.obligations, visitors, strict=True))
        return EdgeStatuses(history.statuses.by_obligation, by_obligation, {each.obligation: each for each in missed})

    @staticmethod
    def of_evidence(model: BehaviorModel, evidence: StatusEvidence) -> EdgeStatuses:
        """Return what certificates and waivers decide; nothing is missing, as there are no cases."""
        statuses = evidence.statuses(Coverage(Obligations.of(model), ()))
        return EdgeStatuses({e.obligation: e for e in statuses.entries if e.decision is not Decision.UNDECIDED})

    def paint(self, obligations: Iterable[Obligation]) -> str:
        """Return the name of the worst paint of some obligations; empty if none of them has a status."""
        found = [self._paint(self.known[each]) for each in obligations if each in self.known]
        return next((name for name in PAINTS if name in found), "")

    def share(self, obligations: Sequence[Obligation]) -> str:
        """Return ` 3 of 5` if three of five obligations are covered; empty if all are alike, or none has a status."""
        paints = [self._paint(self.known[each]) for each in obligations if each in self.known]
        covered = paints.count("visited")
        return f" {covered} of {len(paints)}" if len(dict.fromkeys(paints)) > 1 else ""

    def words(self, obligation: Obligation) -> str:
        """Return the status of an obligation with the cases that visit it, or why it is missing; empty if unknown."""
        if obligation not in self.known:
            return ""
        status, cases = self.known[obligation], self.visitors.get(obligation, ())
        if cases:
            return f"{PAINTS[self._paint(status)].words}: {counted(len(cases), 'case')}: {few(cases)}"
        missed = self.missed.get(obligation)
        if missed is not None and missed.status is Decision.UNDECIDED:
            return f"missing: {missed.reason}"
        return PAINTS["missed"].words if status.decision is Decision.UNDECIDED else status.words

    @staticmethod
    def _paint(status: ObligationStatus) -> str:
        if status.decision is Decision.COVERED:
            return "visited"
        if status.is_forced:
            return "forced"
        return "missed" if status.decision is Decision.UNDECIDED else status.decision.value
