"""The changes of a case over nodes: as in a simulation where they are possible at their times, else they wait."""

from __future__ import annotations

import pytest

from scbm.cases import Case
from scbm.cases.trace import End, MeasurementReceived, Trace, write_trace
from scbm.files import read_case, read_model
from scbm.running import Program
from scbm.testing import Execution, Tester
from scbm.testing.event_logs.event_log import read_event_log, replay, rerun, write_event_log
from support.loops import GUARD_S
from support.nodes import Stage, run_or_lose
from support.virtual_loop import VirtualLoop, run_virtually
from support.wording import Wording

MODEL = read_model("""
behavior_model: gate
variables:
  fetched: {domain: bool, initial: false}
  packed: {domain: bool, initial: false}
  door: {domain: [closed, open, locked], initial: closed}
  part: {domain: [away, there], initial: there}
  lamp: {domain: [dark, lit], initial: dark, source: input}
  level: {domain: 0..3, initial: 1}
  alarm: {domain: bool, initial: false, source: state}
resources:
  robot: {simulation: {latency: 2 s}}
  sensor: {publishes: {level: [1, 2]}}
operations:
  fetch: {request: robot, deadline: 5 s, guard: [fetched == false, part == there], effects: [fetched <- true]}
  pack:
    request: robot
    deadline: 5 s
    guard: [fetched == true, packed == false]
    pre: {gr: door == open}
    effects: [packed <- true]
automatic_transitions:
  warn: {g: lamp == lit && alarm == false, a: [alarm <- true]}
environment:
  opens: {guard: [door == closed, fetched == true], actions: [door <- open]}
  closes: {guard: door == open, actions: [door <- closed]}
  locks: {guard: door == closed, actions: [door <- locked]}
  takes: {guard: part == there, actions: [part <- away]}
  brings: {guard: part == away, actions: [part <- there]}
goals:
  fetched: fetched == true
  packed: packed == true
""")


def case_of(environment: str, more: str = "goal: packed") -> Case:
    return read_case(f"case: gate\n{more}\nenvironment: {environment}\n", MODEL)


def over_nodes(case: Case) -> Execution:
    """The run of a case in a cell in virtual time; of a lost one what a report gets."""

    async def scene(loop: VirtualLoop) -> Execution:
        stage, tester = Stage.virtual(MODEL, loop), Tester(MODEL)
        stage.controller()
        stage.resources()
        node = stage.tester()
        await node.wait_for_cell(GUARD_S)
        execution = await run_or_lose(node, tester, case)
        assert stage.complaints == []
        return execution

    return run_virtually(scene)


def assert_replays(execution: Execution) -> None:
    """Also when the log comes out of a file."""
    assert execution.log is not None
    log = read_event_log(write_event_log(execution.log, MODEL), MODEL, execution.log.digest)
    assert write_trace(Trace(MODEL.name, "gate", replay(log, Program(MODEL)))) == write_trace(execution.trace)


def changes(execution: Execution) -> list[tuple[float, str]]:
    """When something came from outside, and what."""
    return [
        (record.at_ns / 10**9, ", ".join(f"{n} = {v}" for n, v in record.measured) + f" {record.by}".rstrip())
        for record in execution.trace.records
        if isinstance(record, MeasurementReceived)
    ]


@pytest.mark.parametrize(
    ("environment", "more"),
    [
        ("[{at: 3 s, by: opens}]", "goal: packed"),
        ("[{at: 3 s, set: {door: open}}]", "goal: packed"),
        ("[{at: 3 s, set: {door: open}, by: opens}, {at: 4 s, by: closes}]", "goal: packed"),
        ("[{at: 2 s, by: opens}, {at: 2 s, by: closes}, {at: 2 s, by: opens}]", "goal: packed"),
        ("[{at: 500 ms, by: takes}, {at: 1 s, by: brings}, {at: 3 s, by: opens}]", "goal: packed"),
        ("[{when: pack.state == disabled, by: opens}]", "goal: packed"),
        ("[{when: pack.state == disabled, after: 1.5 s, by: opens}, {when: door == open, by: closes}]", "goal: packed"),
        ("[{at: 1 s, set: {lamp: lit, level: 2}}, {at: 3 s, by: opens}]", "goal: packed"),
        ("[{at: 1 s, set: {level: 2}}, {at: 100 s, set: {lamp: lit}}]", "goal: fetched"),
        ("[{at: 1 s, by: takes}]", "goal: fetched\noutcomes: {robot: [fail]}"),
        ("[{at: 1 s, by: takes}, {at: 1.5 s, by: brings}]", "goal: fetched\noutcomes: {robot: [fail]}"),
        ("[{at: 7 s, by: opens}]", "goals: [{goal: fetched}, {goal: packed, when: door == open}]"),
        ("[{at: 4 s, set: {}}]", "goals: [{goal: fetched}, {goal: packed, when: door == open}]"),
        ("[{at: 0 s, set: {lamp: lit}}]", "goals: [{goal: fetched, when: lamp == lit}]"),
        ("[{at: 3 s, set: {lamp: lit}}]", "goals: [{goal: fetched, when: lamp == lit}, {goal: fetched}]"),
        ("[{at: 100 ms, by: takes}, {at: 200 ms, by: brings}, {at: 3 s, by: opens}]", "goal: packed\nplanning: 300 ms"),
        ("[]", "goal: fetched\nplanning: 1700 ms\noutcomes: {robot: [{outcome: succeed, after: 6 s}, succeed]}"),
        ("[]", "goals: [{goal: packed}, {goal: fetched}]\nlimits: {time: 3 s}"),
        ("[{at: 2500 ms, set: {lamp: lit, door: open, part: away}}]", "goal: packed"),
        ("[{when: true, set: {lamp: lit}}]", "goal: fetched\ninjections: [{set: {level: 3}}]"),
        ("[{when: true, set: {lamp: lit}}, {when: lamp == lit, after: 9 s, by: takes}]", "goal: fetched"),
    ],
)  # fmt: skip
def test_changes_that_are_possible_at_their_times_come_then(environment: str, more: str) -> None:
    case = case_of(environment, more)
    real, simulated = over_nodes(case), Tester(MODEL).execute(case)
    assert simulated.verdict.end is not End.IMPOSSIBLE
    assert write_trace(real.trace) == write_trace(simulated.trace)
    assert (real.verdict, real.visited) == (simulated.verdict, simulated.visited)
    assert real.forced_by == simulated.forced_by
    assert_replays(real)


def test_a_change_waits_until_its_maker_can_act() -> None:
    execution = over_nodes(case_of("[{at: 1 s, by: opens}, {at: 1.5 s, set: {level: 2}}, {at: 3 s, by: closes}]"))
    assert changes(execution) == [(2.0, "door = open opens"), (2.0, "level = 2"), (3.0, "door = closed closes")]
    assert (execution.verdict.end, execution.verdict.passed, execution.forced_by) == (End.REACHED, True, None)
    assert_replays(execution)


def test_each_part_of_an_entry_waits_for_its_own_moment() -> None:
    entry = "[{at: 1 s, set: {lamp: lit, door: open, level: 2}}]"
    execution = over_nodes(case_of(entry))
    assert changes(execution) == [(1.0, "lamp = lit"), (2.0, "door = open opens"), (2.0, "level = 2")]
    kinds = [record.kind for record in execution.trace.records]
    first = kinds.index("measurement")
    assert kinds[first + 1] == "automatic"
    assert_replays(execution)


def test_a_time_after_a_change_begins_when_the_change_has_come() -> None:
    entries = "[{at: 1 s, by: opens}, {when: true, after: 500 ms, by: closes}]"
    assert changes(over_nodes(case_of(entries))) == [(2.0, "door = open opens"), (2.5, "door = closed closes")]


NEVER = "[{at: 1 s, by: closes}, {at: 1.5 s, set: {lamp: lit}}, {when: lamp == lit, by: opens}]"


@pytest.mark.parametrize(
    ("environment", "more", "ended_s"),
    [
        (NEVER, "goal: fetched", 2),
        ("[{at: 1 s, set: {door: closed}, by: closes}]", "goal: fetched", 2),
        ("[{at: 1 s, set: {lamp: lit, door: open, level: 2}}]", "goal: fetched\nlimits: {time: 1.5 s}", 1.5),
        ("[{at: 1 s, by: takes}, {at: 2500 ms, by: takes}]", "goal: fetched\noutcomes: {robot: [fail]}", 2.5),
        ("[{at: 4 s, by: closes}]", "goals: [{goal: fetched}, {goal: packed, when: door == open}]", 4),
        ("[{when: fetched == true, by: brings}]", "goals: [{goal: fetched}, {goal: packed, when: door == open}]", 2),
    ],
)  # fmt: skip
def test_a_case_that_ends_while_a_change_waits_is_lost(
    environment: str, more: str, ended_s: float, wording: Wording
) -> None:
    execution = over_nodes(case_of(environment, more))
    assert (execution.verdict.end, execution.ended_ns / 10**9) == (End.LOST, ended_s)
    assert_replays(execution)
    wording(execution.verdict.failures[0].message)
    assert execution.log is not None
    run = rerun(execution.log, Program(MODEL))
    assert run.impossible is not None
    assert (run.end, run.impossible.never_came in execution.verdict.failures[0].message) == (End.LOST, True)


@pytest.mark.parametrize(
    ("environment", "end"),
    [
        ("[{when: door == open, by: closes}]", End.TIME_LIMIT),
        ("[{at: 3601 s, by: closes}]", End.TIME_LIMIT),
        ("[{at: 3 s, by: opens}, {at: 10 s, by: brings}]", End.REACHED),
        ("[{at: 3 s, by: opens}, {when: packed == true, after: 1 s, by: brings}]", End.REACHED),
    ],
)
def test_a_change_whose_time_has_not_come_when_the_case_ends_is_no_loss(environment: str, end: End) -> None:
    case = case_of(environment)
    execution = over_nodes(case)
    assert (execution.verdict.end, execution.digest) == (end, Tester(MODEL).execute(case).digest)
    assert_replays(execution)
