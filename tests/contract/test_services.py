"""What we speak over DDS, next to a program in C that knows nothing of scbm: the driver of a scanner."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path

import pytest

from scbm.nodes.buses.bus import Bus, Service, Topic
from scbm.nodes.types.definitions import FLOAT64, TRIGGER
from support.bus_callbacks import BusCallbacks, over_bus
from support.loops import GUARD_S
from support.peers import LEASE_1S, peer
from support.peers import scanner_program as scanner_program  # noqa: PLC0414 - a fixture, for pytest to find here

pytestmark = pytest.mark.peer

SCAN = Service("/scanner/scan_item_a", TRIGGER)
REQUESTS = Topic("/scanner/request")
REPLIES = Topic("/scanner/reply")
DISTANCE = Topic("/scanner/distance", FLOAT64, is_latched=True)


def test_it_answers_our_calls(domain: int, scanner_program: Path) -> None:
    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        client = bus.client(SCAN, callbacks.answered, callbacks.matched)
        with peer(scanner_program, domain, "--works-ms", 0) as there:
            await callbacks.until(lambda: client.peers == 1)
            calls = [client.call({}), client.call({})]
            await callbacks.until_answers(2)

            assert [answer.call for answer in callbacks.answers] == calls
            assert [vars(answer.message) for answer in callbacks.answers] == [
                {"success": True, "message": "scanned"}
            ] * 2
            there.process.terminate()
            await callbacks.until(lambda: client.peers == 0)

    over_bus(domain, story)


def test_it_may_fail(domain: int, scanner_program: Path) -> None:
    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        client = bus.client(SCAN, callbacks.answered, callbacks.matched)
        with peer(scanner_program, domain, "--fails"):
            await callbacks.until(lambda: client.peers == 1)
            client.call({})
            await callbacks.until_answers(1)
            assert vars(callbacks.answers[0].message) == {"success": False, "message": "nothing in sight"}

    over_bus(domain, story)


def test_none_of_a_thousand_calls_is_lost(domain: int, scanner_program: Path) -> None:
    total, in_flight = 1000, 50

    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        client = bus.client(SCAN, callbacks.answered, callbacks.matched)
        with peer(scanner_program, domain, "--works-ms", 0):
            await callbacks.until(lambda: client.peers == 1)
            calls: list[int] = []
            while len(callbacks.answers) < total:
                while len(calls) < min(total, len(callbacks.answers) + in_flight):
                    calls.append(client.call({}))
                await callbacks.until_answers(len(callbacks.answers) + 1)
            assert sorted(answer.call for answer in callbacks.answers) == calls

    over_bus(domain, story)


def test_it_speaks_the_protocol_of_drivers(domain: int, scanner_program: Path) -> None:
    measured = {"zone": "near"}

    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        requests = bus.publisher(REQUESTS, callbacks.matched)
        replies = bus.subscribe(REPLIES, callbacks.received, callbacks.matched)
        with peer(scanner_program, domain, "--measured", json.dumps(measured)):
            await callbacks.until(lambda: requests.peers == 1 and replies.peers == 1)
            request = {
                "id": "9f2c-7",
                "request": {"scanner_command": "scan_item_a", "of": ['ü"}', {"id": "no"}, -1.5e3]},
            }
            requests.publish({"data": json.dumps(request, ensure_ascii=False)})
            await callbacks.until(lambda: bool(callbacks.messages))

            assert [json.loads(str(message.message.data)) for message in callbacks.messages] == [
                {"id": "9f2c-7", "succeeded": True, "measured": measured}
            ]

    over_bus(domain, story)


def test_a_request_that_is_cancelled_is_not_answered(domain: int, scanner_program: Path) -> None:
    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        requests = bus.publisher(REQUESTS, callbacks.matched)
        replies = bus.subscribe(REPLIES, callbacks.received, callbacks.matched)
        client = bus.client(SCAN, callbacks.answered, callbacks.matched)
        with peer(scanner_program, domain, "--works-ms", 3_600_000) as there:
            await callbacks.until(lambda: requests.peers == 1 and replies.peers == 1 and client.peers == 1)
            requests.publish({"data": '{"id": "a-1", "request": {"scanner_command": "scan_item_a"}}'})
            await asyncio.to_thread(there.says, 'took "a-1"')
            requests.publish({"data": '{"id": "a-1", "cancel": true}'})
            await asyncio.to_thread(there.says, 'cancelled "a-1"')
            requests.publish({"data": '{"id": "a-1"}'})
            await asyncio.to_thread(there.says, 'not of the protocol: {"id": "a-1"}')
            assert callbacks.messages == []

    over_bus(domain, story)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "no JSON",
        "[]",
        '{"id": 1, "request": {}}',
        '{"request": {}}',
        '{"id": "a-1", "request": {}',
        '{"id": "a"} {}',
    ],
)
def test_it_takes_nothing_that_is_not_of_the_protocol(domain: int, scanner_program: Path, text: str) -> None:
    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        requests = bus.publisher(REQUESTS, callbacks.matched)
        with peer(scanner_program, domain) as there:
            await callbacks.until(lambda: requests.peers == 1)
            requests.publish({"data": text})
            await asyncio.to_thread(there.says, f"not of the protocol: {text}")

    over_bus(domain, story)


def test_its_measurements_arrive(domain: int, scanner_program: Path) -> None:
    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        bus.subscribe(DISTANCE, callbacks.received, callbacks.matched)
        client = bus.client(SCAN, callbacks.answered, callbacks.matched)
        with peer(scanner_program, domain, "--distance", 0.75):
            await callbacks.until(lambda: len(callbacks.messages) == 1 and client.peers == 1)
            client.call({})
            await callbacks.until(lambda: len(callbacks.messages) == 2)
            assert [message.message.data for message in callbacks.messages] == [0.75, 0.75]

    over_bus(domain, story)


def test_it_leaves_after_so_many_replies_and_the_last_one_arrives(domain: int, scanner_program: Path) -> None:
    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        client = bus.client(SCAN, callbacks.answered, callbacks.matched)
        with peer(scanner_program, domain, "--exit-after", 2) as there:
            await callbacks.until(lambda: client.peers == 1)
            calls = [client.call({}) for _ in range(2)]
            await callbacks.until(lambda: client.peers == 0)
            await asyncio.to_thread(there.says, "gone")
            assert [answer.call for answer in callbacks.answers] == calls
            assert there.process.wait(GUARD_S) == 0

    over_bus(domain, story)


def test_that_it_is_killed_is_noticed_after_its_lease(domain: int, scanner_program: Path) -> None:
    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        client = bus.client(SCAN, callbacks.answered, callbacks.matched)
        replies = bus.subscribe(REPLIES, callbacks.received, callbacks.matched)
        with peer(scanner_program, domain, "--works-ms", 3_600_000, uri=LEASE_1S) as there:
            await callbacks.until(lambda: client.peers == 1 and replies.peers == 1)
            client.call({})
            await asyncio.to_thread(there.says, "took call 1")
            there.kill()
            killed = asyncio.get_running_loop().time()
            await callbacks.until(lambda: client.peers == 0 and replies.peers == 0)

            # Without a lease of its own, it would be ten seconds.
            assert asyncio.get_running_loop().time() - killed < 9
            assert callbacks.answers == []

    over_bus(domain, story)
