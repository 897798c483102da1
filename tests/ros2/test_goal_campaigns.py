"""Campaigns with goals to servers of `rclpy.action`: counts in the report, busy servers, and what is left of a run."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from support.fibonacci import BINDINGS, CELL
from support.node_processes import PATIENCE, NodeProcess, verdicts
from support.rclpy_installations import Rclpy
from support.wording import Wording

pytestmark = pytest.mark.peer

LONG = CELL.replace("deadline: 2 s", "deadline: 10 min")


@contextmanager
def campaign(rclpy: Rclpy, domain: int, directory: Path, model: str, wish: int, *options: str) -> Iterator[NodeProcess]:
    """Test one case whose first goal has this order."""
    texts = {"model": model, "bindings": BINDINGS, "case": f"case: lifts\ngoal: done\ninitial: {{wish: {wish}}}\n"}
    for name, text in texts.items():
        (directory / f"{name}.yaml").write_text(text, encoding="utf-8")
    words = ("--transport", "dds", "--via", "rclpy", "--real", "gantry", "--bindings", "bindings.yaml", *options)
    node = rclpy.scbm(domain, directory, "test", "model.yaml", "case.yaml", *words)
    try:
        yield node
    finally:
        node.end()


def goals_of(report: str) -> dict[str, int]:
    """Return the counts of goals in a report, without zeros."""
    (counted,) = json.loads(report)["real_resources"]
    return {fate: count for fate, count in counted["goals"].items() if count}


def test_a_goal_that_is_given_up_is_cancelled_and_counted(jazzy: Rclpy, domain: int, tmp_path: Path) -> None:
    with (
        jazzy.program("goal_server", domain, "Fibonacci") as server,
        campaign(jazzy, domain, tmp_path, CELL, 20, "--json", *PATIENCE) as node,
    ):
        ended = node.ends()
        assert verdicts(ended) == {"lifts": ("reached", True, "")}, ended.err
        lines = server.output_lines
        assert lines.index("canceled 20") < lines.index("goal 2")
        counts = goals_of(ended.out)
        assert (counts["accepted"], counts["cancelled"] >= 1) == (lines.count("goal 20") + lines.count("goal 2"), True)
        assert not [line for line in lines if line.startswith("overlap")]


def test_a_server_with_a_goal_of_another_program_is_waited_for_and_named(
    jazzy: Rclpy, domain: int, tmp_path: Path, wording: Wording
) -> None:
    with (
        jazzy.program("goal_server", domain, "Fibonacci") as server,
        jazzy.program("other_client", domain, 20) as other,
    ):
        (which,) = [line.removeprefix("up ") for line in other.output_lines]
        dashed = "-".join((which[:8], which[8:12], which[12:16], which[16:20], which[20:]))
        with campaign(jazzy, domain, tmp_path, LONG, 3, "--wait", "10 s") as node:
            ended = node.ends()
        assert ended.code == 2, ended.err
        last = [line for line in ended.err.splitlines() if not line.startswith("scbm: ")]
        wording("\n".join(last).replace(dashed, "GOAL").replace(f"domain {domain}", "domain N"))
        assert [line for line in server.output_lines if line.startswith(("goal", "cancel"))] == ["goal 20"]
        other.write_line("cancel")
        other.says("over")
        with campaign(jazzy, domain, tmp_path, LONG, 3, "--json", *PATIENCE) as node:
            ended = node.ends()
        assert goals_of(ended.out) == {"accepted": 1, "succeeded": 1}


@pytest.mark.parametrize("order", [20, 60], ids=["active", "not accepted yet"])
def test_a_command_that_is_ended_cancels_its_goal(jazzy: Rclpy, domain: int, tmp_path: Path, order: int) -> None:
    with (
        jazzy.program("goal_server", domain, "Fibonacci") as server,
        campaign(jazzy, domain, tmp_path, LONG, order, *PATIENCE) as node,
    ):
        server.says(f"goal {order}")
        node.send(signal.SIGTERM)
        if order == 60:
            server.write_line("accept")
        server.says(f"canceled {order}")
        assert node.ends().code == 130
