"""Goals over plain DDS, next to action servers of ros2-client on RustDDS, with types that `.action` files define."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from pathlib import Path
from time import monotonic_ns
from typing import Any

import pytest
from msgspec import Struct

from scbm.files import read_bindings, read_model
from scbm.model import Resource
from scbm.nodes.buses.bus import Bus, Topic
from scbm.nodes.links.action_link import ActionLink
from scbm.nodes.links.link import Correlation, LinkContext
from scbm.testing.real_drivers import GoalFate
from support.bus_callbacks import BusCallbacks, over_bus
from support.fibonacci import CELL, INTERFACES
from support.hearing import Heard
from support.loops import LINE_GUARD_S
from support.peers import Peer, peer
from support.ros2_peers import ros2_peer_program as ros2_peer_program  # noqa: PLC0414 - a fixture, for pytest to find

pytestmark = [pytest.mark.peer, pytest.mark.slow]

VALUES = ", ".join(f"{number}: {number}.0" for number in range(101))


class Kind(Struct, frozen=True):
    """A type of action at the peer, and a resource that is bound to it.

    Attributes:
        argument: the argument of the peer.
        action: the name of the action.
        request: the other keys of the binding, in YAML.
        fields: what the peer prints of each goal.
    """

    argument: str
    action: str
    request: str
    fields: str

    def resource(self) -> Resource:
        """The bound resource."""
        head = f"bindings_of: gantry_cell\ninterfaces: [{INTERFACES}]\nresources:\n  gantry:\n    action:\n"
        text = f"{head}      name: {self.action}{self.request}"
        (resource,) = read_bindings(text, read_model(CELL)).resources
        return resource


TRAJECTORIES = Kind(
    "gantry",
    "/gantry",
    f"""
      type: control_msgs/action/FollowJointTrajectory
      goal:
        trajectory.joint_names: [{{text: x}}, {{text: y}}]
        "trajectory.points[0].positions": [{{variable: order, values: {{{VALUES}}}}}]
        goal_time_tolerance.sec: 2
      succeeded: {{error_code: SUCCESSFUL}}
      feedback: {{zone: {{field: "actual.positions[0]", ranges: {{near: ..5, far: 5..}}}}}}
""",
    "x y",
)
NAVIGATION = Kind(
    "navigator",
    "/navigate_to_pose",
    f"""
      type: nav2_msgs/action/NavigateToPose
      goal:
        pose.header.frame_id: {{text: map}}
        pose.pose.position.x: {{variable: order, values: {{{VALUES}}}}}
        pose.pose.position.y: -0.5
        pose.pose.orientation.w: 1.0
        behavior_tree: {{text: tree.xml}}
      succeeded: {{error_code: NONE}}
      feedback: {{zone: {{field: distance_remaining, ranges: {{near: ..2.5, far: 2.5..}}}}}}
""",
    "map -0.5 1 tree.xml",
)


@pytest.fixture(params=[TRAJECTORIES, NAVIGATION], ids=["FollowJointTrajectory", "NavigateToPose"])
def kind(request: pytest.FixtureRequest) -> Kind:
    """A type of action at the peer."""
    found: Kind = request.param
    return found


class Gantry:
    """Our link, and what comes through it."""

    def __init__(self, bus: Bus, there: Peer, resource: Resource) -> None:
        self.heard = Heard()
        self.fates: list[tuple[int, str]] = []
        self.warnings: list[str] = []
        self.there = there
        self.go = bus.publisher(Topic("/go"))
        self._counted = asyncio.Event()
        warn = self.warnings.append
        self.link = ActionLink(LinkContext(bus, resource, self.heard, warn, monotonic_ns, self._count))

    def _count(self, request: Correlation, fate: GoalFate) -> None:
        self.fates.append((request.number, fate.value))
        self._counted.set()

    async def until_counted(self, number: int, fate: str) -> None:
        while (number, fate) not in self.fates:
            self._counted.clear()
            await self._counted.wait()

    def send(self, number: int, order: int) -> None:
        self.link.send(Correlation("run", number), (("order", order),))

    def cancel(self, number: int) -> None:
        self.link.cancel(Correlation("run", number))

    async def says(self, *lines: str) -> None:
        await asyncio.to_thread(self.there.says, *lines)

    async def replies(self, number: int) -> bool:
        """Wait for the reply to a request; return whether it succeeded."""
        await self.heard.until(lambda: number in dict(self.heard.numbers()))
        return dict(self.heard.numbers())[number]

    async def is_over(self, number: int) -> str:
        """Send the goal 3, which waits for the one before; return what became of that."""
        self.send(number + 1, 3)
        assert await self.replies(number + 1)
        return [fate for one, fate in self.fates if one == number][-1]


def play(domain: int, program: Path, kind: Kind, story: Callable[[Gantry], Coroutine[Any, Any, None]]) -> None:
    """Play a story with an action server, once it has found our endpoints for messages both ways."""

    async def scene(bus: Bus, _: BusCallbacks) -> None:
        with peer(program, domain, kind.argument) as there:
            await asyncio.to_thread(there.says, "ready")
            gantry = Gantry(bus, there, kind.resource())
            await gantry.heard.until(lambda: gantry.link.is_there)
            await gantry.says("matched rt/go", f"matched rt{kind.action}/_action/feedback")
            await story(gantry)

    over_bus(domain, scene, LINE_GUARD_S)


def test_each_goal_ends_as_its_server_decides(domain: int, ros2_peer_program: Path, kind: Kind) -> None:
    async def story(gantry: Gantry) -> None:
        gantry.send(1, 3)
        await gantry.says("goal 3", f"fields {kind.fields}", "end 3 Succeeded")
        assert await gantry.replies(1)
        gantry.send(2, 100)
        assert not await gantry.replies(2)
        gantry.send(3, 10)
        assert not await gantry.replies(3)
        gantry.send(4, 11)  # status SUCCEEDED, but another error code
        assert not await gantry.replies(4)
        assert gantry.fates == [
            (1, "accepted"), (1, "succeeded"), (2, "rejected"), (3, "accepted"), (3, "aborted"), (4, "accepted"),
            (4, "succeeded"),
        ]  # fmt: skip
        gantry.send(5, 20)
        await gantry.heard.until(lambda: len(gantry.heard.values) == 4)
        gantry.cancel(5)
        assert await gantry.is_over(5) == "cancelled"
        gantry.send(7, 60)
        await gantry.says("goal 60")
        gantry.cancel(7)  # before it is accepted
        gantry.go.publish({"data": "go"})
        assert await gantry.is_over(7) == "cancelled"
        gantry.send(9, 80)
        await gantry.says("goal 80")
        gantry.cancel(9)
        await gantry.until_counted(9, "cancel_refused")
        gantry.go.publish({"data": "go"})
        assert await gantry.is_over(9) == "succeeded"
        gantry.send(11, 90)
        await gantry.says("goal 90")
        gantry.cancel(11)
        assert await gantry.is_over(11) == "succeeded"
        assert [measured.values[0][1] for _, measured in gantry.heard.values[:4]] == ["near", "far", "far", "far"]
        assert len(gantry.warnings) == 1

    play(domain, ros2_peer_program, kind, story)


def test_a_killed_server_gives_no_reply_and_the_next_one_gets_the_next_goal(
    domain: int, ros2_peer_program: Path, kind: Kind
) -> None:
    async def story(gantry: Gantry) -> None:
        gantry.send(1, 20)
        await gantry.says("goal 20")
        gantry.there.kill()
        await gantry.heard.until(lambda: not gantry.link.is_there)
        with peer(ros2_peer_program, domain, kind.argument):
            gantry.send(2, 3)
            assert await gantry.replies(2)
        assert gantry.heard.numbers() == [(2, True)]

    play(domain, ros2_peer_program, kind, story)
