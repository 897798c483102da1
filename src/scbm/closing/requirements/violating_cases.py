"""Cases that violate requirements: those that are known, those that walks and random draws give, each made small."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from msgspec.structs import replace

from scbm.cases import CaseLimits, Expectations
from scbm.closing.requirements.endless_runs import EndlessRuns
from scbm.closing.scripts.case_scripts import CaseScripts
from scbm.closing.scripts.case_search import bounded
from scbm.closing.scripts.chosen_plans import ChosenPlans
from scbm.model import InputError, Outcome, PlanSet, RunPlans
from scbm.model.requirements import LeadsTo
from scbm.planning import PlanCache
from scbm.running.untimed.relevance import Relevance
from scbm.testing import RandomCases, Shrinker, Tester
from scbm.testing.continuations.reachable_goals import LIMIT_ENDS
from scbm.testing.random_cases import most_goals
from scbm.testing.shrinking.shrinker import UnshrinkableError
from scbm.testing.verdicts import FailureKind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from scbm.cases import Case, OutcomeRule
    from scbm.closing.decisions import Closing
    from scbm.closing.requirements.violation_search import ViolatingWalk
    from scbm.closing.runs.all_runs import AllRuns
    from scbm.model import BehaviorModel, Requirement
    from scbm.model.requirements import RequirementForm
    from scbm.testing import Campaign, Execution
    from scbm.testing.requirement_monitors import Violation
    from scbm.testing.verdicts import Failure

_SEED = 1

MOST_RANDOM_RECORDS = 50_000
"""Maximum number of records of all random cases that are tried at once: a second or two, also if runs take hours."""


class RequirementKey(NamedTuple):
    """What identifies a requirement: a built-in one may be called as one of the user."""

    name: str
    is_built_in: bool = False


class ViolatingCases:
    """The runs that violate requirements of one model, one for each requirement.

    Attributes:
        tester: runs the cases.
    """

    def __init__(
        self,
        model: BehaviorModel,
        extra: Sequence[Requirement],
        most: int,
        progress: Callable[[str], None],
        suffix: str = "",
    ) -> None:
        """Know no case yet.

        Args:
            model: the model.
            extra: requirements beside those of the model, which each new case gets.
            most: the maximum number of cases that are tried for one requirement.
            progress: called with what is being done.
            suffix: what the names of new cases have after the name of the requirement.
        """
        self.tester = Tester(model)
        self._model = model
        self._extra = tuple(extra)
        self._most = most
        self._progress = progress
        self._suffix = suffix
        self._found: dict[RequirementKey, Execution] = {}
        self._written: list[str] = []
        requirements = (*model.requirements, *extra)
        self._untimed = {r.name: r.sentence.reads() for r in requirements if _is_untimed(r.sentence)}

    def __contains__(self, key: RequirementKey) -> bool:
        return key in self._found

    def look_in(self, suite: Campaign, closing: Closing, others: ViolatingCases) -> None:
        """Keep the first run of the suite or of a new case that shows a violation of each requirement.

        A case from a file shows the violation as it is: closing writes no other one. `others` gets the cases with other
        plans than those of the planner.
        """
        for cause in suite.summary.causes:
            failure = cause.failures[0]
            key = RequirementKey(failure.subject, failure.kind is FailureKind.BUILT_IN)
            for position in cause.positions[: self._most] if failure.kind in _KINDS else ():
                if key in self._found:
                    break
                execution = self.tester.execute(self._with_extra(suite.source.case(position)))
                cases = self if self._is_planned(execution) else others
                cases.keep(execution)
                if execution.case.origin is None:
                    cases._written.append(execution.case.name)  # noqa: SLF001 - of the same class
        for made in closing.cases:
            self.keep(self.tester.execute(self._with_extra(made.case)))  # it was made with canonical plans

    def _is_planned(self, execution: Execution) -> bool:
        """Return whether a run has plans of the planner of the model: those of its case may be other ones."""
        case = execution.case
        if not case.plans:
            return True
        preferred = case.plans if self._model.runs.plans is RunPlans.DRAWN else ()
        again = bounded(self.tester, replace(case, plans=()), preferred=preferred)
        return again is not None and again.answers == execution.answers

    def keep(self, execution: Execution | None) -> None:
        """Keep a run for each requirement that it violates, unless another one is known.

        What a forced state violates is no fault of the model.
        """
        if execution is not None:
            for violation in execution.violations:
                key = RequirementKey(violation.requirement, violation.is_built_in)
                if self._shows(key, execution):
                    self._found.setdefault(key, execution)

    def _shows(self, key: RequirementKey, execution: Execution) -> bool:
        """Return whether a run of the model shows that a requirement is violated: without force, and by its goals.

        A run that a limit ended shows that q stays due only if it waited for nothing else, or went round.
        """
        goals = dict(self._model.goals)
        if any(goals.get(goal.name) != goal.predicate for goal in execution.case.goals):
            return False
        violated = (v for v in execution.violations if (v.requirement, v.is_built_in) == key)
        return any(
            (execution.forced_by is None or each.record < execution.forced_by) and self._is_endless(each, execution)
            for each in violated
        )

    def _is_endless(self, violation: Violation, execution: Execution) -> bool:
        """Return whether a run shows a violation although a limit ended it."""
        if violation.is_built_in or violation.requirement not in self._untimed:
            return True
        if execution.verdict.end not in LIMIT_ENDS:
            return True
        reads = self._untimed[violation.requirement]
        program = self.tester.program
        names = Relevance(program.model, program.packing, also=reads).names
        return EndlessRuns(program, names).shows(execution.trace.records, violation.begins)

    def try_walks(self, runs: AllRuns, walks: Iterator[ViolatingWalk], keys: Sequence[RequirementKey]) -> None:
        """Run cases that follow walks until one violates each requirement."""
        chosen = ChosenPlans(runs) if runs.plans is PlanSet.ANY else None
        scripts = CaseScripts(self._model, runs.program, PlanCache(runs.planner), chosen)
        by_name = {key.name: key for key in keys}
        tried = dict.fromkeys(by_name, 0)
        for walk in walks:
            if all(key in self._found or tried[name] >= self._most for name, key in by_name.items()):
                return
            if by_name[walk.requirement] not in self._found and tried[walk.requirement] < self._most:
                tried[walk.requirement] += 1
                case = scripts.case(walk.path, walk.requirement, walk.missing)
                if walk.goes_round:
                    self._try(_without_end(case))
                if by_name[walk.requirement] not in self._found:
                    self._try(case)

    def _try(self, case: Case) -> None:
        self.keep(self._run(self._with_extra(case)))

    def _run(self, case: Case) -> Execution | None:
        """Return the run of a case with the plans of the case as far as they are plans; its case has all plans then."""
        execution = bounded(self.tester, replace(case, plans=()), preferred=case.plans)
        if execution is None or not case.plans:
            return execution
        return replace(execution, case=replace(execution.case, plans=execution.answers))

    def try_random(self, keys: Iterable[RequirementKey]) -> None:
        """Run random cases until one violates each requirement, or they have many records."""
        wanted, left = tuple(keys), MOST_RANDOM_RECORDS
        if self.tester.planner.entry.is_external:
            return
        random = RandomCases(self._model, goals=most_goals(self._model))
        for number in range(1, self._most + 1):
            if all(key in self._found for key in wanted) or left <= 0:
                return
            try:
                case = random.case(_SEED, number)
            except InputError:
                return  # no combination of random values is allowed
            execution = bounded(self.tester, self._with_extra(case), left)
            left -= left if execution is None else len(execution.trace.records)
            self.keep(execution)

    def smallest(self, key: RequirementKey, taken: list[str]) -> tuple[Execution, bool]:
        """Return a run that violates a requirement, and whether it is new: then it is small, and has a new name."""
        execution = self._found[key]
        if execution.case.name in self._written:
            return execution, False
        base, number = f"{key.name}{self._suffix}", 1
        while f"{base}-{number}" in taken:
            number += 1
        taken.append(f"{base}-{number}")
        self._progress(f"making a case small that violates {key.name}")
        execution = self._without_delays(key, execution)
        try:
            shrinker = Shrinker(self.tester, accepts=partial(self._shows, key))
            small = shrinker.shrink(execution, failure_of(key, execution), taken[-1]).execution
        except UnshrinkableError:
            small = self.tester.execute(replace(execution.case, name=taken[-1]))
        return small, True

    def _without_delays(self, key: RequirementKey, execution: Execution) -> Execution:
        """Return a run in which late replies are missing, if it violates the requirement; else the run as it is.

        A missed goal is excused after a missing reply, and not after a late one.
        """
        case = execution.case
        if not any(map(_is_late, case.outcomes)):
            return execution
        rules = tuple(
            replace(rule, outcome=Outcome.TIMEOUT, latency_ns=None) if _is_late(rule) else rule
            for rule in case.outcomes
        )
        plain = case.with_goals([replace(goal, expect=Expectations()) for goal in case.goals])
        other = self._run(replace(plain, outcomes=rules))
        return execution if other is None or not self._shows(key, other) else other

    def _with_extra(self, case: Case) -> Case:
        """Return the case with the extra requirements alone: those of a written case may be called alike."""
        return replace(case, requirements=self._extra) if self._extra else case


_KINDS = (FailureKind.BUILT_IN, FailureKind.REQUIREMENT)


def _is_untimed(sentence: RequirementForm) -> bool:
    return isinstance(sentence, LeadsTo) and sentence.within_ns is None


def failure_of(key: RequirementKey, execution: Execution) -> Failure:
    """Return the failure of a run that violates a requirement."""
    kind = FailureKind.BUILT_IN if key.is_built_in else FailureKind.REQUIREMENT
    return next(each for each in execution.verdict.failures if each.kind is kind and each.subject == key.name)


def _without_end(case: Case) -> Case:
    """Return the case without a limit of its own; the last rule of each subject is about all later requests."""
    last = {rule.subject: rule for rule in case.outcomes}
    rules = tuple(replace(rule, last=None) if rule is last[rule.subject] else rule for rule in case.outcomes)
    return replace(case, outcomes=rules, limits=CaseLimits())


def _is_late(rule: OutcomeRule) -> bool:
    """Return whether a rule makes successful replies come at another time, and says no more about them."""
    return rule.outcome in (None, Outcome.SUCCEED) and rule.latency_ns is not None and not rule.measured
