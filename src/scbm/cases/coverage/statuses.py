"""The status of each obligation, and the figure of what can be covered (semantics 8.5)."""

from __future__ import annotations

from collections import Counter
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING, assert_never

from msgspec import Struct

from scbm.cases.coverage.obligations import Figure
from scbm.cases.coverage.proof_engines import count_engines

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from scbm.cases.coverage.obligations import Obligation, Obligations
    from scbm.cases.coverage.visits import Coverage
    from scbm.model import Waiver


class Decision(StrEnum):
    """The status of an obligation: the first of these that holds, in this order (semantics 8.5)."""

    COVERED = "covered"
    UNCOVERABLE = "uncoverable"
    EXCLUDED = "excluded"
    WAIVED = "waived"
    UNDECIDED = "undecided"

    __hash__ = str.__hash__  # of equal value, and without a call of Python for each lookup

    @property
    def words(self) -> str:
        """The status in words, as reports write it."""
        match self:
            case Decision.EXCLUDED:
                return "excluded by the planner"
            case Decision.COVERED | Decision.UNCOVERABLE | Decision.WAIVED | Decision.UNDECIDED:
                return self.value
        assert_never(self)

    @property
    def can_be_covered(self) -> bool:
        """Whether the figure of what can be covered counts obligations of this status."""
        match self:
            case Decision.UNCOVERABLE | Decision.EXCLUDED | Decision.WAIVED:
                return False
            case Decision.COVERED | Decision.UNDECIDED:
                return True
        assert_never(self)

    @property
    def is_always_counted(self) -> bool:
        """Whether reports give the number of obligations of this status even if it is 0."""
        return self in (Decision.COVERED, Decision.UNCOVERABLE, Decision.UNDECIDED)


class StatusProof(Struct, frozen=True):
    """A checked proof that no run visits an obligation.

    Attributes:
        decision: `UNCOVERABLE` if it holds for any plans, else `EXCLUDED`.
        reason: why no run visits the obligation, one sentence without a full stop.
        certificate: the file or the name of the certificate.
        engine: the engine that found the proof; `None` if that is not known.
    """

    decision: Decision
    reason: str
    certificate: str
    engine: str | None = None


class WaiverReview(Struct, frozen=True):
    """The waivers of a model on one day.

    Attributes:
        counting: the waivers that count, in their order.
        expired: the waivers that do not count any more.
    """

    counting: tuple[Waiver, ...] = ()
    expired: tuple[Waiver, ...] = ()

    @staticmethod
    def on(today: str, waivers: Iterable[Waiver]) -> WaiverReview:
        """Return the waivers on the date `today`, such as `2026-11-23`."""
        known = tuple(waivers)
        return WaiverReview(
            tuple(waiver for waiver in known if not waiver.is_expired(today)),
            tuple(waiver for waiver in known if waiver.is_expired(today)),
        )

    def of(self, obligation: Obligation) -> Waiver | None:
        """Return the waiver of an obligation that counts; `None` if there is none."""
        name = str(obligation)
        return next((waiver for waiver in self.counting if waiver.obligation == name), None)

    def needless(self, covered: Iterable[str]) -> tuple[Waiver, ...]:
        """Return the waivers that count although cases cover their obligations, which have the names `covered`."""
        names = dict.fromkeys(covered)
        return tuple(waiver for waiver in self.counting if waiver.obligation in names)


FORCED_NOTE = "forced states visit it"
"""The note beside the status of an obligation that only forced states visit (semantics 8.5)."""


class ObligationStatus(Struct, frozen=True):
    """The status of one obligation.

    Attributes:
        obligation: the obligation.
        decision: its status.
        reason: why no run visits it, or why it is waived; empty if it is covered or undecided.
        certificate: the file or the name of the certificate, if one proves the status.
        is_visited: whether a case visits it, by a forced state or without; figures count this whatever the status is.
        engine: the engine that found the proof of the status, if there is one.
    """

    obligation: Obligation
    decision: Decision
    reason: str = ""
    certificate: str | None = None
    is_visited: bool = False
    engine: str | None = None

    @property
    def is_forced(self) -> bool:
        """Whether only forced states visit it."""
        return self.is_visited and self.decision is not Decision.COVERED

    @property
    def forced_in_words(self) -> str:
        """The status of an obligation that only forced states visit, with its reason; empty for any other one."""
        return self.words if self.is_forced else ""

    @property
    def words(self) -> str:
        """The status with its reason, and a note if only forced states visit the obligation."""
        reason = f": {self.reason}" if self.reason else ""
        return f"{self.decision.words}{reason}{f'; {FORCED_NOTE}' if self.is_forced else ''}"

    @property
    def marked(self) -> Decision:
        """The status whose mark reports show: what is undecided and visited by force counts as visited, with a note."""
        return Decision.COVERED if self.is_forced and self.decision is Decision.UNDECIDED else self.decision

    @property
    def is_plain(self) -> bool:
        """Whether visits without force alone decide the status."""
        return self.decision in (Decision.COVERED, Decision.UNDECIDED) and not self.is_forced


class Statuses(Struct, frozen=True, dict=True):
    """The status of each obligation of a model.

    Attributes:
        entries: one for each obligation, in the order of the model, *queued* included.
        visited_waivers: the waivers that count although cases cover their obligations; a visit in a forced state
            covers nothing, so it leaves a waiver in use.
        expired_waivers: the waivers that do not count any more.
        ignored: the certificates that do not count, each with the reason, one sentence each.
        contradicted: the proofs for any plans of obligations that cases visit, by the names of the obligations: the
            cell does what its model excludes.
        assumptions: what the proofs assume, one sentence each.
        outside: the cases and goals that the proofs are not about, one sentence each.
    """

    entries: tuple[ObligationStatus, ...]
    visited_waivers: tuple[Waiver, ...] = ()
    expired_waivers: tuple[Waiver, ...] = ()
    ignored: tuple[str, ...] = ()
    contradicted: tuple[tuple[str, StatusProof], ...] = ()
    assumptions: tuple[str, ...] = ()
    outside: tuple[str, ...] = ()

    @staticmethod
    def of(
        coverage: Coverage,
        proofs: Mapping[str, StatusProof] | None = None,
        waivers: WaiverReview | None = None,
        ignored: Sequence[str] = (),
        forced: int = 0,
    ) -> Statuses:
        """Return the statuses of the obligations of a coverage: of each the first that holds (semantics 8.5).

        Args:
            coverage: the visits of the cases.
            proofs: the proofs that count, by the names of their obligations.
            waivers: the waivers on the day of the report.
            ignored: the certificates that do not count, one sentence each.
            forced: the obligations that only forced states visit, as bits.
        """
        review = waivers or WaiverReview()
        by_name = {waiver.obligation: waiver for waiver in review.counting}
        rules = _StatusRules(coverage.obligations, coverage.visited, forced, proofs or {}, by_name)
        entries = tuple(map(rules.status, coverage.obligations))
        covered = [str(entry.obligation) for entry in entries if entry.decision is Decision.COVERED]
        visited = review.needless(covered)
        contradicted = tuple(
            (name, rules.proofs[name])
            for name in covered
            if name in rules.proofs and rules.proofs[name].decision is Decision.UNCOVERABLE
        )
        return Statuses(entries, visited, review.expired, tuple(ignored), contradicted)

    @cached_property
    def counts(self) -> dict[Decision, int]:
        """The number of obligations of each status, without *queued*."""
        return count_statuses(entry.decision for entry in self.entries if entry.obligation.counts)

    @cached_property
    def engines(self) -> dict[str, int]:
        """The number of obligations of each engine that proved the status of some, without *queued*."""
        return count_engines(entry.engine for entry in self.entries if entry.obligation.counts)

    @property
    def forced(self) -> int:
        """The number of obligations that only forced states visit, without *queued*."""
        return sum(entry.is_forced and entry.obligation.counts for entry in self.entries)

    @property
    def coverable(self) -> Figure:
        """The figure of what can be covered."""
        return coverable_figure(self.counts)

    @cached_property
    def by_obligation(self) -> dict[Obligation, ObligationStatus]:
        """The status of each obligation."""
        return {entry.obligation: entry for entry in self.entries}

    def decision(self, obligation: Obligation) -> Decision:
        """Return the status of an obligation of the model."""
        return self.by_obligation[obligation].decision

    @cached_property
    def are_plain(self) -> bool:
        """Whether visits alone decide all statuses, and nothing else is to be reported."""
        return not (
            any(not entry.is_plain for entry in self.entries)
            or self.visited_waivers
            or self.expired_waivers
            or self.ignored
            or self.contradicted
            or self.outside
        )

    def with_status(self, *decisions: Decision) -> tuple[ObligationStatus, ...]:
        """Return the obligations with one of these statuses, in the order of the model."""
        return tuple(entry for entry in self.entries if entry.decision in decisions)


class _StatusRules(Struct, frozen=True):
    """The rules of semantics 8.5 for one coverage."""

    obligations: Obligations
    visited: int
    forced: int
    proofs: Mapping[str, StatusProof]
    waivers: Mapping[str, Waiver]

    def status(self, obligation: Obligation) -> ObligationStatus:
        bit = self.obligations.bit(obligation)
        if self.visited & ~self.forced & bit:
            return ObligationStatus(obligation, Decision.COVERED, is_visited=True)
        is_visited = bool(self.visited & bit)
        proof = self.proofs.get(str(obligation))
        if proof is not None:
            return ObligationStatus(
                obligation, proof.decision, proof.reason, proof.certificate, is_visited, proof.engine
            )
        waiver = self.waivers.get(str(obligation))
        if waiver is not None:
            return ObligationStatus(obligation, Decision.WAIVED, str(waiver), is_visited=is_visited)
        return ObligationStatus(obligation, Decision.UNDECIDED, is_visited=is_visited)


def count_statuses(statuses: Iterable[Decision]) -> dict[Decision, int]:
    """Return the number of obligations of each status; each status has an entry, in the order of `Decision`."""
    counts = Counter(statuses)
    return {status: counts[status] for status in Decision}


def coverable_figure(counts: Mapping[Decision, int]) -> Figure:
    """Return the figure of what can be covered: covered of all that are not uncoverable, excluded or waived.

    Args:
        counts: the number of obligations of each status.
    """
    return Figure(counts[Decision.COVERED], sum(count for status, count in counts.items() if status.can_be_covered))


def forced_count_in_words(forced: int) -> str:
    """Return how many obligations only forced states visit; empty for none."""
    return f"{forced} visited in forced states only, which SCBM-IAS counts" if forced else ""


def visits_in_words(figure: Figure, forced: int, mark: str) -> str:
    """Return how many obligations are visited, and if there are forced ones, how many of each kind: both add up.

    `mark` is the character for forced visits in the report.
    """
    kinds = f": {figure.visited - forced} freely, {mark} {forced} in forced states only" if forced else ""
    return f"{figure.visited} of {figure.of} obligations visited{kinds}"


def status_counts_in_words(counts: Mapping[Decision, int]) -> str:
    """Return `86: 76 covered, 10 uncoverable, 0 undecided`; the other statuses are named if there are any."""
    shown = [f"{count} {status.words}" for status, count in counts.items() if count or status.is_always_counted]
    return f"{sum(counts.values())}: {', '.join(shown)}"
