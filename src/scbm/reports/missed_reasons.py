"""The reasons why cases missed obligations, as far as visits show them, with the command that explains each."""

from __future__ import annotations

from dataclasses import dataclass
from shlex import quote
from typing import TYPE_CHECKING

from scbm.cases.coverage import Aspect, Decision, Obligation
from scbm.model import format_duration
from scbm.reports.figure_table import counted, shown_path

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.cases.coverage import Coverage, ObligationStatus, Statuses
    from scbm.model import BehaviorModel


_FEW_CASES = 20
"""Fewer cases than this say little about the goals and initial states of a model."""


@dataclass(frozen=True, slots=True)
class Missed:
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


def missed_reasons(model: BehaviorModel, coverage: Coverage, file: str, statuses: Statuses) -> tuple[Missed, ...]:
    """Return all missed obligations in the order of the model; `queued` ones come last, as they are not in SCBM-IAS.

    Those that are proved or waived are among them, though forced states may visit them.

    Args:
        model: the model.
        coverage: the visits of the cases.
        file: the model file, for the commands.
        statuses: the statuses of the obligations.
    """
    reasons = _MissedReasons(model, coverage.visits(), coverage.count, has_few_cases(coverage))

    def missed(status: ObligationStatus) -> Missed:
        command = f"scbm explain {shown_path(file)} {quote(str(status.obligation))}"
        reason = reasons.why(status.obligation) if status.decision is Decision.UNDECIDED else status.words
        return Missed(status.obligation, reason, command, status.decision)

    found = [status for status in statuses.entries if status.marked is not Decision.COVERED]
    return tuple(missed(status) for status in sorted(found, key=lambda status: not status.obligation.counts))


def has_few_cases(coverage: Coverage) -> bool:
    """Return whether cases, written or random, are so few that more of them may visit what these missed."""
    return coverage.count < _FEW_CASES


def close_command(file: str) -> str:
    """Return the command that decides all missed obligations, and writes cases for them."""
    return f"scbm close {shown_path(file)} --out closed"


@dataclass(frozen=True)
class _MissedReasons:
    model: BehaviorModel
    visits: Mapping[Obligation, int]
    cases: int
    are_few: bool

    def why(self, obligation: Obligation) -> str:
        """Return why an obligation is missing."""
        subject = obligation.subject
        if obligation.aspect is Aspect.TAKEN:
            return f"its guard never held: {self._guard(subject)}"
        planned, executed = self._cases(subject, Aspect.QUEUED), self._cases(subject, Aspect.EXECUTING)
        if not planned:
            more = "more cases, " if self.are_few else ""
            return (
                f"in no plan of {counted(self.cases, 'case')}: {more}another goal or another initial state may need it"
            )
        if obligation.aspect is Aspect.DISABLED:
            return "its precondition held whenever it was next in the plan: an injection can disable it"
        if not executed:
            return f"planned in {counted(planned, 'case')}, but it never started"
        return f"executed in {counted(executed, 'case')}, {self._instead(obligation)}"

    def _instead(self, obligation: Obligation) -> str:
        """Return what did not happen to an operation that executed."""
        deadline_ns = self.model.operation(obligation.subject).deadline_ns
        if obligation.aspect is Aspect.FAILED:
            return "and it never failed"
        if obligation.aspect is Aspect.COMPLETED:
            return "and it never completed"
        if deadline_ns is None:
            return "and it has no `deadline`, so it never times out"
        return f"never beyond its deadline of {format_duration(deadline_ns)}"

    def _cases(self, subject: str, aspect: Aspect) -> int:
        return self.visits[Obligation(subject, aspect)]

    def _guard(self, name: str) -> str:
        return next(str(t.running_guard) for t in self.model.automatic_transitions if t.name == name)
