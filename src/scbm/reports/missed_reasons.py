"""The reasons why cases missed obligations: how far they came, and what would cover the rest; with a command each."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.coverage import Aspect, Decision, Obligation
from scbm.model.visible_text import counted, shell_word, shown_path
from scbm.reports.cover_advice import CampaignKind, CoverAdvisor, CoverMeans

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.cases.coverage import ObligationStatus
    from scbm.model import BehaviorModel
    from scbm.store import History
    from scbm.testing import CampaignResult


class Missed(Struct, frozen=True):
    """An obligation that no case visits.

    Attributes:
        obligation: the obligation.
        reason: what happened instead, as part of a sentence; or its status, and why it has it.
        command: the command that shows the shortest case that visits it, or why there is none.
    """

    obligation: Obligation
    reason: str
    command: str
    status: Decision = Decision.UNDECIDED


def missed_reasons(result: CampaignResult | History, file: str, kind: CampaignKind) -> tuple[Missed, ...]:
    """Return all missed obligations in the order of the model; `queued` ones come last, as they are not in SCBM-IAS.

    Those that are proved or waived are among them, though forced states may visit them.

    Args:
        result: what the cases showed.
        file: the model file, for the commands.
        kind: the kind of the cases.
    """
    model, coverage = result.model, result.coverage
    advisor = CoverAdvisor(model, coverage, kind)
    reasons = _MissedReasons(model, coverage.visits(), coverage.count, advisor)

    def missed(status: ObligationStatus) -> Missed:
        command = f"scbm explain {shown_path(file)} {shell_word(str(status.obligation))}"
        reason = reasons.why(status.obligation) if status.decision is Decision.UNDECIDED else status.words
        return Missed(status.obligation, reason, command, status.decision)

    found = [status for status in result.statuses.entries if status.marked is not Decision.COVERED]
    return tuple(missed(status) for status in sorted(found, key=lambda status: not status.obligation.counts))


def close_command(file: str) -> str:
    """Return the command that decides all missed obligations, and writes cases for them."""
    return f"scbm close {shown_path(file)} --out closed"


class _MissedReasons(Struct, frozen=True):
    model: BehaviorModel
    visits: Mapping[Obligation, int]
    cases: int
    advisor: CoverAdvisor

    def why(self, obligation: Obligation) -> str:
        """Return how far the cases came, and what would cover the obligation."""
        advice = self.advisor.advice(obligation)
        subject = obligation.subject
        if obligation.aspect is Aspect.TAKEN:
            never = f"its guard never held: {self._guard(subject)}"
            return never if advice.means is CoverMeans.GUARDED else f"{never}; {advice.about_one}"
        planned, executed = self._cases(subject, Aspect.QUEUED), self._cases(subject, Aspect.EXECUTING)
        if not planned:
            queued = self.advisor.advice(Obligation(subject, Aspect.QUEUED)).about_one
            return f"in no plan of {counted(self.cases, 'case')}: {queued.removeprefix('no plan needs it: ')}"
        if obligation.aspect is Aspect.DISABLED:
            how = "an injection can disable it" if advice.means is CoverMeans.UNDISTURBED else advice.about_one
            return f"its precondition held whenever it was next in the plan: {how}"
        if not executed:
            start = self.advisor.advice(Obligation(subject, Aspect.EXECUTING)).about_one
            return f"planned in {counted(planned, 'case')}, but it never started: {start}"
        return f"executed in {counted(executed, 'case')}, {_INSTEAD[obligation.aspect]}: {advice.about_one}"

    def _cases(self, subject: str, aspect: Aspect) -> int:
        return self.visits[Obligation(subject, aspect)]

    def _guard(self, name: str) -> str:
        return next(str(t.running_guard) for t in self.model.automatic_transitions if t.name == name)


_INSTEAD = {
    Aspect.FAILED: "and it never failed",
    Aspect.TIMEDOUT: "and it never timed out",
    Aspect.COMPLETED: "and it never completed",
}
"""What did not happen to an operation that executed."""
