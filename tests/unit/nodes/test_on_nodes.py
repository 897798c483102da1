"""Cases that are run over nodes are judged as those of simulations; a run that was lost is never passed."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction

from msgspec.structs import replace

from scbm.cases import Case
from scbm.cases.trace import End, PlanAsked, PlanReceived
from scbm.files import read_case
from scbm.nodes import LostError, NodeRun
from scbm.nodes.cases_over_nodes import NodeTester
from scbm.running import RunnerOptions
from scbm.running.simulation import Choices, Simulator
from scbm.testing import FailureKind, Tester
from scbm.testing.event_logs.event_log import EventLog
from support.models import scan_cell
from support.wording import Wording

MODEL = scan_cell()
CASES = [
    read_case("case: scans\ngoal: scanned\nexpect: {verdict: reached}\n", MODEL),
    read_case(
        "case: fails\ngoal: scanned\noutcomes: {scan: fail}\nlimits: {plans: 2}\nexpect: {verdict: reached}\n", MODEL
    ),
    read_case("case: hurries\ngoal: scanned\nlimits: {time: 3 ms}\n", MODEL),
]


@dataclass
class Simulates:
    """Runs cases as a session does, in simulation; loses those of a name."""

    loses: str | None = None
    options: list[RunnerOptions] = field(default_factory=list)
    partial: NodeRun | None = None

    def run(self, case: Case, choices: Choices, options: RunnerOptions) -> NodeRun:
        self.options.append(options)
        if case.name == self.loses:
            error = LostError("the controller was lost")
            error.partial = self.partial
            raise error
        run = Simulator(MODEL, options).run(case, choices)
        log = EventLog(MODEL.name, "d" * 64, case, options, Fraction(1), (), (), choices.taken, run.end, "t" * 64)
        return NodeRun(run, log)


def test_verdicts_are_those_of_simulations() -> None:
    tester = Tester(MODEL)
    session = Simulates()
    for case, real in zip(CASES, NodeTester(tester, session).executions(CASES), strict=True):
        simulated = tester.execute(case)
        assert (real.verdict, real.trace, real.reactions) == (simulated.verdict, simulated.trace, simulated.reactions)
        assert (real.visited, real.ended_ns, real.unused) == (simulated.visited, simulated.ended_ns, simulated.unused)
        assert real.log is not None
        assert real.log.case == case
    assert session.options == [tester.options_of(case) for case in CASES]


def test_a_run_that_is_lost_keeps_its_log_and_its_requests_and_visits_nothing() -> None:
    whole = Simulates()
    case = CASES[1]
    tester = Tester(MODEL)
    done = whole.run(case, tester.choices_of(case), tester.options_of(case))
    partial = NodeRun(replace(done.run, end=End.LOST), replace(done.log, end=End.LOST))
    (lost,) = NodeTester(tester, Simulates(loses="fails", partial=partial)).executions([case])
    assert (lost.log, lost.trace.records, lost.ended_ns) == (partial.log, partial.run.records, partial.run.ended_ns)
    assert lost.result.requests == len(done.log.reactions) > 0
    assert (lost.verdict.passed, lost.visited) == (False, 0)


def test_a_run_that_is_lost_is_not_passed_visited_nothing_and_the_next_goes_on(wording: Wording) -> None:
    first, second, third = NodeTester(Tester(MODEL), Simulates(loses="fails")).executions(CASES)
    assert first.verdict.passed
    assert not second.verdict.passed
    assert (second.verdict.end, second.visited, second.log, second.reactions) == (End.LOST, 0, None, ())
    (failure,) = second.verdict.failures
    assert failure.kind is FailureKind.LOST
    wording(failure.message)
    assert third.verdict.end is not End.LOST


class Late(Simulates):
    """Runs cases with a plan that takes five seconds, a thousand times faster than the wall clock."""

    def run(self, case: Case, choices: Choices, options: RunnerOptions) -> NodeRun:
        done = super().run(case, choices, options)
        late = (PlanAsked(0, 1, ()), PlanReceived(5_000_000_000, 1, "solved", (), ()))
        records = (*late, *done.run.records)
        return NodeRun(replace(done.run, records=records), replace(done.log, time_scale=Fraction(1000)))


def test_a_run_that_the_machine_could_not_keep_up_with_says_nothing_of_its_goal(wording: Wording) -> None:
    reached, limited, _ = NodeTester(Tester(MODEL), Late()).executions(CASES)
    assert reached.verdict.passed
    assert limited.verdict.end is End.LOST
    wording(limited.verdict.failures[0].message)
