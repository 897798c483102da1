"""Goals of our link through rclpy, next to a server of `rclpy.action`: each outcome, and no two goals at once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from msgspec import Struct

from support.node_processes import NodeProcess
from support.rclpy_installations import Rclpy

pytestmark = pytest.mark.peer


class Kind(Struct, frozen=True):
    """A type of action of `test_msgs`.

    Attributes:
        name: its name there.
        bindings: those of a resource to its server.
        fields: what the server prints of the goal 3.
    """

    name: str
    bindings: str
    fields: str


FIBONACCI = Kind(
    "Fibonacci",
    """
bindings_of: gantry_cell
resources:
  gantry:
    action:
      name: /fibonacci
      type: test_msgs/action/Fibonacci
      goal: {order: order}
      succeeded: {"sequence[0]": 0}
      measured: {zone: {field: "sequence[1]", ranges: {near: ..3, far: 3..}}}
      feedback: {zone: {field: "sequence[0]", ranges: {near: ..3, far: 3..}}}
""",
    "",
)
ELEVENFOLD = ", ".join(f"{number}: {11 * number}" for number in range(101))
NESTED = Kind(
    "NestedMessage",
    f"""
bindings_of: gantry_cell
resources:
  gantry:
    action:
      name: /nested
      type: test_msgs/action/NestedMessage
      goal:
        nested_field.int32_value: order
        nested_field_no_pkg.duration_value.sec: 7
        nested_different_pkg.nanosec: {{variable: order, values: {{{ELEVENFOLD}}}}}
      succeeded: {{nested_different_pkg.sec: 0}}
      measured: {{zone: {{field: nested_field_no_pkg.time_value.sec, ranges: {{near: ..5, far: 5..}}}}}}
      feedback: {{zone: {{field: nested_field.float64_value, ranges: {{near: ..5, far: 5..}}}}}}
""",
    " 7 33",
)


@contextmanager
def both(rclpy: Rclpy, domain: int, kind: Kind, directory: Path) -> Iterator[tuple[NodeProcess, NodeProcess]]:
    """A server and a link that reaches it; no two goals were active at once."""
    bindings = directory / "bindings.yaml"
    bindings.write_text(rclpy.with_interfaces(kind.bindings), encoding="utf-8")
    with (
        rclpy.program("goal_server", domain, kind.name) as server,
        rclpy.program("goal_sender", domain, bindings) as link,
    ):
        link.says("there")
        yield server, link
        assert not [line for line in server.output_lines if line.startswith("overlap")]


@pytest.mark.parametrize("kind", [FIBONACCI, pytest.param(NESTED, marks=pytest.mark.slow)], ids=["small", "nested"])
def test_each_goal_ends_as_its_server_decides_before_the_next_one_begins(  # noqa: PLR0915 - one scene
    jazzy: Rclpy, domain: int, tmp_path: Path, kind: Kind
) -> None:
    """One scene, as starting the processes and meeting takes longest: each part begins with no goal active."""
    with both(jazzy, domain, kind, tmp_path) as (server, link):
        link.write_line("send 1 3")  # succeeds
        server.says(f"fields{kind.fields}")
        link.says("feedback near")
        link.says("reply 1 True near")
        link.write_line("send 2 100")  # is rejected
        link.says("goal 2 rejected")
        link.says("reply 2 False")
        link.write_line("send 3 10")  # is aborted
        server.says("aborted 10")
        link.says("goal 3 aborted")
        link.says("reply 3 False")

        link.write_line("send 4 20")  # is cancelled
        link.says("feedback .*")
        link.write_line("cancel 4")
        link.write_line("send 5 2")
        server.says("cancel 20")
        server.says("canceled 20")
        server.says("goal 2")
        link.says("goal 4 cancelled")
        link.says("reply 5 True near")

        link.write_line("send 6 60")  # is cancelled before it is accepted
        server.says("goal 60")
        link.write_line("cancel 6")
        link.write_line("send 7 2")
        server.write_line("accept")
        server.says("cancel 60")
        server.says("canceled 60")
        server.says("goal 2")
        link.says("reply 7 True near")

        link.write_line("send 8 80")  # its cancellation is refused
        link.says("feedback .*")
        link.write_line("cancel 8")
        link.write_line("send 9 2")
        server.says("cancel 80")
        link.says("goal 8 cancel_refused")
        link.says("warning .*refused.*")
        server.says("succeeded 80")
        server.says("goal 2")
        link.says("reply 9 True near")

        link.write_line("send 10 90")  # succeeds in spite of its cancellation: the result is late
        link.says("feedback .*")
        link.write_line("cancel 10")
        link.write_line("send 11 2")
        server.says("cancel 90")
        server.says("succeeded 90")
        server.says("goal 2")
        link.says("goal 10 succeeded")
        link.says("reply 11 True near")

        link.write_line("send 12 21")  # is cancelled as the run ends
        link.says("feedback .*")
        link.write_line("end")
        server.says("cancel 21")
        server.says("canceled 21")
        replies = [line.split()[1] for line in link.output_lines if line.startswith("reply")]
        assert replies == ["1", "2", "3", "5", "7", "9", "11"]
        goals = [line for line in server.output_lines if line.startswith("goal")]
        assert goals == [f"goal {order}" for order in (3, 100, 10, 20, 2, 60, 2, 80, 2, 90, 2, 21)]


@pytest.mark.slow
@pytest.mark.parametrize("kind", [FIBONACCI, NESTED], ids=["small", "nested"])
def test_a_killed_server_gives_no_reply_and_the_next_one_gets_the_next_goal(
    jazzy: Rclpy, domain: int, tmp_path: Path, kind: Kind
) -> None:
    with both(jazzy, domain, kind, tmp_path) as (server, link):
        link.write_line("send 1 20")
        link.says("feedback .*")
        server.kill()
        link.says("gone")
        with jazzy.program("goal_server", domain, kind.name) as other:
            link.says("there")
            link.write_line("send 2 2")
            other.says("goal 2")
            link.says("reply 2 True near")
        assert not [line for line in link.output_lines if line.startswith("reply 1")]
