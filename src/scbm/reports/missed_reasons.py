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
    from scbm.reports.cover_advice import CoverAdvice
    from scbm.store import History
    from scbm.testing import CampaignResult


class Missed(Struct, frozen=True):
    """An obligation that no case visits.

    Attributes:
        obligation: the obligation.
        reason: what happened instead, as part of a sentence; or its status, and why it has it.
        command: the command that shows the shortest case that visits it, or why there is none.
        status: its status.
        sort: what happened instead, as a predicate about several obligations without their details: `are in no plan`.
        detail: what the reason says beyond that of others of the same sort: a guard, how many cases, what is lacking.
        advice: what would cover it; `None` if it has another status than undecided.
    """

    obligation: Obligation
    reason: str
    command: str
    status: Decision = Decision.UNDECIDED
    sort: str = ""
    detail: str = ""
    advice: CoverAdvice | None = None


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
        if status.decision is Decision.UNDECIDED:
            return reasons.why(status.obligation, command)
        words, decision = status.words, status.decision
        return Missed(status.obligation, words, command, decision, f"are {decision.words}", status.reason)

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

    def why(self, obligation: Obligation, command: str) -> Missed:
        """Return a missed obligation: how far the cases came, and what would cover it."""
        subject, advice = obligation.subject, self.advisor.advice(obligation)
        if obligation.aspect is Aspect.TAKEN:
            guard = self._guard(subject)
            words = "" if advice.means is CoverMeans.GUARDED else f"; {advice.about_one}"
            reason = f"its guard never held: {guard}{words}"
            return Missed(obligation, reason, command, sort="were never taken", detail=guard, advice=advice)
        planned, executed = self._cases(subject, Aspect.QUEUED), self._cases(subject, Aspect.EXECUTING)
        often = ""
        if not planned:
            one = f"in no plan of {counted(self.cases, 'case')}"
            sort, advice = f"are {one}", self.advisor.advice(Obligation(subject, Aspect.QUEUED))
        elif obligation.aspect is Aspect.DISABLED:
            one = "its precondition held whenever it was next in the plan"
            sort = "were ready whenever they were next in a plan"
        elif not executed:
            often, sort = f"planned in {counted(planned, 'case')}", "were planned, but never started"
            one, advice = f"{often}, but it never started", self.advisor.advice(Obligation(subject, Aspect.EXECUTING))
        else:
            often, never = f"executed in {counted(executed, 'case')}", _NEVER[obligation.aspect]
            one, sort = f"{often}, and it {never}", f"were executed, but {never}"
        is_injected = advice.means is CoverMeans.UNDISTURBED
        words = "an injection can disable it" if is_injected else advice.about_one.removeprefix("no plan needs it: ")
        detail = "; ".join(filter(None, (often, advice.missing)))
        return Missed(obligation, f"{one}: {words}", command, sort=sort, detail=detail, advice=advice)

    def _cases(self, subject: str, aspect: Aspect) -> int:
        return self.visits[Obligation(subject, aspect)]

    def _guard(self, name: str) -> str:
        return next(str(t.running_guard) for t in self.model.automatic_transitions if t.name == name)


_NEVER = {Aspect.FAILED: "never failed", Aspect.TIMEDOUT: "never timed out", Aspect.COMPLETED: "never completed"}
"""What did not happen to an operation that executed."""
