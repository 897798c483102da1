"""Whether a case passed (semantics 7.4): its expectations compared with its run, and clauses without effect.

A clause is without effect if its injection never acted, or if the request of its outcome was never sent.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

from scbm.cases import Network
from scbm.cases.trace import (
    BecameCurrent,
    End,
    InjectionApplied,
    OperationStepped,
    PlanReceived,
    RequestSent,
    ResourceChanged,
    run_end,
    state_after,
)
from scbm.model import OperationState, Outcome, format_duration, format_moment, format_value
from scbm.running import describe_cycle

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases import Case, Expectations, Reaction
    from scbm.cases.trace import Record
    from scbm.model import Predicate, Value
    from scbm.testing.requirement_monitors import Violation


_ARROW = " → "


def find_unmet(
    expect: Expectations, end: End, records: Sequence[Record], visited: Sequence[str]
) -> Iterator[tuple[str, str]]:
    """Yield the key of each expectation that is not met, with the difference between expectation and run."""
    if expect.verdict not in (None, end):
        yield "verdict", f"expected the run to end {_words(expect.verdict)}, and it ended {_words(end)}"
    if expect.plan is not None:
        yield from (("plan", message) for message in _plan(expect.plan, records))
    if expect.order:
        yield from (("order", message) for message in _order(expect.order, records))
    if expect.final:
        state = state_after(records)
        yield from (("final", _final(predicate, state)) for predicate in expect.final if not predicate.holds(state))
    for obligation in expect.visits:
        if str(obligation) not in visited:
            near = [name for name in visited if name.startswith(f"{obligation.subject}/")]
            visited = f"; of {obligation.subject} it visited {', '.join(near)}" if near else ""
            yield "visits", f"expected a visit to {obligation}, and the run made none{visited}"


def _words(end: End | None) -> str:
    return f"`{end}`"


def _plan(expected: tuple[str, ...], records: Sequence[Record]) -> Iterator[str]:
    plans = (record for record in records if isinstance(record, PlanReceived))
    first = next(plans, None)
    if first is None or first.status != "solved":
        found = "none was asked for" if first is None else f"the planner answered `{first.status}`"
        yield f"expected the plan {_listed(expected)}, and {found}"
    elif first.plan != expected:
        yield f"expected the plan {_listed(expected)}, and the first plan is {_listed(first.plan)}: " + _difference(
            expected, first.plan
        )


def _listed(operations: tuple[str, ...]) -> str:
    return _ARROW.join(operations) or "with no operations"


def _difference(expected: tuple[str, ...], found: tuple[str, ...]) -> str:
    """Return the first index at which two lists differ."""
    number = next(
        (n for n, (a, b) in enumerate(zip(expected, found, strict=False)) if a != b), min(len(expected), len(found))
    )
    parts = [plan[number] if number < len(plan) else "nothing" for plan in (expected, found)]
    return f"operation {number + 1} should be {parts[0]} and is {parts[1]}"


def _order(expected: tuple[str, ...], records: Sequence[Record]) -> Iterator[str]:
    """Return the first operation that does not complete behind its predecessors, as a sentence."""
    completed = [r for r in records if isinstance(r, OperationStepped) and r.target is OperationState.COMPLETED]
    position = 0
    for number, name in enumerate(expected):
        found = next((i for i in range(position, len(completed)) if completed[i].operation == name), None)
        if found is None:
            behind = f" behind {expected[number - 1]}" if number else ""
            happened = _ARROW.join(f"{r.operation} at {format_moment(r.at_ns)}" for r in completed) or "none"
            yield (
                f"expected {_ARROW.join(expected)} to complete in this order, and {name} does not complete{behind}; "
                f"completed: {happened}"
            )
            return
        position = found + 1


def _final(predicate: Predicate, state: dict[str, Value]) -> str:
    values = ", ".join(f"{name} == {format_value(state[name])}" for name in predicate.reads())
    return f"expected {predicate} at the end, and it ends with {values or 'something else'}"


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
        message = f"the goal was not reached ({ended}), and no fault was injected{_but_for_real(run)}"
        yield Failure(FailureKind.NOT_REACHED, run.end.value, message)


def _disturbed(case: Case, run: Outcomes) -> bool:
    """Whether a fault was caused: an injection, a fault of the network, a failure, or a missing reply.

    Over nodes, one that simulates a resource may be lost and come back, though the case does not say so. That a message
    or a slow reaction is no fault. A real resource has no caused faults (decision 30).
    """
    if case.injections or case.network.kept != Network():
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


def find_unused(case: Case, records: Sequence[Record]) -> tuple[str, ...]:
    """Yield a sentence for each injection that never acted, each rule of requests never sent, and each late fault."""
    if not (case.injections or case.outcomes or any(case.network.windows())):
        return ()
    return (*_injections(case, records), *_outcomes(case, records), *_faults(case, records))


def _injections(case: Case, records: Sequence[Record]) -> Iterator[str]:
    acted = [r.injection for r in records if isinstance(r, (InjectionApplied, ResourceChanged))]
    for injection in case.injections:
        if injection.name not in acted:
            yield f"injection {injection.name} never acted"


def _outcomes(case: Case, records: Sequence[Record]) -> Iterator[str]:
    sent = _count(records)
    last_numbers: dict[str, int] = {}
    for rule in case.outcomes:
        number = rule.first if rule.last is None else rule.last
        last_numbers[rule.subject] = max(number, last_numbers.get(rule.subject, 0))
    for subject, number in last_numbers.items():
        count = sent.get(subject, 0)
        if number > count:
            requests = f"{count} request{'' if count == 1 else 's'}"
            yield f"the outcome of request {number} of {subject} was not used: {requests} sent"


def _faults(case: Case, records: Sequence[Record]) -> Iterator[str]:
    """Yield the network faults that begin after the end of the run; drawn ones do not count."""
    if case.origin is not None:
        return
    ended_ns = records[-1].at_ns
    for fault, _, window in case.network.windows():
        if window.at_ns > ended_ns:
            yield f"the {fault.window_name} at {format_duration(window.at_ns)} comes after the end of the run"


def _count(records: Sequence[Record]) -> dict[str, int]:
    """Return the number of requests to each resource, and of requests during each operation."""
    sent: dict[str, int] = {}
    operation: str | None = None
    for record in records:
        match record:
            case BecameCurrent():
                operation = record.operation
            case OperationStepped(target=OperationState.INITIAL):
                operation = None
            case RequestSent():
                sent[record.resource] = sent.get(record.resource, 0) + 1
                if operation is not None and operation != record.resource:
                    sent[operation] = sent.get(operation, 0) + 1
            case _:
                continue
    return sent
