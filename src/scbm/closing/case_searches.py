"""The searches for cases, in the order in which closing tries them: each for what those before it left open.

To add one: a function that adds runs of cases to `found` of its `ClosingTask`, and an entry in `CASE_SEARCHES`.
"""

from __future__ import annotations

from collections import Counter
from itertools import islice
from typing import TYPE_CHECKING

from msgspec import Struct, field
from msgspec.structs import replace

from scbm.cases import Case, Expectations
from scbm.cases.coverage import Aspect
from scbm.closing.advice.other_plans import with_first
from scbm.closing.decisions import Stage, StageEnd
from scbm.closing.distinguished_values import distinguished_groups
from scbm.closing.proofs.proofs import scope_of_proofs
from scbm.closing.runs.all_runs import AllRuns, RunScope
from scbm.closing.scripts.case_search import CaseSearch, Merit, bounded
from scbm.closing.scripts.closing_injections import with_inputs, with_inputs_by_force, with_inputs_in_motion
from scbm.closing.scripts.forced_cases import ForcedCases
from scbm.closing.scripts.outside_walks import NaturalWalks
from scbm.model import GoalOrder, InputError, PlanSet, RunPlans, State
from scbm.model.sources import free_groups, outside_groups

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from scbm.cases.coverage import Obligation
    from scbm.closing.runs.all_runs import CloseLimits
    from scbm.closing.scripts.sampled_cases import SampledCases
    from scbm.model import BehaviorModel
    from scbm.testing import Execution, Tester


_FEW_SEQUENCES = 10_000
"""So many situations of sequences of goals are explored before a set says what no run visits."""

_SHARE_OF_SEQUENCES = 3
"""The divisor of the limit of situations of sequences that are explored before a set with canonical plans is tried.

Three times as many are hardly ever all of them where more than half as many were found beyond the limit: in none of the
three of 23 random models where so many were.
"""

_MAX_FOR_CASES = 10_000
"""Maximum number of situations in which inputs change that are explored to find cases, where they prove nothing."""


class ClosingTask(Struct):
    """What is searched for, where, and what was found.

    Attributes:
        tester: runs the cases.
        limits: the limits of the searches.
        progress: called with a description of what is searched for.
        runs: the graphs of runs that nothing changes from outside.
        suite: the obligations that the suite visits, by force if need be, as bits.
        samples: the nominal, random and changed cases that ran before; it has the obligations to search for.
        sampled: those of their runs that count: none where the graph of all runs decides more.
        is_short: whether each obligation gets a short case, or few cases visit much.
        one_each: whether each obligation gets the shortest case found, even if longer cases visit more.
        cases_of: yields the runs of new cases of another model for some obligations.
        ended: the stages that a limit ended; a search adds to them.
        open_runs: other explored runs, in which the world changes or goals follow each other; a search adds to them.
        never: returns which of some obligations a set proves that no run with some plans visits, as bits.
        found: the runs of the cases found; a search adds to them at once, so that an interruption leaves them.
    """

    tester: Tester
    limits: CloseLimits
    progress: Callable[[str], None]
    runs: AllRuns
    suite: int
    samples: SampledCases
    sampled: Sequence[Execution]
    is_short: bool
    one_each: bool
    cases_of: Callable[[BehaviorModel, Sequence[Obligation]], Iterator[Execution]]
    ended: list[StageEnd]
    open_runs: list[AllRuns]
    never: Callable[[int, PlanSet], int]
    found: list[Execution] = field(default_factory=list)

    @property
    def wanted(self) -> int:
        """The obligations for which the graph of runs is searched: sampled cases count where it is incomplete."""
        sampled = 0 if self.runs.stopped is None else Merit.of(self.sampled).freely
        return self.samples.wanted & ~sampled

    @property
    def left(self) -> int:
        """The wanted obligations that no case found so far visits without force."""
        return self.wanted & ~Merit.of(self.found).freely

    def nominal(self) -> Iterator[Execution]:
        """Yield a run without faults for each goal, from the first initial state."""
        for name, goal in self.runs.plannable if self.runs.starts else ():
            start = State(self.runs.model.space, dict(self.runs.starts[0].values))
            execution = bounded(self.tester, Case(name, name, goal, start))
            if execution is not None:
                yield execution


class CaseSearchEntry(Struct, frozen=True):
    """A search for cases.

    Attributes:
        finds: what its cases visit, as a phrase.
        limit: what ends it early, as a phrase.
        search: adds runs of cases to those found.
    """

    finds: str
    limit: str
    search: Callable[[ClosingTask], None]


def takes_classes(model: BehaviorModel) -> bool:
    """Return whether searches for cases take one value of each class of values that change freely."""
    return distinguished_groups(model) != free_groups(model)


def _walk(task: ClosingTask) -> None:
    """Follow paths through the graph of runs, and beyond it."""
    search = CaseSearch(
        task.runs, task.tester, task.wanted, task.samples.unreachable, task.limits, task.found, task.progress
    )
    search.run(short=task.is_short)
    _shorten(search, task.wanted, task)


def _shorten(search: CaseSearch, missing: int, task: ClosingTask) -> None:
    """Search for the shortest case for each obligation, if that is asked for."""
    for obligation in task.tester.obligations if task.one_each else ():
        if task.tester.obligations.bit(obligation) & missing:
            task.progress(f"looking for the shortest case for {obligation}")
            search.shortest(task.tester.obligations.bit(obligation))


def _change_inputs(task: ClosingTask) -> None:
    """Change inputs in known cases, for automatic transitions that no run without injections takes."""
    bases = (*task.nominal(), *task.found, *task.sampled)
    for transition in task.runs.model.automatic_transitions:
        bit = task.tester.obligations.bit_of(transition.name, Aspect.TAKEN)
        if not bit & task.wanted & ~task.runs.visited:
            continue
        in_motion = (case for base in bases for case in with_inputs_in_motion(task.runs.model, transition, base))
        at_rest = (case for base in bases for case in with_inputs(task.runs.model, transition, base.case))
        for attempts in (in_motion, at_rest):
            tried = _executed(attempts, task)
            execution = next((each for each in tried if each.visited_freely & bit), None)
            if execution is not None:
                task.found.append(execution)
                break


def _executed(cases: Iterable[Case], task: ClosingTask) -> Iterator[Execution]:
    """Yield the runs of as many cases as are tried for one obligation."""
    executions = (bounded(task.tester, case) for case in islice(cases, task.limits.candidates))
    return (execution for execution in executions if execution is not None)


def _walk_in_open_world(task: ClosingTask) -> None:
    """Follow paths on which inputs and published values change."""
    if not task.left & ~task.samples.unreachable or not outside_groups(task.runs.model):
        return
    task.progress("exploring runs in which inputs change")
    limits = task.limits
    if task.runs.stopped is not None:  # then all runs are too many in the open world, too
        limits = replace(limits, situations=min(_MAX_FOR_CASES, limits.situations))
    scope = RunScope(is_open=True, takes_classes=takes_classes(task.runs.model))
    runs = AllRuns(task.runs.model, limits, task.progress, scope, planner=task.runs.planner)
    if runs.stopped is not None and task.runs.stopped is None:
        task.ended.append(StageEnd(Stage.GRAPH, runs.stopped, runs.option))
    _walk_naturally(runs, task)


def _walk_in_sequences(task: ClosingTask) -> None:
    """Follow paths on which goals follow each other: first short ones, and longer ones for what no set rules out."""
    wanted = task.left & ~task.samples.unreachable
    if not wanted or task.runs.model.runs.goals is GoalOrder.SINGLE or task.runs.stopped is not None:
        return
    model, planner = task.runs.model, task.runs.planner
    scope = replace(scope_of_proofs(model), takes_classes=takes_classes(model))
    some = -(-task.limits.situations // _SHARE_OF_SEQUENCES)
    runs = None
    for most in dict.fromkeys((min(_FEW_SEQUENCES, some), some, task.limits.situations)):
        limits, goes_on = replace(task.limits, situations=most), most < task.limits.situations
        if runs is None:
            runs = AllRuns(model, limits, task.progress, scope, until=wanted, may_go_on=goes_on, planner=planner)
        else:
            task.open_runs.remove(runs)
            runs = runs.within(limits, until=wanted, may_go_on=goes_on)
        _walk_naturally(runs, task)
        if runs.stopped is None or not task.left & ~task.samples.unreachable:
            return
        task.found += helpful(task.samples.found, task.left)
        if not runs.may_grow or (_FEW_SEQUENCES < most == some and runs.beyond > most // 2):
            return
        task.samples.rule_out(task.never(task.left, PlanSet.CANONICAL if most == some else PlanSet.ANY))
        wanted = task.left & ~task.samples.unreachable
        if not wanted:
            return


def _walk_naturally(runs: AllRuns, task: ClosingTask) -> None:
    """Follow walks through runs of the open world."""
    if runs.is_interrupted:
        raise KeyboardInterrupt
    task.open_runs.append(runs)
    missing, limits = task.left, replace(task.limits, beyond=0)
    search = CaseSearch(runs, task.tester, missing, task.samples.unreachable, limits, task.found, walks=NaturalWalks())
    search.run(short=True)
    _shorten(search, missing, task)


def _force(task: ClosingTask) -> None:
    """Force states, for what nothing else visits: neither the suite nor the cases so far."""
    known = [*task.found, *task.sampled]
    missing = task.samples.wanted & ~task.suite & ~Merit.of(known).visited
    if not missing & ~task.samples.impossible:
        return
    task.found += _inputs_by_force((*task.nominal(), *known), missing & ~task.samples.impossible, task)
    runs, limits = task.runs, task.limits
    search = CaseSearch(runs, task.tester, 0, task.samples.impossible, limits)
    force = ForcedCases(task.tester, missing, task.samples.impossible, limits.candidates, task.found, task.progress)
    force.in_graph(search, runs.visits.current, short=task.is_short)
    force.in_cases(known)
    if runs.stopped is not None:
        force.in_cases(task.samples.bases)
        force.beyond_graph(search, runs.visits.current)


def _inputs_by_force(known: Sequence[Execution], missing: int, task: ClosingTask) -> Iterator[Execution]:
    """Yield runs in which inputs change where no moment is settled, for automatic transitions."""
    for transition in task.runs.model.automatic_transitions:
        bit = task.tester.obligations.bit_of(transition.name, Aspect.TAKEN)
        bases = known if bit & missing else ()
        cases = (case for base in bases for case in with_inputs_by_force(task.runs.model, transition, base.case))
        yield from islice((each for each in _executed(cases, task) if each.visited & bit), 1)


def _keep_samples(task: ClosingTask) -> None:
    """Keep the sampled cases that visit what no other case does."""
    task.found += helpful(task.sampled, task.samples.wanted & ~Merit.of(task.found).freely)


def helpful(executions: Sequence[Execution], missing: int) -> list[Execution]:
    """Return runs that visit all of the missing that any of them visits: again and again the one with most of it."""
    found = []
    while missing & Merit.of(executions).freely:
        found.append(max(executions, key=lambda each: (each.visited_freely & missing).bit_count()))
        missing &= ~found[-1].visited_freely
    return found


def _take_other_plans(task: ClosingTask) -> None:
    """Take shortest plans that are not canonical, where plans are drawn.

    They are the canonical plans of a model in which the operations come first of which most is missing. The cases have
    these plans, so that they do not depend on the order of operations.
    """
    if task.runs.model.runs.plans is not RunPlans.DRAWN:
        return
    missing, obligations = task.samples.wanted & ~task.samples.unreachable, task.tester.obligations
    before, tried = Merit.of(task.found), list[tuple[str, ...]]()
    while missing & ~before.freely:
        left = [each for each in obligations if obligations.bit(each) & missing & ~before.freely]
        reordered = with_first(task.runs.model, Counter(obligation.subject for obligation in left))
        order = tuple(operation.name for operation in reordered.operations)
        if order in tried:
            return
        tried.append(order)
        task.progress(f"looking for cases with other shortest plans, {len(left):,} obligations left")
        for made in task.cases_of(reordered, left):
            case = replace(made.case, expect=Expectations(), plans=made.answers)
            try:
                execution = task.tester.execute(case)
            except InputError:  # in the order of the model the run asks for other plans
                continue
            if Merit.of((execution,)).beyond(before) & missing:
                before = before.and_also(Merit.of((execution,)))
                task.found.append(execution)


CASE_SEARCHES: dict[str, CaseSearchEntry] = {
    "paths": CaseSearchEntry(
        "what runs visit that nothing changes from outside",
        "cases tried for one obligation, situations beyond the graph",
        _walk,
    ),
    "one-change": CaseSearchEntry(
        "automatic transitions that one change of inputs takes", "cases tried for one transition", _change_inputs
    ),
    "outside": CaseSearchEntry(
        "what runs visit in which inputs and published values change", "situations explored", _walk_in_open_world
    ),
    "sequences": CaseSearchEntry(
        "what runs visit in which goals follow each other", "situations explored", _walk_in_sequences
    ),
    "force": CaseSearchEntry("what only forced states visit", "changes tried for one operation", _force),
    "samples": CaseSearchEntry(
        "what the random and changed cases of the stages before visit", "none is left out", _keep_samples
    ),
    "other-plans": CaseSearchEntry(
        "what drawn plans visit that are not canonical", "each order of operations once", _take_other_plans
    ),
}
"""The searches by name, in their order: what one of them finds, those after it do not search for."""
