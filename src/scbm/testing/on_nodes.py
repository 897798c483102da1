"""Cases that are run over nodes, and judged as those of simulations (paper, Figure 5)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from scbm.realtime import LostError
from scbm.testing.lateness import too_late
from scbm.trace import End

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.cases import Case
    from scbm.realtime import NodeRun
    from scbm.running import RunnerOptions
    from scbm.simulating import Choices
    from scbm.testing.tester import Execution, Tester


class RunsCases(Protocol):
    """What runs a case over nodes: `realtime.Session`."""

    def run(self, case: Case, choices: Choices, options: RunnerOptions) -> NodeRun:
        """Raises `LostError` if the run is not finished."""
        ...


class NodeTester:
    """Runs cases of one model over nodes. What the nodes do with a case is decided as in a simulation."""

    __test__ = False  # its name looks to pytest like that of a class of tests

    def __init__(self, tester: Tester, session: RunsCases) -> None:
        self._tester = tester
        self._session = session

    def execute(self, case: Case) -> Execution:
        """Runs one case; it is lost if a node is, or if the machine is too slow for its goal."""
        choices, options = self._tester.choices_of(case), self._tester.options_of(case)
        try:
            done = self._session.run(case, choices, options)
        except LostError as error:
            return self._tester.lost(case, str(error))
        late = too_late(done.run.records, self._tester.model, done.log.time_scale)
        if late is not None and done.run.end is not End.REACHED:
            return self._tester.lost(case, late)
        return self._tester.judged(case, done.run, done.log.reactions, done.log)

    def executions(self, cases: Iterable[Case]) -> Iterator[Execution]:
        """Runs cases one by one."""
        for case in cases:
            yield self.execute(case)
