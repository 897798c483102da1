"""Values that drivers send and the model excludes: they are applied, force the state, and are counted."""

from __future__ import annotations

import json

import pytest

from scbm.cases.coverage import Obligations, visited_by
from scbm.cases.trace import SENT, End, InjectionApplied, Record
from scbm.files import read_case, read_model
from scbm.nodes.roles.cell_topics import CellTopics
from scbm.running import Event, GoalGiven, Measured, PlanAnswered, PlanStatus, Program, ReplyArrived, Runner, records_of
from scbm.running.simulation.excluded_values import excluded_values
from scbm.testing import Execution, Tester
from scbm.testing.event_logs.event_log import read_event_log, rerun, write_event_log
from scbm.testing.real_drivers import ExcludedVariable, with_excluded
from support.loops import GUARD_S
from support.nodes import Stage, run_or_lose
from support.virtual_loop import VirtualLoop, run_virtually
from support.wording import Wording

SECOND_NS = 10**9
MODEL = read_model("""
behavior_model: gate
variables:
  done: {domain: bool, initial: false}
  door: {domain: [closed, open, locked], initial: closed}
  key: {domain: bool, initial: false, source: state}
  lamp: {domain: [dark, lit], initial: dark, source: input}
  horn: {domain: [quiet, loud], initial: quiet, source: input}
  level: {domain: 0..20, initial: 1}
  zone: {domain: [near, far], initial: near}
  weight: {domain: 0..20, initial: 0}
resources:
  robot: {measures: {weight: [0, 1, 2]}, simulation: {latency: 2 s, measured: {weight: [1]}}}
  sensor: {publishes: {level: [1, 2, 4, 5, 6, 7, 8, 9, 10, 11], zone: any}}
operations:
  work: {request: robot, deadline: 5 s, guard: done == false, effects: [done <- true]}
automatic_transitions:
  warn: {g: lamp == lit && key == false, a: [key <- true]}
  calm: {g: horn == loud && key == false, a: [key <- true]}
environment:
  opens: {guard: [door == closed, key == true], actions: [door <- open]}
  forces_open: {guard: [door == locked, lamp == lit], actions: [door <- open]}
  locks: {guard: door == open, actions: [door <- locked]}
goals:
  done: done == true
""")
GOAL = GoalGiven("done", MODEL.goals[0][1])
PLAN = PlanAnswered(1, PlanStatus.SOLVED, ("work",))


def records_after(*events: Event) -> list[Record]:
    """What a runner records of events, one each second."""
    runner = Runner(Program(MODEL), MODEL.nominal_state)
    effects = (runner.handle(event, number * SECOND_NS) for number, event in enumerate(events))
    return [record for each in effects for record in records_of(each)]


@pytest.mark.parametrize(
    ("event", "excluded"),
    [
        (Measured((("level", 2), ("zone", "far"))), []),
        (Measured((("level", 99), ("temperature", 1))), []),
        (Measured((("lamp", "lit"), ("level", 4))), []),
        (Measured((("door", "closed"), ("weight", 0), ("level", 1))), []),
        (ReplyArrived(1, succeeded=True, measured=(("weight", 2),)), []),
        (Measured((("level", 3),)), ["level"]),
        (Measured((("zone", "far"), ("level", 3))), ["level"]),
        (Measured((("level", 3), ("weight", 1), ("level", 3))), ["level", "weight"]),
        (Measured((("door", "open"),)), ["door"]),
        (Measured((("door", "locked"),)), ["door"]),
        (Measured((("door", "open"), ("lamp", "lit"))), ["door"]),
        (Measured((("weight", 2),)), ["weight"]),
        (Measured((("lamp", "lit"), ("horn", "loud"))), ["lamp", "horn"]),
        (ReplyArrived(1, succeeded=True, measured=(("weight", 3),)), ["weight"]),
        (ReplyArrived(1, succeeded=False, measured=(("weight", 20), ("level", 3))), ["weight"]),
    ],
    ids=str,
)
def test_what_no_maker_could_send_is_excluded_with_the_reason(
    event: Event, excluded: list[str], wording: Wording
) -> None:
    records = records_after(GOAL, PLAN, event)
    found = list(excluded_values(Program(MODEL), records))
    assert [each.variable for each in found] == excluded
    assert {each.at_ns for each in found} <= {2 * SECOND_NS}
    is_forced = any(isinstance(each, InjectionApplied) and each.forced for each in records)
    assert is_forced == bool(excluded)
    if found:
        wording(map(str, found))


def test_each_message_is_judged_in_its_own_state() -> None:
    key = Measured((("lamp", "lit"),))
    sent: list[Event] = [
        GOAL,
        PLAN,
        Measured((("door", "open"),)),
        key,
        Measured((("door", "locked"),)),
        Measured((("door", "open"),)),
    ]
    assert [each.at_ns // SECOND_NS for each in excluded_values(Program(MODEL), records_after(*sent))] == [2]
    assert list(excluded_values(Program(MODEL), records_after(GOAL, PLAN, key, sent[2]))) == []


def over_nodes(sent: list[tuple[float, str]], more: str = "", rounds: int = 1) -> tuple[list[Execution], list[str]]:
    """The runs of a case, one after the other, in a cell in virtual time, and what its nodes complained of.

    Args:
        sent: what a driver sends, as JSON, at times of the cell in seconds; the first run begins in the first second.
        more: further keys of the case.
        rounds: how many times the case runs.
    """
    case = read_case(f"case: works\ngoal: done\n{more}", MODEL)

    async def scene(loop: VirtualLoop) -> tuple[list[Execution], list[str]]:
        stage, tester = Stage.virtual(MODEL, loop), Tester(MODEL)
        stage.controller()
        stage.resources()
        node = stage.tester()
        await node.wait_for_cell(GUARD_S)
        driver = stage.join("driver").publisher(CellTopics.of(MODEL).reply("sensor"))
        for at_s, measured in sent:
            loop.call_at(loop.time() + at_s, driver.publish, {"data": json.dumps({"measured": json.loads(measured)})})
        executions = [await run_or_lose(node, tester, case) for _ in range(rounds)]
        return executions, stage.complaints

    return run_virtually(scene)


def assert_counts_by_force_from(execution: Execution, first: int) -> None:
    """What the records from an index on visit alone is visited by force, also when the log is judged."""
    obligations = Obligations.of(MODEL)
    assert execution.forced_by == first
    before = visited_by(execution.trace.records[:first], obligations)
    assert (execution.visited_freely, execution.visited & ~before) == (before, execution.forced)
    assert execution.forced
    assert execution.log is not None
    log = read_event_log(write_event_log(execution.log, MODEL), MODEL, execution.log.digest)
    again = Tester(MODEL).judged(log.case, rerun(log, Program(MODEL)), log.reactions, log)
    assert (again.digest, again.verdict) == (execution.digest, execution.verdict)
    assert (again.forced_by, again.forced, again.excluded) == (first, execution.forced, execution.excluded)


def test_a_run_takes_what_a_driver_sends_and_visits_by_force_from_there_on(wording: Wording) -> None:
    sent = [
        (1.0, '{"level": 2}'),
        (1.25, '{"level": 3}'),
        (1.5, '{"level": 4}'),
        (1.75, '{"door": "open", "level": 3}'),
    ]
    (execution,), complaints = over_nodes(sent)
    applied = [record for record in execution.trace.records if isinstance(record, InjectionApplied)]
    assert [(each.injection, each.forced, each.changes) for each in applied] == [
        (SENT, True, (("level", 3),)),
        (SENT, True, (("door", "open"), ("level", 3))),
    ]
    assert [each.variable for each in execution.excluded] == ["level", "door", "level"]
    assert (execution.verdict.end, execution.verdict.passed, execution.result.excluded) == (End.REACHED, True, 3)
    assert_counts_by_force_from(execution, execution.trace.records.index(applied[0]))
    assert len(complaints) == 2  # each variable once
    wording(complaints)


def test_a_value_of_a_reply_that_is_never_sent_is_treated_alike() -> None:
    measured = "outcomes: {robot: [{outcome: timeout}, succeed]}"
    case_text = f"case: works\ngoal: done\n{measured}\n"
    case = read_case(case_text, MODEL)

    async def scene(loop: VirtualLoop) -> tuple[Execution, list[str]]:
        stage, tester = Stage.virtual(MODEL, loop), Tester(MODEL)
        stage.controller()
        stage.resources()
        node = stage.tester()
        await node.wait_for_cell(GUARD_S)
        bus = stage.join("driver")
        replies = bus.publisher(CellTopics.of(MODEL).reply("robot"))
        asked: list[str] = []

        def answer(request: str) -> None:
            asked.append(request)
            reply = {"id": json.loads(request)["id"], "succeeded": True, "measured": {"weight": 7}}
            loop.call_later(1.0, replies.publish, {"data": json.dumps(reply)})

        bus.subscribe(CellTopics.of(MODEL).request("robot"), lambda received: answer(str(received.message.data)))
        return await run_or_lose(node, tester, case), stage.complaints

    execution, complaints = run_virtually(scene)
    kinds = [record.kind for record in execution.trace.records]
    first = kinds.index("injection")
    assert kinds[first + 1] == "reply_received"
    assert [(each.variable, each.value) for each in execution.excluded] == [("weight", 7)]
    assert_counts_by_force_from(execution, first)
    assert len(complaints) == 1


def test_what_was_measured_before_a_run_is_judged_alike() -> None:
    lawful = [(0.5, '{"lamp": "lit"}'), (1.0, '{"horn": "loud"}'), (1.5, '{"level": 8, "zone": "far"}')]
    (first, second), complaints = over_nodes(lawful, rounds=2)
    assert (first.excluded, second.excluded, complaints) == ((), (), [])
    before = [record.changes for record in second.trace.records[:8] if record.kind in ("measurement", "injection")]
    assert before == [(("lamp", "lit"),), (("horn", "loud"),), (("level", 8), ("zone", "far"))]
    (_, second), complaints = over_nodes([*lawful, (1.6, '{"level": 3}'), (1.7, '{"level": 99}')], rounds=2)
    assert [each.variable for each in second.excluded] == ["level"]
    assert_counts_by_force_from(second, [record.kind for record in second.trace.records].index("injection"))


def test_a_campaign_counts_values_by_their_variable() -> None:
    (once, twice), _ = over_nodes([(0.5, '{"level": 3}'), (1.5, '{"door": "locked"}'), (3.0, '{"level": 0}')], rounds=2)
    counted: dict[str, ExcludedVariable] = {}
    for execution in (once, twice):
        counted = with_excluded(counted, execution)
    first = {each.variable: each for each in reversed(once.excluded)}
    assert counted["level"] == ExcludedVariable("level", 3, 2, "works", first["level"])
    assert counted["door"].count == 2
    assert list(counted) == ["level", "door"]
