"""The statuses of obligations by certificates and waivers, where these count (semantics 8.5)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases.coverage import Decision, Statuses, StatusProof, WaiverReview
from scbm.cases.coverage.assumptions import assumptions
from scbm.closing.certificate_files import proved_status
from scbm.model import GoalOrder

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.cases.case import CaseGoalNames
    from scbm.cases.coverage import Coverage
    from scbm.closing.certificate_files import CheckedCertificate
    from scbm.closing.decisions import Closing, Decided
    from scbm.model import BehaviorModel


class StatusEvidence(Struct, frozen=True):
    """The certificates and waivers that decide statuses beside the visits of cases.

    Attributes:
        model: the model that the proofs are about.
        proofs: the claims of sound certificates of this version of the model, by the names of their obligations.
        waivers: the waivers, on the day of the report.
        ignored: the certificates that do not count, one sentence each.
        sound: the certificates that count.
    """

    model: BehaviorModel
    proofs: dict[str, StatusProof]
    waivers: WaiverReview
    ignored: tuple[str, ...] = ()
    sound: tuple[CheckedCertificate, ...] = ()

    @staticmethod
    def of(checked: Iterable[CheckedCertificate], waivers: WaiverReview, model: BehaviorModel) -> StatusEvidence:
        """Return the evidence of checked certificates of a model and of waivers."""
        known = tuple(checked)
        sound = tuple(each for each in known if each.is_sound)
        ignored = tuple(each.why_ignored for each in known if not each.is_sound)
        return StatusEvidence(model, {}, waivers, ignored, sound).with_proofs(
            pair for each in sound for pair in claims_of(each)
        )

    def with_proofs(self, proofs: Iterable[tuple[str, StatusProof]]) -> StatusEvidence:
        """Return the evidence with more proofs by the names of obligations; a proof for any plans goes first."""
        united = dict(self.proofs)
        for name, proof in proofs:
            if name not in united or united[name].decision is Decision.EXCLUDED:
                united[name] = proof
        return replace(self, proofs=united)

    def statuses(self, coverage: Coverage, forced: int = 0, cases: Iterable[CaseGoalNames] = ()) -> Statuses:
        """Return the statuses of the obligations of a coverage.

        Args:
            coverage: the visits of the cases.
            forced: the obligations that only forced states visit, as bits.
            cases: the cases from files, as proofs may not be about their goals.
        """
        found = Statuses.of(coverage, self.proofs, self.waivers, self.ignored, forced)
        assumed = assumptions(self.model, [entry.decision for entry in found.entries])
        outside = tuple(self._outside(tuple(cases))) if assumed else ()
        return replace(found, assumptions=assumed, outside=outside)

    def _outside(self, cases: tuple[CaseGoalNames, ...]) -> Iterator[str]:
        """Yield a sentence about the goals that no proof is about, and one about cases with too many goals."""
        known = dict(self.model.goals)
        goals = dict.fromkeys(goal for case in cases for goal in case.goals if goal not in known)
        if goals:
            yield f"Proofs are about goals of the model, and not about {_few(tuple(goals))}"
        several = tuple(case.name for case in cases if len(case.goals) > 1)
        if several and self.model.runs.goals is GoalOrder.SINGLE:
            yield f"Proofs are about cases with one goal, and not about {_few(several)}"


_FEW = 5


def _few(names: tuple[str, ...]) -> str:
    more = f" and {len(names) - _FEW} more" if len(names) > _FEW else ""
    return f"{', '.join(names[:_FEW])}{more}"


def claims_of(checked: CheckedCertificate) -> Iterator[tuple[str, StatusProof]]:
    """Yield what a sound certificate proves: the names of obligations, each with its proof."""
    file = checked.file
    status, kind = proved_status(file.certificate), file.certificate.argument.kind
    for claim in checked.obligations:
        yield claim, StatusProof(status, file.reasons[claim], str(file.path), kind)


def with_waivers(closing: Closing, waivers: WaiverReview) -> Closing:
    """Return the result of closing in which undecided obligations with a waiver that counts are waived."""
    decided = tuple(_waived(each, waivers) for each in closing.decided)
    needless = waivers.needless(str(each.obligation) for each in decided if each.decision is Decision.COVERED)
    return replace(closing, decided=decided, visited_waivers=needless, expired_waivers=waivers.expired)


def _waived(decided: Decided, waivers: WaiverReview) -> Decided:
    waiver = waivers.of(decided.obligation)
    if waiver is None or decided.decision is not Decision.UNDECIDED:
        return decided
    return replace(decided, decision=Decision.WAIVED, reason=str(waiver))
