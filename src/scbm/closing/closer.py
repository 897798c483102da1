"""Decides every obligation of a model in stages, each for what the stages before it left open (decision 38).

Few runs are explored at once. Where they are not few, nominal and random cases run first, then changed ones, and then
as many runs are explored as the limits allow. Ctrl-C ends all stages; what was decided until then is the result.
"""

from __future__ import annotations

import gc
import re
from contextlib import contextmanager
from functools import partial, reduce
from hashlib import sha256
from itertools import count
from operator import and_, or_
from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.cases import Case, Expectations
from scbm.cases.coverage import Coverage, Obligation, Obligations, visited_by
from scbm.cases.trace import End, ends_of, ranges_of_goals
from scbm.closing.advice.goal_search import GoalSearch
from scbm.closing.advice.other_plans import suggest_other_plans
from scbm.closing.advice.suggestions import Oracles, TriedVisits, in_order_of, suggest
from scbm.closing.case_searches import CASE_SEARCHES, ClosingTask, helpful, takes_classes
from scbm.closing.counted_activity import CountedActivity
from scbm.closing.decisions import Closing, ClosingCase, Decided, Decision, Stage, StageEnd
from scbm.closing.few_collections import few_collections
from scbm.closing.interruption import Interruption
from scbm.closing.proofs.proofs import Proofs, explored_for_proofs
from scbm.closing.runs.all_runs import AllRuns, CloseLimits, ObservedStates
from scbm.closing.scripts.case_plans import CasePlans, PlanEffort, with_canonical_plans
from scbm.closing.scripts.case_search import (
    CaseSearch,
    Merit,
    in_order,
    natural,
    shortest_for_each,
    with_makers,
    without_leftovers,
)
from scbm.closing.scripts.forced_cases import ForcedCases
from scbm.closing.scripts.sampled_cases import SampledCases, as_closing_case
from scbm.closing.symbolic.reached_sets import NoSetError
from scbm.closing.symbolic.set_proofs import SetProofs
from scbm.model import Diagnostic, GoalOrder, InputError, Place, PlanSet, RunPlans, Slug
from scbm.planning import DEFAULT_PLANNER, PlanCache, Planner
from scbm.testing import Campaign, Execution, Tester

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from scbm.closing.decisions import Suggestion
    from scbm.model import BehaviorModel, Predicate
    from scbm.testing.batches.campaign_runs import Executor


_MAX_FOR_A_GOAL = 20_000
"""Maximum number of situations that are explored to verify a suggested goal."""

_DIGITS = 6
"""Number of hexadecimal digits of a digest in the name of a case."""

_MAX_PLANNED_FOR_A_GOAL = 30_000
"""Maximum number of states that are expanded to plan for such a goal, where that is not possible at once."""

_PLANNED_FOR_SUGGESTIONS = 250
"""All suggested goals together may take so many times the states of `CloseLimits.planning`: up to a minute."""

_SHARE_OF_ALL_VALUES = 10
"""The divisor of the limit of situations for proofs about inputs of many values that make little difference.

Each of these values leads on from each situation, so such a graph is complete soon or never.
"""

_FEW_SITUATIONS = 30_000
"""Maximum number of situations of the small graph, which takes some three seconds and decides small models at once."""

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
        interruption: Interruption | None = None,
    ) -> None:
        """Prepare closing.

        Args:
            model: the model.
            limits: the limits of exploration and search.
            progress: called with what is being decided, with counts.
            executor: where random cases run; by default in this process.
            interruption: the handling of Ctrl-C, if the caller handles it.
        """
        self.model = model
        self._limits = limits
        self._executor = executor
        self._interruption = interruption or Interruption()
        self._ended: list[StageEnd] = []
        self._show = progress or (lambda _: None)
        self._progress = self._interruption.checked(self._show_activity)
        self._asked = self._left = 0
        self._without_set: list[StageEnd] = []
        self._plans = CasePlans(model)
        # Cases are searched for under canonical plans, which do not depend on what is changed in a case.
        self._tester = Tester(with_canonical_plans(model), plans=self._plans)
        self._obligations = Obligations.of(model)
        self._visited_for: dict[tuple[str, Predicate], TriedVisits] = {}
        self._suggestion_states = 0
        self._goal_planner = Planner.of(model)
        self._takes_classes = takes_classes(model)
        self._open_runs: list[AllRuns] = []
        self._one_case_each = self._is_partial = self._has_collected = False

    def close(
        self,
        suite: Campaign | None = None,
        wanted: Sequence[Obligation] | None = None,
        *,
        one_case_each: bool = False,
    ) -> Closing:
        """Decide every obligation that a suite leaves open; without a suite, every obligation.

        Raises `InputError` if the model has no goals, or no initial state is allowed.

        Args:
            suite: the executed suite.
            wanted: the obligations to decide, each by the shortest case found; `None` for all, by few cases that visit
                much.
            one_case_each: whether each obligation gets the shortest case found, even if longer cases visit more.
        """
        with few_collections():
            return self._close(suite, wanted, one_case_each=one_case_each)

    def _close(self, suite: Campaign | None, wanted: Sequence[Obligation] | None, *, one_case_each: bool) -> Closing:
        asked = tuple(self._obligations if wanted is None else wanted)
        self._refuse_without_goals()
        suite = suite or Campaign.of(self.model, ())
        self._ended, self._open_runs = [], []
        self._has_collected, self._without_set = False, []
        self._asked, self._left = len(asked), len(asked)
        self._one_case_each, self._is_partial = one_case_each, wanted is not None
        proofs = Proofs(self.model)
        runs, cases = self._run_cases(suite, proofs, asked, short=one_case_each or wanted is not None)
        after = suite.coverage + Coverage(self._obligations, tuple((c.case.name, c.execution.visited) for c in cases))
        visitors = _CaseVisits(suite, cases)
        missing = sum(self._obligations.bit(o) for o in asked if proofs.cheap(o) is None) & ~visitors.freely
        self._left = missing.bit_count()
        explored = self._explored_proofs(runs, missing, proofs)
        proofs.explored = explored
        decided = tuple(self._decide(obligation, visitors, cases, proofs, runs) for obligation in asked)
        excluded = [each.obligation for each in decided if each.decision is Decision.EXCLUDED]
        found = ((d.obligation, proofs.find(d.obligation)) for d in decided if d.certificate is not None)
        proved = [(obligation, proof) for obligation, proof in found if proof is not None]
        certificates = tuple(proofs.certificates(proved))
        runs = explored[-1] if explored else runs
        suggestions: tuple[Suggestion, ...] = ()
        self._left = sum(each.decision is Decision.UNDECIDED for each in decided)
        with self._stage(Stage.SUGGESTIONS):
            proved = [] if self.is_interrupted else proved
            suggestions = self._suggestions([obligation for obligation, _ in proved], excluded, runs)
        is_open = any(each.decision is Decision.UNDECIDED for each in decided)
        ended = (*self._ended, *(self._without_set if is_open else ()))
        return Closing(self.model, suite.coverage, after, decided, cases, certificates, suggestions, ended)

    def find_cases(self, wanted: Sequence[Obligation]) -> tuple[Execution, ...]:
        """Return the runs of few new cases that visit much of `wanted`, without proofs."""
        suite = Campaign.of(self.model, ())
        _, cases = self._run_cases(suite, Proofs(self.model), wanted, short=False)
        return tuple(each.execution for each in cases)

    def _run_cases(
        self, suite: Campaign, proofs: Proofs, asked: Sequence[Obligation], *, short: bool
    ) -> tuple[AllRuns, tuple[ClosingCase, ...]]:
        """Return the runs that were explored, and the new cases. Raise `InputError` without an initial state."""
        search = self._first_cases(suite, proofs, asked)
        few = replace(self._limits, situations=min(self._limits.situations, _FEW_SITUATIONS))
        runs = self._explored(few, may_go_on=few != self._limits)
        if not runs.starts and runs.stopped is None:
            message = "no combination of random values satisfies `initial_states`"
            raise InputError([Diagnostic(Slug.NO_INITIAL_STATE, message, Place(self.model.name))])
        if runs.stopped is not None and not self.is_interrupted:
            with self._stage(Stage.GRAPH):
                search.rule_out(self._never(proofs, search.missing))
                self._left = search.missing.bit_count()
        return self._cases(suite, search, runs, asked, proofs, short=short)

    # stages

    @property
    def is_interrupted(self) -> bool:
        """Whether the user interrupted a stage."""
        return any(end.is_interrupted for end in self._ended)

    @contextmanager
    def _stage(self, stage: Stage) -> Iterator[None]:
        """End a stage, and not closing, when the user interrupts it."""
        try:
            with self._interruption.stage():
                yield
        except KeyboardInterrupt:
            self._interrupt(stage)

    def _show_activity(self, text: str) -> None:
        """Show an activity behind the number of obligations that are still to decide."""
        prefix = f"{self._left:,} of {self._asked:,} open; "
        self._show(text.behind(prefix) if isinstance(text, CountedActivity) else f"{prefix}{text}")

    def _interrupt(self, stage: Stage) -> None:
        """Note the stage that the user interrupted; later ones do not begin."""
        if not self.is_interrupted:
            self._ended.append(StageEnd(stage, "it was interrupted", is_interrupted=True))

    def _first_cases(self, suite: Campaign, proofs: Proofs, asked: Sequence[Obligation]) -> SampledCases:
        """Run nominal and a few random cases. They count only where the graph of all runs decides less."""
        missing = sum(self._obligations.bit(o) for o in asked) & ~_freely(suite)
        never = sum(self._obligations.bit(o) for o in self._obligations if proofs.cheap(o) is not None)
        search = SampledCases(self._tester, self._plans, missing, never, self._progress)
        with self._stage(Stage.RANDOM):
            if search.missing:
                search.look(self._limits.random)
        self._left = search.missing.bit_count()
        return search

    def _sample(self, search: SampledCases, runs: AllRuns) -> None:
        """Run nominal, random and changed cases."""
        planning = self._limits.planning * _PLANNED_FOR_CASES
        with self._stage(Stage.RANDOM):
            search.sample(runs.starts, self._limits.random, planning, self._executor)
            self._note(Stage.RANDOM, search.limit)
        if not self.is_interrupted:
            with self._stage(Stage.SEARCH):
                search.change(self._limits.changes, planning)
                self._note(Stage.SEARCH, search.limit)

    def _note(self, stage: Stage, limit: tuple[str, str | None] | None) -> None:
        if limit is not None:
            self._ended.append(StageEnd(stage, *limit))

    def _explored(self, limits: CloseLimits, runs: AllRuns | None = None, *, may_go_on: bool = False) -> AllRuns:
        """Return the graph of all runs as far as limits allow; one that explores nothing after an interruption.

        Args:
            limits: the limits.
            runs: the runs within lower limits, if they were explored.
            may_go_on: whether the runs may be explored further within higher limits.
        """
        try:
            with self._interruption.stage():
                if runs is not None:
                    return runs.within(limits)
                explores = not self.is_interrupted
                planner = self._goal_planner
                return AllRuns(
                    self.model, limits, self._progress, explores=explores, planner=planner, may_go_on=may_go_on
                )
        except KeyboardInterrupt:
            self._interrupt(Stage.GRAPH)
            return AllRuns(self.model, limits, self._progress, explores=False)

    def _sets_for(self, proofs: Proofs, missing: int) -> SetProofs | None:
        """Return the proofs by a set of all situations; they are looked for once."""
        if missing and not self._has_collected:
            self._has_collected = True
            try:
                proofs.sets = SetProofs.of(self.model, missing, self._progress)
            except NoSetError as error:
                self._without_set.append(StageEnd(Stage.SETS, str(error)))
        return proofs.sets

    def _never(self, proofs: Proofs, missing: int, plans: PlanSet = PlanSet.ANY) -> int:
        """Return what is missing and a set proves that no run with these plans visits, as bits."""
        sets = self._sets_for(proofs, missing)
        never = 0 if sets is None else sets.never
        return never if plans is PlanSet.ANY else never | self._never_with_canonical_plans(proofs, missing & ~never)

    def _never_with_canonical_plans(self, proofs: Proofs, missing: int) -> int:
        """Return the obligations that a set excludes under canonical plans, as bits; none under another planner."""
        is_canonical = self._goal_planner.name == DEFAULT_PLANNER
        if not missing or proofs.sets is None or not is_canonical or self.model.runs.proved_plans is PlanSet.ANY:
            return 0
        try:
            proofs.canonical_sets = proofs.sets.canonical(missing)
        except NoSetError as error:
            self._without_set.append(StageEnd(Stage.SETS, str(error)))
            return 0
        return proofs.canonical_sets.never

    def _refuse_without_goals(self) -> None:
        if not self.model.goals:
            message, remedy = "the model has no goals, so there are no runs", "add `goals:` to the model"
            raise InputError([Diagnostic(Slug.NO_GOALS, message, Place(self.model.name), remedy)])

    # cases

    def _cases(  # noqa: PLR0913 - what was found so far
        self,
        suite: Campaign,
        search: SampledCases,
        runs: AllRuns,
        asked: Sequence[Obligation],
        proofs: Proofs,
        *,
        short: bool,
    ) -> tuple[AllRuns, tuple[ClosingCase, ...]]:
        """Return the runs that were explored, and the new cases."""
        missing, never = search.wanted, search.unreachable
        planning = self._limits.planning * _PLANNED_FOR_CASES
        is_sampled = runs.stopped is not None and not runs.is_interrupted and bool(missing & ~never)
        if is_sampled:
            self._sample(search, runs)
            if not self.is_interrupted:
                with self._stage(Stage.GRAPH):
                    search.rule_out(self._never_with_canonical_plans(proofs, search.missing))
            never = search.unreachable
            self._left = search.missing.bit_count()
            if search.missing and runs.may_grow and not self.is_interrupted:
                runs = self._explored(self._limits, runs)
        if runs.is_interrupted and not self.is_interrupted:
            self._interrupt(Stage.GRAPH)
        task = ClosingTask(
            self._tester,
            self._limits,
            self._progress,
            runs,
            suite.coverage.visited,
            samples=search,
            sampled=[] if runs.stopped is None and not is_sampled else search.found,
            is_short=short,
            one_each=self._one_case_each,
            cases_of=self._cases_of,
            ended=self._ended,
            open_runs=self._open_runs,
            never=partial(self._never, proofs),
        )
        found = task.found
        with self._plans.effort(PlanEffort.ALL if runs.stopped is None else PlanEffort.WHOLE, planning):
            self._search(task)
        if self.is_interrupted:
            found += helpful(search.found, missing & ~Merit.of(found).freely)
        if missing & ~never & ~Merit.of(found).visited and runs.stopped is not None and not self.is_interrupted:
            self._ended.append(StageEnd(Stage.GRAPH, runs.stopped, runs.option))
        with self._plans.effort(PlanEffort.ALL if runs.stopped is None else PlanEffort.BRIEF, planning):
            return runs, self._finished(found, missing, suite, asked)

    def _search(self, task: ClosingTask) -> None:
        """Search for cases, one search after the other."""
        for entry in CASE_SEARCHES.values():
            if self.is_interrupted:
                return
            with self._stage(Stage.SEARCH):
                self._progress(f"looking for cases: {entry.finds}")
                entry.search(task)

    def _cases_of(self, other: BehaviorModel, wanted: Sequence[Obligation]) -> Iterator[Execution]:
        """Yield the runs of new cases of another model within the same limits."""
        closer = Closer(other, self._limits, self._progress, self._executor, self._interruption)
        yield from closer.find_cases(wanted)
        if closer.is_interrupted:
            raise KeyboardInterrupt

    def _finished(
        self, found: Sequence[Execution], missing: int, suite: Campaign, asked: Sequence[Obligation]
    ) -> tuple[ClosingCase, ...]:
        """Return the cases that are kept. The first Ctrl-C does not end that: it is short, and all would be lost.

        The second one does.
        """
        before = Merit(suite.coverage.visited, _freely(suite))
        about = shortest_for_each(found, missing) if self._one_case_each else {}
        kept = [each for each in in_order(found) if id(each) in about]
        if not about:
            kept = natural(found, before, missing, self._obligations)
        purposes = [about.get(id(each), 0) for each in kept]
        needed = [_alone(each, kept, before) & missing | about.get(id(each), 0) for each in kept]

        def finish() -> tuple[ClosingCase, ...]:
            plain = [as_closing_case(each, bits, self._tester) for each, bits in zip(kept, needed, strict=True)]
            return tuple(self._named(zip(plain, purposes, strict=True), suite, asked))

        try:
            return finish()
        except KeyboardInterrupt:
            if self._interruption.is_asked:
                raise
            self._interrupt(Stage.SEARCH)
            return finish()

    def _named(
        self, kept: Iterable[tuple[Execution, int]], suite: Campaign, asked: Sequence[Obligation]
    ) -> Iterator[ClosingCase]:
        """Yield the cases with names and expectations, and what each is for or adds to the cases before it."""
        before = Merit(suite.coverage.visited, _freely(suite))
        taken = [name for name, _ in suite.coverage.cases]
        for execution, purpose in ((without_leftovers(each, self._tester), purpose) for each, purpose in kept):
            new = Merit.of((execution,)).beyond(before) | purpose
            adds = tuple(o for o in asked if self._obligations.bit(o) & new)
            before = before.and_also(Merit.of((execution,)))
            case = self._expecting(with_makers(execution), execution, [o for o in adds if o.counts])
            case = replace(case, name=self._new_name(case, taken))
            taken.append(case.name)
            by_force = tuple(o for o in adds if self._obligations.bit(o) & execution.forced)
            yield ClosingCase(case, self._tester.execute(case), adds, by_force)

    def _new_name(self, case: Case, taken: Sequence[str]) -> str:
        """Return a new name for a case: the name of its goal, or of the first and the last one, with a number.

        A case for some obligations has a digest of its content: it is kept beside others that were made alone.
        """
        ends = dict.fromkeys((case.goals[0].name, case.goals[-1].name))
        base = "_then_".join(re.sub(r"[^A-Za-z0-9_]+", "_", goal).strip("_") or "case" for goal in ends)
        if self._is_partial:
            from scbm.files import write_case  # noqa: PLC0415 - only cases for some obligations need it

            text = write_case(replace(case, name="case"), self.model, None)
            base = f"{base}-{sha256(text.encode()).hexdigest()[:_DIGITS]}"
            if base not in taken:
                return base
        number = next(number for number in count(1) if f"{base}-{number}" not in taken)
        return f"{base}-{number}"

    def _expecting(self, case: Case, execution: Execution, visits: Sequence[Obligation]) -> Case:
        """Return a case that expects what each of its runs has shown: its end, and its first visits."""
        records = execution.trace.records
        left = dict.fromkeys(visits)
        goals = []
        for goal, indices, ended in zip(case.goals, ranges_of_goals(records), ends_of(records), strict=True):
            visited = visited_by(records[indices.start : indices.stop], self._obligations)
            first = tuple(each for each in left if self._obligations.bit(each) & visited)
            left = {each: None for each in left if each not in first}
            goals.append(replace(goal, expect=Expectations(verdict=End(ended.end), visits=first)))
        return case.with_goals(goals)

    def _explored_proofs(self, runs: AllRuns, missing: int, proofs: Proofs) -> tuple[AllRuns, ...]:
        """Return explored runs that prove something about what is missing."""
        if runs.stopped is not None:  # where these are too many, others are, too
            return ()
        known, limits = (runs, *self._open_runs), self._limits
        if self._takes_classes:
            limits = replace(limits, situations=limits.situations // _SHARE_OF_ALL_VALUES)
        try:
            with self._interruption.stage():
                bounds = None if self.is_interrupted else limits
                by_sets = partial(self._sets_for, proofs)
                found = explored_for_proofs(self.model, bounds, self._progress, missing, known, by_sets)
        except KeyboardInterrupt:
            self._interrupt(Stage.GRAPH)
            return explored_for_proofs(self.model, None, self._progress, missing, known)
        if proofs.sets is not None:
            missing &= ~proofs.sets.never
        left = reduce(and_, (each.visited | each.cut_off for each in found), missing)
        if self._takes_classes and left and not any(each.plans is self.model.runs.proved_plans for each in found):
            noun = "situation" if limits.situations == 1 else "situations"
            reason = f"runs in which inputs take all of their values can be in more than {limits.situations:,} {noun}"
            self._ended.append(StageEnd(Stage.GRAPH, reason, "--max-states"))
        return found

    # decisions

    def _decide(
        self, obligation: Obligation, visitors: _CaseVisits, cases: Sequence[ClosingCase], proofs: Proofs, runs: AllRuns
    ) -> Decided:
        bit = self._obligations.bit(obligation)
        name = visitors.free(bit)
        if name is not None:
            return Decided(obligation, Decision.COVERED, self._how(obligation, name, cases), case=name)
        proof, by_force = proofs.find(obligation), visitors.any(bit)
        if proof is not None:
            decision = Decision.UNCOVERABLE if proof.plans is PlanSet.ANY else Decision.EXCLUDED
            return Decided(obligation, decision, proof.reason, by_force, proof.certificate, proof.kind)
        return Decided(obligation, Decision.UNDECIDED, _what_stopped(runs, self._open_runs, bit), by_force)

    def _how(self, obligation: Obligation, name: str, cases: Sequence[ClosingCase]) -> str:
        execution = next((each.execution for each in cases if each.case.name == name), None)
        if execution is None:
            return f"{name}, a case of the suite, visits it"
        bit = self._obligations.bit(obligation)
        first = next(r for r in execution.trace.records if visited_by((r,), self._obligations) & bit)
        return f"{name} visits it after {first.at_ns / 1e9:.3f} s"

    # suggestions

    def _suggestions(
        self, uncoverable: Sequence[Obligation], excluded: Sequence[Obligation], runs: AllRuns
    ) -> tuple[Suggestion, ...]:
        if not uncoverable:
            return ()
        self._progress("looking for suggestions")
        observed = ObservedStates(runs)
        self._suggestion_states = self._limits.planning * _PLANNED_FOR_SUGGESTIONS
        oracles = Oracles(observed.can_hold, observed.where if observed.are_known else None, self._visits_for_last_goal)
        with _frozen_objects():
            suggestions = suggest(self.model, uncoverable, oracles, GoalSearch(self.model, runs.planner))
        if self._suggestion_states <= 0:
            why = f"{len(self._visited_for):,} goals were tried, and there may be others"
            self._ended.append(StageEnd(Stage.SUGGESTIONS, why, "--max-planning"))
        others = suggest_other_plans(self.model, excluded, self._visited_by_closing)
        return in_order_of((*others, *suggestions), self.model)

    def _visits_for_last_goal(self, extended: BehaviorModel) -> TriedVisits:
        """Return what cases for the last goal of an extended model visit; nothing beyond the limit of suggestions."""
        goal = extended.goals[-1]
        if goal not in self._visited_for:
            if self._suggestion_states <= 0:
                return TriedVisits()
            self._progress(
                f"looking for suggestions: trying {goal[0]}, {len(self._visited_for):,} goals tried, "
                f"at most {self._suggestion_states:,} more states"
            )
            one_goal = replace(extended, goals=(goal,))
            self._visited_for[goal] = self._visited_by_closing(one_goal, self._goal_planner.with_goals_of(one_goal))
            gc.collect()  # the explored runs have cycles
            gc.freeze()  # what is left is cached, so the next search for cycles need not look at it
        return self._visited_for[goal]

    def _visited_by_closing(self, model: BehaviorModel, planner: Planner | None = None) -> TriedVisits:
        """Return what cases of a model visit that nothing changes from outside; `planner` is one of the model."""
        planning = min(self._limits.planning, _MAX_PLANNED_FOR_A_GOAL)
        most = min(self._limits.situations, _MAX_FOR_A_GOAL)
        limits = replace(self._limits, situations=most, planning=planning, beyond=0)
        program = self._tester.program.of_mutant(model)  # models with other goals are compiled once
        runs = AllRuns(model, limits, lambda _: None, planner=planner, program=program)
        self._suggestion_states -= runs.situations + runs.planned
        if runs.is_interrupted:
            raise KeyboardInterrupt
        plans = PlanCache(runs.planner)
        tester, found = Tester(model, plans=plans, program=program), list[Execution]()
        search = CaseSearch(runs, tester, runs.visits.mask, 0, limits, found, plans=plans)
        search.run(short=False)
        force = ForcedCases(tester, runs.visits.mask & ~Merit.of(found).visited, 0, limits.candidates, found)
        force.in_graph(search, runs.visits.current, short=False)
        merit, obligations = Merit.of(found), Obligations.of(model)
        by_force = merit.visited & ~merit.freely
        return TriedVisits(
            frozenset(each for each in obligations if obligations.bit(each) & merit.freely),
            frozenset(each for each in obligations if obligations.bit(each) & by_force),
        )


@contextmanager
def _frozen_objects() -> Iterator[None]:
    """Let Python search for cycles among new objects alone, so that a search for them after each goal is short."""
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


class _CaseVisits:
    """The cases that visit obligations, in the order of the suite and the new cases.

    Attributes:
        freely: all that they visit before anything is forced in them, as bits.
    """

    def __init__(self, suite: Campaign, cases: Sequence[ClosingCase]) -> None:
        made = [(each.case.name, each.execution) for each in cases]
        self._free = (*suite.visited_freely, *((name, execution.visited_freely) for name, execution in made))
        self.freely = reduce(or_, (visited for _, visited in self._free), 0)
        self._all = (*suite.coverage.cases, *((name, execution.visited) for name, execution in made))

    def free(self, bit: int) -> str | None:
        """Return the first case that visits an obligation before anything is forced in it; `None` if none does."""
        return next((name for name, visited in self._free if visited & bit), None)

    def any(self, bit: int) -> str | None:
        """Return the first case that visits an obligation, by force if need be; `None` if none does."""
        return next((name for name, visited in self._all if visited & bit), None)


def _freely(suite: Campaign) -> int:
    return reduce(or_, (visited for _, visited in suite.visited_freely), 0)


def _alone(execution: Execution, kept: Sequence[Execution], before: Merit) -> int:
    """Return what one run visits and no other one, nor the suite."""
    others = before.and_also(Merit.of(each for each in kept if each is not execution))
    return Merit.of((execution,)).beyond(others)


def _what_stopped(runs: AllRuns, others: Iterable[AllRuns], bit: int) -> str:
    if runs.other_planner is not None:
        return (
            f"no case that visits it was found, and no proof about all plans excludes it; runs of the planner "
            f"`{runs.other_planner}` were not explored: `--planner {DEFAULT_PLANNER}` explores all runs"
        )
    is_visited = any((each.visited | each.cut_off) & bit for each in (runs, *others))
    if not is_visited and runs.stopped is None and runs.model.runs.plans is RunPlans.DRAWN:
        return (
            "no case that visits it was found, and no proof about any plans excludes it: random cases draw their plans"
        )
    if is_visited:
        return f"some runs visit it, but no case that was tried has such a run; {_what_would_help(runs.goals)}"
    if runs.stopped is not None:
        return f"no run that visits it was found, and not all runs were explored: {runs.stopped}"
    return "no case that visits it was found, and runs with all goals and plans that are possible were not explored"


def _what_would_help(goals: GoalOrder) -> str:
    """Return who may find a case for what some run visits, as a clause."""
    if goals is GoalOrder.SINGLE:
        return "a case ends with its goal: `runs: {goals: sequence}` shows what follows the end"
    return "random cases with other seeds may have one, or a written case with times of its own"
