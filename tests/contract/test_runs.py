"""The same cases give the same runs: in simulation, over `loopback` in virtual and in wall time, and over DDS.

What differs has a name: messages and plans take time, so times are later in wall time; and a record of what the network
did to a message stands where the tester's note of it comes, behind the records of its step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial

import pytest

from scbm.cases import Case
from scbm.cases.trace import Trace, write_trace
from scbm.files import read_case, read_network
from scbm.model import BehaviorModel
from scbm.nodes import Bus
from scbm.nodes.buses.loopback import LoopbackHub
from scbm.running import Program
from scbm.testing import Execution, RandomCases, Tester
from scbm.testing.event_logs.event_log import read_event_log, replay, write_event_log
from support.loops import run
from support.nodes import Stage, notes, run_cases, without_notes, without_times
from support.profiles import share
from support.runs import AFTER, BEFORE, ROOT
from support.virtual_loop import VirtualLoop, run_virtually

WRITTEN = sorted((ROOT / "examples/robot_in_the_air/cases").glob("*.yaml"))
FAULTS = "latency: 5 ms, jitter: 20 ms, loss: 5 %, duplication: 10 %, reordering: 20 %"
SCALES = (Fraction(20), Fraction(5), Fraction(1))
"""Between a reply of the model's slowest kind and its deadline there are 8.5 s, at the scale 20 425 ms of the wall.

A machine that is too busy for that runs the cases that came too late again, more slowly.
"""

HELD = """\
case: held
goal: item_a_scanned
initial: {robot_at: toolbox_scanner}
outcomes:
  robot_mount_scanner: [fail, {outcome: succeed, after: 500 ms}]
  gantry: [{request: [50 ms, 300 ms]}, {reply: lost}]
  scanner: [{outcome: fail, reply: [10 ms, 400 ms]}, {cancel: lost, outcome: timeout}]
injections:
  - name: someone_else_scans
    when: current.name == scanner_scan_item_a
    set: {scanner_req_state: executing}
    hold: 2 s
  - {name: slow, at: 1 s, resource: gantry, becomes: {slower: 1.5}, hold: 3 s}
  - {name: busy, when: current.name == gantry_move_to_box_a, resource: gantry, becomes: occupied, hold: 1 s}
network:
  partitions: [{at: 200 ms, for: 400 ms, resource: gripper}]
  restarts: [{resource: gripper, at: 300 ms, for: 500 ms}, {resource: robot, at: 400 ms, for: 300 ms}]
"""


def written(model: BehaviorModel = AFTER) -> list[Case]:
    return [read_case(path.read_text(encoding="utf-8"), model) for path in WRITTEN]


def over_loopback(model: BehaviorModel, cases: Sequence[Case], time_scale: Fraction) -> list[Execution]:
    async def scene() -> list[Execution]:
        return await run_cases(Stage(model, LoopbackHub().join), cases, time_scale)

    return run(scene())


def over_dds(model: BehaviorModel, cases: Sequence[Case], time_scale: Fraction, domain: int) -> list[Execution]:
    async def scene() -> list[Execution]:
        from scbm.nodes.buses.dds import open_dds  # noqa: PLC0415 - cyclonedds may be missing

        complaints: list[str] = []

        def join(name: str) -> Bus:
            return open_dds(f"scbm_{name}", domain, complaints.append)

        executions = await run_cases(Stage(model, join), cases, time_scale)
        assert complaints == []
        return executions

    return run(scene())


def in_virtual_time(model: BehaviorModel, cases: Sequence[Case], time_scale: Fraction = Fraction(1)) -> list[Execution]:
    async def scene(loop: VirtualLoop) -> list[Execution]:
        return await run_cases(Stage.virtual(model, loop), cases, time_scale)

    return run_virtually(scene)


def assert_same(real: Execution, simulated: Execution) -> None:
    """All but times, and the places of notes."""
    assert without_times(without_notes(real.trace.records)) == without_times(without_notes(simulated.trace.records))
    assert (real.verdict, real.visited) == (simulated.verdict, simulated.visited)
    assert [(r.resource, r.outcome, r.latency_ns, r.measured) for r in real.reactions] == [
        (r.resource, r.outcome, r.latency_ns, r.measured) for r in simulated.reactions
    ]
    noted = sorted(map(repr, without_times(notes(real.trace.records))))
    assert noted == sorted(map(repr, without_times(notes(simulated.trace.records))))


def assert_same_in_wall_time(
    model: BehaviorModel, cases: Sequence[Case], run_all: Callable[[Sequence[Case], Fraction], list[Execution]]
) -> None:
    """Run cases over nodes, and those that came too late again at the next scale."""
    left = list(cases)
    for scale in SCALES:
        executions, cases, left = run_all(left, scale), left, []
        for case, real in zip(cases, executions, strict=True):
            try:
                assert_same(real, Tester(model).execute(case))
            except AssertionError:
                if scale == SCALES[-1]:
                    raise
                left.append(case)
            assert_replays(real, model)
        if not left:
            return


def assert_replays(execution: Execution, model: BehaviorModel) -> None:
    """The log gives the trace, byte for byte, also when it comes out of a file."""
    log = execution.log
    assert log is not None
    kept = read_event_log(write_event_log(log, model), model, log.digest)
    for known in (log, kept):
        trace = Trace(model.name, execution.case.name, replay(known, Program(model)))
        assert write_trace(trace) == write_trace(execution.trace)


def drawn(model: BehaviorModel, network: str | None, count: int, seed: int) -> list[Case]:
    """Random cases; each with a network drawn for it, if none is given."""
    drawing = RandomCases(model, None, None if network is None else read_network(network, model))
    return list(drawing.first(count, seed))


PERFECT = "latency: 0 s"


@pytest.mark.parametrize("model", [BEFORE, AFTER], ids=["before", "after"])
def test_in_virtual_time_runs_over_nodes_are_those_of_simulations_byte_for_byte(model: BehaviorModel) -> None:
    cases = drawn(model, PERFECT, share(30), seed=1)
    for case, real in zip(cases, in_virtual_time(model, cases), strict=True):
        simulated = Tester(model).execute(case)
        assert write_trace(real.trace) == write_trace(simulated.trace)
        assert real.reactions == simulated.reactions
        assert (real.verdict, real.ended_ns, real.visited) == (
            simulated.verdict,
            simulated.ended_ns,
            simulated.visited,
        )
        assert_replays(real, model)


@pytest.mark.slow
@pytest.mark.parametrize("network", [FAULTS, None], ids=["faults", "drawn"])
@pytest.mark.parametrize("model", [BEFORE, AFTER], ids=["before", "after"])
def test_so_they_are_with_faults_of_the_network_but_for_the_places_of_notes(
    model: BehaviorModel, network: str | None
) -> None:
    cases = drawn(model, network, share(30), seed=2)
    for case, real in zip(cases, in_virtual_time(model, cases), strict=True):
        simulated = Tester(model).execute(case)
        assert without_notes(real.trace.records) == without_notes(simulated.trace.records)
        assert sorted(map(repr, notes(real.trace.records))) == sorted(map(repr, notes(simulated.trace.records)))
        assert (real.reactions, real.verdict) == (simulated.reactions, simulated.verdict)
        assert_replays(real, model)


@pytest.mark.slow
def test_so_are_cases_that_say_what_happens() -> None:
    cases = [*written(), read_case(HELD, AFTER)]
    for case, real in zip(cases, in_virtual_time(AFTER, cases), strict=True):
        simulated = Tester(AFTER).execute(case)
        assert without_notes(real.trace.records) == without_notes(simulated.trace.records)
        assert (real.reactions, real.verdict) == (simulated.reactions, simulated.verdict)


@pytest.mark.parametrize("scale", [Fraction(1, 2), Fraction(7, 3), Fraction(50), Fraction(10_000)], ids=str)
def test_whatever_the_scale_of_time(scale: Fraction) -> None:
    cases = [*drawn(AFTER, FAULTS, 3, seed=3), read_case(HELD, AFTER)]
    for case, real in zip(cases, in_virtual_time(AFTER, cases, scale), strict=True):
        assert_same(real, Tester(AFTER).execute(case))


@pytest.mark.slow
@pytest.mark.parametrize("model", [BEFORE, AFTER], ids=["before", "after"])
def test_in_wall_time_runs_are_the_same_but_for_times(model: BehaviorModel) -> None:
    cases = drawn(model, PERFECT, 4, seed=1)
    assert_same_in_wall_time(model, cases, partial(over_loopback, model))


@pytest.mark.slow
def test_in_wall_time_so_are_cases_that_say_what_happens() -> None:
    cases = [*written()[:1], *written()[3:], read_case(HELD, AFTER)]
    assert_same_in_wall_time(AFTER, cases, partial(over_loopback, AFTER))


@pytest.mark.dds
def test_over_dds_runs_are_the_same_but_for_times(domain: int) -> None:
    cases = [*drawn(AFTER, PERFECT, 2, seed=1), *written()[-2:], read_case(HELD, AFTER)]
    assert_same_in_wall_time(AFTER, cases, partial(over_dds, AFTER, domain=domain))
