"""Decides the requirements of the user in all runs (semantics 7.3, 9.3; decision 67)."""

from __future__ import annotations

from functools import cached_property, partial
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases.coverage import engine_words
from scbm.closing.decisions import DecidedRequirement, RequirementStatus
from scbm.closing.proofs.blame import parts_of
from scbm.closing.proofs.nearest_misses import nearest_miss, nearest_of
from scbm.closing.requirements.liveness_search import LivenessSearch
from scbm.closing.requirements.other_plan_violations import TOO_MANY
from scbm.closing.requirements.sentence_monitor import SentenceMonitor
from scbm.closing.requirements.violating_cases import RequirementKey, failure_of
from scbm.closing.requirements.violation_search import ViolationSearch
from scbm.closing.symbolic.reached_sets import DEFAULT_LIMITS, NoSetError, SetLimits
from scbm.closing.symbolic.requirement_sets import RequirementSets
from scbm.model import PlanSet
from scbm.model.requirements import LeadsTo
from scbm.running.untimed.relevance import Relevance

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from scbm.closing.requirements.other_plan_violations import OtherPlanViolations
    from scbm.closing.requirements.requirement_certificates import Proof
    from scbm.closing.requirements.violating_cases import ViolatingCases
    from scbm.closing.requirements.violation_search import ViolatingWalk
    from scbm.closing.runs.all_runs import AllRuns, CloseLimits, RunScope
    from scbm.model import Predicate, Requirement

    Explore = Callable[[RunScope, CloseLimits | None], AllRuns]
    Collect = Callable[[Sequence[Requirement], SetLimits], RequirementSets]

_BESIDE = 2
"""A requirement remembers one of two things of a run."""

_SHARE_OF_ANY_PLANS = 100
"""The divisor of the limit of situations for runs with any plans: often they are many times those of canonical ones."""

_NODES_PER_SITUATION = 200
"""A set for any plans may take so many nodes for each situation under canonical plans: about the same time."""
_FEW_NODES = 500_000
"""It may take so many nodes in any case: about a second."""

_TO_VIOLATE = "to violate it a run"
_NOT_SHOWN = "a run violates it, and no simulated case that was tried shows it"
_ENDLESS = "runs may repeat {} without end before it is satisfied, and no case that was tried shows it"
_ONLY_CASES = "only cases judge this form of requirement"
_TAKES_TIME = "time may pass before it is satisfied, and only cases know times"
_WHERE = {
    True: "in all runs",
    False: "in all runs in which requests succeed in the end",
}
_BY_SETS = f"in all runs, by {engine_words('sets')}"


class SentenceAnswer(Struct, frozen=True):
    """The answer of one exploration about one requirement.

    Attributes:
        status: holds, violated, undecided or only in cases.
        reason: where it holds, or why it is open.
        option: the option that raises the limit that ended the search.
    """

    status: RequirementStatus
    reason: str
    option: str | None = None


class SentenceDecisions:
    """The decisions about the requirements of the user.

    Attributes:
        proved: the runs of which none violates a requirement, or the set of their situations, for those that a
            certificate can claim.
    """

    def __init__(  # noqa: PLR0913, PLR0917 - what is decided, and what decides it
        self,
        requirements: Sequence[Requirement],
        cases: ViolatingCases,
        others: OtherPlanViolations,
        limits: CloseLimits,
        explore: Explore,
        collect: Collect,
    ) -> None:
        """Decide nothing yet.

        Args:
            requirements: the requirements.
            cases: the cases that violate requirements.
            others: the cases that violate them with other plans than those of the planner.
            limits: the limits of exploration and search.
            explore: returns all runs of a scope, within these limits or its own.
            collect: returns the set of all situations for some requirements, within limits of its own.
        """
        self._requirements = tuple(requirements)
        self._cases = cases
        self._others = others
        self._limits = limits
        self._explore = explore
        self._collect = collect
        self._answers: dict[str, SentenceAnswer] = {}
        self.proved: dict[RequirementKey, Proof] = {}
        self._any_plans: dict[RunScope, AllRuns] = {}

    @property
    def are_any(self) -> bool:
        """Whether there are requirements to decide."""
        return bool(self._requirements)

    @property
    def watched_together(self) -> tuple[Predicate, ...]:
        """The predicates of the requirements that read nothing but what runs depend on anyway."""
        return _predicates(self._by_variables.get((), ()))

    @cached_property
    def _by_variables(self) -> Mapping[tuple[str, ...], Sequence[Requirement]]:
        """The requirements by the variables that they read and runs do not depend on."""
        program = self._cases.tester.program
        names = dict.fromkeys(Relevance(program.model, program.packing).names)
        found: dict[tuple[str, ...], list[Requirement]] = {}
        for requirement in self._requirements:
            more = tuple(sorted(name for name in requirement.sentence.reads() if name not in names))
            found.setdefault(more, []).append(requirement)
        return found

    def decide(self, runs: AllRuns) -> None:
        """Decide all requirements: those that `runs` watch, and others in explorations that keep more variables."""
        for more, requirements in self._by_variables.items():
            scope = replace(runs.scope, watched=_predicates(requirements))
            self._decide_in(self._explore(scope, None) if more else runs, requirements)
        self._decide_by_sets(runs, [each for each in self._requirements if self._may_be_proved_by_sets(each)])

    def nearest_miss(self, requirement: Requirement) -> str:
        """Return how near runs come to violating a requirement that holds, as a clause; empty if it is not known."""
        runs, sentence = self.proved.get(RequirementKey(requirement.name)), requirement.sentence
        if runs is None or isinstance(runs, RequirementSets):
            return ""
        misses = (nearest_miss((each,), runs) for each in sentence.needed_to_violate)
        found = next((miss.words(_TO_VIOLATE) for miss in misses if miss is not None), "")
        then = sentence.needed_then
        if found or then is None:
            return found
        search = ViolationSearch(runs, _monitor(runs, requirement), _BESIDE * self._limits.situations)
        miss = nearest_of(parts_of((then.predicate,)), tuple(search.settled_states(then.memory)), runs.program.packing)
        return "" if miss is None else miss.words(_TO_VIOLATE, then.when)

    def interrupt(self, reason: str) -> None:
        """Leave open what is not decided yet."""
        for requirement in self._requirements:
            self._answers.setdefault(requirement.name, SentenceAnswer(RequirementStatus.UNDECIDED, reason))

    def _decide_in(self, runs: AllRuns, requirements: Sequence[Requirement]) -> None:
        for requirement in requirements:
            self._answers[requirement.name] = self._decided_in(runs, requirement)
        held = [each for each in requirements if self._answers[each.name].status is RequirementStatus.HOLDS]
        others = self.with_any_plans(runs) if held else None
        for requirement in held:
            proves = others
            if not self._holds_with_any_plans(others, requirement):
                where, proves = self._answers[requirement.name].reason, runs
                self._answers[requirement.name] = SentenceAnswer(RequirementStatus.HOLDS_CANONICAL, where)
            if proves is not None and requirement.sentence.is_safety:
                self.proved[RequirementKey(requirement.name)] = proves

    def _may_be_proved_by_sets(self, requirement: Requirement) -> bool:
        """Return whether too many runs are the only reason why a requirement is not known to hold for any plans."""
        answer, key = self._answers[requirement.name], RequirementKey(requirement.name)
        if answer.status is RequirementStatus.UNDECIDED:
            return requirement.sentence.is_safety and answer.reason != _NOT_SHOWN and key not in self._cases
        is_canonical = answer.status is RequirementStatus.HOLDS_CANONICAL
        return requirement.sentence.is_safety and is_canonical and self._others.are_too_many(key)

    def _decide_by_sets(self, runs: AllRuns, requirements: Sequence[Requirement]) -> None:
        """Look in sets of situations for proofs of requirements: for any plans, or else for canonical ones."""
        if not requirements:
            return
        undecided = [r for r in requirements if self._answers[r.name].status is RequirementStatus.UNDECIDED]
        limits = DEFAULT_LIMITS
        if not undecided:
            work = max(_FEW_NODES, _NODES_PER_SITUATION * runs.situations)
            limits = replace(limits, work=min(limits.work, work))
        try:
            sets = self._collect(requirements, limits)
            self._take_over(sets, requirements, RequirementStatus.HOLDS)
            undecided = [r for r in undecided if self._answers[r.name].status is RequirementStatus.UNDECIDED]
            if undecided and runs.plans is PlanSet.CANONICAL and runs.other_planner is None:
                self._take_over(sets.canonical(), undecided, RequirementStatus.HOLDS_CANONICAL)
        except NoSetError as error:
            for each in undecided:
                answer = self._answers[each.name]
                self._answers[each.name] = replace(answer, reason=f"{answer.reason}; {error}")

    def _take_over(self, sets: RequirementSets, requirements: Sequence[Requirement], status: RequirementStatus) -> None:
        """Take over what a set proves."""
        for requirement in requirements:
            if sets.proves(requirement):
                key = RequirementKey(requirement.name)
                self._answers[requirement.name] = SentenceAnswer(status, _BY_SETS)
                self.proved[key] = sets
                if status is RequirementStatus.HOLDS:
                    self._others.rule_out(key)
                else:
                    self._others.leave_open(key)

    def _holds_with_any_plans(self, runs: AllRuns | None, requirement: Requirement) -> bool:
        """Return whether runs with any plans satisfy a requirement; show the violation with a case if they do not."""
        key = RequirementKey(requirement.name)
        if runs is None or (runs.stopped is not None and not requirement.sentence.is_safety):
            self._others.leave_open(key)
            return False
        answer = self._answer(runs, requirement)
        if answer.status is RequirementStatus.UNDECIDED and answer.option is None:
            self._others.show(runs, self._walks(runs, requirement), (key,))
        elif answer.status is not RequirementStatus.HOLDS:
            is_judged = answer.status is RequirementStatus.UNDECIDED
            self._others.leave_open(key, TOO_MANY if is_judged else answer.reason)
        return answer.status is RequirementStatus.HOLDS

    def with_any_plans(self, runs: AllRuns) -> AllRuns | None:
        """Return the same runs with any plans; `None` if they are too many, as canonical plans are some of them."""
        if runs.plans is PlanSet.ANY:
            return runs
        scope = replace(runs.scope, plans=PlanSet.ANY)
        if scope not in self._any_plans:
            most = self._limits.situations // _SHARE_OF_ANY_PLANS
            if runs.situations > most:
                return None
            self._any_plans[scope] = self._explore(scope, replace(self._limits, situations=most))
        return self._any_plans[scope]

    def _decided_in(self, runs: AllRuns, requirement: Requirement) -> SentenceAnswer:
        """Return the answer of one exploration, with a case if there is a violation to show."""
        answer = self._answer(runs, requirement)
        key = RequirementKey(requirement.name)
        if answer.status is RequirementStatus.UNDECIDED and answer.option is None and key not in self._cases:
            shown = runs
            if runs.plans is not PlanSet.CANONICAL:
                shown = self._explore(replace(runs.scope, plans=PlanSet.CANONICAL), None)
            self._cases.try_walks(shown, self._walks(shown, requirement), (key,))
            self._cases.try_random((key,))
            if shown is not runs:
                self._others.show_drawn(runs, partial(self._walks, runs, requirement), (key,), self._cases)
        return answer

    def _answer(self, runs: AllRuns, requirement: Requirement) -> SentenceAnswer:
        sentence = requirement.sentence
        if sentence.is_safety:
            return self._answer_about_safety(runs, requirement)
        if isinstance(sentence, LeadsTo):
            return self._answer_about_liveness(runs, requirement, is_timed=sentence.within_ns is not None)
        return SentenceAnswer(RequirementStatus.CASES_ONLY, _ONLY_CASES)

    def _answer_about_safety(self, runs: AllRuns, requirement: Requirement) -> SentenceAnswer:
        search = ViolationSearch(runs, _monitor(runs, requirement), _BESIDE * self._limits.situations)
        if search.violated():
            return SentenceAnswer(RequirementStatus.UNDECIDED, _NOT_SHOWN)
        return _answered(runs, is_complete=search.is_complete, holds_always=True)

    def _answer_about_liveness(self, runs: AllRuns, requirement: Requirement, *, is_timed: bool) -> SentenceAnswer:
        search = LivenessSearch(runs, _monitor(runs, requirement), _BESIDE * self._limits.situations)
        if is_timed and search.is_due_when_settled:
            return SentenceAnswer(RequirementStatus.CASES_ONLY, _TAKES_TIME)
        if not is_timed and search.ends_due:
            return SentenceAnswer(RequirementStatus.UNDECIDED, _NOT_SHOWN)
        if not is_timed and search.goes_round is not None and search.is_complete:
            repeated = ", ".join(search.goes_round) or "changes from outside"
            return SentenceAnswer(RequirementStatus.UNDECIDED, _ENDLESS.format(repeated))
        return _answered(runs, is_complete=search.is_complete, holds_always=is_timed)

    def _walks(self, runs: AllRuns, requirement: Requirement) -> Iterator[ViolatingWalk]:
        monitor, most = _monitor(runs, requirement), _BESIDE * self._limits.situations
        if requirement.sentence.is_safety:
            return ViolationSearch(runs, monitor, most).walks((requirement.name,))
        return LivenessSearch(runs, monitor, most).walks(requirement.name)

    # decisions

    def decided(self, taken: list[str]) -> Iterator[DecidedRequirement]:
        """Yield the decisions, in the order of the requirements; `taken` are names of cases."""
        for requirement in self._requirements:
            name, key = requirement.name, RequirementKey(requirement.name)
            answer = self._answers.get(name, SentenceAnswer(RequirementStatus.CASES_ONLY, _ONLY_CASES))
            if key in self._cases:
                execution, is_new = self._cases.smallest(key, taken)
                made, reason = (execution if is_new else None), str(failure_of(key, execution))
                violated = RequirementStatus.VIOLATED
                yield DecidedRequirement(name, violated, reason, execution.case.name, made, is_built_in=False)
            else:
                open_ = DecidedRequirement(name, answer.status, answer.reason, option=answer.option, is_built_in=False)
                yield self._others.added_to(open_, taken)


def _predicates(requirements: Sequence[Requirement]) -> tuple[Predicate, ...]:
    return tuple(dict.fromkeys(each for requirement in requirements for each in requirement.sentence.predicates))


def _monitor(runs: AllRuns, requirement: Requirement) -> SentenceMonitor:
    return SentenceMonitor(requirement, runs.scope.watched)


def _answered(runs: AllRuns, *, is_complete: bool, holds_always: bool) -> SentenceAnswer:
    """Return that a requirement holds if all runs were searched; `holds_always` if no request needs to succeed."""
    if is_complete:
        return SentenceAnswer(RequirementStatus.HOLDS, _WHERE[holds_always])
    return SentenceAnswer(RequirementStatus.UNDECIDED, *why_incomplete(runs))


def why_incomplete(runs: AllRuns) -> tuple[str, str | None]:
    """Return why not all runs were searched, with the option that raises the limit."""
    if runs.stopped is not None:
        return f"not all runs were explored: {runs.stopped}", runs.option
    return "not all runs were explored: too many differ in their earlier requests", "--max-states"
