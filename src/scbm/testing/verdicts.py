"""Whether a case passed (semantics 7.4)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from scbm.cases.trace import End, ResourceChanged, run_end
from scbm.model import Outcome
from scbm.running import describe_cycle
from scbm.testing.expectation_check import find_unmet

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases import Case, Reaction
    from scbm.cases.trace import Record
    from scbm.testing.requirement_monitors import Violation


class FailureKind(StrEnum):
    """Why a case can fail."""

    REQUIREMENT = "requirement"
    EXPECTATION = "expectation"
    LIVELOCK = "livelock"
    MODEL_ERROR = "model_error"
    NOT_REACHED = "not_reached"
    LOST = "lost"


@dataclass(frozen=True, slots=True)
class Failure:
    """One reason to call a case failed.

    Attributes:
        kind: the sort of reason.
        subject: what of that sort: the requirement, the key of the expectation, or the end of the run.
        message: a sentence.
    """

    kind: FailureKind
    subject: str
    message: str

    def __str__(self) -> str:
        return self.message

    def is_like(self, other: Failure) -> bool:
        """Whether the reason is the same; time and values may differ."""
        return self.kind is other.kind and self.subject == other.subject


@dataclass(frozen=True, slots=True)
class Verdict:
    """How a case ended, and why it failed if it did.

    Attributes:
        end: the end of the run.
        failures: the reasons to call the case failed; none if it passed.
    """

    end: End
    failures: tuple[Failure, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether the case passed."""
        return not self.failures


@dataclass(frozen=True, slots=True)
class Outcomes:
    """The parts of a run that its verdict depends on.

    Attributes:
        end: how it ended.
        records: what happened.
        reactions: what happened to its requests.
        violations: the requirements that were broken.
        visited: the names of the obligations that it visited.
        real: the real resources, whose behaviour the tester did not cause.
    """

    end: End
    records: Sequence[Record]
    reactions: Sequence[Reaction]
    violations: Sequence[Violation]
    visited: Sequence[str]
    real: Sequence[str] = ()


def lost(why: str) -> Verdict:
    """Return the verdict on a case whose run was not finished; `why` is a clause."""
    return Verdict(End.LOST, (Failure(FailureKind.LOST, End.LOST.value, f"the run was not finished: {why}"),))


def judge(case: Case, run: Outcomes) -> Verdict:
    """Return the verdict on a run, from its end, its violations, and the faults that were caused."""
    return Verdict(run.end, tuple(_failures(case, run)))


def _failures(case: Case, run: Outcomes) -> Iterator[Failure]:
    for violation in run.violations:
        yield Failure(FailureKind.REQUIREMENT, violation.requirement, str(violation))
    for key, message in find_unmet(case.expect, run.end, run.records, run.visited):
        yield Failure(FailureKind.EXPECTATION, key, message)
    if case.expect.verdict is not None:
        return  # how it ends is expected, or complained of already
    if run.end in (End.LIVELOCK, End.MODEL_ERROR):
        yield Failure(FailureKind(run.end.value), run.end.value, _described(run.end, run.records))
    elif run.end is not End.REACHED and not _disturbed(case, run):
        ended = run.end.replace("_", " ")
        message = f"the goal was not reached ({ended}), and nothing was made to go wrong{_but_for_real(run)}"
        yield Failure(FailureKind.NOT_REACHED, run.end.value, message)


def _disturbed(case: Case, run: Outcomes) -> bool:
    """Whether a fault was caused: an injection, a fault of the network, a failure, or a missing reply.

    Over nodes, one that simulates a resource may be lost and come back, though the case does not say so. That a message
    or a slow reaction is no fault. A real resource has no caused faults (decision 30).
    """
    if case.injections or case.network.partitions or case.network.restarts:
        return True
    return any(name not in run.real for name in _went_wrong(run))


def _went_wrong(run: Outcomes) -> Iterator[str]:
    """Return the resources that failed, sent no reply, or were lost, and those that lost messages."""
    for record in run.records:
        if isinstance(record, ResourceChanged) and record.injection == "network":
            yield record.resource
    for reaction in run.reactions:
        if reaction.outcome is not Outcome.SUCCEED or any(
            d is not None and len(d) != 1 for d in (reaction.request, reaction.reply, reaction.cancel)
        ):
            yield reaction.resource


def _but_for_real(run: Outcomes) -> str:
    """Return the faults of real resources, as the end of a sentence."""
    names = [f"`{name}`" for name in dict.fromkeys(_went_wrong(run))]
    if not names:
        return ""
    was, is_ = ("was", "is") if len(names) == 1 else ("were", "are")
    return f"; {', '.join(names)} failed, did not answer, or {was} lost, and {is_} real"


def _described(end: End, records: Sequence[Record]) -> str:
    last = run_end(records)
    detail = () if last is None else last.detail
    if end is End.LIVELOCK:
        return describe_cycle(detail)
    return f"the model is wrong: {', '.join(detail)}"
