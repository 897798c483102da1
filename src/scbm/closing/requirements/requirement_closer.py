"""Decides the requirements of a model in all its runs: the built-in ones, and those of the user (decisions 53, 67).

The graph of all runs decides where it is complete. What it finds violated counts only once a case shows it.
"""

from __future__ import annotations

from functools import partial
from itertools import islice
from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.cases.coverage import Decision
from scbm.cases.coverage.assumptions import assumptions
from scbm.closing.decisions import (
    DecidedRequirement,
    RequirementDecisions,
    RequirementStatus,
)
from scbm.closing.few_collections import few_collections
from scbm.closing.interruption import Interruption
from scbm.closing.proofs.proofs import scope_of_proofs
from scbm.closing.requirements.blocking_search import BlockingSearch
from scbm.closing.requirements.other_plan_violations import TOO_MANY, OtherPlanViolations
from scbm.closing.requirements.recovery_search import RecoverySearch
from scbm.closing.requirements.request_monitor import RequestMonitor
from scbm.closing.requirements.requirement_certificates import claim_of, requirement_certificates
from scbm.closing.requirements.sentence_decisions import SentenceDecisions, why_incomplete
from scbm.closing.requirements.violating_cases import RequirementKey, ViolatingCases, failure_of
from scbm.closing.requirements.violation_search import ViolationSearch
from scbm.closing.runs.all_runs import AllRuns
from scbm.closing.symbolic.requirement_sets import RequirementSets
from scbm.model import GoalOrder, PlanSet, RunPlans
from scbm.model.requirements import BuiltIn
from scbm.model.sources import undeclared
from scbm.planning import DEFAULT_PLANNER
from scbm.testing.built_in_requirements import BUILT_INS
from scbm.testing.continuations.reachable_goals import ReachableGoals, UnknownReachabilityError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from scbm.closing.decisions import Closing
    from scbm.closing.requirements.recovery_search import MissedGoal
    from scbm.closing.runs.all_runs import CloseLimits, RunScope
    from scbm.closing.symbolic.reached_sets import SetLimits
    from scbm.model import BehaviorModel, Requirement
    from scbm.proofcheck import Certificate
    from scbm.testing import Campaign

BESIDE = 4
"""A situation may occur beside so many memories of runs, on average; more count as incomplete."""

_NOT_SHOWN = "a run violates it, and no simulated case that was tried shows it"
_NOT_JUDGED = "a run with canonical plans violates it, and cases with drawn plans are not judged by it"
_OTHERS_NOT_JUDGED = "a run with other plans violates it, and cases with drawn plans are not judged by it"
_UNKNOWN_HELP = "a run waits, and the search was too long whether a change from outside leads it to its goal"
_UNKNOWN_REACH = "the search was too long whether all goals can be reached after runs with other plans"
_INTERRUPTED = "closing was interrupted"
_IN_TIME = "recovers: a reply that comes is as fast as in the simulation, and no limit of time or plans ends the run."
_NO_LIMITS = "non_blocking: no limit of time or plans ends a run before, and the planner {} plans what follows."
_OF_DEVICES = "proofs know nothing of the work of devices"
_SINGLE_GOALS = "each run has one goal, so nothing follows it"


class RequirementCloser:
    """Decides the requirements of one model."""

    def __init__(
        self,
        model: BehaviorModel,
        limits: CloseLimits,
        progress: Callable[[str], None],
        interruption: Interruption | None = None,
        extra: Sequence[Requirement] = (),
    ) -> None:
        """Prepare the search.

        Args:
            model: the model.
            limits: the limits of exploration and search.
            progress: called with what is being decided, with counts.
            interruption: the handling of Ctrl-C, if the caller handles it.
            extra: requirements beside those of the model.
        """
        self._model = model
        self._limits = limits
        self._interruption = interruption or Interruption()
        self._progress = self._interruption.checked(progress)
        self._cases = ViolatingCases(model, extra, limits.candidates, self._progress)
        self._asked = {requirement.name: str(requirement.sentence) for requirement in extra}
        self._others = OtherPlanViolations(model, extra, limits.candidates, self._progress)
        asked = (*model.requirements, *extra)
        self._sentences = SentenceDecisions(asked, self._cases, self._others, limits, self._explored, self._collected)
        self._open: dict[str, tuple[str, str | None]] = {}
        self._situations = 0
        self._is_any_waiting = self._is_any_livelocked = self._is_interrupted = False
        self._only_canonical: list[str] = []
        self._undeclared = undeclared(model)
        self._rest_on_undeclared: list[str] = []
        self._proved: dict[RequirementKey, AllRuns] = {}
        self._continued: BlockingSearch | None = None

    def decide(self, suite: Campaign, closing: Closing) -> RequirementDecisions:
        """Return the decisions.

        Args:
            suite: the executed suite.
            closing: the result of closing the obligations; its cases may violate requirements already.
        """
        with few_collections():
            return self._decide(suite, closing)

    def _decide(self, suite: Campaign, closing: Closing) -> RequirementDecisions:
        off = dict(self._not_judged())
        asked = [name for name in map(str, BUILT_INS) if name not in off]
        names = [case for case, _ in closing.after.cases]
        try:
            with self._interruption.stage():
                self._cases.look_in(suite, closing, self._others.cases)
                self._follow_runs(asked)
        except KeyboardInterrupt:
            self._is_interrupted = True
            for name in asked:
                self._open.setdefault(name, (_INTERRUPTED, None))
            self._sentences.interrupt(_INTERRUPTED)
        named = (*map(str, BUILT_INS), *self._model.requirements_on)
        decided = [self._decided(name, off, names) for name in named]
        decided += self._with_sentences(self._sentences.decided(names))
        if self._cases.tester.planner.name != DEFAULT_PLANNER:
            decided = [_with_its_planner(each) for each in decided]
        holds = any(each.holds for each in decided) and self._situations > 0
        assumed = tuple(self._assumptions(asked, [each for each in decided if each.holds])) if holds else ()
        certificates = tuple(self._certificates(decided))
        proofs = {claim: name for name, certificate in certificates for claim in certificate.claims}
        certified = tuple(replace(each, certificate=proofs.get(claim_of(_key(each)))) for each in decided)
        return RequirementDecisions(certified, self._situations, assumed, self._is_interrupted, certificates)

    def _certificates(self, decided: Sequence[DecidedRequirement]) -> Iterator[tuple[str, Certificate]]:
        """Yield the certificates of what holds; none is about requirements that the model does not have."""
        own = [requirement.name for requirement in self._model.requirements]
        keys = [_key(each) for each in decided if each.holds and (each.is_built_in or each.name in own)]
        proved = {**self._proved, **self._sentences.proved}
        is_continued = RequirementKey(BuiltIn.NON_BLOCKING.value, is_built_in=True) in keys
        continued = self._continued if is_continued else None
        yield from requirement_certificates(self._model, {key: proved[key] for key in keys if key in proved}, continued)

    def _with_sentences(self, decided: Iterable[DecidedRequirement]) -> Iterator[DecidedRequirement]:
        """Yield the decisions about requirements of the user; those of the command line with their sentences."""
        for each in decided:
            yield replace(each, asked=self._asked.get(each.name, ""))

    def nearest_miss(self, requirement: Requirement) -> str:
        """Return how near runs come to violating a requirement that holds, as a clause; empty if it is not known."""
        return self._sentences.nearest_miss(requirement)

    def _not_judged(self) -> Iterator[tuple[str, str]]:
        """Yield the built-in requirements that are not decided, each with the reason."""
        yield from self._model.requirements_off
        if self._model.runs.goals is GoalOrder.SINGLE:
            yield BuiltIn.NON_BLOCKING.value, _SINGLE_GOALS

    # all runs

    def _follow_runs(self, asked: Sequence[str]) -> None:
        scope = replace(scope_of_proofs(self._model, self._model.runs.proved_plans), keeps_notes=True)
        scope = replace(scope, watched=self._sentences.watched_together)
        judges = [name for name in RequestMonitor.judges if name in asked and self._model.resources]
        runs = None
        if judges or self._sentences.are_any or BuiltIn.NON_BLOCKING.value in asked:
            runs = self._explored(scope)
            self._judge_requests(runs, judges)
            self._sentences.decide(runs)
            if BuiltIn.NON_BLOCKING.value in asked:
                self._judge_blocking(runs)
        if BuiltIn.RECOVERS.value in asked and self._model.resources:
            is_closed = runs is not None and not scope.is_open
            closed = replace(scope, is_open=False, watched=())
            self._judge_recovery(runs if is_closed and runs is not None else self._explored(closed))
        known = (*RequestMonitor.judges, BuiltIn.RECOVERS.value, BuiltIn.NON_BLOCKING.value)
        for name in asked:
            if name not in known:
                self._open[name] = ("only verdicts of cases decide it", None)

    def _explored(self, scope: RunScope, limits: CloseLimits | None = None) -> AllRuns:
        runs = AllRuns(self._model, limits or self._limits, self._progress, scope, only_proves=limits is not None)
        if runs.is_interrupted:
            raise KeyboardInterrupt
        self._situations += runs.situations
        return runs

    def _collected(self, requirements: Sequence[Requirement], limits: SetLimits) -> RequirementSets:
        return RequirementSets.of(self._model, requirements, self._progress, limits)

    def _judge_requests(self, runs: AllRuns, asked: Sequence[str]) -> None:
        if not asked:
            return
        self._progress("following the requests of all runs")
        monitor = RequestMonitor(self._model, runs.program)
        search = ViolationSearch(runs, monitor, BESIDE * self._limits.situations)
        violated = [name for name in search.violated() if name in asked]
        for name in asked:
            if name in violated:
                self._open[name] = (_NOT_SHOWN, None)
            elif not search.is_complete:
                self._open[name] = why_incomplete(runs)
            else:
                self._proved[RequirementKey(name, is_built_in=True)] = runs
        held = [name for name in asked if name not in self._open]
        self._judge_requests_of_any_plans(runs, monitor, held)
        if self._undeclared and held:
            strict = RequestMonitor(self._model, runs.program, self._undeclared)
            found = ViolationSearch(runs, strict, BESIDE * self._limits.situations, self._undeclared).violated()
            self._rest_on_undeclared += [name for name in held if name in found]
        wanted = [key for name in violated if (key := RequirementKey(name, is_built_in=True)) not in self._cases]
        if wanted:
            shown = self._with_canonical_plans(runs)
            search = ViolationSearch(shown, monitor, BESIDE * self._limits.situations)
            names = tuple(key.name for key in wanted)
            self._cases.try_walks(shown, search.walks(names), wanted)
            self._cases.try_random(wanted)
            if shown is not runs:
                search = ViolationSearch(runs, monitor, BESIDE * self._limits.situations)
                self._others.show_drawn(runs, partial(search.walks, names), wanted, self._cases)

    def _judge_requests_of_any_plans(self, runs: AllRuns, monitor: RequestMonitor, held: Sequence[str]) -> None:
        """Decide whether runs with any plans satisfy what those with canonical plans do."""
        others = self._sentences.with_any_plans(runs) if held else None
        search = None if others is None else ViolationSearch(others, monitor, BESIDE * self._limits.situations)
        violated = () if search is None else search.violated()
        for name in held:
            key = RequirementKey(name, is_built_in=True)
            if others is None or search is None or not search.is_complete or name in violated:
                self._only_canonical.append(name)
                self._others.leave_open(key)
            else:
                self._proved[key] = others
        wanted = [RequirementKey(name, is_built_in=True) for name in held if name in violated]
        if others is not None and search is not None and wanted and others is not runs:
            self._others.show(others, search.walks(tuple(key.name for key in wanted)), wanted)

    def _recovers_with_any_plans(self, runs: AllRuns) -> bool:
        others, key = self._sentences.with_any_plans(runs), RequirementKey(BuiltIn.RECOVERS.value, is_built_in=True)
        if others is None or others.stopped is not None:
            self._others.leave_open(key)
            return False
        search = RecoverySearch(others, BESIDE * self._limits.situations)
        missed = search.missed()
        if missed:
            self._others.show(others, map(search.walk, missed), (key,))
            if key not in self._others.cases:
                self._others.leave_open(key, _why_missed(missed))
        elif not search.is_complete or search.is_any_unknown:
            self._others.leave_open(key, _UNKNOWN_HELP if search.is_any_unknown else TOO_MANY)
        return not missed and search.is_complete and not search.is_any_unknown

    def _judge_recovery(self, runs: AllRuns) -> None:
        self._progress("following the runs with one failed or missing reply")
        name = BuiltIn.RECOVERS.value
        key = RequirementKey(name, is_built_in=True)
        search = RecoverySearch(runs, BESIDE * self._limits.situations)
        missed = search.missed()
        if missed:
            self._open[name] = (_why_missed(missed), None)
        elif not search.is_complete:
            self._open[name] = why_incomplete(runs)
        elif search.is_any_unknown:
            self._open[name] = (_UNKNOWN_HELP, None)
        else:
            if self._undeclared and RecoverySearch(runs, BESIDE * self._limits.situations, self._undeclared).missed():
                self._rest_on_undeclared.append(name)
            if not self._recovers_with_any_plans(runs):
                self._only_canonical.append(name)
        self._is_any_waiting, self._is_any_livelocked = search.is_any_waiting, search.is_any_livelocked
        if missed and key not in self._cases:
            shown = self._with_canonical_plans(runs)
            search_shown = search if shown is runs else RecoverySearch(shown, BESIDE * self._limits.situations)
            missed_shown = missed if shown is runs else search_shown.missed()
            self._cases.try_walks(shown, map(search_shown.walk, missed_shown), (key,))
            self._cases.try_random((key,))
            if shown is not runs:
                self._others.show_drawn(runs, partial(map, search.walk, missed), (key,), self._cases)
            others = [each.value for each in _HIDING if RequirementKey(each.value, is_built_in=True) in self._cases]
            if others:  # a run that violates these is not judged by `recovers`
                self._open[name] = (f"after one fault a run may miss its goal; repair {others[0]} first", None)

    def _judge_blocking(self, runs: AllRuns) -> None:
        self._progress("following what runs leave behind")
        name = BuiltIn.NON_BLOCKING.value
        key = RequirementKey(name, is_built_in=True)
        canonical = self._with_canonical_plans(runs)
        if canonical.stopped is not None:
            self._open[name] = why_incomplete(canonical)
            return
        search = BlockingSearch(canonical)
        is_drawn = self._model.runs.plans is RunPlans.DRAWN
        if search.blocked:
            self._open[name] = (_NOT_JUDGED if is_drawn else _NOT_SHOWN, None)
            if key not in self._cases:
                self._cases.try_walks(canonical, search.walks(), (key,))
                self._cases.try_random((key,))
        else:
            if self._undeclared and BlockingSearch(canonical, self._undeclared).blocked:
                self._rest_on_undeclared.append(name)
            is_certified = canonical.proves and not is_drawn  # the checker knows continuations of canonical plans alone
            self._continued = search if is_certified else None
            if not self._blocks_nothing_with_any_plans(search.rests, canonical):
                self._only_canonical.append(name)

    def _blocks_nothing_with_any_plans(self, rests: Mapping[int, int], canonical: AllRuns) -> bool:
        """Return whether no history with any plans makes a goal unreachable; `rests` are those of canonical plans."""
        others, key = self._sentences.with_any_plans(canonical), RequirementKey(BuiltIn.NON_BLOCKING.value, True)
        if others is None or others.stopped is not None:
            self._others.leave_open(key)
            return False
        search, reachable = BlockingSearch(others), ReachableGoals(self._model, canonical.program)
        new = {state: node for state, node in search.rests.items() if state not in rests}
        lost, unknown = list[int](), len(new) > self._limits.candidates
        for state, node in islice(new.items(), self._limits.candidates):
            try:
                lost += [node] if reachable.lost_after(others.program.packing.values(state)) is not None else []
            except UnknownReachabilityError:
                unknown = True
        if lost and self._model.runs.plans is RunPlans.DRAWN:
            self._others.leave_open(key, _OTHERS_NOT_JUDGED)
        elif lost:
            self._others.show(others, search.walks(lost), (key,))
        elif unknown:
            self._others.leave_open(key, _UNKNOWN_REACH)
        return not lost and not unknown

    def _with_canonical_plans(self, runs: AllRuns) -> AllRuns:
        """Return the runs that cases can follow: those of cases have canonical plans."""
        if runs.plans is PlanSet.CANONICAL:
            return runs
        return self._explored(replace(runs.scope, plans=PlanSet.CANONICAL))

    # decisions

    def _decided(self, name: str, off: dict[str, str], taken: list[str]) -> DecidedRequirement:
        key = RequirementKey(name, is_built_in=True)
        if name in off:
            return DecidedRequirement(name, RequirementStatus.OFF, off[name])
        if key in self._cases:
            execution, is_new = self._cases.smallest(key, taken)
            made = execution if is_new else None
            reason = str(failure_of(key, execution))
            return DecidedRequirement(name, RequirementStatus.VIOLATED, reason, execution.case.name, made)
        if name in self._model.requirements_on:
            return DecidedRequirement(name, RequirementStatus.CASES_ONLY, _OF_DEVICES)
        if name in self._open:
            reason, option = self._open[name]
            undecided = DecidedRequirement(name, RequirementStatus.UNDECIDED, reason, option=option)
            return self._others.added_to(undecided, taken)
        is_canonical = name in self._only_canonical
        status = RequirementStatus.HOLDS_CANONICAL if is_canonical else RequirementStatus.HOLDS
        rests_on = self._undeclared if name in self._rest_on_undeclared else ()
        decided = DecidedRequirement(name, status, self._where(name), undeclared=rests_on)
        return self._others.added_to(decided, taken)

    def _where(self, name: str) -> str:
        if not self._model.resources and name != BuiltIn.NON_BLOCKING.value:
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

    def _assumptions(self, asked: Sequence[str], held: Sequence[DecidedRequirement]) -> Iterator[str]:
        planner = self._cases.tester.planner.name
        of_any_plans = [each for each in held if each.status is RequirementStatus.HOLDS]
        yield from assumptions(
            self._model, (Decision.UNCOVERABLE if of_any_plans else Decision.EXCLUDED,), planner=planner
        )
        if of_any_plans and len(of_any_plans) < len(held):
            yield f"Where an answer says under which plans it holds, plans are those of the planner {planner}."
        if BuiltIn.RECOVERS.value in asked and self._model.resources:
            yield _IN_TIME
        if BuiltIn.NON_BLOCKING.value in asked:
            yield _NO_LIMITS.format(planner)


def _with_its_planner(decided: DecidedRequirement) -> DecidedRequirement:
    is_canonical = decided.status is RequirementStatus.HOLDS_CANONICAL
    return replace(decided, status=RequirementStatus.HOLDS_PLANNER) if is_canonical else decided


def _key(decided: DecidedRequirement) -> RequirementKey:
    return RequirementKey(decided.name, decided.is_built_in)


_HIDING = (BuiltIn.NO_ORPHAN, BuiltIn.READY_AGAIN, BuiltIn.NON_BLOCKING)
"""Requirements whose violations name the reason of a missed goal, so that `recovers` is not violated, too."""


def _why_missed(missed: Sequence[MissedGoal]) -> str:
    """Return why it is open whether each run with one fault reaches its goal, if no case shows one that does not."""
    endless = next((each.operations for each in missed if each.operations), ())
    if len(missed) == 1 and endless:
        return f"after one fault a run may repeat {', '.join(endless)} without end, if replies allow it each time"
    return "after one fault a run may miss its goal, and no simulated case that was tried shows it"
