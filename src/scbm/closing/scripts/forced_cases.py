"""Cases that force a state, as the last resort: they disable operations that nothing else disables (decision 45).

The controller's own bookkeeping changes as an operation becomes current. Of the changes that disable it the first one
is taken after which no requirement breaks; if there is none, the first one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.cases.coverage import Aspect, Obligation
from scbm.cases.trace import End, state_after
from scbm.closing.scripts.case_search import bounded
from scbm.closing.scripts.closing_injections import (
    HOLD_NS,
    MAX_INJECTIONS,
    changes_that_disable,
    current_operations,
    injection,
)
from scbm.model import State

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from scbm.cases import Case
    from scbm.closing.scripts.case_search import CaseSearch
    from scbm.model import Value
    from scbm.testing import Execution, Tester

_WRONG_ENDS = (End.LIVELOCK, End.MODEL_ERROR, End.TIME_LIMIT)
"""The ends by which a run shows a fault of its model, if nothing is forced."""


class ForcedCases:
    """Makes cases that disable operations by force.

    Attributes:
        missing: the obligations that no case visits, not even by force.
    """

    def __init__(  # noqa: PLR0913, PLR0917 - what is searched for, how far, and where it is kept
        self,
        tester: Tester,
        missing: int,
        impossible: int,
        most: int,
        found: list[Execution],
        progress: Callable[[str], None] | None = None,
    ) -> None:
        """Prepare the search.

        Args:
            tester: runs the cases.
            missing: the obligations that no case visits.
            impossible: the obligations that are known to be uncoverable, by injections too.
            most: maximum number of changes that are tried for one operation in one case.
            found: the list of runs that is extended.
            progress: called with a description of what is searched for.
        """
        self.missing = missing
        self._tester = tester
        self._impossible = impossible
        self._most = most
        self._found = found
        self._progress = progress or (lambda _: None)
        self._operations = {operation.name: operation for operation in tester.model.operations}

    @property
    def names(self) -> list[str]:
        """The operations that are still to be disabled, and are not always enabled."""
        wanted = self.missing & ~self._impossible
        return [name for name in self._operations if wanted & self._bit(name)]

    def in_graph(self, search: CaseSearch, current: Callable[[str], int], *, short: bool) -> None:
        """Disable operations in cases that follow walks through the graph of a search.

        Args:
            search: the search in the graph of all runs.
            current: returns the bit of the graph for an operation that becomes current.
            short: whether each operation gets the shortest case of its own.
        """
        tried = 0
        while not short and (wanted := sum(map(current, self.names)) & ~tried):
            execution, bits = search.far_path(wanted)
            if not bits:
                break
            tried |= bits
            if execution is not None:
                self.in_case(execution)
        for name in self.names:
            execution = search.path_to(current(name))
            if execution is not None:
                self.in_case(execution, [name])

    def beyond_graph(self, search: CaseSearch, current: Callable[[str], int]) -> None:
        """Disable operations in cases on paths that a guided search finds beyond the explored runs."""
        for name in self.names:
            execution = search.guided_path(Obligation(name, Aspect.DISABLED), current(name))
            if execution is not None:
                self.in_case(execution, [name])

    def in_cases(self, executions: Iterable[Execution]) -> None:
        """Disable operations in cases that are known."""
        for execution in executions:
            if not self.names:
                return
            self.in_case(execution)

    def in_case(self, base: Execution, wanted: Sequence[str] | None = None) -> None:
        """Disable the operations that become current in a case before anything is forced in it; all, or some of them.

        Each case gets about `MAX_INJECTIONS` at most.
        """
        known = current_operations(base.trace.records[: base.forced_by])
        names = [name for name in known if name in self.names and (wanted is None or name in wanted)]
        if names:
            self._progress(f"forcing states: {len(self.names):,} operations are left")
        most = max(1, MAX_INJECTIONS - len(base.case.injections))
        parts = max(1, round(len(names) / most))
        for number in range(parts):
            self._disable(base, names[number * len(names) // parts : (number + 1) * len(names) // parts])

    def _disable(self, base: Execution, names: Sequence[str]) -> None:
        """Disable some operations of a case by the first change for each; else one by one, by any change."""
        first = [(name, next(self._changes(name, base), None)) for name in names]
        if len(names) > 1 and self._take_together(base, [(name, change) for name, change in first if change]):
            return
        alone = [(name, found) for name in names if (found := self._alone(name, base)) is not None]
        calm = [(name, found[0]) for name, found in alone if not _breaks(base, found[1])]
        if len(calm) > 1:
            self._take_together(base, calm)
        for _, (_, execution) in alone:
            self._take(execution)

    def _take_together(self, base: Execution, changes: Sequence[tuple[str, dict[str, Value]]]) -> bool:
        """Take the case with all of these changes if each disables its operation and no requirement breaks."""
        case = base.case
        for name, changed in changes:
            case = _with(case, name, changed)
        execution = bounded(self._tester, case)
        wanted = sum(self._bit(name) for name, _ in changes)
        if execution is None or wanted & ~execution.visited or _breaks(base, execution):
            return False
        return self._take(execution)

    def _alone(self, name: str, base: Execution) -> tuple[dict[str, Value], Execution] | None:
        """Return the first change that disables one operation and breaks no requirement; else the first that does."""
        fallback = None
        left = self._most
        for hold_ns in (HOLD_NS, 1, None):
            for changed in self._changes(name, base):
                left -= 1
                execution = bounded(self._tester, _with(base.case, name, changed, hold_ns))
                if execution is not None and execution.visited & self._bit(name):
                    if not _breaks(base, execution):
                        return changed, execution
                    fallback = fallback or (changed, execution)
                if not left:
                    return fallback
        return fallback

    def _changes(self, name: str, base: Execution) -> Iterator[dict[str, Value]]:
        """Yield the changes that disable an operation when it is current for the first time."""
        records = base.trace.records
        first = current_operations(records)[name]
        state = State(self._tester.model.running_space, state_after(records[: first + 1]))
        return changes_that_disable(self._tester.model, self._operations[name], state, base.case.predicate)

    def _take(self, execution: Execution) -> bool:
        """Keep a run if it visits something that no other one visits."""
        if not execution.visited & self.missing:
            return False
        self.missing &= ~execution.visited
        self._found.append(execution)
        return True

    def _bit(self, name: str) -> int:
        return self._tester.obligations.bit_of(name, Aspect.DISABLED)


def _with(case: Case, name: str, changed: dict[str, Value], hold_ns: int | None = HOLD_NS) -> Case:
    return replace(case, injections=(*case.injections, injection(case, name, changed, hold_ns)))


def _breaks(base: Execution, execution: Execution) -> bool:
    """Return whether a run breaks a requirement, or ends as no run should, and the run before the changes does not."""
    before = {(violation.requirement, violation.is_built_in) for violation in base.violations}
    is_wrong = execution.verdict.end in _WRONG_ENDS and execution.verdict.end is not base.verdict.end
    after = ((violation.requirement, violation.is_built_in) for violation in execution.violations)
    return is_wrong or any(each not in before for each in after)
