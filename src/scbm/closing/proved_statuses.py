"""What certificates and waivers say about the statuses of obligations, where they count (semantics 9.4)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from scbm.cases.coverage import Decision, Statuses, StatusProof, WaiverReview

if TYPE_CHECKING:
    from collections.abc import Iterable

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
    """

    proofs: dict[str, StatusProof]
    waivers: WaiverReview
    ignored: tuple[str, ...] = ()

    @staticmethod
    def of(checked: Iterable[CheckedCertificate], waivers: WaiverReview) -> StatusEvidence:
        """Return the evidence of checked certificates and of waivers."""
        proofs: dict[str, StatusProof] = {}
        ignored = []
        for each in checked:
            if each.is_sound:
                for name, proof in _claims(each):
                    known = proofs.get(name)
                    if known is None or known.decision is Decision.EXCLUDED:
                        proofs[name] = proof
            else:
                ignored.append(each.why_ignored)
        return StatusEvidence(proofs, waivers, tuple(ignored))

    def statuses(self, coverage: Coverage) -> Statuses:
        """Return the statuses of the obligations of a coverage."""
        return Statuses.of(coverage, self.proofs, self.waivers, self.ignored)


def _claims(checked: CheckedCertificate) -> Iterable[tuple[str, StatusProof]]:
    status, name = proved_status(checked.file.certificate), str(checked.file.path)
    for claim in checked.file.certificate.claims:
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
