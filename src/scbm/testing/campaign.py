"""Many cases, run one by one, judged, measured, and added up (paper, Section VI, steps 4 and 5)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from scbm.coverage import Coverage, Obligations, visited_by
from scbm.simulating import DrawnChoices, RecordedChoices, Simulator
from scbm.testing.generation import RandomCases
from scbm.testing.requirements import find_violations
from scbm.testing.verdicts import Verdict, judge
from scbm.trace import Trace

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.model import BehaviorModel
    from scbm.planning import PlanLimits
    from scbm.running import RunnerOptions
    from scbm.testing.cases import Case
    from scbm.testing.requirements import Violation


@dataclass(frozen=True, slots=True)
class Execution:
    """A case that was run.

    Attributes:
        case: the case, with all reactions that were drawn: run again, it gives the same trace.
        trace: what happened.
        verdict: what that means.
        ended_ns: how long the run took, in simulated time.
        violations: the first violation of each requirement that was broken.
    """

    case: Case
    trace: Trace
    verdict: Verdict
    ended_ns: int
    violations: tuple[Violation, ...] = ()


@dataclass(frozen=True, slots=True)
class CaseResult:
    """What a campaign keeps of a case: neither its trace nor what was drawn, as both can be had again from the case.

    Attributes:
        case: the case as it was given.
        requests: how many requests its run sent.
        verdict: how it ended.
        ended_ns: how long it took, in simulated time.
        visited: the obligations that it visited, as bits.
    """

    case: Case
    requests: int
    verdict: Verdict
    ended_ns: int
    visited: int


@dataclass(frozen=True, slots=True)
class Campaign:
    """The results of many cases of one model."""

    model: BehaviorModel
    seed: int
    results: tuple[CaseResult, ...]
    coverage: Coverage

    @property
    def simulated_ns(self) -> int:
        """How long all runs took together, in simulated time."""
        return sum(result.ended_ns for result in self.results)

    @property
    def failed(self) -> tuple[CaseResult, ...]:
        """The cases that failed."""
        return tuple(result for result in self.results if not result.verdict.passed)


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

    def execute(self, case: Case) -> Execution:
        """Runs one case; reactions that it does not have are drawn from its origin.

        Raises:
            ReplayError: the case has reactions, and they do not fit the model.
            ValueError: the case has neither reactions nor an origin.
        """
        chooser: DrawnChoices | RecordedChoices
        if case.reactions is not None:
            chooser = RecordedChoices(case.reactions)
        elif case.origin is not None:
            chooser = DrawnChoices(RandomCases.reactions(case.origin))
        else:
            raise ValueError(f"{case.name} has neither reactions nor an origin to draw them from")
        run = self._simulator.run(case.initial, (case.goal, case.predicate), chooser, case.injections)
        reactions = tuple(chooser.drawn) if isinstance(chooser, DrawnChoices) else chooser.used
        violations = find_violations(self.model.requirements, run.records)
        verdict = judge(case, run.end, run.records, reactions, violations)
        trace = Trace(self.model.name, case.name, run.records)
        return Execution(replace(case, reactions=reactions), trace, verdict, run.ended_ns, violations)

    def results(self, cases: Iterable[Case]) -> Iterator[CaseResult]:
        """Runs cases one by one and measures what each visits."""
        for case in cases:
            done = self.execute(case)
            visited = visited_by(done.trace.records, self.obligations)
            requests = len(done.case.reactions or ())
            yield CaseResult(case, requests, done.verdict, done.ended_ns, visited)

    def campaign(self, results: Iterable[CaseResult], seed: int) -> Campaign:
        """Adds results up."""
        kept = tuple(results)
        coverage = Coverage(self.obligations, tuple((result.case.name, result.visited) for result in kept))
        return Campaign(self.model, seed, kept, coverage)
