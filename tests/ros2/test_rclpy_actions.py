"""Goals of our link through rclpy, next to a server of `rclpy.action`: each outcome, and no two goals at once."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from support.node_processes import NodeProcess
from support.rclpy_installations import Rclpy

pytestmark = pytest.mark.peer


@contextmanager
def both(rclpy: Rclpy, domain: int) -> Iterator[tuple[NodeProcess, NodeProcess]]:
    """A server and a link that reaches it; no two goals were active at once."""
    with rclpy.program("fibonacci_server", domain) as server, rclpy.program("goal_sender", domain) as link:
        link.says("there")
        yield server, link
        assert not [line for line in server.output_lines if line.startswith("overlap")]


def test_goals_end_as_their_server_decides(jazzy: Rclpy, domain: int) -> None:
    with both(jazzy, domain) as (server, link):
        link.write_line("send 1 3")
        link.says("feedback near")
        link.says("reply 1 True near")
        link.write_line("send 2 100")
        link.says("reply 2 False")
        link.write_line("send 3 10")
        server.says("aborted 10")
        link.says("reply 3 False")
        link.write_line("send 4 2")
        link.says("reply 4 True near")
        assert [line for line in server.output_lines if line.startswith("goal")] == [
            "goal 3",
            "goal 100",
            "goal 10",
            "goal 2",
        ]


def test_a_cancelled_goal_is_cancelled_at_its_server_before_the_next_one(jazzy: Rclpy, domain: int) -> None:
    with both(jazzy, domain) as (server, link):
        link.write_line("send 1 20")
        link.says("feedback .*")
        link.write_line("cancel 1")
        link.write_line("send 2 2")
        server.says("cancel 20")
        server.says("canceled 20")
        server.says("goal 2")
        link.says("reply 2 True near")


def test_a_goal_that_is_cancelled_before_its_acceptance_is_cancelled_as_soon_as_it_is_accepted(
    jazzy: Rclpy, domain: int
) -> None:
    with both(jazzy, domain) as (server, link):
        link.write_line("send 1 60")
        server.says("goal 60")
        link.write_line("cancel 1")
        link.write_line("send 2 2")
        server.write_line("accept")
        server.says("cancel 60")
        server.says("canceled 60")
        server.says("goal 2")
        link.says("reply 2 True near")


@pytest.mark.parametrize(("order", "warning"), [(80, "warning .*refused.*"), (90, None)])
def test_the_next_goal_waits_for_one_whose_cancellation_is_refused_or_ignored(
    jazzy: Rclpy, domain: int, order: int, warning: str | None
) -> None:
    with both(jazzy, domain) as (server, link):
        link.write_line(f"send 1 {order}")
        link.says("feedback .*")
        link.write_line("cancel 1")
        link.write_line("send 2 2")
        server.says(f"cancel {order}")
        if warning is not None:
            link.says(warning)
        server.says(f"succeeded {order}")
        server.says("goal 2")
        link.says("reply 2 True near")


def test_a_killed_server_gives_no_reply_and_the_next_one_gets_the_next_goal(jazzy: Rclpy, domain: int) -> None:
    with jazzy.program("fibonacci_server", domain) as server, jazzy.program("goal_sender", domain) as link:
        link.says("there")
        link.write_line("send 1 20")
        link.says("feedback .*")
        server.kill()
        link.says("gone")
        with jazzy.program("fibonacci_server", domain) as other:
            link.says("there")
            link.write_line("send 2 2")
            other.says("goal 2")
            link.says("reply 2 True near")
        assert not [line for line in link.output_lines if line.startswith("reply 1")]


def test_a_run_that_ends_cancels_its_goal(jazzy: Rclpy, domain: int) -> None:
    with both(jazzy, domain) as (server, link):
        link.write_line("send 1 20")
        link.says("feedback .*")
        link.write_line("end")
        server.says("cancel 20")
        server.says("canceled 20")
