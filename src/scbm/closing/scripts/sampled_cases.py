"""Cases that need no graph of runs: nominal and random cases, and changes of these for single obligations.

Where runs are too many to explore, or planning for all of them is too much work, cases still run under the planner of
the model. First nominal and random cases run, until they visit nothing new. Then the cases that were kept are changed:
the operations that execute in them fail or time out, and other initial values are taken.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.cases import Case, Network, OutcomeRule
from scbm.cases.coverage import Aspect
from scbm.cases.trace import End
from scbm.closing.counted_activity import CountedActivity
from scbm.closing.scripts.case_plans import CasePlans, PlanEffort
from scbm.closing.scripts.case_search import bounded
from scbm.closing.scripts.closing_injections import current_operations
from scbm.model import InputError, Outcome, State
from scbm.planning import DEFAULT_PLANNER, PlanLimits
from scbm.testing.batches.batch_summary import BatchSummary
from scbm.testing.batches.campaign_runs import StopRule, run_steps
from scbm.testing.batches.campaign_work import CampaignWork
from scbm.testing.random_cases import most_goals

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from scbm.closing.runs.run_graph import Start
    from scbm.model import BehaviorModel
    from scbm.testing import Execution, Tester
    from scbm.testing.batches.campaign_runs import Executor

_DRY = 200
"""After so many random cases in a row that visit nothing new, the next stage has better prospects."""

_PROBES = 2
"""Random cases that run after nominal ones without a plan; if these have no plan either, no more are drawn."""

_FIRST = 20
"""Random cases that run before anything else, so that an interruption leaves some."""

_LOOK_STATES = 500_000
"""The number of states that are expanded to plan for them, which takes a few seconds."""

_LITTLE_PLANNING = 100_000
"""If the plans of the first cases take fewer expanded states together, those of further cases need no common budget."""

_PLANLESS = (End.PLANNER_LIMIT, End.NO_PLAN_FOUND)

_ENDS = ((Aspect.FAILED, Outcome.FAIL), (Aspect.TIMEDOUT, Outcome.TIMEOUT))


class SampledCases:
    """Runs cases, and keeps those that visit something missing.

    Attributes:
        wanted: the obligations to search for, those included that are known to be uncoverable.
        impossible: the obligations that are known to be uncoverable, by injections too.
        unreachable: these, and those that are known to be uncoverable otherwise.
        found: the runs of the kept cases, in the order in which they were found.
        missing: the obligations that none of them visits.
        limit: what ended the last method before it was complete, and the option that raises the limit, if any.
    """

    def __init__(
        self,
        tester: Tester,
        plans: CasePlans,
        missing: int,
        impossible: int,
        progress: Callable[[str], None],
    ) -> None:
        """Prepare the search.

        Args:
            tester: runs the cases.
            plans: the plans of the tester.
            missing: the obligations to search for.
            impossible: the obligations that are known to be uncoverable.
            progress: called with a description of what is searched for.
        """
        self.found: list[Execution] = []
        self.wanted = missing
        self.impossible = self.unreachable = impossible
        self.missing = missing & ~impossible
        self.limit: tuple[str, str | None] | None = None
        self._all = self.missing.bit_count()
        self._model: BehaviorModel = tester.model
        self._tester = tester
        self._plans = plans
        self._starts: Sequence[Start] = ()
        self._progress = progress
        self._bases: list[Execution] = []
        self._left = 0
        self._automatic = tester.obligations.mask(Aspect.TAKEN)

    @property
    def bases(self) -> tuple[Execution, ...]:
        """The kept cases without draws, each to be changed."""
        cases = (_without_draws(base) for base in self._bases)
        return tuple(execution for case in cases if (execution := bounded(self._tester, case)) is not None)

    def rule_out(self, unreachable: int) -> None:
        """Search no longer for these obligations: no run visits them."""
        self.unreachable |= unreachable
        self.missing &= ~unreachable

    # nominal and random cases

    def look(self, most: int) -> None:
        """Run a nominal case for each goal and a few random cases, with plans that are found at once."""
        nominal = State(self._model.space, dict(self._model.nominal_state))
        plain = [Case(goal[0], *goal, nominal) for goal in self._model.goals]
        drawn = self._drawn(min(_FIRST, most))
        with self._plans.effort(PlanEffort.BRIEF, _LOOK_STATES):
            for case in chain(plain if self._model.initial_states.holds(nominal) else (), drawn):
                self._progress(f"nominal and random cases: {self._counts}")
                self._run(case)

    def sample(self, starts: Sequence[Start], most: int, planning: int, executor: Executor | None = None) -> None:
        """Run a nominal case for each goal, then random cases until they visit nothing new, or `most` have run.

        Args:
            starts: initial states, the nominal one first.
            most: the maximum number of random cases.
            planning: the number of states that are expanded to plan for random cases.
            executor: where random cases run whose plans take little work.
        """
        self.limit = None
        self._starts = starts
        with self._plans.effort(PlanEffort.WHOLE, planning):
            plain = [self._run(case) for case in self._plain_cases(starts[:1])]
        with self._plans.effort(PlanEffort.BRIEF, planning):
            if not any(map(self._has_plan, plain)) and not self._probe(min(_PROBES, most)):
                self.limit = (f"no case got a plan from the planner {self._planner_name}", _PLANNER)
                return
            if self._plans.are_limited and (self._plans.refused or self._plans.expanded > _LITTLE_PLANNING):
                self._draw_here(most)
            else:
                self._draw(most, executor)

    @staticmethod
    def _work(model: BehaviorModel, most: int) -> CampaignWork:
        """Return the random cases 1 to `most`, each with one goal or some that follow each other."""
        return CampaignWork(model, numbers=range(1, most + 1), network=Network(), goals=most_goals(model))

    def _drawn(self, most: int) -> Iterator[Case]:
        """Yield the first random cases; fewer if no more can be drawn, which is the limit then."""
        work = self._work(self._model, most)
        try:
            for position in range(1, most + 1):
                yield work.case(position)
        except InputError as error:
            self.limit = (error.diagnostics[0].message, None)

    def _draw_here(self, most: int) -> None:
        """Run random cases one by one in this process: their plans share one budget."""
        dry = count = 0
        for count, case in enumerate(self._drawn(most), start=1):
            self._progress(CountedActivity.of("random cases", count - 1, most, f"cases, {self._counts}"))
            missing = self.missing
            self._run(case)
            dry = dry + 1 if missing == self.missing else 0
            if dry == _DRY or not self.missing:
                return
        if count == most:
            self.limit = _last_was_new(most)

    def _draw(self, most: int, executor: Executor | None) -> None:
        """Run random cases by an executor, with a limit on plans that take long; those that are kept run again."""
        work = self._work(self._briefly_planned, most)
        total = BatchSummary()
        try:
            for step in run_steps(work, executor, StopRule(dry=_DRY)):
                total = step.total
                self._progress(CountedActivity.of("random cases", total.count, most, f"cases, {self._counts}"))
        except InputError as error:
            self.limit = (error.diagnostics[0].message, None)
        finally:
            for position, visited in total.news:
                if visited & self.missing:
                    self._run(work.case(position))
        if total.count == most and total.last - total.last_new < _DRY:
            self.limit = _last_was_new(most)

    @property
    def _briefly_planned(self) -> BehaviorModel:
        """The model with a limit for plans that take long."""
        if not self._plans.are_limited:
            return self._model
        expansions = min(PlanLimits.of(self._model).expansions, _LITTLE_PLANNING)
        return replace(self._model, planner=replace(self._model.planner, max_expanded=expansions))

    def _probe(self, count: int) -> bool:
        """Return whether one of the first random cases has a plan."""
        return any(self._has_plan(self._run(case)) for case in self._drawn(count))

    @staticmethod
    def _has_plan(execution: Execution | None) -> bool:
        return execution is not None and (execution.verdict.end not in _PLANLESS or bool(execution.visited))

    @property
    def _planner_name(self) -> str:
        return self._model.planner.name or DEFAULT_PLANNER

    def _plain_cases(self, starts: Sequence[Start]) -> Iterator[Case]:
        for start in starts:
            for goal in self._model.goals:
                yield Case(goal[0], *goal, State(self._model.space, dict(start.values)))

    # changed cases

    def change(self, most: int, planning: int) -> None:
        """Change kept cases for the obligations that are missing, until that is exhausted, or `most` cases have run.

        `planning` is the number of states that are expanded to plan for them.
        """
        is_named = self.limit is not None and self.limit[1] == _PLANNER
        self.limit = None
        self._left = most
        with self._plans.effort(PlanEffort.BRIEF, planning):
            self._change_all()
        if self.missing and self._left <= 0:
            self.limit = (f"{most:,} changed cases were run", _CHANGES)
        elif self.missing and self._plans.refused and not is_named:
            self.limit = ("plans that take a long search were left out, and runs end before them", _PLANNER)

    def _change_all(self) -> None:
        done = 0
        while self.missing and self._left > 0 and done < len(self._bases):
            self._change(self._bases[done])
            done += 1
            if done == len(self._bases):
                self._start_elsewhere()
        for base in tuple(self._bases):
            self._repeat(base)

    def _change(self, base: Execution) -> None:
        """Let operations of a case fail and time out: all at once, then one by one."""
        plain = _without_draws(base)
        current = current_operations(base.trace.records)
        for aspect, outcome in _ENDS:
            names = [name for name in current if self._is_open(name, aspect)]
            self._report(names, aspect)
            self._try_rules(plain, names, outcome)
            for name in names:
                if self._is_open(name, aspect):
                    self._report([name], aspect)
                    self._try_rules(plain, [name], outcome)

    def _report(self, names: Sequence[str], aspect: Aspect) -> None:
        """Report what the next changed cases are for."""
        what = f"{names[0]}/{aspect}" if len(names) == 1 else f"{aspect} of {len(names):,} operations"
        if names:
            self._progress(f"guided search: {what}, {self._counts}, at most {max(0, self._left):,} more cases")

    def _try_rules(self, case: Case, names: Sequence[str], outcome: Outcome, last: int | None = 1) -> None:
        """Run a case in which the first requests of each of these operations, up to `last`, have another outcome."""
        rules = tuple(OutcomeRule(name, 1, last, outcome) for name in names)
        others = tuple(rule for rule in case.outcomes if rule.subject not in names)
        if names:
            self._try(replace(case, outcomes=(*others, *rules)))

    def _repeat(self, base: Execution) -> None:
        """Let all requests of one operation end alike: a transition may wait for several failures in a row."""
        plain = _without_draws(base)
        for name in current_operations(base.trace.records):
            for _, outcome in _ENDS:
                if not self.missing & self._automatic or self._left <= 0:
                    return
                what = f"repeated ends of {name}"
                self._progress(f"guided search: {what}, {self._counts}, at most {self._left:,} more cases")
                self._try_rules(plain, [name], outcome, last=None)

    def _start_elsewhere(self) -> None:
        """Run nominal cases from other initial states until one of them visits something missing."""
        for case in self._plain_cases(self._starts[1:]):
            if not self.missing or self._left <= 0 or self._try(case):
                return

    def _is_open(self, operation: str, aspect: Aspect) -> bool:
        return bool(self._tester.obligations.bit_of(operation, aspect) & self.missing)

    # runs

    def _try(self, case: Case) -> bool:
        """Run a changed case if any may still be run; return whether it visits something missing."""
        self._left -= 1
        before = len(self.found)
        if self._left >= 0:
            self._run(case)
        return len(self.found) > before

    def _run(self, case: Case) -> Execution | None:
        """Run a case, and keep it if it visits something missing. The first case is a base for changes in any case."""
        execution = bounded(self._tester, case)
        if execution is None:
            return None
        is_new = bool(execution.visited_freely & self.missing)
        if is_new:
            self.found.append(execution)
            self.missing &= ~execution.visited_freely
        if is_new or not self._bases:
            self._bases.append(execution)
        return execution

    @property
    def _counts(self) -> str:
        return f"{self._all - self.missing.bit_count():,} of {self._all:,} obligations visited"


def _last_was_new(most: int) -> tuple[str, str]:
    return f"{most:,} random cases were run, and the last of them still visited something new", _RANDOM


_PLANNER = "--planner"
_RANDOM = "--max-random"
_CHANGES = "--max-changes"


def _without_draws(execution: Execution) -> Case:
    """Return the case of a run with all that was drawn written into it, without plans: a changed case has others."""
    return execution.case if execution.case.origin is None else replace(execution.closed_case, origin=None, plans=())


def as_closing_case(execution: Execution, needed: int, tester: Tester) -> Execution:
    """Return the run of a case that draws nothing and visits all of `needed`, with as few rules as are found at once.

    Rules for requests that succeed come from draws; most of them only repeat the default.
    """
    if execution.case.origin is None:
        return execution
    case = _without_draws(execution)
    unusual = tuple(rule for rule in case.outcomes if rule.outcome is not Outcome.SUCCEED)
    plain = tuple(replace(rule, latency_ns=None) for rule in unusual)
    for outcomes in ((), plain, unusual):
        attempt = bounded(tester, replace(case, outcomes=outcomes))
        if attempt is not None and not needed & ~attempt.visited:
            return attempt
    return tester.execute(case)
