"""Nodes as processes in time of trouble: killed, stopped and started again at any moment."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from scbm.cases.trace import Record, ReplyReceived, RequestCancelled, RequestSent, ResourceChanged
from scbm.files import digest_of, load_model
from scbm.nodes.buses.dds.dds_classes import message_class
from scbm.nodes.buses.dds.raw_samples import delete
from scbm.nodes.types.definitions import BOOL, MessageDefinition
from scbm.running import Program
from scbm.testing.event_logs.event_log import open_event_log, replay
from support.domains import LOOPBACK
from support.loops import GUARD_S
from support.node_processes import MODEL, PATIENCE, Ended, ProcessCell, process_cell, process_of, verdicts, wait_for_end
from support.overhearing import Overheard, overhearing
from support.wording import Wording

pytestmark = pytest.mark.dds

SLOW = "outcomes: {arm: [{outcome: succeed, after: 9 s}]}"
"""The first time the arm answers a second before its deadline: at the usual scale, 4, after 2.25 s. Then at once."""

LEASE, LONG_LEASE = (
    LOOPBACK.replace("</Discovery>", f"<LeaseDuration>{lease}</LeaseDuration></Discovery>") for lease in ("2s", "10min")
)
"""For `CYCLONEDDS_URI`: a killed node counts as lost, but none that a busy machine delays; and a node that does not say
good-bye is not missed in a test.
"""

ROOT = Path(__file__).parents[2]

STOPS = (signal.SIGINT, signal.SIGTERM)


@pytest.fixture
def cell(domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ProcessCell]:
    monkeypatch.setenv("CYCLONEDDS_URI", LEASE)
    with process_cell(domain, tmp_path) as made:
        yield made


@pytest.fixture
def heard(cell: ProcessCell) -> Iterator[Overheard]:
    with overhearing(cell.domain, load_model(cell.model)) as listening:
        yield listening


def records_of(cell: ProcessCell, case: str) -> tuple[Record, ...]:
    """The records of a run that was logged, made again of its events."""
    model = load_model(cell.model)
    log = open_event_log(cell.log(case)).read(model, digest_of(model))
    return replay(log, Program(model))


def replies(records: tuple[Record, ...]) -> list[tuple[int, str]]:
    return [(record.request, record.resource) for record in records if isinstance(record, ReplyReceived)]


def changes(records: tuple[Record, ...]) -> list[tuple[str, str]]:
    return [(record.resource, record.condition) for record in records if isinstance(record, ResourceChanged)]


def waited_ns(records: tuple[Record, ...], request: int) -> int:
    """How long a request was wanted that was cancelled."""
    sent = next(record for record in records if isinstance(record, RequestSent) and record.request == request)
    ended = next(record for record in records if isinstance(record, RequestCancelled) and record.request == request)
    return ended.at_ns - sent.at_ns


def complaints(ended: Ended) -> list[str]:
    """Return the lines of stderr without those that depend on the speed of a machine.

    These are lines about progress, and about replies that came when their run had ended.
    """
    by_speed = re.compile(r"scbm: (waiting for|\d+ of \d+: )|.*\bwas dropped\b")
    return [line for line in ended.err.splitlines() if not by_speed.match(line)]


def errors(cell: ProcessCell, ended: Ended) -> list[str]:
    """Return what a command complained of, with the processes and the domain of a test replaced by names."""
    lines = (line.replace(f"domain {cell.domain}", "domain N") for line in complaints(ended))
    return [re.sub(rf"process \d+ on {re.escape(os.uname().nodename)}", "process PID on HOST", line) for line in lines]


LOST = ("lost", False)
REACHED = ("reached", True, "")
"""The verdict on a case, whether it passed, and why it failed."""


# a resource


def test_what_a_killed_resource_was_asked_times_out_and_what_it_is_asked_when_it_is_back_is_answered(
    cell: ProcessCell,
) -> None:
    controller, arm, _lamp = cell.controller(), cell.resources("arm"), cell.resources("lamp")
    tester = cell.tester(cell.case("one", SLOW))
    arm.says("arm gets run_.*-1")
    arm.kill()
    controller.says("arm is not reached")
    arm = cell.resources("arm")
    answered = int(arm.says("arm answers run_.*-(.*): succeeded")[1])
    assert verdicts(tester.ends()) == {"one": REACHED}
    records = records_of(cell, "one")
    assert waited_ns(records, 1) == 10_000_000_000  # the deadline of the model
    assert replies(records) == [(answered, "arm"), (answered + 1, "lamp")]
    assert changes(records) == [("arm", "down"), ("arm", "well")]


def test_a_resource_that_is_started_again_at_once_is_asked_as_well(cell: ProcessCell) -> None:
    cell.controller()
    arm, _lamp = cell.resources("arm"), cell.resources("lamp")
    tester = cell.tester(cell.case("one", SLOW))
    arm.says("arm gets run_.*-1")
    arm.kill()
    arm = cell.resources("arm")
    answered = int(arm.says("arm answers run_.*-(.*): succeeded")[1])
    assert answered > 1
    assert verdicts(tester.ends()) == {"one": REACHED}
    assert replies(records_of(cell, "one")) == [(answered, "arm"), (answered + 1, "lamp")]


def test_a_goal_that_is_not_reached_as_a_resource_was_killed_is_no_failure_even_if_nobody_missed_it(
    cell: ProcessCell, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LONG_LEASE)
    cell.controller()
    arm, _lamp = cell.resources("arm"), cell.resources("lamp")
    tester = cell.tester(cell.case("one", f"{SLOW}\nlimits: {{plans: 3}}"))
    arm.says("arm gets run_.*-1")
    arm.kill()
    assert verdicts(tester.ends()) == {"one": ("replan_limit", True, "")}
    records = records_of(cell, "one")
    assert changes(records) == []
    assert waited_ns(records, 1) == 10_000_000_000


def test_a_resource_that_was_stopped_for_a_while_goes_on(cell: ProcessCell) -> None:
    controller, arm, _lamp = cell.controller(), cell.resources("arm"), cell.resources("lamp")
    tester = cell.tester(cell.case("one", SLOW), cell.case("two"))
    arm.says("arm gets run_.*-1")
    arm.send(signal.SIGSTOP)
    controller.says("arm is not reached")
    arm.send(signal.SIGCONT)
    assert verdicts(tester.ends()) == {"one": REACHED, "two": REACHED}
    came_and_went = changes(records_of(cell, "one"))  # it joins again, once or twice
    assert came_and_went[0] == ("arm", "down")
    assert came_and_went[-1] == ("arm", "well")


# the controller


def test_a_case_that_loses_the_controller_is_lost_and_the_next_runs_with_the_new_one(
    cell: ProcessCell, wording: Wording
) -> None:
    controller, arm = cell.controller(), cell.resources()
    tester = cell.tester(cell.case("one", "outcomes: {arm: timeout}"), cell.case("two"))
    run = arm.says("arm gets (run_.*)-1")[1]
    controller.kill()
    controller = cell.controller()
    ended = tester.ends()
    assert ended.code == 1
    ends = verdicts(ended)
    assert (ends["one"][:2], ends["two"]) == (LOST, REACHED)
    wording(ends["one"][2])
    assert complaints(ended) == []
    header = json.loads(cell.log("one").read_text(encoding="utf-8").splitlines()[0])
    assert (header["end"], header["reactions"]) == ("lost", 1)
    (line,) = [line for line in arm.output_lines if run in line]
    assert line.endswith(f" {run}-1")
    assert re.match(r"two\b.*\breached\b", controller.output_lines[-1])


def test_a_reply_to_a_controller_that_is_gone_is_not_taken_by_its_successor(
    cell: ProcessCell, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LONG_LEASE)  # so the arm does not miss who asked, and answers
    controller, arm = cell.controller(), cell.resources()
    cell.tester(cell.case("one", SLOW))
    arm.says("arm gets run_.*-1")
    controller.kill()
    controller = cell.controller()
    controller.says("lamp is reached")
    arm.says("arm answers run_.*-1: succeeded")
    controller.send(signal.SIGTERM)
    ended = controller.ends()
    # If the reader of the successor is found in time, the successor gets the reply and reports that it drops it.
    assert (ended.code, complaints(ended)) == (0, [])
    wording(sorted(ended.out.splitlines()[1:]))


def test_a_controller_that_is_stopped_for_a_while_loses_its_case_and_the_cell_goes_on(
    cell: ProcessCell, heard: Overheard, wording: Wording
) -> None:
    controller, arm = cell.controller(), cell.resources()
    tester = cell.tester(cell.case("one", SLOW), cell.case("two"))
    arm.says("arm gets run_.*-1")
    controller.send(signal.SIGSTOP)
    heard.kind("abandon")
    controller.send(signal.SIGCONT)
    ends = verdicts(tester.ends())
    assert (ends["one"][:2], ends["two"]) == (LOST, REACHED)
    wording(ends["one"][2])


# the tester


def test_a_controller_that_loses_the_tester_cancels_what_is_in_flight_and_serves_the_next(
    cell: ProcessCell, heard: Overheard
) -> None:
    controller, arm = cell.controller(), cell.resources()
    tester = cell.tester(cell.case("one", "outcomes: {arm: timeout}"), scale=1)
    run = arm.says("arm gets (run_.*)-1")[1]
    tester.kill()
    controller.says("the tester is gone, and its run is given up")
    assert heard.cancel() == f"{run}-1"
    assert verdicts(cell.tester(cell.case("two")).ends()) == {"two": REACHED}
    (line,) = [line for line in arm.output_lines if run in line]
    assert line.endswith(f" {run}-1")


def test_a_tester_that_is_started_again_at_once_does_not_wait_long_for_the_run_of_its_predecessor(
    cell: ProcessCell,
) -> None:
    _controller, arm = cell.controller(), cell.resources()
    tester = cell.tester(cell.case("one", SLOW), scale=1)
    arm.says("arm gets run_.*-1")
    tester.kill()
    assert verdicts(cell.tester(cell.case("two")).ends()) == {"two": REACHED}


def test_a_tester_that_was_stopped_for_a_while_calls_its_case_lost_and_goes_on(cell: ProcessCell) -> None:
    controller, arm = cell.controller(), cell.resources()
    tester = cell.tester(cell.case("one", SLOW), cell.case("two"))
    arm.says("arm gets run_.*-1")
    tester.send(signal.SIGSTOP)
    controller.says("the tester is gone, and its run is given up")
    tester.send(signal.SIGCONT)
    ended = verdicts(tester.ends())
    assert (ended["one"][:2], ended["two"]) == (LOST, REACHED)


# leaving


@pytest.mark.parametrize("stop", STOPS)
def test_a_controller_that_is_ended_cancels_what_is_in_flight_and_its_case_is_lost_at_once(
    cell: ProcessCell, monkeypatch: pytest.MonkeyPatch, stop: signal.Signals, wording: Wording
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LONG_LEASE)
    controller, arm = cell.controller(), cell.resources()
    with overhearing(cell.domain, load_model(cell.model)) as heard:
        tester = cell.tester(cell.case("one", SLOW), cell.case("two"), cell.case("three"))
        request = arm.says("arm gets (run_.*-1)")[1]
        controller.send(stop)
        assert heard.cancel() == request
    ended = controller.ends()
    assert (ended.code, complaints(ended)) == (0, [])
    cell.controller()
    ends = verdicts(tester.ends())
    assert (ends["one"][:2], ends["two"], ends["three"]) == (LOST, REACHED, REACHED)
    wording(ends["one"][2])


@pytest.mark.parametrize("stop", STOPS)
def test_resources_that_are_ended_are_missed_at_once(
    cell: ProcessCell, monkeypatch: pytest.MonkeyPatch, stop: signal.Signals
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LONG_LEASE)
    controller, arm, _lamp = cell.controller(), cell.resources("arm"), cell.resources("lamp")
    controller.says("arm is reached")
    arm.send(stop)
    controller.says("arm is not reached")
    ended = arm.ends()
    assert (ended.code, complaints(ended)) == (0, [])


@pytest.mark.parametrize("stop", STOPS)
def test_a_tester_that_is_ended_has_its_run_given_up_at_once(
    cell: ProcessCell, monkeypatch: pytest.MonkeyPatch, stop: signal.Signals
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LONG_LEASE)
    controller, arm = cell.controller(), cell.resources()
    with overhearing(cell.domain, load_model(cell.model)) as heard:
        tester = cell.tester(cell.case("one", "outcomes: {arm: timeout}"), scale=1)
        request = arm.says("arm gets (run_.*-1)")[1]
        tester.send(stop)
        assert heard.cancel() == request
    ended = tester.ends()
    (complaint,) = complaints(ended)
    assert (ended.code, ended.out, "interrupted" in complaint) == (130, "", True)
    controller.says("one: given up after .*")
    assert verdicts(cell.tester(cell.case("two")).ends()) == {"two": REACHED}


@pytest.mark.parametrize("stop", STOPS)
def test_a_tester_that_is_ended_reports_the_cases_that_were_done(
    cell: ProcessCell, stop: signal.Signals, wording: Wording
) -> None:
    _controller, arm = cell.controller(), cell.resources()
    store = cell.directory / "cov.db"
    tester = cell.tester(cell.case("one"), cell.case("two", "outcomes: {arm: timeout}"), "--store", store, scale=1)
    arm.says("arm answers run_.*")
    arm.says("arm gets run_.*-1")
    tester.send(stop)
    ended = tester.ends()
    assert (ended.code, verdicts(ended)) == (130, {"one": REACHED})
    wording((json.loads(ended.out)["ended_early"], " ".join(" ".join(complaints(ended)).split())))


@pytest.fixture
def background() -> Iterator[None]:
    """What is started meanwhile ignores SIGINT, as what a script starts with `&` does."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("background")
def test_a_tester_in_the_background_of_a_script_is_ended_by_sigterm(cell: ProcessCell, wording: Wording) -> None:
    _controller, arm = cell.controller(), cell.resources()
    tester = cell.tester(cell.case("one"), cell.case("two", "outcomes: {arm: timeout}"), scale=1)
    arm.says("arm answers run_.*")
    arm.says("arm gets run_.*-1")
    tester.send(signal.SIGTERM)
    ended = tester.ends()
    assert (ended.code, verdicts(ended)) == (130, {"one": REACHED})
    wording(complaints(ended))


# who has no place


def test_a_second_controller_ends_and_the_first_goes_on(
    cell: ProcessCell, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LONG_LEASE)
    first, arm = cell.controller(), cell.resources()
    tester = cell.tester(cell.case("one", SLOW), scale=2)
    arm.says("arm gets run_.*-1")
    ended = cell.start("node", "controller", cell.model).ends()
    assert ended.code == 2
    assert complaints(ended)[0].startswith("DDS: error[bus-unusable]: ")
    assert f"process {first.process.pid} " in ended.err
    wording(errors(cell, ended))
    assert verdicts(tester.ends()) == {"one": REACHED}
    assert first.process.poll() is None


def test_a_second_node_of_a_resource_ends_and_the_first_goes_on(
    cell: ProcessCell, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LONG_LEASE)
    cell.controller()
    first, _lamp = cell.resources("arm"), cell.resources("lamp")
    tester = cell.tester(cell.case("one", SLOW), scale=2)
    first.says("arm gets run_.*-1")
    second = cell.start("node", "resources", cell.model, "arm").ends()
    assert second.code == 2
    assert f"process {first.process.pid} " in second.err
    wording(errors(cell, second))
    assert "answers" not in second.out
    assert verdicts(tester.ends()) == {"one": REACHED}
    assert changes(records_of(cell, "one")) == []


def test_a_second_tester_ends_and_the_first_goes_on(
    cell: ProcessCell, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LONG_LEASE)
    controller, arm, _lamp = cell.controller(), cell.resources("arm"), cell.resources("lamp")
    first = cell.tester(cell.case("one", "outcomes: {arm: [{outcome: timeout}]}\nlimits: {plans: 1000000}"))
    arm.says("arm gets run_.*-1")
    arm.send(signal.SIGTERM)  # the run goes on until the arm is back
    controller.says("arm is not reached")
    second = cell.tester(cell.case("two")).ends()
    assert (second.code, second.out) == (2, "")
    assert f"process {first.process.pid} " in second.err
    wording(errors(cell, second))
    cell.resources("arm")
    assert verdicts(first.ends()) == {"one": REACHED}


def test_whoever_tests_with_nodes_of_its_own_does_not_take_those_of_others(cell: ProcessCell) -> None:
    others = cell.controller(), cell.resources()
    ended = cell.start("test", cell.model, "--cases", 1, "--transport", "dds", *PATIENCE, "--time-scale", 4).ends()
    assert (ended.code, ended.out) == (2, "")
    assert any(f"process {other.process.pid} on " in ended.err for other in others)  # it hears of one of them first
    assert [other.process.poll() for other in others] == [None, None]


# who is missing


def test_a_controller_of_another_version_of_the_model_is_reported(cell: ProcessCell, wording: Wording) -> None:
    other = cell.directory / "other.yaml"
    other.write_text(MODEL.replace("deadline: 10 s", "deadline: 9 s"), encoding="utf-8")
    controller = cell.controller(other)
    cell.resources()
    ended = cell.tester(cell.case("one")).ends()
    assert (ended.code, ended.out) == (2, "")
    assert f"process {controller.process.pid} " in ended.err
    wording(errors(cell, ended))


def test_without_a_controller_there_is_an_error(cell: ProcessCell, wording: Wording) -> None:
    cell.resources()
    ended = cell.tester(cell.case("one"), "--wait", "6 s").ends()
    assert (ended.code, ended.out) == (2, "")
    wording(errors(cell, ended))


def test_resources_that_nobody_simulates_are_reported(cell: ProcessCell, wording: Wording) -> None:
    cell.controller()
    cell.resources("arm")
    ended = cell.tester(cell.case("one"), "--wait", "6 s").ends()
    assert (ended.code, ended.out) == (2, "")
    wording(errors(cell, ended))


@contextmanager
def hearing(domain: int, name: str, type_: MessageDefinition) -> Iterator[None]:
    """A driver that hears a topic, of a type that may be wrong."""
    peer = DomainParticipant(domain)
    class_ = message_class(type_)
    reader = DataReader(peer, Topic(peer, name, class_), Qos(Policy.Reliability.Reliable(duration(seconds=1))))
    yield
    for entity in (reader, peer):
        delete(entity)


def test_a_driver_of_another_type_is_reported_however_long_nodes_may_take_to_come(
    cell: ProcessCell, wording: Wording
) -> None:
    bindings = cell.directory / "bindings.yaml"
    bindings.write_text("bindings_of: trouble\nresources: {arm: {topics: {request: /arm/ask, reply: /arm/tell}}}\n")
    with hearing(cell.domain, "rt/arm/ask", BOOL):
        cell.start("node", "controller", cell.model, "--bindings", bindings, "--real", "arm").says("controller of .*")
        cell.resources("lamp")
        ended = cell.tester(cell.case("one"), "--wait", "1 h", scale=1).ends()
    assert (ended.code, ended.out) == (2, "")
    wording(errors(cell, ended))


# a tester that has nodes of its own


def test_a_tester_that_is_killed_leaves_none_of_its_nodes_behind(cell: ProcessCell, heard: Overheard) -> None:
    case = cell.case("one", "outcomes: {arm: timeout}")
    tester = cell.start("test", cell.model, case, "--transport", "dds", *PATIENCE)
    nodes = [process_of(heard.status(role)) for role in ("controller", "resources")]
    tester.kill()
    for node in nodes:
        wait_for_end(node)


def test_a_controller_of_a_testers_own_that_is_killed_is_started_again_and_its_case_is_lost(
    cell: ProcessCell, heard: Overheard, wording: Wording
) -> None:
    cases = [cell.case("one", SLOW), cell.case("two"), cell.case("three")]
    tester = cell.start("test", cell.model, *cases, "--transport", "dds", *PATIENCE, "--time-scale", 4, "--json")
    controller = process_of(heard.status("controller"))
    heard.kind("react")  # before the first request the case would begin again
    os.kill(controller, signal.SIGKILL)
    ended = tester.ends()
    ends = verdicts(ended)
    assert (ends["one"][:2], ends["two"], ends["three"]) == (LOST, REACHED, REACHED)
    wording((ends["one"][2], *complaints(ended)))


def test_resources_of_a_testers_own_that_are_killed_are_started_again_and_the_case_goes_on(
    cell: ProcessCell, heard: Overheard, wording: Wording
) -> None:
    tester = cell.start(
        "test", cell.model, cell.case("one", SLOW), "--transport", "dds", *PATIENCE, "--time-scale", 4, "--json"
    )
    resources = process_of(heard.status("resources"))
    heard.kind("go")
    os.kill(resources, signal.SIGKILL)
    ended = tester.ends()
    assert verdicts(ended) == {"one": REACHED}
    wording(complaints(ended)[0])


# at any moment


def test_ten_kills_at_random_moments_do_no_harm(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LEASE)
    kills = ROOT / "benchmarks" / "kills.py"
    command = [sys.executable, str(kills), "--kills", "10", "--seed", "99", "--domain", str(domain)]
    ran = subprocess.run(command, capture_output=True, text=True, timeout=2 * GUARD_S, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
    for node in ("controller", "robot, gantry", "scanner, gripper", "tester"):
        assert f" {node}\n" in ran.stdout
