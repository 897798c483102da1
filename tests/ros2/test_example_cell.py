"""The example with an action, a service, topics and a nested measured topic at once: its trace is a simulated one."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import pytest

from scbm.cases.trace import MeasurementReceived, Record
from scbm.files import digest_of, load_bindings, load_model, read_case
from scbm.running import Program
from scbm.testing import Tester
from scbm.testing.event_logs.event_log import open_event_log, replay
from support.fibonacci import INTERFACES
from support.node_processes import PATIENCE, NodeProcess, verdicts
from support.nodes import without_times
from support.peers import peer
from support.rclpy_installations import Rclpy
from support.ros2_peers import ros2_peer_program as ros2_peer_program  # noqa: PLC0414 - a fixture, for pytest to find

pytestmark = [pytest.mark.peer, pytest.mark.slow]

EXAMPLE = Path(__file__).parents[2] / "examples" / "robot_in_the_air" / "after.yaml"
REAL = ("gantry", "scanner", "gripper", "battery")
BINDINGS = f"""
bindings_of: robot_in_the_air
interfaces: [{INTERFACES}]
resources:
  gantry:
    action:
      name: /gantry/move
      type: test_msgs/action/Fibonacci
      goal: {{order: {{variable: gantry_command, values: {{none: 0, move_to_box_a: 1, move_to_agv: 2}}}}}}
  scanner:
    services: {{scanner_command: {{scan_item_a: {{name: /scanner/scan_item_a, type: std_srvs/srv/Trigger}}}}}}
  gripper:
    topics: {{request: /gripper/request, reply: /gripper/reply}}
  battery:
    measured:
      charged:
        topic: /battery
        type: sensor_msgs/msg/BatteryState
        field: "cell_voltage[1]"
        ranges: {{true: 3.2.., false: ..3.2}}
"""
AT_RUST = f"""
bindings_of: robot_in_the_air
interfaces: [{INTERFACES}]
resources:
  gantry:
    action:
      name: /gantry
      type: control_msgs/action/FollowJointTrajectory
      goal:
        trajectory.joint_names: [{{text: x}}]
        "trajectory.points[0].positions":
          - {{variable: gantry_command, values: {{none: 0, move_to_box_a: 1, move_to_agv: 2}}}}
        "trajectory.points[0].time_from_start.sec": 5
      succeeded: {{error_code: SUCCESSFUL}}
  scanner:
    services: {{scanner_command: {{scan_item_a: {{name: /scanner/scan_item_a, type: std_srvs/srv/Trigger}}}}}}
  gripper:
    topics: {{request: /scanner/request, reply: /scanner/reply}}
  battery:
    measured:
      charged:
        topic: /points
        type: trajectory_msgs/msg/JointTrajectoryPoint
        field: time_from_start.sec
        ranges: {{true: 3.., false: ..3}}
"""
CASE = "case: delivers\ngoal: scanned_a == true && gripper_act == closed && charged == true\noutcomes: {@}\n"


def model_text() -> str:
    """The example, with a battery that measures whether it is charged."""
    text = EXAMPLE.read_text(encoding="utf-8")
    text = text.replace("variables:\n", "variables:\n  charged: {domain: bool, initial: true}\n", 1)
    return text.replace("resources:\n", "resources:\n  battery: {publishes: [charged]}\n", 1)


def changes(records: Sequence[Record]) -> list[Record]:
    """The records without times and without measurements that change nothing: a simulation makes none."""
    return without_times([r for r in records if not isinstance(r, MeasurementReceived) or r.changes])


def assert_as_simulated(start: Callable[..., NodeProcess], bindings: str, directory: Path, via: str) -> None:
    """Run a case with real drivers, and in simulation."""
    texts = {"model": model_text(), "bindings": bindings, "case": CASE.replace("@", "robot: succeed")}
    for name, text in texts.items():
        (directory / f"{name}.yaml").write_text(text, encoding="utf-8")
    words = [word for name in REAL for word in ("--real", name)]
    options = ("--transport", "dds", "--via", via, "--bindings", "bindings.yaml", "--logs", "logs", "--json")
    node = start("test", "model.yaml", "case.yaml", *options, *words, *PATIENCE)
    try:
        ended = node.ends()
    finally:
        node.end()
    assert verdicts(ended) == {"delivers": ("reached", True, "")}, ended.err
    model = load_bindings(directory / "bindings.yaml", load_model(directory / "model.yaml"))
    log = open_event_log(directory / "logs" / "delivers.log").read(model, digest_of(model))
    outcomes = ", ".join(f"{name}: succeed" for name in ("robot", "gantry", "scanner", "gripper"))
    simulated = Tester(model).execute(read_case(CASE.replace("@", outcomes), model))
    assert changes(replay(log, Program(model))) == changes(simulated.trace.records)


def test_the_example_behaves_through_rclpy_as_in_simulation(jazzy: Rclpy, domain: int, tmp_path: Path) -> None:
    with jazzy.program("cell_driver", domain) as driver:
        assert_as_simulated(partial(jazzy.scbm, domain, tmp_path), BINDINGS, tmp_path, "rclpy")
        assert {line.split()[0] for line in driver.output_lines} == {"up", "moves", "scans", "grips"}


def test_the_example_behaves_over_dds_as_in_simulation(domain: int, ros2_peer_program: Path, tmp_path: Path) -> None:
    def start(*words: object) -> NodeProcess:
        command = [sys.executable, "-m", "scbm", *map(str, words), "--domain", str(domain)]
        return NodeProcess(command, tmp_path)

    with peer(ros2_peer_program, domain, "gantry") as gantry, peer(ros2_peer_program, domain, "driver") as driver:
        gantry.says("ready")
        driver.says("ready")
        assert_as_simulated(start, AT_RUST, tmp_path, "dds")
        gantry.says("goal 1", "fields x")
        driver.says("responded")
