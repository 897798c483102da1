"""The reasons for missed obligations, as far as visits show them, with the command that explains each."""

from __future__ import annotations

from dataclasses import dataclass
from shlex import quote
from typing import TYPE_CHECKING

from scbm.cases.coverage import Aspect, Obligation
from scbm.model import format_duration
from scbm.reports.figure_table import counted, shown_path

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.cases.coverage import Coverage
    from scbm.model import BehaviorModel


_FEW_CASES = 20
"""Fewer cases than this say little about the goals and initial states of a model."""


@dataclass(frozen=True, slots=True)
class Missed:
    """An obligation that no case visits.

    Attributes:
        obligation: which.
        reason: what happened instead, a part of a sentence.
        command: the command that shows the shortest case that visits it, or why there is none.
    """

    obligation: Obligation
    reason: str
    command: str


def missed_reasons(model: BehaviorModel, coverage: Coverage, file: str) -> tuple[Missed, ...]:
    """All that is missing, in the order of the model; what is beside the figure (queued) comes last.

    Args:
        model: the model.
        coverage: what was visited.
        file: the model file, for the commands.
    """
    visits = coverage.visits()
    reasons = _MissedReasons(model, visits, len(coverage.cases))
    missed = (*coverage.missed(), *coverage.missed(Aspect.QUEUED))
    return tuple(Missed(o, reasons.why(o), f"scbm explain {shown_path(file)} {quote(str(o))}") for o in missed)


def close_command(file: str) -> str:
    """The command that decides all that is missing, and writes the cases for it."""
    return f"scbm close {shown_path(file)} --out closed"


@dataclass(frozen=True)
class _MissedReasons:
    model: BehaviorModel
    visits: Mapping[Obligation, int]
    cases: int

    def why(self, obligation: Obligation) -> str:
        """Why an obligation is missing."""
        subject = obligation.subject
        if obligation.aspect is Aspect.TAKEN:
            return f"its guard never held: {self._guard(subject)}"
        planned, executed = self._cases(subject, Aspect.QUEUED), self._cases(subject, Aspect.EXECUTING)
        if not planned:
            more = "" if self.cases >= _FEW_CASES else "more cases, "
            return (
                f"in no plan of {counted(self.cases, 'case')}: {more}another goal or another initial state may need it"
            )
        if obligation.aspect is Aspect.DISABLED:
            return "it could start whenever its turn came: an injection in between can keep it from that"
        if not executed:
            return f"planned in {counted(planned, 'case')}, but it never started"
        return f"executed in {counted(executed, 'case')}, {self._instead(obligation)}"

    def _instead(self, obligation: Obligation) -> str:
        """What did not happen to an operation that executed."""
        deadline_ns = self.model.operation(obligation.subject).deadline_ns
        if obligation.aspect is Aspect.FAILED:
            return "and nothing failed it"
        if obligation.aspect is Aspect.COMPLETED:
            return "and it never completed"
        if deadline_ns is None:
            return "and it has no `deadline`, so it never times out"
        return f"never beyond its deadline of {format_duration(deadline_ns)}"

    def _cases(self, subject: str, aspect: Aspect) -> int:
        return self.visits[Obligation(subject, aspect)]

    def _guard(self, name: str) -> str:
        return next(str(t.running_guard) for t in self.model.automatic_transitions if t.name == name)
