"""Runs cases over nodes and judges them like simulated ones (paper, Figure 5).

It also finds runs that were too far behind their own time.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from msgspec.structs import replace

from scbm.cases.trace import End, PlanningSpan, ends_of, spans_of
from scbm.model import format_duration
from scbm.nodes.roles.tester_node import LostError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from fractions import Fraction

    from scbm.cases import Case
    from scbm.cases.trace import Record
    from scbm.model import BehaviorModel
    from scbm.nodes.roles.tester_node import NodeRun
    from scbm.running import RunnerOptions
    from scbm.running.simulation import Choices
    from scbm.testing import Execution, Tester


def too_late(records: Sequence[Record], model: BehaviorModel, time_scale: Fraction, planning_ns: int = 0) -> str | None:
    """Return why a run says nothing about the model: the machine is too slow for its time scale.

    That is so if a plan took half of the shortest deadline longer than the case says (`planning_ns`). `None` if nothing
    speaks for it.
    """
    deadlines_ns = [op.deadline_ns for op in model.operations if op.deadline_ns is not None]
    slowest_ns = slowest_plan_ns(records) - planning_ns
    if time_scale <= 1 or not deadlines_ns or 2 * slowest_ns < min(deadlines_ns):
        return None
    took = f"a plan took {slowest_ns / 1e9:.3g} s of the run, and the shortest deadline is"
    scale = f"the machine did not keep up with a time scale of {float(time_scale):g}"
    return f"{scale}: {took} {format_duration(min(deadlines_ns))}; try a smaller one"


def slowest_plan_ns(records: Sequence[Record]) -> int:
    """Return the longest time that a run waited for a plan; in a simulation it is what the case says."""
    plans = spans_of(records).plans
    return max((span.duration_ns for span in plans if isinstance(span, PlanningSpan) and span.status), default=0)


class RunsCases(Protocol):
    """The interface of `nodes.Session`, which runs a case over nodes."""

    def run(self, case: Case, choices: Choices, options: RunnerOptions) -> NodeRun:
        """Run a case; raise `LostError` if the run is not finished."""
        ...


class NodeTester:
    """Runs cases of one model over nodes, with the choices of a simulation."""

    __test__ = False  # its name looks to pytest like that of a class of tests

    def __init__(self, tester: Tester, session: RunsCases) -> None:
        self._tester = tester
        self._session = session

    def execute(self, case: Case) -> Execution:
        """Run one case; it counts as lost if a node is lost, or the machine is too slow for its goal."""
        choices, options = self._tester.choices_of(case), self._tester.options_of(case)
        try:
            done = self._session.run(case, choices, options)
        except LostError as error:
            partial = error.partial
            return self._tester.lost(case, str(error), *(() if partial is None else (partial.run, partial.log)))
        late = too_late(done.run.records, self._tester.model, done.log.time_scale, case.planning_ns)
        is_missed = any(ended.end != End.REACHED.value for ended in ends_of(done.run.records))
        if late is not None and is_missed:
            return self._tester.lost(case, late, done.run, replace(done.log, end=End.LOST))
        return self._tester.judged(case, done.run, done.log.reactions, done.log)

    def executions(self, cases: Iterable[Case]) -> Iterator[Execution]:
        """Run cases one by one."""
        for case in cases:
            yield self.execute(case)
