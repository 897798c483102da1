"""Messages of a real rclpy with nested types, read through paths: over plain DDS and through rclpy."""

from __future__ import annotations

from pathlib import Path

import pytest

from support.rclpy_installations import Rclpy

pytestmark = pytest.mark.peer

MODEL = """
behavior_model: sensors
variables:
  shoulder: {domain: [low, high, unknown], initial: unknown}
  elbow: {domain: [low, high, unknown], initial: unknown}
  power: {domain: [full, charging, unknown], initial: unknown}
  charge: {domain: [low, high, unknown], initial: unknown}
  cell: {domain: [low, high, unknown], initial: unknown}
  level: {domain: [ok, warn, unknown], initial: unknown}
  temperature: {domain: [hot, cold, unknown], initial: unknown}
resources:
  sensors: {publishes: [shoulder, elbow, power, charge, cell, level, temperature]}
  arm: {simulation: {latency: 1 s}}
operations:
  wave: {request: arm, guard: temperature == hot}
goals: {done: temperature == cold}
"""
FIELDS = {
    "shoulder": ("/joint_states", "sensor_msgs/msg/JointState", "position[0]", "ranges: {low: ..1, high: 1..}"),
    "elbow": ("/joint_states", "sensor_msgs/msg/JointState", "position[name=elbow]", "ranges: {low: ..1, high: 1..}"),
    "power": ("/battery", "sensor_msgs/msg/BatteryState", "power_supply_status",
              "values: {POWER_SUPPLY_STATUS_FULL: full, POWER_SUPPLY_STATUS_CHARGING: charging}"),
    "charge": ("/battery", "sensor_msgs/msg/BatteryState", "percentage", "ranges: {low: ..0.75, high: 0.75..}"),
    "cell": ("/battery", "sensor_msgs/msg/BatteryState", "cell_voltage[1]", "ranges: {low: ..3.6, high: 3.6..}"),
    "level": ("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "status[1].level", "values: {WARN: warn, OK: ok}"),
    "temperature": ("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "status[1].values[0].value",
                    "values: {hot: hot, cold: cold}"),
}  # fmt: skip
"""The topic of each variable, its type, the field, and what that means."""


def binding(name: str) -> str:
    topic, kind, path, meaning = FIELDS[name]
    quality = ", best_effort: true" if topic == "/battery" else ""
    return f'      {name}: {{topic: {topic}, type: {kind}{quality}, field: "{path}", {meaning}}}\n'


BINDINGS = f"bindings_of: sensors\nresources:\n  sensors:\n    measured:\n{''.join(map(binding, FIELDS))}"
SENT = {
    "shoulder low", "elbow high", "power full", "charge high", "cell low", "level warn", "temperature hot",
}  # fmt: skip


@pytest.mark.parametrize("via", ["dds", "rclpy"])
def test_fields_of_nested_messages_are_measured(jazzy: Rclpy, domain: int, tmp_path: Path, via: str) -> None:
    model, bindings = tmp_path / "model.yaml", tmp_path / "bindings.yaml"
    model.write_text(MODEL, encoding="utf-8")
    bindings.write_text(BINDINGS, encoding="utf-8")
    with (
        jazzy.program("sensor_driver", domain),
        jazzy.program("measured_values", domain, via, model, bindings) as node,
    ):
        ended = node.ends()
        assert ended.code == 0, ended.err
        assert {*ended.out.splitlines()[1:]} == SENT
