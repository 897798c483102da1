"""Goals over DDS, between nodes of ours: three services, two topics, and responses that come later than requests."""

from __future__ import annotations

from time import monotonic_ns

import pytest
from msgspec.structs import replace

from scbm.model import Resource
from scbm.nodes.bindings.ros_binding import Reading, RosBinding
from scbm.nodes.buses.bus import Bus
from scbm.nodes.buses.dds import open_dds
from scbm.nodes.links.action_link import ActionLink
from scbm.nodes.links.goals import GoalStatus, goal_id
from scbm.nodes.links.link import Correlation, LinkContext
from scbm.nodes.types.definitions import ListShape, MessageDefinition, Primitive
from support.action_servers import ActionServer
from support.bus_callbacks import BusCallbacks, over_bus
from support.fibonacci import CALL, FIBONACCI, GANTRY, ZONES, path
from support.hearing import Heard
from support.wording import Wording


def test_a_goal_is_accepted_later_cancelled_then_and_followed_by_the_next_one(domain: int) -> None:
    first, second = Correlation("run", 1), Correlation("run", 2)

    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        there = open_dds("driver", domain, callbacks.complained)
        server, heard = ActionServer(there, "/fibonacci", FIBONACCI), Heard()
        server.accepts = None
        link = ActionLink(LinkContext(bus, GANTRY, heard, callbacks.complained, monotonic_ns))
        await heard.until(lambda: link.is_there)
        link.send(first, (("shelf", 3),))
        await server.until(lambda: bool(server.goals))
        link.cancel(first)
        link.send(second, (("shelf", 4),))
        server.accepts = True
        server.accept(goal_id(first))
        await server.until(lambda: bool(server.cancels))
        server.end(goal_id(first), GoalStatus.CANCELED)
        await server.until(lambda: goal_id(second) in server.watched)
        server.feed_back(goal_id(second), sequence=[1])
        await heard.until(lambda: bool(heard.values))
        server.end(goal_id(second), GoalStatus.SUCCEEDED, sequence=[0, 5])
        await heard.until(lambda: bool(heard.replies))
        assert [goal.order for goal in server.goals.values()] == [3, 4]
        assert heard.numbers() == [(2, True)]
        assert heard.values[0][1].values == (("zone", "near"),)
        await there.close()

    over_bus(domain, story)


@pytest.mark.longer
def test_the_last_of_a_million_elements_is_measured(domain: int) -> None:
    last = "sequence[999999]"
    call = replace(
        CALL,
        measured=(Reading("zone", path(FIBONACCI.result, last), ZONES),),
        feedback=(Reading("zone", path(FIBONACCI.feedback, last), ZONES),),
    )
    resource = Resource("gantry", ("shelf",), ("zone",), binding=RosBinding({}, call))
    request = Correlation("run", 1)

    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        there = open_dds("driver", domain, callbacks.complained)
        server, heard = ActionServer(there, "/fibonacci", FIBONACCI), Heard()
        link = ActionLink(LinkContext(bus, resource, heard, callbacks.complained, monotonic_ns))
        await heard.until(lambda: link.is_there)
        link.send(request, (("shelf", 3),))
        await server.until(lambda: bool(server.watched))
        server.feed_back(goal_id(request), sequence=[9] * 999_999 + [1])
        await heard.until(lambda: bool(heard.values))
        server.end(goal_id(request), GoalStatus.SUCCEEDED, sequence=[0] * 999_999 + [9])
        await heard.until(lambda: bool(heard.replies))
        assert heard.values[0][1].values == (("zone", "near"),)
        assert heard.replies[0][1].measured == (("zone", "far"),)
        assert callbacks.complaints == []
        await there.close()

    over_bus(domain, story)


def test_messages_with_too_long_lists_are_dropped_with_a_sentence_and_the_goal_goes_on(
    domain: int, wording: Wording
) -> None:
    lines = (("lines", ListShape(Primitive("string"))),)
    feedback = MessageDefinition("test_msgs/action/Fibonacci_Feedback", lines)
    kind = replace(FIBONACCI, feedback=feedback)
    readings = (Reading("zone", path(feedback, "lines[0]")),)
    binding = RosBinding({}, replace(CALL, type=kind, feedback=readings))
    resource = Resource("gantry", ("shelf",), ("zone",), binding=binding)
    request = Correlation("run", 1)

    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        there = open_dds("driver", domain, callbacks.complained)
        server, heard = ActionServer(there, "/fibonacci", kind), Heard()
        link = ActionLink(LinkContext(bus, resource, heard, callbacks.complained, monotonic_ns))
        await heard.until(lambda: link.is_there)
        link.send(request, (("shelf", 3),))
        await server.until(lambda: bool(server.watched))
        server.feed_back(goal_id(request), lines=["far"] * 100_001)
        server.feed_back(goal_id(request), lines=["near"] * 100_000)
        await heard.until(lambda: bool(heard.values))
        server.end(goal_id(request), GoalStatus.SUCCEEDED, sequence=[0, 5])
        await heard.until(lambda: bool(heard.replies))
        assert [measured.values for _, measured in heard.values] == [(("zone", "near"),)]
        assert heard.numbers() == [(1, True)]
        wording("".join(f"{each}\n" for each in callbacks.complaints))
        callbacks.complaints.clear()
        await there.close()

    over_bus(domain, story)
