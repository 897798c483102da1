"""What certificates and waivers say about the statuses of obligations, where they count (semantics 9.4)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from scbm.cases.coverage import Decision, Statuses, StatusProof, WaiverReview

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.cases.coverage import Coverage
    from scbm.closing.certificate_files import CheckedCertificate
    from scbm.closing.decisions import Closing, Decided
    from scbm.proofcheck import Certificate


def proved_status(certificate: Certificate) -> Decision:
    """Return the status that a sound certificate gives its obligations: it depends on the plans that it is about."""
    return Decision.UNCOVERABLE if certificate.is_for_any_plan else Decision.EXCLUDED


@dataclass(frozen=True, slots=True)
class StatusEvidence:
    """What decides statuses beside the visits of cases.

    Attributes:
        proofs: the claims of sound certificates of this version of the model, by the names of their obligations.
        waivers: the waivers, on the day of the report.
        ignored: the certificates that do not count, one sentence each.
        sound: the certificates that count.
    """

    proofs: dict[str, StatusProof]
    waivers: WaiverReview
    ignored: tuple[str, ...] = ()
    sound: tuple[CheckedCertificate, ...] = ()

    @staticmethod
    def of(checked: Iterable[CheckedCertificate], waivers: WaiverReview) -> StatusEvidence:
        """Return the evidence of checked certificates and of waivers."""
        known = tuple(checked)
        sound = tuple(each for each in known if each.is_sound)
        ignored = tuple(each.why_ignored for each in known if not each.is_sound)
        return StatusEvidence({}, waivers, ignored, sound).with_proofs(
            pair for each in sound for pair in claims_of(each)
        )

    def with_proofs(self, proofs: Iterable[tuple[str, StatusProof]]) -> StatusEvidence:
        """Return the evidence with more proofs by the names of obligations; a proof for any plans goes first."""
        united = dict(self.proofs)
        for name, proof in proofs:
            if name not in united or united[name].decision is Decision.EXCLUDED:
                united[name] = proof
        return replace(self, proofs=united)

    def statuses(self, coverage: Coverage, forced: int = 0) -> Statuses:
        """Return the statuses of the obligations of a coverage; `forced` are those that only forced states visit."""
        return Statuses.of(coverage, self.proofs, self.waivers, self.ignored, forced)


def claims_of(checked: CheckedCertificate) -> Iterator[tuple[str, StatusProof]]:
    """Yield what a sound certificate proves: the names of obligations, each with its proof."""
    yield from proofs_of(checked.file.certificate, str(checked.file.path))


def proofs_of(certificate: Certificate, name: str) -> Iterator[tuple[str, StatusProof]]:
    """Yield what a certificate proves if it is sound; `name` is its file or its name."""
    status = proved_status(certificate)
    for claim in certificate.claims:
        yield claim.obligation, StatusProof(status, claim.reason, name)


def with_waivers(closing: Closing, waivers: WaiverReview) -> Closing:
    """Return the result of closing in which undecided and forced obligations with a waiver that counts are waived."""
    decided = tuple(_waived(each, waivers) for each in closing.decided)
    visited = {str(d.obligation) for d in closing.decided if closing.after.visited & closing.bit(d.obligation)}
    needless = tuple(waiver for waiver in waivers.counting if waiver.obligation in visited)
    return replace(closing, decided=decided, visited_waivers=needless, expired_waivers=waivers.expired)


def _waived(decided: Decided, waivers: WaiverReview) -> Decided:
    waiver = waivers.of(decided.obligation)
    if waiver is None or decided.decision not in (Decision.UNDECIDED, Decision.FORCED):
        return decided
    return replace(decided, decision=Decision.WAIVED, reason=str(waiver))
