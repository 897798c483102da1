"""The search for cases: walks through the graph of runs, with injections where operations have to be disabled."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from scbm.cases import CaseLimits
from scbm.cases.coverage import Aspect
from scbm.cases.trace import state_after
from scbm.closing.runs.walks import best_walk, direct_walks, walk_over
from scbm.closing.scripts.case_scripts import CaseScripts
from scbm.closing.scripts.closing_injections import HOLD_NS, changes_that_disable, current_operations, injection
from scbm.closing.scripts.guided_search import distance_to, find_path, guard_of
from scbm.model import State
from scbm.planning import PlanCache
from scbm.running.simulation import TooLongError, UnplannedError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from scbm.cases import Case
    from scbm.cases.coverage import Obligation
    from scbm.closing.runs.all_runs import AllRuns, CloseLimits
    from scbm.closing.runs.walks import Walk
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
        """
        self.found: list[Execution] = [] if found is None else found
        self._runs = runs
        self._tester = tester
        self._missing = missing
        self._impossible = impossible
        self._progress = progress or (lambda _: None)
        self._candidates = limits.candidates
        self._beyond = limits.beyond
        self._scripts = CaseScripts(runs.model, runs.program, PlanCache(runs.planner))
        self._operations = {operation.name: operation for operation in runs.model.operations}

    def run(self, *, short: bool) -> None:
        """Search for everything: by the shortest case for each obligation, or by few cases that visit much."""
        if not short:
            self._walk_far()
        for bit in _bits(self._wanted()):
            if bit & self._wanted():
                self._progress(f"looking for cases: {self._missing.bit_count():,} obligations are left")
                self._insist(bit)
        for bit in _bits(self._missing & self._runs.visited):  # disabled without injections, where none does it
            self._insist(bit)
        for bit in _bits(self._missing & self._runs.cut_off):
            self._cut_off(bit)
        if self._runs.stopped is not None:
            self._search_beyond()

    def _walk_far(self) -> None:
        """Take walks that visit much, as long as they find something."""
        tried = 0
        while (walk := best_walk(self._runs.graphs, self._wanted() & ~tried)) is not None:
            before = self._wanted() & walk.visits
            self._take(self._disabling(self._execute(self._scripts.case(walk.goal, walk.path, _CANDIDATE))))
            tried |= before

    def _wanted(self) -> int:
        """Return what walks have to visit: what is missing, and instead of *disabled* that the operation is current."""
        visits = self._runs.visits
        others = self._missing & ~visits.obligations.mask(Aspect.DISABLED)
        wanted = others | sum(visits.current(name) for name in self._to_disable())
        return wanted & self._runs.visited

    def _to_disable(self) -> list[str]:
        """Return the operations that are still to be disabled, and are not always enabled."""
        open_ones = self._missing & ~self._impossible
        return [name for name in self._operations if open_ones & self._disabled(name)]

    def _disabled(self, operation: str) -> int:
        return self._runs.visits.bit(operation, Aspect.DISABLED)

    def _take(self, execution: Execution | None) -> bool:
        """Keep a run if it visits something missing."""
        if execution is None or not execution.visited & self._missing:
            return False
        self._missing &= ~execution.visited
        self.found.append(execution)
        return True

    def _execute(self, case: Case) -> Execution | None:
        return bounded(self._tester, case)

    # injections

    def _disabling(self, execution: Execution | None) -> Execution | None:
        """Return the run with injections that disable operations as they become current."""
        if execution is None:
            return None
        execution = self._all_at_once(execution)
        for name in self._to_disable():
            if self._is_current(name, execution) and not execution.visited & self._disabled(name):
                execution = self._disable(name, execution) or execution
        return execution

    def _all_at_once(self, plain: Execution) -> Execution:
        """Return the run with the first change for every operation, if it visits at least as much as the plain run."""
        case, promised = plain.case, plain.visited
        for name in self._to_disable():
            if self._is_current(name, plain):
                changed = next(self._changes(name, plain), None)
                if changed is not None:
                    case = _with_injection(case, name, changed)
                    promised |= self._disabled(name)
        execution = self._execute(case)
        return execution if execution is not None and not promised & ~execution.visited else plain

    def _disable(self, name: str, execution: Execution) -> Execution | None:
        """Return the run with an injection that disables one operation, if it visits all that it visited before."""
        promised = execution.visited | self._disabled(name)
        for case in self._disabling_cases(name, execution):
            attempt = self._execute(case)
            if attempt is not None and not promised & ~attempt.visited:
                return attempt
        return None

    def _disabling_cases(self, name: str, execution: Execution) -> Iterator[Case]:
        for changed in self._changes(name, execution):
            yield _with_injection(execution.case, name, changed)

    def _changes(self, name: str, execution: Execution) -> Iterator[dict[str, bool | int | str]]:
        """Yield the changes that disable an operation when it is current for the first time."""
        records = execution.trace.records
        first = current_operations(records)[name]
        state = State(self._runs.model.running_space, state_after(records[: first + 1]))
        return changes_that_disable(self._runs.model, self._operations[name], state, execution.case.predicate)

    @staticmethod
    def _is_current(name: str, execution: Execution) -> bool:
        return name in current_operations(execution.trace.records)

    # what a walk promised and its run did not visit

    def _insist(self, bit: int) -> None:
        """Try the direct walks to one obligation, for every goal."""
        for walk in direct_walks(self._runs.graphs, bit):
            for case, needed in self._attempts(bit, walk):
                execution = self._execute(case)
                if execution is not None and execution.visited & needed and self._take(execution):
                    return

    # runs that a limit of plans ends

    def _cut_off(self, bit: int) -> None:
        """Try limits of plans for what is visited where they end a run."""
        for graph in self._runs.graphs:
            for node, edge, visits in graph.cut_offs:
                if not visits & bit:
                    continue
                walk = walk_over(graph, node, edge)
                case = self._scripts.case(walk.goal, walk.path, _CANDIDATE)
                for plans in range(1, self._candidates):
                    execution = self._execute(replace(case, limits=CaseLimits(plans=plans)))
                    if execution is not None and execution.visited & bit:
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
            wanted = bit
            if obligation.aspect is Aspect.DISABLED and not bit & self._impossible:
                wanted |= runs.visits.current(obligation.subject)
            if bit & self._missing & ~self._impossible & ~runs.visited:
                of = f"obligation {number:,} of {len(runs.visits.obligations.all):,}"
                self._progress(f"guided search: {obligation} ({of}), at most {max(0, self._beyond):,} more situations")
                self._go_beyond(obligation, wanted)

    def _go_beyond(self, obligation: Obligation, wanted: int) -> None:
        runs = self._runs
        distance = distance_to(guard_of(runs.model, obligation), runs.program.packing)
        for goal in runs.plannable:
            most = min(self._beyond, _MAX_BEYOND)
            path, visited = find_path(runs.steps(goal[1]), runs.starts, wanted, distance, most)
            self._beyond -= visited
            if path is not None:
                execution = self._disabling(self._execute(self._scripts.case(goal, path, _CANDIDATE)))
                if self._take(execution):
                    return

    def _attempts(self, bit: int, walk: Walk) -> Iterator[tuple[Case, int]]:
        """Yield cases that may visit an obligation, each with what its run has to visit."""
        case = self._scripts.case(walk.goal, walk.path, _CANDIDATE)
        names = [name for name in self._to_disable() if bit == self._runs.visits.current(name)]
        if not names:
            yield case, bit
            return
        execution = self._execute(case)
        if execution is None or not self._is_current(names[0], execution):
            return
        left = self._candidates
        for hold_ns in (HOLD_NS, 1, None):
            for changed in self._changes(names[0], execution):
                yield _with_injection(case, names[0], changed, hold_ns), self._disabled(names[0])
                left -= 1
                if not left:
                    return


def bounded(tester: Tester, case: Case) -> Execution | None:
    """Return the run of a case; `None` if it has more records than a test should have.

    A run that asks for a plan that the source of plans refuses ends there: its case gets a limit of plans. `None` if
    even the first plan is refused.
    """
    try:
        return tester.execute(case, _MAX_RECORDS)
    except TooLongError:
        return None
    except UnplannedError as error:
        plans = error.plans
    return bounded(tester, replace(case, limits=replace(case.limits, plans=plans))) if plans else None


def without_leftovers(execution: Execution, tester: Tester) -> Execution:
    """Return the run without the parts of its case that had no effect, as far as it visits the same."""
    case = execution.case
    for part in ("injections", "outcomes"):
        for clause in getattr(case, part):
            if not execution.unused:
                return execution
            rest: dict[str, Any] = {
                part: tuple(other for other in getattr(execution.case, part) if other is not clause)
            }
            attempt = bounded(tester, replace(execution.case, **rest))
            if attempt is None:
                continue
            if attempt.visited == execution.visited and len(attempt.unused) < len(execution.unused):
                execution = attempt
    return execution


def _with_injection(
    case: Case, operation: str, changed: dict[str, bool | int | str], hold_ns: int | None = HOLD_NS
) -> Case:
    return replace(case, injections=(*case.injections, injection(case, operation, changed, hold_ns)))


def _bits(mask: int) -> Iterator[int]:
    while mask:
        bit = mask & -mask
        yield bit
        mask ^= bit


def minimal(executions: Sequence[Execution], visited: int) -> list[Execution]:
    """Return the runs that add something to `visited`, without any that the others make redundant; shortest first.

    Runs that visit most are removed last, so that few cases remain.
    """
    kept = sorted(executions, key=lambda each: each.visited.bit_count())
    for execution in tuple(kept):
        others = visited
        for other in kept:
            if other is not execution:
                others |= other.visited
        if not execution.visited & ~others:
            kept.remove(execution)
    return sorted(kept, key=lambda each: (each.ended_ns, len(each.trace.records)))
