"""Drivers in a real rclpy, by plain DDS and by `--via rclpy`: which are reached, and which refused before a request."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from support.node_processes import PATIENCE, Ended, NodeProcess, verdicts
from support.rclpy_installations import Rclpy
from support.wording import Wording

pytestmark = pytest.mark.peer

MODEL = """
behavior_model: scan_cell
variables:
  scanned: {domain: bool, initial: false}
  near: {domain: bool, initial: true} # a run can begin before the first measurement
  sees: {domain: bool, initial: false}
resources:
  scanner: {publishes: [near, sees], simulation: {latency: 1 s}}
operations:
  scan: {request: scanner, deadline: 60 s, guard: scanned == false && near == true, effects: [scanned <- true]}
goals: {done: scanned == true}
"""

MEASURED = """
    measured:
      near: {topic: /scanner/distance, type: std_msgs/msg/Float64, ranges: {true: ..0.5, false: 0.5..}}
      sees: {topic: /scanner/sees, type: std_msgs/msg/Bool}
"""
SERVICE = "service: {name: /scanner/scan_item_a, type: std_srvs/srv/Trigger}"
TOPICS = "topics: {request: /scanner/request, reply: /scanner/reply}"


@contextmanager
def campaign(
    rclpy: Rclpy, domain: int, directory: Path, requests: str, *options: str
) -> Iterator[tuple[NodeProcess, Ended]]:
    """Test one case with a driver of rclpy."""
    model, bindings = directory / "model.yaml", directory / "bindings.yaml"
    model.write_text(MODEL, encoding="utf-8")
    bindings.write_text(f"bindings_of: scan_cell\nresources:\n  scanner:\n    {requests}{MEASURED}", encoding="utf-8")
    words = ("--cases", 1, "--transport", "dds", "--real", "scanner", "--bindings", bindings, *options)
    with rclpy.program("scanner_driver", domain) as driver:
        node = rclpy.scbm(domain, directory, "test", model, *words)
        try:
            yield driver, node.ends()
        finally:
            node.end()


@pytest.mark.parametrize(
    ("requests", "via"),
    [(TOPICS, "dds"), (TOPICS, "rclpy"), (SERVICE, "rclpy")],
    ids=["topics over dds", "topics through rclpy", "a service through rclpy"],
)
def test_a_driver_is_reached(jazzy: Rclpy, domain: int, tmp_path: Path, requests: str, via: str) -> None:
    with campaign(jazzy, domain, tmp_path, requests, "--via", via, "--json", *PATIENCE) as (driver, ended):
        assert ended.code == 0, ended.out + ended.err
        assert verdicts(ended) == {"seed-0-case-1": ("reached", True, "")}
        driver.says("took .*|called")


def test_a_service_of_another_vendor_is_refused_before_the_first_request(
    jazzy: Rclpy, domain: int, tmp_path: Path, wording: Wording
) -> None:
    with campaign(jazzy, domain, tmp_path, SERVICE, *PATIENCE) as (driver, ended):
        assert ended.code == 2
        wording("\n".join(ended.err.splitlines()[-2:]).replace(f"domain {domain}", "domain N"))
        assert driver.output_lines == ("up rmw_fastrtps_cpp",)


@pytest.mark.slow
def test_a_node_of_the_next_release_leaves_the_terminal_alone(kilted: Rclpy, domain: int, tmp_path: Path) -> None:
    with campaign(kilted, domain, tmp_path, TOPICS, "--json", *PATIENCE) as (driver, ended):
        assert ended.code == 0, ended.err
        assert json.loads(ended.out)["passed"] is True
        assert "ddsi_xt" not in ended.err
        driver.says("took .*")
