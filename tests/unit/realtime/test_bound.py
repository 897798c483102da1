"""Real resources are reached at the bus of drivers, which may be another than that of the cell."""

from __future__ import annotations

import json
from dataclasses import asdict

from scbm.notation import read_bindings, read_case, write_case
from scbm.realtime import Bus, ControllerNode
from scbm.realtime.bus import Topic
from scbm.realtime.cell import CellTopics
from scbm.realtime.loopback import LoopbackHub
from scbm.realtime.wire import Go, Message, Prepare, encode
from scbm.running import RunnerOptions
from support.models import scan_cell
from support.nodes import Stage
from support.virtual_loop import VirtualLoop, run_virtually

MODEL = read_bindings(
    "bindings_of: scan_cell\nresources: {scan: {topics: {request: /scan/request, reply: /scan/reply}}}\n", scan_cell()
)
TOPICS = CellTopics.of(MODEL)
REQUEST, REPLY = Topic("/scan/request"), Topic("/scan/reply")


def open_driver(bus: Bus) -> list[str]:
    """A driver that never replies; what it is asked."""
    asked: list[str] = []
    bus.subscribe(REQUEST, lambda received: asked.append(str(received.data)))
    bus.publisher(REPLY)
    return asked


def test_a_driver_at_the_bus_of_drivers_is_reached_and_one_in_the_cell_is_not() -> None:
    async def scene(loop: VirtualLoop) -> None:
        cell, drivers = LoopbackHub(loop.now_ns), LoopbackHub(loop.now_ns)
        stage = Stage(MODEL, cell.join, loop.now_ns)
        node = ControllerNode(stage.seat("controller", ["scan"]), drivers=drivers.join("controller"))
        asked_in_cell = open_driver(cell.join("impostor"))
        await loop.settle(10**9)
        assert node.membership.own.troubles != ()
        asked = open_driver(drivers.join("driver"))
        await loop.settle(10**9)
        assert node.membership.own.troubles == ()

        cases = cell.join("tester").publisher(TOPICS.case)
        case = write_case(read_case("case: scans\ngoal: scanned\n", MODEL), MODEL, None)
        prepare = Prepare("run_1", (node.membership.own.node,), case, asdict(RunnerOptions()), "1", False)
        messages: list[Message] = [prepare, Go("run_1")]
        for message in messages:
            cases.publish(encode(message))
            await loop.settle()
        assert [json.loads(text)["request"] for text in asked] == [{"scan_command": "scan_box"}]
        assert asked_in_cell == []
        await node.close()

    run_virtually(scene)


def test_without_another_bus_drivers_are_in_the_cell() -> None:
    async def scene(loop: VirtualLoop) -> None:
        cell = LoopbackHub(loop.now_ns)
        node = ControllerNode(Stage(MODEL, cell.join, loop.now_ns).seat("controller", ["scan"]))
        open_driver(cell.join("driver"))
        await loop.settle(10**9)
        assert node.membership.own.troubles == ()
        await node.close()

    run_virtually(scene)
