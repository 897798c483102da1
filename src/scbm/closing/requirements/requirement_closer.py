"""Decides the built-in requirements of a model in all its runs (decision 53).

The graph of all runs decides where it is complete. What it finds violated counts only once a case shows it.
"""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.cases import Expectations
from scbm.cases.coverage import Decision
from scbm.cases.coverage.assumptions import assumptions
from scbm.closing.decisions import (
    DecidedRequirement,
    RequirementDecisions,
    RequirementStatus,
)
from scbm.closing.interruption import Interruption
from scbm.closing.proofs.proofs import scope_of_proofs
from scbm.closing.requirements.recovery_search import RecoverySearch
from scbm.closing.requirements.request_monitor import RequestMonitor, RequestSearch
from scbm.closing.runs.all_runs import AllRuns
from scbm.closing.scripts.case_scripts import CaseScripts
from scbm.closing.scripts.case_search import bounded
from scbm.model import InputError, Outcome, PlanSet
from scbm.model.requirements import BuiltIn
from scbm.planning import PlanCache
from scbm.testing import RandomCases, Shrinker, Tester
from scbm.testing.built_in_requirements import BUILT_INS
from scbm.testing.shrinking.shrinker import UnshrinkableError
from scbm.testing.verdicts import FailureKind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from scbm.cases import Case, OutcomeRule
    from scbm.closing.decisions import Closing
    from scbm.closing.requirements.recovery_search import MissedGoal
    from scbm.closing.requirements.request_monitor import ViolatingWalk
    from scbm.closing.runs.all_runs import CloseLimits, RunScope
    from scbm.model import BehaviorModel
    from scbm.testing import Campaign, Execution
    from scbm.testing.verdicts import Failure

_SEED = 1
_BESIDE = 4
"""A situation may occur beside so many memories of requests, on average; more count as incomplete."""

_NOT_SHOWN = "a run violates it, and no simulated case that was tried shows it"
_UNKNOWN_HELP = "a run waits, and the search was too long whether a change from outside leads it to its goal"
_INTERRUPTED = "closing was interrupted"
_IN_TIME = "recovers: a reply that comes is as fast as in the simulation, and no limit of time or plans ends the run."


class RequirementCloser:
    """Decides the built-in requirements of one model."""

    def __init__(
        self,
        model: BehaviorModel,
        limits: CloseLimits,
        progress: Callable[[str], None],
        interruption: Interruption | None = None,
    ) -> None:
        """Prepare the search.

        Args:
            model: the model.
            limits: the limits of exploration and search.
            progress: called with what is being decided, with counts.
            interruption: the handling of Ctrl-C, if the caller handles it.
        """
        self._model = model
        self._limits = limits
        self._interruption = interruption or Interruption()
        self._progress = self._interruption.checked(progress)
        self._tester = Tester(model)
        self._found: dict[str, Execution] = {}
        self._written: list[str] = []
        self._open: dict[str, tuple[str, str | None]] = {}
        self._situations = 0
        self._is_any_waiting = self._is_any_livelocked = False
        self._is_interrupted = False

    def decide(self, suite: Campaign, closing: Closing) -> RequirementDecisions:
        """Return the decisions.

        Args:
            suite: the executed suite.
            closing: the result of closing the obligations; its cases may violate requirements already.
        """
        off = dict(self._model.requirements_off)
        asked = [name for name in map(str, BUILT_INS) if name not in off]
        names = [case for case, _ in closing.after.cases]
        try:
            if asked and self._model.resources:
                with self._interruption.stage():
                    self._look_in_cases(suite, closing, asked)
                    self._follow_runs(asked)
        except KeyboardInterrupt:
            self._is_interrupted = True
            for name in asked:
                self._open.setdefault(name, (_INTERRUPTED, None))
        decided = tuple(self._decided(name, off, names) for name in map(str, BUILT_INS))
        holds = any(each.status is RequirementStatus.HOLDS for each in decided) and bool(self._model.resources)
        assumed = tuple(self._assumptions()) if holds else ()
        return RequirementDecisions(decided, self._situations, assumed, self._is_interrupted)

    # what is known already

    def _look_in_cases(self, suite: Campaign, closing: Closing, asked: Sequence[str]) -> None:
        """Keep the first run of the suite or of a new case that violates a requirement.

        A case from a file shows the violation as it is: closing writes no other one.
        """
        for cause in suite.summary.causes:
            failure = cause.failures[0]
            if failure.kind is FailureKind.BUILT_IN and failure.subject in asked:
                execution = self._tester.execute(suite.source.case(cause.positions[0]))
                self._keep(execution)
                if execution.case.origin is None:
                    self._written.append(execution.case.name)
        for made in closing.cases:
            self._keep(made.execution)

    def _keep(self, execution: Execution | None) -> None:
        """Keep a run for each built-in requirement that it violates, unless another one is known."""
        if execution is not None:
            for violation in execution.violations:
                if violation.is_built_in:
                    self._found.setdefault(violation.requirement, execution)

    # all runs

    def _follow_runs(self, asked: Sequence[str]) -> None:
        scope = replace(scope_of_proofs(self._model, self._model.runs.proved_plans), keeps_notes=True)
        closed = replace(scope, is_open=False)
        if any(name in asked for name in RequestMonitor.judges):
            runs = self._explored(scope)
            self._judge_requests(runs, [name for name in RequestMonitor.judges if name in asked])
        else:
            runs = self._explored(closed)
        if BuiltIn.RECOVERS.value in asked:
            self._judge_recovery(runs if runs.scope == closed else self._explored(closed))
        known = (*RequestMonitor.judges, BuiltIn.RECOVERS.value)
        for name in asked:
            if name not in known:
                self._open[name] = ("only verdicts of cases decide it", None)

    def _explored(self, scope: RunScope) -> AllRuns:
        runs = AllRuns(self._model, self._limits, self._progress, scope)
        if runs.is_interrupted:
            raise KeyboardInterrupt
        self._situations += runs.situations
        return runs

    def _judge_requests(self, runs: AllRuns, asked: Sequence[str]) -> None:
        self._progress("following the requests of all runs")
        monitor = RequestMonitor(self._model, runs.program)
        search = RequestSearch(runs, monitor, _BESIDE * self._limits.situations)
        violated = [name for name in search.violated() if name in asked]
        for name in asked:
            if name in violated:
                self._open[name] = (_NOT_SHOWN, None)
            elif not search.is_complete:
                self._open[name] = _why_incomplete(runs)
        wanted = tuple(name for name in violated if name not in self._found)
        if wanted:
            shown = self._with_canonical_plans(runs)
            search = RequestSearch(shown, monitor, _BESIDE * self._limits.situations)
            self._try_walks(shown, search.walks(wanted), wanted)
            self._try_random(wanted)

    def _judge_recovery(self, runs: AllRuns) -> None:
        self._progress("following the runs with one failed or missing reply")
        name = BuiltIn.RECOVERS.value
        search = RecoverySearch(runs, _BESIDE * self._limits.situations)
        missed = search.missed()
        if missed:
            self._open[name] = (_why_missed(missed), None)
        elif not search.is_complete:
            self._open[name] = _why_incomplete(runs)
        elif search.is_any_unknown:
            self._open[name] = (_UNKNOWN_HELP, None)
        self._is_any_waiting, self._is_any_livelocked = search.is_any_waiting, search.is_any_livelocked
        if missed and name not in self._found:
            shown = self._with_canonical_plans(runs)
            if shown is not runs:
                search = RecoverySearch(shown, _BESIDE * self._limits.situations)
                missed = search.missed()
            self._try_walks(shown, map(search.walk, missed), (name,))
            self._try_random((name,))
            others = [each.value for each in (BuiltIn.NO_ORPHAN, BuiltIn.READY_AGAIN) if each.value in self._found]
            if others:  # a run that violates these is not judged by `recovers`
                self._open[name] = (f"after one fault a run may miss its goal; repair {others[0]} first", None)

    def _with_canonical_plans(self, runs: AllRuns) -> AllRuns:
        """Return the runs that cases can follow: those of cases have canonical plans."""
        if runs.plans is PlanSet.CANONICAL:
            return runs
        return self._explored(replace(runs.scope, plans=PlanSet.CANONICAL))

    # cases

    def _try_walks(self, runs: AllRuns, walks: Iterator[ViolatingWalk], names: Sequence[str]) -> None:
        """Run cases that follow walks until one violates each requirement."""
        scripts = CaseScripts(self._model, runs.program, PlanCache(runs.planner))
        tried = dict.fromkeys(names, 0)
        for walk in walks:
            if all(name in self._found or tried[name] >= self._limits.candidates for name in names):
                return
            if walk.requirement not in self._found and tried[walk.requirement] < self._limits.candidates:
                tried[walk.requirement] += 1
                self._keep(bounded(self._tester, scripts.case(walk.path, walk.requirement, walk.missing)))

    def _try_random(self, names: Sequence[str]) -> None:
        """Run random cases until one violates each requirement."""
        if self._tester.planner.entry.is_external or all(name in self._found for name in names):
            return
        try:
            for case in islice(self._random_cases(), self._limits.candidates):
                self._keep(bounded(self._tester, case))
        except InputError:
            return  # no combination of random values is allowed

    def _random_cases(self) -> Iterator[Case]:
        random = RandomCases(self._model)
        yield from (random.case(_SEED, number) for number in range(1, self._limits.candidates + 1))

    # decisions

    def _decided(self, name: str, off: dict[str, str], taken: list[str]) -> DecidedRequirement:
        if name in off:
            return DecidedRequirement(name, RequirementStatus.OFF, off[name])
        if name in self._found:
            execution = self._found[name]
            is_written = execution.case.name in self._written
            if not is_written:
                execution = self._shrunk(name, execution, taken)
            made = None if is_written else execution
            reason = str(_failure(name, execution))
            return DecidedRequirement(name, RequirementStatus.VIOLATED, reason, execution.case.name, made)
        if name in self._open:
            reason, option = self._open[name]
            return DecidedRequirement(name, RequirementStatus.UNDECIDED, reason, option=option)
        return DecidedRequirement(name, RequirementStatus.HOLDS, self._where(name))

    def _where(self, name: str) -> str:
        if not self._model.resources:
            return "in all runs, as they send no requests"
        if name == BuiltIn.RECOVERS.value and (self._is_any_waiting or self._is_any_livelocked):
            parts = (
                ("wait for a change from outside", self._is_any_waiting),
                ("end in a livelock", self._is_any_livelocked),
            )
            others = " or ".join(words for words, is_any in parts if is_any)
            return f"in all runs that do not {others}; the others are not judged"
        if name == BuiltIn.RECOVERS.value and scope_of_proofs(self._model).is_open:
            return "in all runs in which nothing changes from outside"
        return "in all runs"

    def _shrunk(self, name: str, execution: Execution, taken: list[str]) -> Execution:
        """Return a small case that violates a requirement, run, under a new name."""
        number = 1
        while f"{name}-{number}" in taken:
            number += 1
        taken.append(f"{name}-{number}")
        self._progress(f"making a case small that violates {name}")
        execution = self._without_delays(name, execution)
        failure = _failure(name, execution)
        try:
            return Shrinker(self._tester).shrink(execution, failure, taken[-1]).execution
        except UnshrinkableError:
            return self._tester.execute(replace(execution.case, name=taken[-1]))

    def _without_delays(self, name: str, execution: Execution) -> Execution:
        """Return a run in which late replies are missing, if it violates the requirement; else the run as it is.

        A missed goal is excused after a missing reply, and not after a late one.
        """
        case = execution.case
        rules = tuple(
            replace(rule, outcome=Outcome.TIMEOUT, latency_ns=None) if _is_late(rule) else rule
            for rule in case.outcomes
        )
        plain = case.with_goals([replace(goal, expect=Expectations()) for goal in case.goals])
        other = bounded(self._tester, replace(plain, outcomes=rules))
        if other is None or all(violation.requirement != name for violation in other.violations):
            return execution
        return other

    def _assumptions(self) -> Iterator[str]:
        planner = self._tester.planner.name
        yield from assumptions(self._model, (Decision.EXCLUDED,), planner=planner)
        if BuiltIn.RECOVERS.value not in dict(self._model.requirements_off):
            yield _IN_TIME


def _is_late(rule: OutcomeRule) -> bool:
    """Return whether a rule makes successful replies come at another time, and says no more about them."""
    return rule.outcome in (None, Outcome.SUCCEED) and rule.latency_ns is not None and not rule.measured


def _failure(name: str, execution: Execution) -> Failure:
    failures = execution.verdict.failures
    return next(each for each in failures if each.kind is FailureKind.BUILT_IN and each.subject == name)


def _why_incomplete(runs: AllRuns) -> tuple[str, str | None]:
    if runs.stopped is not None:
        return f"not all runs were explored: {runs.stopped}", runs.option
    return "not all runs were explored: too many differ in their earlier requests", "--max-states"


def _why_missed(missed: Sequence[MissedGoal]) -> str:
    """Return why it is open whether each run with one fault reaches its goal, if no case shows one that does not."""
    endless = next((each.operations for each in missed if each.operations), ())
    if len(missed) == 1 and endless:
        return f"after one fault a run may repeat {', '.join(endless)} without end, if replies allow it each time"
    return "after one fault a run may miss its goal, and no simulated case that was tried shows it"
