"""The result of closing: decisions about obligations and requirements, with cases, certificates, suggestions, faults.

The cases that show a fault are failed cases, and new cases that end as no run of a correct model does.
"""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases.coverage import Decision, count_engines, count_statuses, coverable_figure
from scbm.cases.coverage.assumptions import assumptions
from scbm.cases.trace import End, InjectionApplied, PutBack, run_end
from scbm.model import format_moment
from scbm.running import describe_cycle
from scbm.testing.decided_requirements import KnownDecision, OtherPlans, RequirementStatus
from scbm.testing.verdicts import Verdict, violation_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from scbm.cases import Case
    from scbm.cases.coverage import Coverage, Figure, Obligation
    from scbm.model import BehaviorModel, Predicate, Waiver
    from scbm.proofcheck import Certificate
    from scbm.testing import Campaign, Execution
    from scbm.testing.requirement_monitors import Violation


__all__ = [
    "Closing",
    "ClosingCase",
    "Consequence",
    "Decided",
    "Decision",
    "FailedCase",
    "FoundFault",
    "RequirementStatus",
    "Stage",
    "StageEnd",
    "Suggestion",
    "SuggestionKind",
    "consequences_of_force",
    "failed_cases",
    "found_faults",
]


class Decided(Struct, frozen=True):
    """The decision about one obligation.

    Attributes:
        case: the name of the first case that visits it; if it is not covered, one does so in a forced state only.
        certificate: the name of the certificate, if it is uncoverable or excluded by the planner; a key of
            `Closing.certificates`.
        reason: one sentence: how the case covers it, why nothing does, why it is waived, or what ended the search.
        engine: the engine that found the proof, if there is one.
    """

    obligation: Obligation
    decision: Decision
    reason: str
    case: str | None = None
    certificate: str | None = None
    engine: str | None = None

    @property
    def is_forced(self) -> bool:
        """Whether only forced states visit it."""
        return self.case is not None and self.decision is not Decision.COVERED


class ClosingCase(Struct, frozen=True):
    """A case that closing made.

    Attributes:
        case: the case with its expectations (verdict, visits), without recorded choices.
        execution: its run.
        adds: the obligations that no case before it visits, *queued* included, or that all of these visit by force.
        adds_by_force: those of them that it visits in a forced state only (semantics 9.10).
        violates: the requirement that it was made to violate; empty if it was made for obligations.
        has_other_plans: whether it violates it with other plans than those of the planner.
    """

    case: Case
    execution: Execution
    adds: tuple[Obligation, ...]
    adds_by_force: tuple[Obligation, ...] = ()
    violates: str = ""
    has_other_plans: bool = False

    @property
    def adds_freely(self) -> tuple[Obligation, ...]:
        """The added obligations that the case visits before anything is forced."""
        return tuple(obligation for obligation in self.adds if obligation not in self.adds_by_force)

    @property
    def forcing(self) -> str | None:
        """What forces the state, as a clause; `None` if nothing does."""
        if self.execution.forced_by is None:
            return None
        record = forcing_record(self.execution)
        if record is None:
            return "forced from the start, as no run begins in this initial state"
        names = ", ".join(name for name, _ in record.changes)
        return f"forced from {format_moment(record.at_ns)} on, as {record.injection} changes {names}"

    @property
    def consequences(self) -> tuple[str, ...]:
        """The failures of its run after its state was forced, as clauses: the model is not at fault."""
        if self.execution.forced_by is None:
            return ()
        broken = tuple(str(violation) for violation in _broken_by_force(self.execution))
        end = self.execution.verdict.end
        return (*broken, f"it {_end_sentence(end, self.execution)}") if end in _WRONG_ENDS else broken

    @property
    def verdict(self) -> Verdict:
        """The verdict on its run without the consequences of force."""
        broken = _broken_by_force(self.execution)
        verdict = self.execution.verdict
        kept = (failure for failure in verdict.failures if violation_of(failure, broken) is None)
        return Verdict(verdict.end, tuple(kept))


_WRONG_ENDS = (End.LIVELOCK, End.MODEL_ERROR, End.TIME_LIMIT)
"""The ends of runs that no correct model has if nothing is forced."""


def forcing_record(execution: Execution) -> InjectionApplied | PutBack | None:
    """Return the record from which on the state of a run is forced; `None` if it is from the start, or never."""
    if execution.forced_by is None:
        return None
    record = execution.trace.records[execution.forced_by]
    return record if isinstance(record, (InjectionApplied, PutBack)) else None


def _broken_by_force(execution: Execution) -> tuple[Violation, ...]:
    """Return the violations that a run shows only after its state was forced."""
    if execution.forced_by is None:
        return ()
    return tuple(violation for violation in execution.violations if violation.record >= execution.forced_by)


class SuggestionKind(StrEnum):
    """The part of the model that a suggestion would change."""

    GOAL = "goal"
    GUARD = "guard"
    SHADOWED = "shadowed"
    DEADLINE = "deadline"
    FAILURE = "failure"
    INSTANT = "instant"
    PLANS = "plans"


class Suggestion(Struct, frozen=True):
    """A change that would make uncoverable obligations coverable, or the reason why they are not.

    Attributes:
        obligations: the obligations that it is about, without those of `by_force`.
        kind: the part of the model that it would change.
        text: one sentence.
        name: for a goal, the name that it would have in the model.
        goal: for a goal, the goal; it was found by search and verified by a run.
        blamed: for a guard, the conjuncts that never hold together; for a shadowed transition, the transitions that
            shadow it.
        by_force: the obligations that cases would visit in forced states only (semantics 9.10): the change does not
            make them coverable.
    """

    obligations: tuple[Obligation, ...]
    kind: SuggestionKind
    text: str
    name: str | None = None
    goal: Predicate | None = None
    blamed: tuple[str, ...] = ()
    by_force: tuple[Obligation, ...] = ()


class Stage(StrEnum):
    """A stage of closing; what a stage decides stays decided."""

    RANDOM = "random cases"
    SEARCH = "guided search"
    GRAPH = "graph of all runs"
    SETS = "set of all situations"
    SUGGESTIONS = "suggestions"


class StageEnd(Struct, frozen=True):
    """A stage that ended before it was complete.

    Attributes:
        stage: the stage.
        why: what ended it, as a clause.
        option: the option of `scbm close` that lets it go on, if there is one.
        is_interrupted: whether the user ended it.
    """

    stage: Stage
    why: str
    option: str | None = None
    is_interrupted: bool = False


class Closing(Struct, frozen=True):
    """The result of closing a model.

    Attributes:
        before: the coverage of the given suite.
        after: the coverage of the suite and the new cases.
        decided: one decision for each obligation of the model, in the order of `Obligations`, *queued* included.
        cases: the new cases, in order; each adds something.
        certificates: by name: `structure`, `values`, `runs`.
        suggestions: in the order of the obligations that they are about.
        ended: the stages that ended early, in order.
        visited_waivers: the waivers that count although cases cover their obligations.
        expired_waivers: the waivers that do not count any more.
        requirements: the decisions about built-in requirements; `None` if they were not asked for.
    """

    model: BehaviorModel
    before: Coverage
    after: Coverage
    decided: tuple[Decided, ...]
    cases: tuple[ClosingCase, ...]
    certificates: tuple[tuple[str, Certificate], ...]
    suggestions: tuple[Suggestion, ...]
    ended: tuple[StageEnd, ...] = ()
    visited_waivers: tuple[Waiver, ...] = ()
    expired_waivers: tuple[Waiver, ...] = ()
    requirements: RequirementDecisions | None = None

    @property
    def counterexamples(self) -> tuple[ClosingCase, ...]:
        """The cases that violate requirements, made small."""
        decided = () if self.requirements is None else self.requirements.decided
        return tuple(
            ClosingCase(each.execution.case, each.execution, (), violates=each.name)
            for each in decided
            if each.execution is not None
        )

    @property
    def cases_with_other_plans(self) -> tuple[ClosingCase, ...]:
        """The cases that violate requirements with other plans than those of the planner, made small."""
        decided = () if self.requirements is None else self.requirements.decided
        runs = ((each.name, each.other_execution) for each in decided)
        return tuple(
            ClosingCase(run.case, run, (), (), name, has_other_plans=True) for name, run in runs if run is not None
        )

    def bit(self, obligation: Obligation) -> int:
        """Return the bit of an obligation in the sets of `before` and `after`."""
        return self.after.obligations.bit(obligation)

    @property
    def counts(self) -> dict[Decision, int]:
        """The number of obligations of each status, without *queued*."""
        return count_statuses(found.decision for found in self.decided if found.obligation.counts)

    @property
    def engines(self) -> dict[str, int]:
        """The number of obligations of each engine that proved something about some, without *queued*."""
        return count_engines(found.engine for found in self.decided if found.obligation.counts)

    @property
    def coverable(self) -> Figure:
        """The figure of what can be covered (semantics 8.5)."""
        return coverable_figure(self.counts)

    @property
    def forced(self) -> int:
        """The number of obligations that cases visit in forced states only, whatever their status; without *queued*."""
        return sum(each.is_forced and each.obligation.counts for each in self.decided)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """The assumptions of the proofs, one sentence each."""
        return assumptions(self.model, [found.decision for found in self.decided])

    @property
    def is_interrupted(self) -> bool:
        """Whether the user ended a stage."""
        is_interrupted = self.requirements is not None and self.requirements.is_interrupted
        return is_interrupted or any(end.is_interrupted for end in self.ended)


class FailedCase(Struct, frozen=True):
    """A case that failed.

    Attributes:
        case: the name of the case.
        failures: one sentence for each reason.
        again: the command that reproduces the failure.
    """

    case: str
    failures: tuple[str, ...]
    again: str


def failed_cases(suite: Campaign, closing: Closing, again: Callable[[str], str]) -> tuple[FailedCase, ...]:
    """Return the failed cases, those of the suite first; `again` returns the command that runs a case, by its name."""
    verdicts = [(result.case.name, result.verdict) for result in suite.failed]
    verdicts += [(made.case.name, made.verdict) for made in (*closing.cases, *closing.counterexamples)]
    return tuple(
        FailedCase(name, tuple(str(failure) for failure in verdict.failures), again(name))
        for name, verdict in verdicts
        if not verdict.passed
    )


class FoundFault(Struct, frozen=True):
    """A new case that passes, because it expects its end, but ends as no run of a correct model does.

    Attributes:
        case: the name of the case.
        end: the end of its run.
        message: the fault, as what the case does.
        again: the command that reproduces it.
    """

    case: str
    end: End
    message: str
    again: str


def found_faults(closing: Closing, again: Callable[[str], str]) -> tuple[FoundFault, ...]:
    """Return the faults that new cases found; `again` as in `failed_cases`."""
    free = [made for made in closing.cases if made.execution.forced_by is None]
    ends = [(made.case.name, made.execution.verdict.end, made.execution) for made in free]
    return tuple(
        FoundFault(name, end, _end_sentence(end, execution), again(name))
        for name, end, execution in ends
        if end in _WRONG_ENDS and not _is_chosen(end, execution.case)
    )


def _is_chosen(end: End, case: Case) -> bool:
    """Return whether a case may have been made so that it ends so: by its own limit, or as an input is away."""
    is_away = bool(case.injections or case.environment)
    return end is End.TIME_LIMIT and (is_away or case.limits.time_ns is not None)


class Consequence(Struct, frozen=True):
    """A failure of the run of a new case that occurs only because its state is forced.

    Attributes:
        name: the name of the case.
        forcing: what forces the state, as a clause.
        message: what is wrong.
        again: the command that reproduces it.
    """

    name: str
    forcing: str
    message: str
    again: str


def consequences_of_force(closing: Closing, again: Callable[[str], str]) -> tuple[Consequence, ...]:
    """Return what is wrong in forced states of new cases; `again` as in `failed_cases`."""
    return tuple(
        Consequence(made.case.name, made.forcing or "", message, again(made.case.name))
        for made in closing.cases
        for message in made.consequences
    )


def _end_sentence(end: End, execution: Execution) -> str:
    if end is End.TIME_LIMIT:
        return "ends at the time limit: it neither reaches the goal nor aborts before"
    last = run_end(execution.trace.records)
    detail = () if last is None else last.detail
    if end is End.LIVELOCK:
        return f"ends in a livelock: {describe_cycle(detail)}"
    return f"ends in an error of the model: {', '.join(detail)}"


class DecidedRequirement(Struct, frozen=True):
    """The decision about one requirement.

    Attributes:
        name: its name.
        status: the decision.
        reason: in which runs it holds, how the case violates it, what ended the search, why only cases judge it, or why
            it is switched off.
        case: the name of the case that violates it; `None` if it is not violated.
        execution: the run of that case, if it is a new one.
        option: the option of `scbm close` that raises the limit that ended the search, if there is one.
        is_built_in: whether it is a built-in requirement; one of the user may be called alike.
        certificate: the name of its certificate; `None` if it has none.
        undeclared: as in `words_of_undeclared`; empty if the answer does not rest on such variables.
        other_plans: what is known of other plans; `None` if the answer is about any plans, or no case violates it.
        other_execution: the run of the case with other plans that violates it, if closing has made it.
        asked: the sentence of a requirement of the command line; empty for others.
    """

    name: str
    status: RequirementStatus
    reason: str
    case: str | None = None
    execution: Execution | None = None
    option: str | None = None
    is_built_in: bool = True
    certificate: str | None = None
    undeclared: tuple[str, ...] = ()
    other_plans: OtherPlans | None = None
    other_execution: Execution | None = None
    asked: str = ""

    @property
    def holds(self) -> bool:
        """Whether it holds, perhaps under canonical plans only."""
        some = (RequirementStatus.HOLDS_CANONICAL, RequirementStatus.HOLDS_PLANNER)
        return self.status in (RequirementStatus.HOLDS, *some)


class RequirementDecisions(Struct, frozen=True):
    """The decisions about all requirements of a model.

    Attributes:
        decided: one decision for each: the built-in ones in the order of `BUILT_INS`, then those of the user.
        situations: the number of situations of runs that were explored.
        assumptions: what those that hold assume, one sentence each.
        is_interrupted: whether the user ended the search.
        certificates: the certificates of those that hold, each with its name.
    """

    decided: tuple[DecidedRequirement, ...]
    situations: int = 0
    assumptions: tuple[str, ...] = ()
    is_interrupted: bool = False
    certificates: tuple[tuple[str, Certificate], ...] = ()

    @property
    def left_to_cases(self) -> int:
        """The number of requirements that only cases judge; they do not count as undecided."""
        return sum(each.status is RequirementStatus.CASES_ONLY for each in self.decided)

    @property
    def not_decided_with_other_plans(self) -> dict[str, list[str]]:
        """The requirements that hold under the plans of the planner alone, by why other plans are not decided."""
        found: dict[str, list[str]] = {}
        for each in self.decided:
            if each.other_plans is not None and not each.other_plans.case:
                found.setdefault(each.other_plans.reason, []).append(each.name)
        return found

    def known(self, files: Mapping[str, str]) -> tuple[KnownDecision, ...]:
        """Return the decisions as stores keep them; `files` are those of cases, by name."""
        found = []
        for each in self.decided:
            others, case = each.other_plans, each.case or ""
            known = KnownDecision(
                each.asked or each.name, each.is_built_in, each.status, each.reason, case, each.undeclared
            )
            others = None if others is None else replace(others, file=files.get(others.case, ""))
            found.append(replace(known, file=files.get(case, ""), other_plans=others))
        return tuple(found)

    @property
    def is_open(self) -> bool:
        """Whether a requirement is undecided."""
        return any(each.status is RequirementStatus.UNDECIDED for each in self.decided)
