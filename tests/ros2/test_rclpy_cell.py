"""The example with an action, a service, topics and a nested measured topic at once: its trace is a simulated one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from scbm.cases.trace import MeasurementReceived, Record
from scbm.files import digest_of, load_bindings, load_model, read_case
from scbm.running import Program
from scbm.testing import Tester
from scbm.testing.event_logs.event_log import open_event_log, replay
from support.fibonacci import INTERFACES
from support.node_processes import PATIENCE, verdicts
from support.nodes import without_times
from support.rclpy_installations import Rclpy

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
CASE = "case: delivers\ngoal: scanned_a == true && gripper_act == closed && charged == true\noutcomes: {@}\n"


def model_text() -> str:
    """The example, with a battery that measures whether it is charged."""
    text = EXAMPLE.read_text(encoding="utf-8")
    text = text.replace("variables:\n", "variables:\n  charged: {domain: bool, initial: true}\n", 1)
    return text.replace("resources:\n", "resources:\n  battery: {publishes: [charged]}\n", 1)


def changes(records: Sequence[Record]) -> list[Record]:
    """The records without times and without measurements that change nothing: a simulation makes none."""
    return without_times([r for r in records if not isinstance(r, MeasurementReceived) or r.changes])


def test_the_example_behaves_as_in_simulation(jazzy: Rclpy, domain: int, tmp_path: Path) -> None:
    texts = {"model": model_text(), "bindings": BINDINGS, "case": CASE.replace("@", "robot: succeed")}
    for name, text in texts.items():
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    words = [word for name in REAL for word in ("--real", name)]
    options = ("--transport", "dds", "--via", "rclpy", "--bindings", "bindings.yaml", "--logs", "logs", "--json")
    with jazzy.program("cell_driver", domain) as driver:
        node = jazzy.scbm(domain, tmp_path, "test", "model.yaml", "case.yaml", *options, *words, *PATIENCE)
        try:
            ended = node.ends()
        finally:
            node.end()
        assert verdicts(ended) == {"delivers": ("reached", True, "")}, ended.err
        assert {line.split()[0] for line in driver.output_lines} == {"up", "moves", "scans", "grips"}
    model = load_bindings(tmp_path / "bindings.yaml", load_model(tmp_path / "model.yaml"))
    log = open_event_log(tmp_path / "logs" / "delivers.log").read(model, digest_of(model))
    outcomes = ", ".join(f"{name}: succeed" for name in ("robot", "gantry", "scanner", "gripper"))
    simulated = Tester(model).execute(read_case(CASE.replace("@", outcomes), model))
    assert changes(replay(log, Program(model))) == changes(simulated.trace.records)
