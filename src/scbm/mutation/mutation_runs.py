"""Runs a suite against mutants: each until the first case fails on it that passes on the original."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.cases.coverage import MutantStatus, Obligations
from scbm.model import InputError, State
from scbm.model.variables import operation_state_name
from scbm.mutation.evaluations import Evaluations
from scbm.mutation.mutant_obligations import MutantObligations, belonging, visited_ones
from scbm.mutation.mutant_results import MutantResult
from scbm.mutation.mutants import MutatedPart
from scbm.mutation.named_operations import values_of_current
from scbm.mutation.run_differences import RunDifferences

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.cases import Case
    from scbm.model import BehaviorModel, Predicate, StateSpace
    from scbm.mutation.mutant_obligations import MutantObligation
    from scbm.mutation.mutants import Mutant
    from scbm.testing.tester import Execution, Tester


class MutationRuns:
    """A suite that is run against mutants of one model.

    Attributes:
        cases: the cases that pass on the original; only they can kill.
        failing: the names of the others.
    """

    def __init__(
        self, original: Tester, cases: Iterable[Case], *, records: bool = False, finds_visitors: bool = False
    ) -> None:
        """Run the cases on the original model.

        Args:
            original: the tester of the original model.
            cases: the suite.
            records: whether cases without a recorded result are compared with what they did on the original.
            finds_visitors: whether a killed mutant is run further, until a case kills it that visits its obligation.

        Raises:
            InputError: a case does not fit the model.
        """
        self._original = original
        self.cases: list[Case] = []
        self.failing: list[str] = []
        self._finds_visitors = finds_visitors
        self._visited: list[int] = []
        self._obligations = MutantObligations(original.model, Obligations.of(original.model))
        evaluations = Evaluations(original.program)
        for case in cases:
            execution = original.execute(case)
            if execution.verdict.passed:
                self.cases.append(_with_record(case, execution) if records else case)
                self._visited.append(execution.result.visited)
                evaluations.add(execution)
            else:
                self.failing.append(case.name)
        self._differences = RunDifferences(original, evaluations)

    def results(self, mutants: Iterable[Mutant]) -> Iterator[MutantResult]:
        """Run the suite against each mutant; mutants that no case kills are undecided."""
        return map(self.result, mutants)

    def result(self, mutant: Mutant) -> MutantResult:
        """Run the suite against one mutant, until a case kills it; leave out runs that cannot differ."""
        under_test = self.under_test(mutant)
        obligations = self._obligations.of(mutant)
        belongs = belonging(obligations)
        runs = skipped = 0
        for number, case in enumerate(self.cases):
            if not under_test.may_differ(number, case):
                skipped += 1
                continue
            runs += 1
            reason = under_test.failure(case)
            if reason is not None:
                noticed = self._noticed(under_test, obligations, number) if self._finds_visitors else 0
                killed = MutantResult(mutant, MutantStatus.KILLED, case.name, reason, runs, skipped)
                return replace(killed, belongs=belongs, noticed=noticed)
        return MutantResult(mutant, MutantStatus.UNDECIDED, "", "", runs, skipped, belongs=belongs)

    def _noticed(self, under_test: MutantUnderTest, obligations: tuple[MutantObligation, ...], killer: int) -> int:
        """Return those of the obligations of a mutant that a case visits which kills it, as bits.

        Args:
            under_test: the mutant.
            obligations: the obligations that it belongs to.
            killer: the number of the first case that kills it.
        """
        noticed = visited_ones(obligations, self._visited[killer])
        for number in range(killer + 1, len(self.cases)):
            case = self.cases[number]
            gained = visited_ones(obligations, self._visited[number]) & ~noticed
            if gained and under_test.may_differ(number, case) and under_test.failure(case) is not None:
                noticed |= gained
        return noticed

    def under_test(self, mutant: Mutant) -> MutantUnderTest:
        """Return one mutant, to run cases on it one by one."""
        return MutantUnderTest(self._original, self._differences, mutant)


def _with_record(case: Case, execution: Execution) -> Case:
    """Return a case with the result of its run, unless it has one."""
    has_one = case.recorded is not None and case.recorded.goals
    return case if has_one else replace(case, recorded=execution.recorded)


class MutantUnderTest:
    """One mutant on which cases of a suite are run."""

    def __init__(self, original: Tester, differences: RunDifferences, mutant: Mutant) -> None:
        self._model = original.model
        self._mutant = mutant
        self._differences = differences
        self._plans_alike = differences.are_plans_alike(mutant)
        self._tester = original.of_mutant(mutant.model, plans_alike=self._plans_alike)
        self._differing = differences.in_runner(mutant, self._tester) | differences.in_verdict(mutant)

    def may_differ(self, number: int, case: Case) -> bool:
        """Return whether the run of a case, or its verdict, can differ from those on the original.

        Args:
            number: the number of the case among those that pass on the original, from 0.
            case: the case.
        """
        if self._differing >> number & 1 or self.missing(case) is not None:
            return True
        return not self._plans_alike and self._differences.in_plans(number, self._tester)

    def failure(self, case: Case) -> str | None:
        """Return why a case fails on the mutant, in one sentence; `None` if it passes."""
        missing = self.missing(case)
        if missing is not None:
            return f"the case names {missing}, which the mutant does not have"
        try:
            verdict = self.execute(case).verdict
        except InputError as error:
            return error.diagnostics[0].message
        return None if verdict.passed else str(verdict.failures[0])

    def execute(self, case: Case) -> Execution:
        """Run a case that names nothing that the mutant lacks. May raise `InputError`, as `Tester.execute` does."""
        return self._tester.execute(begun_as(self._mutant, case, self._model))

    def missing(self, case: Case) -> str | None:
        """Return what the case names that the mutant lacks, in words; `None` if there is no such thing."""
        return missing_name(self._mutant, case, self._model)


def begun_as(mutant: Mutant, case: Case, original: BehaviorModel) -> Case:
    """Return the case with the initial state that it has on a mutant.

    A variable with another nominal value begins with that value where it began with the nominal value of the original.
    Random values that a case drew are kept.
    """
    if MutatedPart.INITIAL not in mutant.parts:
        return case
    old, new = original.space[mutant.subject], mutant.model.space[mutant.subject]
    is_drawn = case.origin is not None and len(old.random) > 1
    if is_drawn or case.initial[old.name] != old.initial:
        return case
    return replace(case, initial=State(case.initial.space, {**case.initial, old.name: new.initial}))


def missing_name(mutant: Mutant, case: Case, original: BehaviorModel) -> str | None:
    """Return the operation that a case names and a mutant does not have; `None` if it has all.

    The file of such a case could not be read for the mutant.
    """
    if MutatedPart.OPERATIONS not in mutant.parts:
        return None
    name = mutant.subject
    if any(operation.name == name for operation in mutant.model.operations):
        return None  # it has only changed its place
    return name if _names(case, name, original.running_space) else None


def _names(case: Case, operation: str, space: StateSpace) -> bool:
    """Return whether a case names an operation anywhere."""
    state = operation_state_name(operation)
    assigned = [name for injection in case.injections for name, _ in injection.assign]
    listed = [rule.subject for rule in case.outcomes]
    for goal in case.goals:
        listed += [*(goal.expect.plan or ()), *goal.expect.order]
        listed += [visit.subject for visit in goal.expect.visits]
    predicates = tuple(_predicates(case))
    read = [name for predicate in predicates for name in predicate.reads()]
    compared = values_of_current(predicates, space)
    return operation in (*listed, *compared) or state in (*assigned, *read)


def _predicates(case: Case) -> Iterator[Predicate]:
    yield from (injection.when for injection in case.injections if injection.when is not None)
    for goal in case.goals:
        yield goal.predicate
        yield from () if goal.when is None else (goal.when,)
        yield from goal.expect.final
    for requirement in case.requirements:
        yield from requirement.sentence.predicates
