"""Runs cases of one model in simulation, judges them, and measures what they visit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from hashlib import sha256
from typing import TYPE_CHECKING

from scbm.cases import Network, Recorded
from scbm.coverage import Obligations, visited_by
from scbm.simulating import Choices, DrawnReactions, PlainReactions, Simulator, leave_nothing_open
from scbm.testing.campaign import CaseResult
from scbm.testing.chance import message_stream, reaction_stream
from scbm.testing.requirements import find_violations
from scbm.testing.unused import find_unused
from scbm.testing.verdicts import Outcomes, Verdict, judge
from scbm.trace import Trace, write_trace

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.cases import Case, Reaction
    from scbm.model import BehaviorModel
    from scbm.planning import PlanLimits
    from scbm.running import RunnerOptions
    from scbm.testing.requirements import Violation


@dataclass(frozen=True, slots=True)
class Execution:
    """A case that was run.

    Attributes:
        case: the case as it was given.
        reactions: what happened to its requests, in order.
        trace: what happened.
        verdict: what that means.
        ended_ns: how long the run took, in simulated time.
        violations: the first violation of each requirement that was broken.
        visited: the obligations that it visited, as bits.
        unused: what the case says and nothing came of, one sentence each.
    """

    case: Case
    reactions: tuple[Reaction, ...]
    trace: Trace
    verdict: Verdict
    ended_ns: int
    violations: tuple[Violation, ...]
    visited: int
    unused: tuple[str, ...] = ()

    @property
    def result(self) -> CaseResult:
        """What a campaign keeps of it."""
        requests = len(self.reactions)
        return CaseResult(self.case, requests, self.verdict, self.ended_ns, self.visited, self.unused)

    @property
    def digest(self) -> str:
        """The SHA-256 of the trace as text."""
        return sha256(write_trace(self.trace).encode()).hexdigest()

    @property
    def closed_case(self) -> Case:
        """The case with all that was decided in its run said: it gives the same trace without anything drawn.

        Partitions and restarts stay what they are; all else that the network did is told with the requests.
        """
        network = Network(partitions=self.case.network.partitions, restarts=self.case.network.restarts)
        return replace(self.case, outcomes=leave_nothing_open(self.reactions), network=network)

    @property
    def recorded(self) -> Recorded:
        """What came of the case, to compare a replay with."""
        return Recorded(self.verdict.end.value, self.digest)

    @property
    def recorded_case(self) -> Case:
        """The closed case, and what came of it."""
        return replace(self.closed_case, recorded=self.recorded)


class Tester:
    """Runs cases of one model in simulation."""

    __test__ = False  # its name looks to pytest like that of a class of tests

    def __init__(
        self,
        model: BehaviorModel,
        options: RunnerOptions | None = None,
        plan_limits: PlanLimits | None = None,
    ) -> None:
        self.model = model
        self.obligations = Obligations.of(model)
        self._simulator = Simulator(model, options, plan_limits)
        self._plain = PlainReactions()

    def execute(self, case: Case, most_records: int | None = None) -> Execution:
        """Runs one case. What it leaves open is drawn from its origin, or plain if it has none.

        Raises:
            TooLongError: more happens than `most_records`.
            ValueError: the network of the case is a matter of chance, and the case has no origin.
        """
        choices = self._choices(case)
        run = self._simulator.run(case, choices, most_records)
        violations = find_violations((*self.model.requirements, *case.requirements), run.records)
        visited = visited_by(run.records, self.obligations)
        names = self.obligations.names(visited) if case.expect.visits else ()
        verdict = judge(case, Outcomes(run.end, run.records, choices.taken, violations, names))
        trace = Trace(self.model.name, case.name, run.records)
        unused = find_unused(case, run.records)
        return Execution(case, choices.taken, trace, verdict, run.ended_ns, violations, visited, unused)

    def _choices(self, case: Case) -> Choices:
        if case.origin is None:
            return Choices(self._plain, case.outcomes, case.network)
        messages = message_stream(case.origin) if case.network.draws else None
        return Choices(DrawnReactions(reaction_stream(case.origin)), case.outcomes, case.network, messages)

    def results(self, cases: Iterable[Case]) -> Iterator[CaseResult]:
        """Runs cases one by one and measures what each visits."""
        for case in cases:
            yield self.execute(case).result
