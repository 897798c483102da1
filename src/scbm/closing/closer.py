"""Decides every obligation of a model in stages, each for what the stages before it left open (decision 38).

Few runs are explored at once. Where they are not few, nominal and random cases run first, then changed ones, and then
as many runs are explored as the limits allow. Ctrl-C ends a stage; what was decided until then is the result.
"""

from __future__ import annotations

import re
from contextlib import contextmanager
from dataclasses import replace
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING

from scbm.cases import Case, Expectations
from scbm.cases.coverage import Aspect, Coverage, Obligation, Obligations, visited_by
from scbm.closing.advice.goal_search import GoalSearch
from scbm.closing.advice.suggestions import Oracles, suggest
from scbm.closing.decisions import Closing, ClosingCase, Decided, Decision, Stage, StageEnd
from scbm.closing.proofs.explored_proofs import explored_for_proofs
from scbm.closing.proofs.proofs import Proofs
from scbm.closing.runs.all_runs import AllRuns, CloseLimits, ObservedStates, RunScope
from scbm.closing.scripts.case_plans import CasePlans, PlanEffort
from scbm.closing.scripts.case_search import CaseSearch, bounded, minimal, without_leftovers
from scbm.closing.scripts.closing_injections import with_inputs
from scbm.closing.scripts.sampled_cases import SampledCases, as_closing_case
from scbm.model import Diagnostic, InputError, Place, PlanSet, Slug, State
from scbm.model.sources import outside_groups
from scbm.planning import DEFAULT_PLANNER
from scbm.testing import Campaign, Tester

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from scbm.closing.decisions import Suggestion
    from scbm.model import BehaviorModel, Predicate
    from scbm.testing import Execution
    from scbm.testing.batches.campaign_runs import Executor


_MAX_FOR_A_GOAL = 20_000
"""Maximum number of situations that are explored to verify a suggested goal."""

_MAX_PLANNED_FOR_A_GOAL = 30_000
"""Maximum number of states that are expanded to plan for such a goal, where that is not possible at once."""

_PLANNED_FOR_SUGGESTIONS = 250
"""All suggested goals together may take so many times the states of `CloseLimits.planning`: up to a minute."""

_MAX_FOR_CASES = 10_000
"""Maximum number of situations in which inputs change that are explored to find cases, where they prove nothing."""

_FEW_SITUATIONS = 30_000
"""So many situations are explored in some three seconds. With fewer, the graph of all runs decides all, and fastest."""

_PLANNED_FOR_CASES = 25
"""Plans of random cases may take so many times the states of `CloseLimits.planning`, those of changed cases again.

By default these are five million, which takes about half a minute.
"""


class Closer:
    """Closes one model.

    Attributes:
        model: the model.
    """

    def __init__(
        self,
        model: BehaviorModel,
        limits: CloseLimits = CloseLimits(),  # noqa: B008 - an immutable value
        progress: Callable[[str], None] | None = None,
        executor: Executor | None = None,
    ) -> None:
        """Prepare closing.

        Args:
            model: the model.
            limits: the limits of exploration and search.
            progress: called with what is being decided, with counts.
            executor: where random cases run; by default in this process.
        """
        self.model = model
        self._limits = limits
        self._executor = executor
        self._ended: list[StageEnd] = []
        self._progress = progress or (lambda _: None)
        self._plans = CasePlans(model)
        self._tester = Tester(model, plans=self._plans)
        self._obligations = Obligations.of(model)
        self._visited_for: dict[tuple[str, Predicate], int] = {}
        self._suggestion_states = 0
        self._outside = outside_groups(model)

    def close(self, suite: Campaign | None = None, wanted: Sequence[Obligation] | None = None) -> Closing:
        """Decide every obligation that a suite leaves open; without a suite, every obligation.

        Raises `InputError` if the model has no goals, or no initial state is allowed.

        Args:
            suite: the executed suite.
            wanted: the obligations to decide, each by the shortest case found; `None` for all, by few cases that visit
                much.
        """
        asked = tuple(self._obligations if wanted is None else wanted)
        self._refuse_without_goals()
        suite = suite or Campaign.of(self.model, ())
        self._ended = []
        proofs = Proofs(self.model)
        search = self._first_cases(suite, proofs, asked)
        few = replace(self._limits, situations=min(self._limits.situations, _FEW_SITUATIONS))
        runs = AllRuns(self.model, few, self._progress, explores=not self._is_interrupted)
        if not runs.starts and runs.stopped is None:
            message = "no combination of random values satisfies `initial_states`"
            raise InputError([Diagnostic(Slug.NO_INITIAL_STATE, message, Place(self.model.name))])
        runs, cases = self._cases(suite, search, runs, asked, short=wanted is not None)
        after = suite.coverage + Coverage(self._obligations, tuple((c.case.name, c.execution.visited) for c in cases))
        missing = sum(self._obligations.bit(o) for o in asked if proofs.cheap(o) is None) & ~after.visited
        explored = self._explored_proofs(runs, missing)
        proofs.explored = explored
        decided = tuple(self._decide(obligation, after, cases, proofs, runs) for obligation in asked)
        found = ((d.obligation, proofs.find(d.obligation)) for d in decided if d.certificate is not None)
        proved = [(obligation, proof) for obligation, proof in found if proof is not None]
        certificates = tuple(proofs.certificates(proved))
        runs = explored[-1] if explored else runs
        suggestions: tuple[Suggestion, ...] = ()
        with self._stage(Stage.SUGGESTIONS):
            proved = [] if self._is_interrupted else proved
            suggestions = self._suggestions([obligation for obligation, _ in proved], runs)
        ended = tuple(self._ended)
        return Closing(self.model, suite.coverage, after, decided, cases, certificates, suggestions, ended)

    # stages

    @property
    def _is_interrupted(self) -> bool:
        return any(end.is_interrupted for end in self._ended)

    @contextmanager
    def _stage(self, stage: Stage) -> Iterator[None]:
        """End a stage, and not closing, when the user interrupts it."""
        try:
            yield
        except KeyboardInterrupt:
            self._interrupt(stage)

    def _interrupt(self, stage: Stage) -> None:
        self._ended.append(StageEnd(stage, "it was interrupted", is_interrupted=True))

    def _first_cases(self, suite: Campaign, proofs: Proofs, asked: Sequence[Obligation]) -> SampledCases:
        """Run nominal and a few random cases. They count only where the graph of all runs decides less."""
        missing = sum(self._obligations.bit(o) for o in asked) & ~suite.coverage.visited
        never = sum(self._obligations.bit(o) for o in self._obligations if proofs.cheap(o) is not None)
        search = SampledCases(self._tester, self._plans, missing, never, self._progress)
        with self._stage(Stage.RANDOM):
            if search.missing:
                search.look(self._limits.random)
        return search

    def _sample(self, search: SampledCases, runs: AllRuns) -> None:
        """Run nominal, random and changed cases."""
        planning = self._limits.planning * _PLANNED_FOR_CASES
        with self._stage(Stage.RANDOM):
            search.sample(runs.starts, self._limits.random, planning, self._executor)
            self._note(Stage.RANDOM, search.limit)
        if not self._is_interrupted:
            with self._stage(Stage.SEARCH):
                search.change(self._limits.changes, planning)
                self._note(Stage.SEARCH, search.limit)

    def _note(self, stage: Stage, limit: tuple[str, str | None] | None) -> None:
        if limit is not None:
            self._ended.append(StageEnd(stage, *limit))

    def _explored(self, few: AllRuns, missing: int) -> AllRuns:
        """Return the graph of all runs as far as the limits allow, if anything is missing that it can decide."""
        if not missing or not few.may_grow or self._is_interrupted:
            return few
        return AllRuns(self.model, self._limits, self._progress)

    def _refuse_without_goals(self) -> None:
        if not self.model.goals:
            message, remedy = "the model has no goals, so there are no runs", "add `goals:` to the model"
            raise InputError([Diagnostic(Slug.NO_GOALS, message, Place(self.model.name), remedy)])

    # cases

    def _cases(
        self, suite: Campaign, search: SampledCases, runs: AllRuns, asked: Sequence[Obligation], *, short: bool
    ) -> tuple[AllRuns, tuple[ClosingCase, ...]]:
        """Return the runs that were explored, and the new cases."""
        missing, never = search.wanted, search.impossible
        planning = self._limits.planning * _PLANNED_FOR_CASES
        is_sampled = runs.stopped is not None and not runs.is_interrupted and bool(missing & ~never)
        if is_sampled:
            self._sample(search, runs)
            runs = self._explored(runs, search.missing)
        if runs.is_interrupted and not self._is_interrupted:
            self._interrupt(Stage.GRAPH)
        sampled = [] if runs.stopped is None and not is_sampled else search.found
        left = missing if runs.stopped is None else missing & ~_visited(sampled)
        with self._plans.effort(PlanEffort.ALL if runs.stopped is None else PlanEffort.WHOLE, planning):
            found = self._searched(runs, left, never, sampled, short=short)
        found += _helpful(search.found if self._is_interrupted else sampled, missing & ~_visited(found))
        if missing & ~never & ~_visited(found) and runs.stopped is not None and not self._is_interrupted:
            self._ended.append(StageEnd(Stage.GRAPH, runs.stopped, runs.option))
        with self._plans.effort(PlanEffort.ALL if runs.stopped is None else PlanEffort.BRIEF, planning):
            return runs, self._finished(found, missing, suite, asked)

    def _searched(
        self, runs: AllRuns, missing: int, never: int, sampled: Sequence[Execution], *, short: bool
    ) -> list[Execution]:
        """Return the runs of cases that follow paths through the graph, or in which inputs change."""
        found: list[Execution] = []
        if self._is_interrupted:
            return found
        search = CaseSearch(runs, self._tester, missing, never, self._limits, found, self._progress)
        with self._stage(Stage.SEARCH):
            self._progress("looking for cases")
            search.run(short=short)
            found += self._with_inputs([*found, *sampled], runs, missing)
            found += self._with_changes_from_outside(runs, missing & ~_visited(found), never)
        return found

    def _with_inputs(self, found: Sequence[Execution], runs: AllRuns, missing: int) -> Iterator[Execution]:
        """Yield runs with an injection into inputs, for automatic transitions that no run without injections takes."""
        plain = [self._plain(runs, goal) for goal in runs.plannable] if runs.starts else []
        for transition in self.model.automatic_transitions:
            bit = self._obligations.bit_of(transition.name, Aspect.TAKEN)
            if not bit & missing & ~runs.visited:
                continue
            bases = (*plain, *(execution.case for execution in found))
            attempts = (case for base in bases for case in with_inputs(self.model, transition, base))
            for _, case in zip(range(self._limits.candidates), attempts, strict=False):
                execution = bounded(self._tester, case)
                if execution is not None and execution.visited & bit:
                    yield execution
                    break

    def _with_changes_from_outside(self, closed: AllRuns, missing: int, never: int) -> list[Execution]:
        """Return runs in which inputs and published values change, for what no other run visits."""
        if not missing & ~never or not self._outside:
            return []
        self._progress("exploring runs in which inputs change")
        limits = self._limits
        if closed.stopped is not None:  # then all runs are too many in the open world, too
            limits = replace(limits, situations=min(_MAX_FOR_CASES, limits.situations))
        runs = AllRuns(self.model, limits, self._progress, RunScope(self._outside))
        if runs.is_interrupted:
            raise KeyboardInterrupt
        if runs.stopped is not None and closed.stopped is None:
            self._ended.append(StageEnd(Stage.GRAPH, runs.stopped, runs.option))
        search = CaseSearch(runs, self._tester, missing, never, replace(limits, beyond=0))
        search.run(short=True)
        return search.found

    def _plain(self, runs: AllRuns, goal: tuple[str, Predicate]) -> Case:
        return Case(goal[0], *goal, State(self.model.space, dict(runs.starts[0].values)))

    def _finished(
        self, found: Sequence[Execution], missing: int, suite: Campaign, asked: Sequence[Obligation]
    ) -> tuple[ClosingCase, ...]:
        """Return the cases that are kept. The first Ctrl-C does not end that: it is short, and all would be lost."""
        visited = suite.coverage.visited
        kept = minimal(found, visited)
        needed = {id(each): _alone(each, kept, visited | ~missing) for each in kept}

        def finish() -> tuple[ClosingCase, ...]:
            plain = [as_closing_case(each, needed[id(each)], self._tester) for each in kept]
            return tuple(self._named(plain, suite, asked))

        try:
            return finish()
        except KeyboardInterrupt:
            self._interrupt(Stage.SEARCH)
            return finish()

    def _named(self, kept: Sequence[Execution], suite: Campaign, asked: Sequence[Obligation]) -> Iterator[ClosingCase]:
        """Yield the cases with names and expectations, and what each adds to the cases before it."""
        visited = suite.coverage.visited
        taken = [name for name, _ in suite.coverage.cases]
        for execution in (without_leftovers(each, self._tester) for each in kept):
            name = _new_name(execution.case.goal, taken)
            taken.append(name)
            adds = tuple(o for o in asked if self._obligations.bit(o) & execution.visited & ~visited)
            visited |= execution.visited
            expected = Expectations(verdict=execution.verdict.end, visits=tuple(o for o in adds if o.counts))
            case = replace(execution.case, name=name, expect=expected)
            yield ClosingCase(case, self._tester.execute(case), adds)

    def _explored_proofs(self, runs: AllRuns, missing: int) -> tuple[AllRuns, ...]:
        """Return explored runs that prove something about what is missing."""
        if runs.stopped is not None:  # where these are too many, others are, too
            return ()
        try:
            return explored_for_proofs(self.model, self._limits, self._progress, missing, runs)
        except KeyboardInterrupt:
            self._interrupt(Stage.GRAPH)
            return ()

    # decisions

    def _decide(
        self, obligation: Obligation, after: Coverage, cases: Sequence[ClosingCase], proofs: Proofs, runs: AllRuns
    ) -> Decided:
        bit = self._obligations.bit(obligation)
        for name, visited in after.cases:
            if visited & bit:
                return Decided(obligation, Decision.COVERED, self._how(obligation, name, cases), case=name)
        proof = proofs.find(obligation)
        if proof is not None:
            decision = Decision.UNCOVERABLE if proof.plans is PlanSet.ANY else Decision.EXCLUDED
            return Decided(obligation, decision, proof.reason, certificate=proof.certificate)
        return Decided(obligation, Decision.UNDECIDED, _what_stopped(runs, bit))

    def _how(self, obligation: Obligation, name: str, cases: Sequence[ClosingCase]) -> str:
        execution = next((each.execution for each in cases if each.case.name == name), None)
        if execution is None:
            return f"{name}, a case of the suite, visits it"
        bit = self._obligations.bit(obligation)
        first = next(r for r in execution.trace.records if visited_by((r,), self._obligations) & bit)
        return f"{name} visits it after {first.at_ns / 1e9:.3f} s"

    # suggestions

    def _suggestions(self, uncoverable: Sequence[Obligation], runs: AllRuns) -> tuple[Suggestion, ...]:
        if not uncoverable:
            return ()
        self._progress("looking for suggestions")
        observed = ObservedStates(runs)
        self._suggestion_states = self._limits.planning * _PLANNED_FOR_SUGGESTIONS
        oracles = Oracles(observed.can_hold, observed if observed.are_known else None, self._makes_coverable)
        suggestions = suggest(self.model, uncoverable, oracles, GoalSearch(self.model, runs.planner))
        if self._suggestion_states <= 0:
            why = f"{len(self._visited_for):,} goals were tried, and there may be others"
            self._ended.append(StageEnd(Stage.SUGGESTIONS, why, "--max-planning"))
        return suggestions

    def _makes_coverable(self, extended: BehaviorModel, obligations: Sequence[Obligation]) -> bool:
        """Return whether cases for the last goal of an extended model visit all of these obligations."""
        goal = extended.goals[-1]
        if goal not in self._visited_for:
            if self._suggestion_states <= 0:
                return False
            self._visited_for[goal] = self._visited_by_closing(replace(extended, goals=(goal,)))
        return all(self._visited_for[goal] & self._obligations.bit(obligation) for obligation in obligations)

    def _visited_by_closing(self, model: BehaviorModel) -> int:
        """Return what cases of a model with the same operations visit."""
        planning = min(self._limits.planning, _MAX_PLANNED_FOR_A_GOAL)
        most = min(self._limits.situations, _MAX_FOR_A_GOAL)
        limits = replace(self._limits, situations=most, planning=planning, beyond=0)
        self._progress(
            f"looking for suggestions: trying {model.goals[0][0]}, {len(self._visited_for):,} goals tried, "
            f"at most {self._suggestion_states:,} more states"
        )
        runs = AllRuns(model, limits, lambda _: None)
        self._suggestion_states -= runs.situations + runs.planned
        if runs.is_interrupted:
            raise KeyboardInterrupt
        search = CaseSearch(runs, Tester(model), runs.visits.mask, 0, limits)
        search.run(short=False)
        return _visited(search.found)


def _visited(executions: Iterable[Execution]) -> int:
    return reduce(or_, (execution.visited for execution in executions), 0)


def _helpful(executions: Sequence[Execution], missing: int) -> list[Execution]:
    """Return runs that visit all of the missing that any of them visits: again and again the one with most of it."""
    found = []
    while missing & _visited(executions):
        found.append(max(executions, key=lambda each: (each.visited & missing).bit_count()))
        missing &= ~found[-1].visited
    return found


def _alone(execution: Execution, kept: Sequence[Execution], others: int) -> int:
    """Return what one run visits and no other one, nor `others`."""
    return execution.visited & ~_visited(each for each in kept if each is not execution) & ~others


def _what_stopped(runs: AllRuns, bit: int) -> str:
    if runs.other_planner is not None:
        return (
            f"no case that visits it was found; under the planner `{runs.other_planner}` only proofs count that hold "
            f"whichever plan is chosen, and there is none: `--planner {DEFAULT_PLANNER}` explores all runs"
        )
    if (runs.visited | runs.cut_off) & bit:
        simulated = "in a simulation planning takes no time, and deadlines pass last in their instant"
        return f"there are runs that visit it, but none of the cases that were tried is one of them: {simulated}"
    return f"no run that visits it was found, and not all runs were explored: {runs.stopped}"


def _new_name(goal: str, taken: Sequence[str]) -> str:
    """Return a new name for a case: the name of its goal with a number."""
    base = re.sub(r"[^A-Za-z0-9_]+", "_", goal).strip("_") or "case"
    number = 1
    while f"{base}-{number}" in taken:
        number += 1
    return f"{base}-{number}"
