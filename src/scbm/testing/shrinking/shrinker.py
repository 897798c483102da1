"""Shrinks a failing case: the result fails for the same reason, and needs each of its parts (decision 12).

A case is a list of choices: where it begins, what its goal is, each fault, injection and forced outcome. The shrinker
leaves choices out, all at once, then in halves, then one by one, and puts plainer ones in the place of others. After
each attempt it runs the case. Nothing is drawn, so the same case shrinks to the same case, everywhere.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases import Expectations
from scbm.cases.trace import End, PlanReceived, RunEnded
from scbm.model import InitialStates
from scbm.planning import DRAWN_PLANS
from scbm.running.simulation import TooLongError
from scbm.testing.requirement_monitors import find_violations
from scbm.testing.shrinking.case_sizes import choices_of, size_of
from scbm.testing.shrinking.relative_times import with_relative_times
from scbm.testing.shrinking.shrink_steps import STEPS, without_changes
from scbm.testing.verdicts import Failure, FailureKind, violation_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from scbm.cases import Case, OutcomeRule, RecordedPlan
    from scbm.cases.trace import Record
    from scbm.model import State
    from scbm.testing.shrinking.case_sizes import Choice, Size
    from scbm.testing.shrinking.shrink_steps import Step
    from scbm.testing.tester import Execution, Tester

MAX_RUNS = 2_000
"""Maximum number of attempts; the examples need less than a hundred."""

_MAX_SINGLES = 100
"""A rule for more requests than these stays one."""

_MORE_OF_ONE = 5_000
"""An attempt is given up when its trace has four times the records of the original, and so many more."""

MAX_RECORDS = 500_000
"""Maximum number of records in the traces of all attempts: five to ten seconds."""


class Shrunk(Struct, frozen=True):
    """The result of shrinking.

    Attributes:
        execution: the small case, run.
        failure: why it fails.
        before, after: the sizes, before with all that was drawn.
        runs: how many attempts were made.
        matters: the choices that are left and that matter, each alone.
    """

    execution: Execution
    failure: Failure
    before: Size
    after: Size
    runs: int
    matters: tuple[Choice, ...]


class UnshrinkableError(Exception):
    """A case fails only while its choices are drawn."""


class Shrinker:
    """Shrinks failing cases of one model."""

    def __init__(
        self, tester: Tester, most_runs: int = MAX_RUNS, accepts: Callable[[Execution], bool] = lambda _: True
    ) -> None:
        """Prepare the search.

        Args:
            tester: runs the cases.
            most_runs: the maximum number of runs.
            accepts: whether a run that fails for the same reason may take the place of a larger one.
        """
        self._tester = tester
        self._model = tester.model
        self._most_runs = most_runs
        self._accepts = accepts

    @staticmethod
    def can_shrink(failure: Failure) -> bool:
        """Return whether a smaller case can fail for the same reason.

        What a case expects, and a change that no maker can make, belong to that case alone. That a node was lost has
        nothing to do with the case.
        """
        return failure.kind not in (FailureKind.EXPECTATION, FailureKind.IMPOSSIBLE, FailureKind.LOST)

    def shrink(self, execution: Execution, failure: Failure, name: str | None = None) -> Shrunk:
        """Return the smallest case found that fails as `execution` did.

        Args:
            execution: a failed run.
            failure: which of its failures is kept.
            name: the name of the small case.

        Raises:
            UnshrinkableError: the case does not fail so once its random choices are written into it: what has not acted
                from outside until the end of the run could still have acted, and does not any more.
            ValueError: the run did not fail so, or `can_shrink` says no.
        """
        if not self.can_shrink(failure) or failure not in execution.verdict.failures:
            raise ValueError(f"{execution.case.name} cannot be shrunk by: {failure}")
        search = _ShrinkSearch(self._tester, execution, failure, self._most_runs, self._accepts)
        case = replace(
            _recorded_case(execution),
            name=name or f"small-{execution.case.name}",
            origin=None,
            recorded=None,
            expect=Expectations(),
            later=tuple(replace(goal, expect=Expectations()) for goal in execution.case.later),
            requirements=tuple(r for r in execution.case.requirements if _is_needed(r.name, failure)),
        )
        best = search.start(case)
        if best is None:
            raise UnshrinkableError(f"{execution.case.name} fails otherwise when its random choices are recorded")
        before = size_of(best, failure, self._model)
        best = search.with_relative_times(search.improve(best, without_changes))
        improved = True
        while improved:
            improved = False
            for step in STEPS:
                found = search.improve(best, step)
                improved = improved or found is not best
                best = found
        kept = next(f for f in best.verdict.failures if _cause(f, best) == search.cause)
        after = size_of(best, kept, self._model)
        return Shrunk(search.with_plans(best), kept, before, after, search.runs, tuple(search.what_matters(best)))


def _is_needed(requirement: str, failure: Failure) -> bool:
    return failure.kind is FailureKind.REQUIREMENT and requirement == failure.subject


def _recorded_case(execution: Execution) -> Case:
    """Return the case with all draws written into it, and one rule for each request."""
    case = execution.case
    if case.origin is not None:
        return execution.closed_case
    rules = (single for rule in case.outcomes for single in _singles(rule))
    return replace(case, outcomes=tuple(rules))


def _singles(rule: OutcomeRule) -> Iterator[OutcomeRule]:
    if rule.last is None or rule.last - rule.first >= _MAX_SINGLES:
        yield rule
    else:
        yield from (replace(rule, first=number, last=number) for number in range(rule.first, rule.last + 1))


class _ShrinkSearch:
    """Runs attempts, keeps smaller cases that fail for the same reason, and counts."""

    def __init__(
        self,
        tester: Tester,
        original: Execution,
        failure: Failure,
        most_runs: int,
        accepts: Callable[[Execution], bool],
    ) -> None:
        self._tester = tester
        self._accepts = accepts
        self._model = tester.model
        self._failure = failure
        self.cause = _cause(failure, original)
        self._initial = InitialStates(tester.model)
        self._is_forced = original.forced_by is not None
        self._begins_broken = _begins_broken(original, failure)
        self._most_runs = most_runs
        self._most_of_one = _MORE_OF_ONE + 4 * len(original.trace.records)
        is_drawn = original.trace.planner.name == DRAWN_PLANS
        self._plans = original.plans_to_keep if is_drawn else original.case.plans
        self._preferred: tuple[RecordedPlan, ...] = ()
        self._tried: dict[Case, None] = {}
        self._records = 0
        self.runs = 0

    def start(self, case: Case) -> Execution | None:
        """Run the closed case; return it if it fails for the same reason, under canonical plans or those of its run."""
        found = self._fails(case)
        if found is None and self._plans:
            self._preferred = self._plans
            found = self._fails(case)
        return found

    def with_plans(self, best: Execution) -> Execution:
        """Return the run with its plans in the case, if those of the original run matter."""
        return replace(best, case=replace(best.case, plans=best.answers)) if self._preferred else best

    def with_relative_times(self, best: Execution) -> Execution:
        """Return the run of the case with times that belong to events, if it fails for the same reason."""
        case = with_relative_times(best.case, best.trace.records, self._model)
        found = None if case == best.case else self._fails(case)
        return best if found is None or len(found.notes) > len(best.notes) else found

    def improve(self, best: Execution, step: Step) -> Execution:
        """Repeat a step as long as it leads to a smaller case, and return the smallest."""
        improved = True
        while improved:
            improved = False
            for case in step(best.case, self._model):
                if self._is_over:
                    return best
                found = self._attempt(case, best)
                if found is not None:
                    best, improved = found, True
                    break
        return best

    def _attempt(self, case: Case, best: Execution) -> Execution | None:
        """Return the run of a case if it is smaller than the smallest so far."""
        if case in self._tried:
            return None
        self._tried[case] = None
        found = self._fails(case)
        if found is None or len(found.notes) > len(best.notes):  # a run within the rates is preferred
            return None
        sizes = (size_of(run, self._failure, self._model) for run in (found, best))
        return found if next(sizes) < next(sizes) else None

    @property
    def _is_over(self) -> bool:
        return self.runs >= self._most_runs or self._records >= MAX_RECORDS

    def _may_begin(self, initial: State) -> bool:
        """Return whether a run may begin in a state; one that was forced before may begin anywhere."""
        return self._initial.can_begin(initial) or (self._is_forced and self._initial.allows(initial))

    def _fails(self, case: Case) -> Execution | None:
        if not self._may_begin(case.initial):
            return None
        self.runs += 1
        try:
            execution = self._tester.execute(replace(case, plans=()), self._most_of_one, self._preferred)
        except TooLongError:
            self._records += self._most_of_one
            return None
        self._records += len(execution.trace.records)
        if all(_cause(failure, execution) != self.cause for failure in execution.verdict.failures):
            return None
        if (execution.forced_by is not None and not self._is_forced) or not self._accepts(execution):
            return None
        # That a state is bad in which a run may begin is another reason than that a run leads to a bad one.
        return execution if self._begins_broken or not _begins_broken(execution, self._failure) else None

    def what_matters(self, best: Execution) -> Iterator[Choice]:
        """Return each remaining choice without which the case does not fail for the same reason.

        A choice is none of them if without it the requirement is violated in the same way, and only the rest of the
        run is too long, impossible or forced; nor is one that comes after the violation, or after the end of the run.
        """
        violation = violation_of(self._failure, best.violations)
        until = () if violation is None else best.trace.records[: violation.record + 1]
        until_ns = best.trace.records[-1].at_ns if violation is None else violation.at_ns
        for choice, case in choices_of(best.case, self._model):
            if self._is_over:
                return
            if (choice.at_ns or 0) > until_ns:
                continue
            if self._may_begin(case.initial) and self._fails(case) is None and not self._violates(case, until):
                yield choice

    def _violates(self, case: Case, until: Sequence[Record]) -> bool:
        """Return whether the run of a case begins with records that end with the violation, or has it elsewhere."""
        if not until:
            return False
        try:
            execution = self._tester.execute(replace(case, plans=()), self._most_of_one, self._preferred)
            records = execution.trace.records[: None if self._is_forced else execution.forced_by]
        except TooLongError as error:
            records = error.records
        if tuple(records[: len(until)]) == tuple(until):
            return True
        found = find_violations((*self._model.requirements, *case.requirements), records)
        violation = violation_of(self._failure, found)
        return violation is not None and (self._begins_broken or violation.record > 0)


def _cause(failure: Failure, execution: Execution) -> tuple[FailureKind, str]:
    """Return the kind and the subject of a failure; a run that has no plan at its time limit counts as unsolvable.

    Such a run ends later only because changes from outside were still due.
    """
    is_limit = failure.kind is FailureKind.NOT_REACHED and failure.subject == End.TIME_LIMIT.value
    lacks_plan = is_limit and _lacks_plan(execution.trace.records)
    return failure.kind, End.UNSOLVABLE.value if lacks_plan else failure.subject


def _lacks_plan(records: Sequence[Record]) -> bool:
    """Return whether a run for a goal ends at its time limit, and the planner has last proved that no plan exists."""
    status = ""
    for record in records:
        if isinstance(record, PlanReceived):
            status = record.status
        elif isinstance(record, RunEnded):
            if (status, record.end) == (End.UNSOLVABLE.value, End.TIME_LIMIT.value):
                return True
            status = ""
    return False


def _begins_broken(execution: Execution, failure: Failure) -> bool:
    """Return whether the initial state violates a requirement already."""
    violation = violation_of(failure, execution.violations)
    return violation is not None and violation.record == 0
