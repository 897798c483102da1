"""Verdicts on runs with a real driver: what a simulated fault excuses, a driver that is silent does not."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from itertools import chain, repeat

import pytest

from scbm.cases.trace import End
from scbm.files import read_bindings, read_case, read_model
from scbm.nodes import ControllerNode
from scbm.nodes.buses.bus import Topic
from scbm.running import Program
from scbm.testing import Answers, Excuse, Execution, FailureKind, Tester
from scbm.testing.event_logs.event_log import read_event_log, rerun, write_event_log
from support.loops import GUARD_S
from support.nodes import Stage, run_or_lose
from support.virtual_loop import VirtualLoop, run_virtually
from support.wording import Wording

MODEL = read_bindings(
    """
bindings_of: cell
resources: {scanner: {topics: {request: /scanner/request, reply: /scanner/reply}}}
""",
    read_model("""
behavior_model: cell
variables:
  up: {domain: bool, initial: false}
  scanned: {domain: bool, initial: false}
  tries: {domain: 0..5, initial: 0}
resources:
  lift: {simulation: {latency: 1 s}}
  scanner: {}
operations:
  raise: {request: lift, deadline: 5 s, guard: up == false, effects: [up <- true]}
  scan:
    request: scanner
    deadline: 2 s
    guard: [up == true, scanned == false]
    effects: [scanned <- true]
    on_timeout: [tries += 1]
automatic_transitions:
  give_up: {g: tries == 5, a: [tries <- 0, plan.state <- aborted]}
goals:
  scanned: scanned == true
  lifted: up == true
"""),
)
SILENT = "silent"


def over_nodes(case_text: str, answers: Sequence[str]) -> Execution:
    """The run of a case whose scanner is real; its driver answers so, and is silent after that."""
    case = read_case(f"case: scans\n{case_text}", MODEL)

    async def scene(loop: VirtualLoop) -> Execution:
        stage, tester = Stage.virtual(MODEL, loop), Tester(MODEL)
        ControllerNode(stage.context("controller", ["scanner"]))
        stage.resources(["lift"])
        driver, left = stage.join("driver"), chain(answers, repeat(SILENT))
        replies = driver.publisher(Topic("/scanner/reply"))

        def answer(request: str, left: Iterator[str] = left) -> None:
            message = json.loads(request)
            if "request" in message and (how := next(left)) != SILENT:
                reply = json.dumps({"id": message["id"], "succeeded": how == "succeeds"})
                loop.call_later(0.5, replies.publish, {"data": reply})

        driver.subscribe(Topic("/scanner/request"), lambda received: answer(str(received.message.data)))
        node = stage.tester()
        await node.wait_for_cell(GUARD_S)
        execution = await run_or_lose(node, tester, case)
        assert stage.complaints == []
        return execution

    return run_virtually(scene)


FAILS_ONCE = "goal: scanned\noutcomes: {lift: [fail, succeed]}\n"
FAILS_TWICE = "goal: scanned\noutcomes: {lift: [fail, timeout, succeed]}\n"


@pytest.mark.parametrize(
    "case_text", [FAILS_ONCE, FAILS_TWICE, "goal: scanned\n", f"{FAILS_ONCE}limits: {{time: 9 s}}\n"]
)
@pytest.mark.parametrize("answers", [[], ["fails"] * 5, [SILENT, "fails", SILENT]], ids=str)
def test_a_driver_that_never_succeeds_fails_the_case_whatever_else_went_wrong(
    case_text: str, answers: list[str], wording: Wording
) -> None:
    execution = over_nodes(case_text, answers)
    (failure,) = execution.verdict.failures
    assert failure.kind is FailureKind.NOT_REACHED
    wording(failure.message)
    assert execution.verdict.excuses == ()
    assert Answers("scanner").after(execution.trace.records).succeeded == 0
    assert_judged_alike(execution)


def assert_judged_alike(execution: Execution) -> None:
    """Also from a log that comes out of a file."""
    assert execution.log is not None
    log = read_event_log(write_event_log(execution.log, MODEL), MODEL, execution.log.digest)
    assert log.real == ("scanner",)
    again = Tester(MODEL).judged(log.case, rerun(log, Program(MODEL)), log.reactions, log)
    assert (again.verdict, again.digest) == (execution.verdict, execution.digest)


@pytest.mark.parametrize("answers", [["succeeds"], [*[SILENT] * 4, "succeeds"], ["fails", SILENT, "succeeds"]], ids=str)
def test_a_driver_that_recovers_in_time_fails_nothing(answers: list[str]) -> None:
    execution = over_nodes(FAILS_TWICE, answers)
    assert (execution.verdict.end, execution.verdict.passed, execution.verdict.excuses) == (End.REACHED, True, ())


@pytest.mark.parametrize(
    ("case_text", "excuse"),
    [
        (f"{FAILS_ONCE}may_end: [aborted]\n", Excuse.MAY_END),
        (f"{FAILS_ONCE}expect: {{verdict: aborted}}\n", Excuse.EXPECTED),
    ],
)
def test_a_case_may_say_that_a_silent_driver_is_no_failure(case_text: str, excuse: Excuse) -> None:
    execution = over_nodes(case_text, [])
    assert (execution.verdict.end, execution.verdict.passed, execution.verdict.excuses) == (
        End.ABORTED,
        True,
        (excuse,),
    )


def test_faults_of_simulated_resources_excuse_what_they_cause() -> None:
    execution = over_nodes("goal: scanned\noutcomes: {lift: fail}\nlimits: {plans: 3}\n", ["succeeds"])
    assert (execution.verdict.passed, execution.verdict.excuses) == (True, (Excuse.FAULT,))


def test_each_goal_is_judged_by_its_own_requests_to_the_driver() -> None:
    goals = "goals: [{goal: scanned}, {goal: lifted}]\n"
    execution = over_nodes(f"{goals}outcomes: {{lift: [fail, succeed]}}\n", [])
    assert [failure.kind for failure in execution.verdict.failures] == [FailureKind.NOT_REACHED]
    assert execution.verdict.end is End.REACHED
