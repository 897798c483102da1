"""Real resources are reached at the bus of drivers, which may be another than that of the cell."""

from __future__ import annotations

import json
from collections.abc import Mapping

from scbm.files import read_bindings, read_case, write_case
from scbm.model import Binding, Resource
from scbm.nodes import Bus, ControllerNode
from scbm.nodes.bindings.ros_binding import MeasuredTopic, RosBinding, TopicPair
from scbm.nodes.buses.bus import MISMATCHES, Publisher, Service, Topic, UnmatchedKind
from scbm.nodes.buses.loopback import LoopbackHub
from scbm.nodes.links.bound_link import BoundLink
from scbm.nodes.links.link import Correlation, LinkContext, Reply
from scbm.nodes.node_messages import Abandon, Go, Message, Prepare, Refused, decode, encode
from scbm.nodes.roles.cell_topics import CellTopics
from scbm.nodes.types.definitions import BOOL, FLOAT64, TRIGGER, Scalar
from support.event_records import OPTIONS
from support.hearing import Heard
from support.models import scan_cell
from support.nodes import Stage
from support.ros_types import reading
from support.virtual_loop import VirtualLoop, run_virtually
from support.wording import Wording

MODEL = read_bindings(
    "bindings_of: scan_cell\nresources: {scan: {topics: {request: /scan/request, reply: /scan/reply}}}\n", scan_cell()
)
TOPICS = CellTopics.of(MODEL)
REQUEST, REPLY = Topic("/scan/request"), Topic("/scan/reply")


def open_driver(bus: Bus) -> list[str]:
    """A driver that never replies; what it is asked."""
    asked: list[str] = []
    bus.subscribe(REQUEST, lambda received: asked.append(str(received.message.data)))
    bus.publisher(REPLY)
    return asked


async def begin_run(node: ControllerNode, cases: Publisher, loop: VirtualLoop, more: str = "") -> None:
    """A run that goes on until the driver replies."""
    case = write_case(read_case(f"case: scans\ngoal: scanned\n{more}", MODEL), MODEL, None)
    prepare = Prepare("run_1", (node.membership.own.node,), case, OPTIONS, "1", False, "process 1", ())
    messages: list[Message] = [prepare, Go("run_1")]
    for message in messages:
        cases.publish({"data": encode(message)})
        await loop.settle()


def test_a_driver_at_the_bus_of_drivers_is_reached_and_one_in_the_cell_is_not() -> None:
    async def scene(loop: VirtualLoop) -> None:
        cell, drivers = LoopbackHub(loop.now_ns), LoopbackHub(loop.now_ns)
        stage = Stage(MODEL, cell.join, loop.now_ns)
        node = ControllerNode(stage.context("controller", ["scan"]), drivers=drivers.join("controller"))
        asked_in_cell = open_driver(cell.join("impostor"))
        await loop.settle(10**9)
        assert node.membership.own.troubles != ()
        asked = open_driver(drivers.join("driver"))
        await loop.settle(10**9)
        assert node.membership.own.troubles == ()

        await begin_run(node, cell.join("tester").publisher(TOPICS.case), loop)
        assert [json.loads(text)["request"] for text in asked] == [{"scan_command": "scan_box"}]
        assert asked_in_cell == []
        await node.close()

    run_virtually(scene)


def test_without_another_bus_drivers_are_in_the_cell() -> None:
    async def scene(loop: VirtualLoop) -> None:
        cell = LoopbackHub(loop.now_ns)
        node = ControllerNode(Stage(MODEL, cell.join, loop.now_ns).context("controller", ["scan"]))
        open_driver(cell.join("driver"))
        await loop.settle(10**9)
        assert node.membership.own.troubles == ()
        await node.close()

    run_virtually(scene)


def test_a_driver_hears_that_nobody_waits_for_its_reply_any_more() -> None:
    async def scene(loop: VirtualLoop) -> None:
        cell = LoopbackHub(loop.now_ns)
        node = ControllerNode(Stage(MODEL, cell.join, loop.now_ns).context("controller", ["scan"]))
        asked = open_driver(cell.join("driver"))
        await loop.settle(10**9)
        cases = cell.join("tester").publisher(TOPICS.case)
        await begin_run(node, cases, loop)
        assert [json.loads(text)["id"] for text in asked] == ["run_1-1"]
        cases.publish({"data": encode(Abandon("run_1"))})
        await loop.settle()
        assert [json.loads(text) for text in asked[1:]] == [{"id": "run_1-1", "cancel": True}]
        await node.close()

    run_virtually(scene)


# two servers of one service

CALLED = read_bindings(
    "bindings_of: scan_cell\nresources: {scan: {service: {name: /scan, type: std_srvs/srv/Trigger}}}\n", scan_cell()
)


def serve(hub: LoopbackHub, name: str) -> list[object]:
    """A driver that answers at once; what it is asked."""
    asked: list[object] = []

    def answer(fields: Mapping[str, Scalar]) -> Mapping[str, Scalar]:
        asked.append(fields)
        return {"success": False, "message": ""}

    hub.join(name).serve(Service("/scan", TRIGGER), answer)
    return asked


def test_a_service_with_two_servers_is_a_trouble_that_names_them(wording: Wording) -> None:
    async def scene(loop: VirtualLoop) -> None:
        cell = LoopbackHub(loop.now_ns)
        node = ControllerNode(Stage(CALLED, cell.join, loop.now_ns).context("controller", ["scan"]))
        asked = [serve(cell, "left_driver"), serve(cell, "right_driver")]
        await loop.settle(10**9)
        (trouble,) = node.membership.own.troubles
        assert trouble.kind == UnmatchedKind.CROWDED
        wording(trouble.words)
        await begin_run(node, cell.join("tester").publisher(CellTopics.of(CALLED).case), loop)
        assert asked == [[], []]
        await node.close()

    run_virtually(scene)


def test_a_second_server_that_appears_in_a_run_makes_the_case_lost(wording: Wording) -> None:
    async def scene(loop: VirtualLoop) -> None:
        cell = LoopbackHub(loop.now_ns)
        node = ControllerNode(Stage(CALLED, cell.join, loop.now_ns).context("controller", ["scan"]))
        first = serve(cell, "left_driver")
        await loop.settle(10**9)
        assert node.membership.own.troubles == ()
        tester, messages = cell.join("tester"), list[Message]()
        tester.subscribe(CellTopics.of(CALLED).run, lambda received: messages.append(decode(received.message.data)))
        await begin_run(node, tester.publisher(CellTopics.of(CALLED).case), loop, "initial: {light: red}\n")
        second = serve(cell, "right_driver")
        await loop.settle(10**9)
        (refused,) = [message for message in messages if isinstance(message, Refused)]
        wording(refused.why)
        assert (first, second) == ([], [])
        await node.close()

    run_virtually(scene)


# what is measured beside requests


class Whole:
    """A driver that takes requests and measures, the callbacks of its link, and its requests."""

    def __init__(self, loop: VirtualLoop, binding: Binding) -> None:
        self.hub = LoopbackHub(loop.now_ns)
        self.heard = Heard()
        self.complaints: list[str] = []
        resource = Resource("scan", ("command",), ("zone",), binding=binding)
        self.link = BoundLink(
            LinkContext(self.hub.join("controller"), resource, self.heard, self.complaints.append, loop.now_ns)
        )


ZONE = MeasuredTopic("/scan/zone", BOOL, reading("zone", BOOL))
BOTH = RosBinding({}, TopicPair(REQUEST.name, REPLY.name), (ZONE,))


def test_a_driver_is_there_while_all_is_that_its_binding_names() -> None:
    async def scene(loop: VirtualLoop) -> None:
        whole = Whole(loop, BOTH)
        missing = [whole.link.missing]
        asked = open_driver(whole.hub.join("driver"))
        whole.link.send(Correlation("run", 1), (("command", "scan"),))
        await loop.settle()
        assert len(asked) == 1  # whatever is measured
        assert [*missing, whole.link.missing] == [(REQUEST.name, REPLY.name, ZONE.topic), (ZONE.topic,)]
        assert whole.heard.presence == []
        sensor = whole.hub.join("sensor")
        sensor.publisher(Topic(ZONE.topic, BOOL)).publish({"data": True})
        await loop.settle()
        assert (whole.link.is_there, whole.heard.presence) == (True, [("scan", True)])
        assert [reported.values for _, reported in whole.heard.values] == [(("zone", True),)]
        await sensor.close()
        await loop.settle()
        assert (whole.link.is_there, whole.heard.presence) == (False, [("scan", True), ("scan", False)])

    run_virtually(scene)


def test_why_it_is_not_there_is_reported_of_what_it_measures_too(wording: Wording) -> None:
    async def scene(loop: VirtualLoop) -> None:
        whole = Whole(loop, BOTH)
        open_driver(whole.hub.join("driver"))
        whole.hub.join("sensor").publisher(Topic(ZONE.topic, FLOAT64))
        await loop.settle()
        unmatched = whole.link.why_unmatched()
        assert unmatched is not None
        assert unmatched.kind in MISMATCHES
        wording(unmatched.why)

    run_virtually(scene)


def test_a_request_to_what_only_measures_has_failed_by_the_clock_of_the_bus() -> None:
    async def scene(loop: VirtualLoop) -> None:
        whole = Whole(loop, RosBinding({}, None, (ZONE,)))
        sent_ns = loop.now_ns()
        whole.link.send(Correlation("run", 1), ())
        assert whole.heard.replies == []  # not in the midst of sending
        await loop.settle()
        assert whole.heard.replies == [
            ("scan", Reply(Correlation("run", 1), succeeded=False, measured=(), stamp_ns=sent_ns))
        ]

    run_virtually(scene)


# drivers that answer twice


def test_a_second_reply_is_reported_once_in_a_run_and_so_is_one_that_comes_behind_the_end(wording: Wording) -> None:
    async def scene(loop: VirtualLoop) -> None:
        whole = Whole(loop, BOTH)
        driver = whole.hub.join("driver")
        driver.subscribe(REQUEST, lambda _: None)
        replies = driver.publisher(REPLY)
        for request in ("run-1", "run-2", "other-1"):
            replies.publish({"data": json.dumps({"id": request, "succeeded": True})})
        await loop.settle()
        assert whole.complaints == []
        for request in ("run-1", "run-2", "run-1", "other-1"):
            replies.publish({"data": json.dumps({"id": request, "succeeded": True})})
        await loop.settle()
        first, second = whole.complaints
        assert first == second
        wording(first)
        assert whole.heard.numbers() == [(number, True) for number in (1, 2, 1, 1, 2, 1, 1)]

    run_virtually(scene)
