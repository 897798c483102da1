"""The search for cases that visit what runs visit: walks through the graph of runs. Nothing in them is forced."""

from __future__ import annotations

from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Any, NamedTuple

from msgspec.structs import replace

from scbm.cases import CaseLimits, EnvironmentChange
from scbm.cases.coverage import Aspect, visited_by
from scbm.cases.trace import (
    AutomaticTaken,
    End,
    MeasurementReceived,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    RunStarted,
)
from scbm.closing.runs.walks import best_walk, direct_walks, walk_over
from scbm.closing.scripts.case_scripts import CaseScripts
from scbm.closing.scripts.closing_injections import HOLD_NS
from scbm.closing.scripts.guided_search import distance_to, find_path, guard_of
from scbm.model import RateKind
from scbm.planning import PlanCache
from scbm.running.simulation import TooLongError, UnplannedError, typical_ns

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from scbm.cases import Case, RecordedPlan
    from scbm.cases.coverage import Obligation, Obligations
    from scbm.closing.runs.all_runs import AllRuns, CloseLimits
    from scbm.closing.runs.run_graph import RunGraph
    from scbm.closing.runs.walks import Walk
    from scbm.model import Value
    from scbm.testing import Execution, Tester

_MAX_RECORDS = 200_000
_CANDIDATE = "candidate"
_MAX_BEYOND = 5_000
"""Maximum number of situations of the guided search for one obligation and one goal."""


class CaseSearch:
    """Searches for cases until no walk can visit anything that is missing.

    Attributes:
        found: the runs of the cases found, each of which visited something missing.
    """

    def __init__(  # noqa: PLR0913, PLR0917 - what is searched in, what is searched for, and where it is kept
        self,
        runs: AllRuns,
        tester: Tester,
        missing: int,
        impossible: int,
        limits: CloseLimits,
        found: list[Execution] | None = None,
        progress: Callable[[str], None] | None = None,
        walks: Callable[[Sequence[RunGraph], int], Iterator[Walk]] = direct_walks,
        plans: PlanCache | None = None,
    ) -> None:
        """Prepare the search.

        Args:
            runs: the graphs of runs.
            tester: runs the cases.
            missing: the obligations to search for.
            impossible: the obligations that are known to be uncoverable, by injections too.
            limits: the limits of the search.
            found: the list that is extended, so that an interruption leaves what was found until then.
            progress: called with the obligation that is searched for, with counts.
            walks: yields the walks to one obligation, the best first.
            plans: the plans of the planner of the runs; by default a new cache.
        """
        self.found: list[Execution] = [] if found is None else found
        self._runs = runs
        self._tester = tester
        self._missing = missing
        self._impossible = impossible
        self._progress = progress or (lambda _: None)
        self._walks = walks
        self._candidates = limits.candidates
        self._beyond = limits.beyond
        self._scripts = CaseScripts(runs.model, runs.program, plans or PlanCache(runs.planner))

    def run(self, *, short: bool) -> None:
        """Search for everything: by the shortest case for each obligation, or by few cases that visit much."""
        if not short:
            self._walk_far()
        for bit in _bits(self._wanted()):
            if bit & self._wanted():
                self._progress(f"looking for cases: {self._missing.bit_count():,} obligations are left")
                self._insist(bit)
        for bit in _bits(self._missing & self._runs.cut_off):
            self._cut_off(bit)
        if self._runs.stopped is not None:
            self._search_beyond()

    def shortest(self, bit: int) -> None:
        """Search for the shortest case for one obligation, even if a longer one was found."""
        missing, self._missing = self._missing, bit & self._runs.visited
        self._insist(self._missing)
        self._missing = missing if self._missing else missing & ~bit

    def path_to(self, wanted: int) -> Execution | None:
        """Return the run of a case whose walk visits one of the bits `wanted`, such as *is current*; `None` if none."""
        for walk in self._walks(self._runs.graphs, wanted & self._runs.visited):
            execution = self._execute(self._scripts.case(walk.path, _CANDIDATE))
            if execution is not None:
                return execution
        return None

    def far_path(self, wanted: int) -> tuple[Execution | None, int]:
        """Return the run of a case whose walk visits many of the bits `wanted`, and which of them the walk visits."""
        walk = best_walk(self._runs.graphs, wanted & self._runs.visited)
        if walk is None:
            return None, 0
        return self._execute(self._scripts.case(walk.path, _CANDIDATE)), walk.visits & wanted

    def guided_path(self, obligation: Obligation, wanted: int) -> Execution | None:
        """Return the run of a case on the path that a guided search finds beyond the explored runs; `None` if none."""
        runs = self._runs
        distance = distance_to(guard_of(runs.model, obligation), runs.program.packing)
        for goal in runs.plannable:
            most = min(self._beyond, _MAX_BEYOND)
            path, visited = find_path(goal, runs.steps(goal[1]), runs.starts, wanted, distance, most)
            self._beyond -= visited
            execution = None if path is None else self._execute(self._scripts.case(path, _CANDIDATE))
            if execution is not None:
                return execution
        return None

    def _walk_far(self) -> None:
        """Take walks that visit much, as long as they find something."""
        tried = 0
        while (wanted := self._wanted() & ~tried) and (walk := best_walk(self._runs.graphs, wanted)) is not None:
            before = self._wanted() & walk.visits
            self._take(self._execute(self._scripts.case(walk.path, _CANDIDATE)))
            tried |= before

    def _wanted(self) -> int:
        """Return what is missing and visited by runs."""
        return self._missing & self._runs.visited

    def _take(self, execution: Execution | None) -> bool:
        """Keep a run if it visits something missing, and not by force."""
        if execution is None or not execution.visited_freely & self._missing:
            return False
        self._missing &= ~execution.visited_freely
        self.found.append(execution)
        return True

    def _execute(self, case: Case) -> Execution | None:
        return bounded(self._tester, case)

    # what a walk promised and its run did not visit

    def _insist(self, bit: int) -> None:
        """Try the best walks to one obligation, for every goal."""
        for walk in self._walks(self._runs.graphs, bit):
            execution = self._execute(self._scripts.case(walk.path, _CANDIDATE))
            if execution is not None and execution.visited_freely & bit:
                self._take(self._put_back(execution, bit))
                return

    def _put_back(self, execution: Execution, bit: int) -> Execution:
        """Return the run of a case in which something outside acts once more, if only then it does not wait to the end.

        What changed freely gets its first value again, or an environment transition acts, a while after the visit.
        """
        case = execution.case
        if not case.environment or execution.verdict.end is not End.TIME_LIMIT:
            return execution
        records, obligations = execution.trace.records, self._tester.obligations
        at_ns = next(r.at_ns for r in records if visited_by((r,), obligations) & bit) + HOLD_NS
        names = [name for change in case.environment for name, _ in change.assign or ()]
        before = tuple((name, case.initial[name]) for name in dict.fromkeys(names))
        more = [EnvironmentChange(at_ns, before)] if before else []
        for each in self._runs.model.environment:
            if each.rate is not None and each.rate.kind is RateKind.AFTER:
                after_ns = typical_ns(each.rate.time)
                more.append(EnvironmentChange(None, None, each.name, when=each.guard, after_ns=after_ns))
            more.append(EnvironmentChange(at_ns, None, each.name))
        for change in more:
            mended = self._execute(replace(case, environment=(*case.environment, change)))
            is_shorter = mended is not None and mended.verdict.end not in (End.TIME_LIMIT, End.ABORTED)
            if mended is not None and is_shorter and mended.visited_freely & bit:
                return mended
        return execution

    # runs that a limit of plans ends

    def _cut_off(self, bit: int) -> None:
        """Try limits of plans for what is visited where they end a run."""
        for graph in self._runs.graphs:
            for node, edge, visits in graph.cut_offs:
                if not visits & bit:
                    continue
                walk = walk_over(graph, node, edge)
                case = self._scripts.case(walk.path, _CANDIDATE)
                for plans in range(1, self._candidates):
                    execution = self._execute(replace(case, limits=CaseLimits(plans=plans)))
                    if execution is not None and execution.visited_freely & bit:
                        self._take(execution)
                        return

    # beyond what was explored

    def _search_beyond(self) -> None:
        """Search, one by one, for obligations that the explored runs do not visit, with the guided search."""
        runs = self._runs
        if not runs.plannable:
            return
        for number, obligation in enumerate(runs.visits.obligations, start=1):
            bit = runs.visits.bit(obligation.subject, obligation.aspect)
            if bit & self._missing & ~self._impossible & ~runs.visited:
                of = f"obligation {number:,} of {len(runs.visits.obligations.all):,}"
                self._progress(f"guided search: {obligation} ({of}), at most {max(0, self._beyond):,} more situations")
                self._take(self.guided_path(obligation, bit))


def bounded(
    tester: Tester, case: Case, most: int = _MAX_RECORDS, preferred: Sequence[RecordedPlan] = ()
) -> Execution | None:
    """Return the run of a case; `None` if it has more than `most` records, by default those that a test should have.

    For `preferred` see `Tester.execute`. A run that asks for a plan that the source of plans refuses ends there: its
    case gets a limit of plans; one of a later goal is left out. `None` if even the first plan is refused.
    """
    try:
        return tester.execute(case, most, preferred)
    except TooLongError:
        return None
    except UnplannedError as error:
        begun = sum(isinstance(record, RunStarted) for record in error.records)
        if begun > 1:
            planned = case.with_goals(case.goals[: begun - 1])
        elif error.plans:
            planned = replace(case, limits=replace(case.limits, plans=error.plans))
        else:
            return None
    return bounded(tester, planned, most, preferred)


def without_leftovers(execution: Execution, tester: Tester) -> Execution:
    """Return the run without the parts of its case that had no effect, as far as it visits the same."""
    case = execution.case
    for part in ("injections", "outcomes", "environment"):
        for clause in getattr(case, part) or ():
            if not execution.unused:
                return execution
            rest: dict[str, Any] = {
                part: tuple(other for other in getattr(execution.case, part) if other is not clause)
            }
            attempt = bounded(tester, replace(execution.case, **rest))
            if attempt is None:
                continue
            is_alike = Merit.of((attempt,)) == Merit.of((execution,))
            if is_alike and len(attempt.unused) < len(execution.unused):
                execution = attempt
    return execution


def with_makers(execution: Execution) -> Case:
    """Return the case of a run in which each change from outside names the environment transition that made it.

    An entry for several sources is divided if it has a time; else it stays.
    """
    case, changes = execution.case, list[EnvironmentChange]()
    made = [record for record in execution.trace.records if isinstance(record, MeasurementReceived)]
    for change in case.environment or ():
        parts = _taken(change, made)
        if change.by or not parts or (change.at_ns is None and len(parts) > 1):
            changes.append(change)
        else:
            changes += [replace(change, assign=None if p.by else p.measured, by=p.by) for p in parts]
    return case if case.environment is None else replace(case, environment=tuple(changes))


def _taken(change: EnvironmentChange, made: list[MeasurementReceived]) -> list[MeasurementReceived]:
    """Take the first records in a row from `made` that assign together what a change does; none if there are none."""
    wanted = dict(change.assign or ())
    for begin in range(len(made)):
        values: dict[str, Value] = {}
        for end in range(begin, len(made)):
            values |= dict(made[end].measured)
            if values == wanted:
                taken, made[begin : end + 1] = made[begin : end + 1], []
                return taken
            if any(values[name] != wanted.get(name) for name in values):
                break
    return []


def _bits(mask: int) -> Iterator[int]:
    while mask:
        bit = mask & -mask
        yield bit
        mask ^= bit


class Merit(NamedTuple):
    """The obligations that runs visit, as two sets.

    Attributes:
        visited: all that they visit, as bits.
        freely: what they visit before anything is forced.
    """

    visited: int = 0
    freely: int = 0

    @staticmethod
    def of(executions: Iterable[Execution]) -> Merit:
        """Return what all of these runs visit together."""
        visited = freely = 0
        for each in executions:
            visited, freely = visited | each.visited, freely | each.visited_freely
        return Merit(visited, freely)

    def and_also(self, other: Merit) -> Merit:
        """Return what both visit together."""
        return Merit(self.visited | other.visited, self.freely | other.freely)

    def beyond(self, other: Merit) -> int:
        """Return the obligations that these runs visit and others do not, or visit only by force."""
        return self.visited & ~other.visited | self.freely & ~other.freely


def minimal(executions: Sequence[Execution], before: Merit) -> list[Execution]:
    """Return the runs that add something to `before`, without any that the others make redundant.

    Runs that force nothing come first, shorter ones before longer ones. Runs that visit most are removed last, so that
    few cases remain.
    """
    kept = sorted(executions, key=lambda each: (each.forced_by is None, each.visited.bit_count()))
    for execution in tuple(kept):
        others = before.and_also(Merit.of(other for other in kept if other is not execution))
        if not Merit.of((execution,)).beyond(others):
            kept.remove(execution)
    return in_order(kept)


def natural(executions: Sequence[Execution], before: Merit, missing: int, obligations: Obligations) -> list[Execution]:
    """Return the runs that `minimal` keeps, and those that take an automatic transition in mid motion.

    An emergency stop between two runs shows little. So a run in which it comes while a request is in flight is kept,
    and comes first, even if another run takes the transition at rest, and visits something else, too.
    """
    kept = minimal(executions, before)
    in_motion = {id(each): _taken_in_motion(each, obligations) & missing for each in executions}
    lacking = reduce(or_, in_motion.values(), 0) & ~reduce(or_, (in_motion[id(each)] for each in kept), 0)
    first: list[Execution] = []
    for execution in in_order(executions):
        if in_motion[id(execution)] & lacking:
            first.append(execution)
            lacking &= ~in_motion[id(execution)]
    if not first:
        return kept
    others = [each for each in executions if all(each is not other for other in first)]
    return [*first, *minimal(others, before.and_also(Merit.of(first)))]


def _taken_in_motion(execution: Execution, obligations: Obligations) -> int:
    """Return the automatic transitions that a run takes while a request is in flight, and not by force, as bits."""
    taken = 0
    in_flight: dict[str, None] = {}
    for record in execution.trace.records:
        match record:
            case RequestSent():
                in_flight[record.resource] = None
            case ReplyReceived() | RequestCancelled():
                in_flight.pop(record.resource, None)
            case AutomaticTaken() if in_flight:
                taken |= obligations.bit_of(record.transition, Aspect.TAKEN)
            case _:
                pass
    return taken & execution.visited_freely


def shortest_for_each(executions: Sequence[Execution], missing: int) -> dict[int, int]:
    """Return for each obligation the shortest run that visits it, by force only if no other one does.

    Returns:
        For the `id` of each such run, the obligations for which it is the shortest.
    """
    ordered = in_order(executions)
    found: dict[int, int] = {}
    for bit in _bits(missing & Merit.of(executions).visited):
        free = (each for each in ordered if each.visited_freely & bit)
        best = next(free, None) or next(each for each in ordered if each.visited & bit)
        found[id(best)] = found.get(id(best), 0) | bit
    return found


def in_order(executions: Sequence[Execution]) -> list[Execution]:
    """Return runs that force nothing before the others, and shorter ones before longer ones."""
    return sorted(executions, key=lambda each: (each.forced_by is not None, each.ended_ns, len(each.trace.records)))
