"""Runs over DDS in which a driver publishes at random moments visit nothing that is proved uncoverable."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scbm.closing import Closer, Decision
from scbm.files import load_model
from scbm.proofcheck import check_certificate
from support.node_processes import PATIENCE, process_cell
from support.profiles import share

pytestmark = pytest.mark.dds

RUNS = 200

MODEL = """
behavior_model: press_cell
variables:
  estop: {domain: [healthy, pressed], initial: healthy}
  curtain: {domain: [clear, broken], initial: clear}
  arm_at: {domain: [home, press], initial: home}
  part: {domain: [raw, pressed], initial: raw}
resources:
  safety: {publishes: [estop, curtain]}
  arm: {simulation: {latency: {uniform: [5 ms, 60 ms]}, outcomes: {succeed: 0.9, fail: 0.05, timeout: 0.05}}}
  press: {simulation: {latency: {uniform: [5 ms, 60 ms]}, outcomes: {succeed: 0.9, fail: 0.05, timeout: 0.05}}}
operations:
  move_to_press:
    deadline: 100 ms
    pre:
      g: arm_req_state == initial && arm_req_trigger == false && arm_at == home && part == raw
      gr: curtain == clear
      a: [arm_req_trigger <- true]
    post:
      g: true
      gr: arm_req_state == succeeded
      a: [arm_req_state <- initial, arm_req_trigger <- false, arm_at <- press]
    timedout: [arm_req_trigger <- false]
  press_part:
    deadline: 100 ms
    pre:
      g: press_req_state == initial && press_req_trigger == false && arm_at == press && part == raw
      a: [press_req_trigger <- true]
    post:
      g: true
      gr: press_req_state == succeeded
      a: [press_req_state <- initial, press_req_trigger <- false, part <- pressed]
    timedout: [press_req_trigger <- false]
  move_home:
    deadline: 100 ms
    pre:
      g: arm_req_state == initial && arm_req_trigger == false && arm_at == press && part == pressed
      gr: curtain == clear
      a: [arm_req_trigger <- true]
    post:
      g: true
      gr: arm_req_state == succeeded
      a: [arm_req_state <- initial, arm_req_trigger <- false, arm_at <- home]
    timedout: [arm_req_trigger <- false]
automatic_transitions:
  emergency_stop: {g: 'estop == pressed && plan.state in {planning, executing}', a: [plan.state <- aborted]}
  arm_failed:
    g: arm_req_state == failed && current.state == executing
    a: [current.state <- failed, arm_req_state <- initial, arm_req_trigger <- false]
  press_failed:
    g: press_req_state == failed && current.state == executing
    a: [current.state <- failed, press_req_state <- initial, press_req_trigger <- false]
  press_without_arm: {g: press_part.state == executing && arm_at == home, a: [plan.state <- aborted]}
  moved_after_stop: {g: estop == pressed && plan.state == executing, a: [arm_at <- home]}
goals: {done: part == pressed && arm_at == home}
may_end: [aborted, time_limit, unsolvable]
"""
"""Its proofs are about any moment at which a button is pressed, or a person reaches in."""

BINDINGS = """
bindings_of: press_cell
resources:
  safety:
    measured:
      estop: {topic: /safety/estop, type: std_msgs/msg/String}
      curtain: {topic: /safety/curtain, type: std_msgs/msg/String}
"""

DRIVER = """
import random, sys, time
from dataclasses import dataclass
from threading import Event
from cyclonedds.core import Listener, Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from cyclonedds.util import duration

@dataclass
class String(IdlStruct, typename="std_msgs::msg::dds_::String_"):
    data: str

reliable = Policy.Reliability.Reliable(duration(seconds=2))
qos = Qos(reliable, Policy.History.KeepAll, Policy.DataRepresentation(use_cdrv0_representation=True))
participant = DomainParticipant(int(sys.argv[1]))

def writer_of(name):
    matched, listener = Event(), Listener()
    listener.set_on_publication_matched(lambda writer, status: matched.set())
    topic = Topic(participant, f"rt/safety/{name}", String)
    return DataWriter(participant, topic, qos, listener=listener), matched

(estop, estop_matched), (curtain, curtain_matched) = map(writer_of, ("estop", "curtain"))
print("the driver publishes", flush=True)
estop_matched.wait()
curtain_matched.wait()
print("the driver is heard", flush=True)
draw = random.Random(1)
while True:
    for writer, calm, other, rate in ((curtain, "clear", "broken", 0.4), (estop, "healthy", "pressed", 0.1)):
        time.sleep(draw.uniform(0.0, 0.08))
        if draw.random() < rate:
            writer.write(String(other))
            time.sleep(draw.uniform(0.0, 0.05))
        writer.write(String(calm))
"""
"""A driver of nothing but cyclonedds: whatever it publishes, and whenever, the proofs have to be true."""


def test_what_a_driver_publishes_visits_nothing_that_is_proved_uncoverable(domain: int, tmp_path: Path) -> None:
    runs = share(RUNS, least=20)
    for name, text in (("model.yaml", MODEL), ("bindings.yaml", BINDINGS), ("driver.py", DRIVER)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    closing = Closer(load_model(tmp_path / "model.yaml")).close()
    assert [flaw for _, each in closing.certificates for flaw in check_certificate(each, closing.model)] == []
    proved = {str(d.obligation) for d in closing.decided if d.decision is Decision.UNCOVERABLE}
    assert {"automatic/press_without_arm", "automatic/moved_after_stop", "press_part/disabled"} <= proved

    with process_cell(domain, tmp_path) as cell:
        cell.model.write_text(MODEL, encoding="utf-8")
        driver = cell.program(tmp_path / "driver.py")
        driver.says("the driver publishes")
        controller = cell.start("node", "controller", cell.model, "--bindings", "bindings.yaml", "--real", "safety")
        controller.says("controller of .*")
        driver.says("the driver is heard")
        cell.resources("arm", "press")
        tester = cell.start(
            "node", "tester", cell.model, "--cases", runs, "--seed", 1, "--json", "--logs", "logs", *PATIENCE
        )
        ended = tester.ends(guard_s=1800.0)

    cases = json.loads(ended.out)["cases"]
    assert len(cases) == runs, ended.err
    visited = {name for case in cases for name in case["visited"]}
    assert visited & proved == set()
    assert "move_to_press/executing" in visited
    logs = (log.read_text(encoding="utf-8") for log in (tmp_path / "logs").iterdir())
    assert any('"broken"' in text for text in logs), "the controller received nothing from the driver"
    lost = [case["failures"] for case in cases if case["verdict"] == "lost"]
    assert lost == []
