"""Goals over DDS, between nodes of ours: three services, two topics, and responses that come later than requests."""

from __future__ import annotations

from time import monotonic_ns

from scbm.nodes.buses.bus import Bus
from scbm.nodes.buses.dds import open_dds
from scbm.nodes.links.action_link import ActionLink
from scbm.nodes.links.goals import GoalStatus, goal_id
from scbm.nodes.links.link import Correlation, LinkContext
from support.action_servers import ActionServer
from support.bus_callbacks import BusCallbacks, over_bus
from support.fibonacci import FIBONACCI, GANTRY
from support.hearing import Heard


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
