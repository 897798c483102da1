"""What we speak over DDS, next to a node of ROS 2 that has nothing of Cyclone DDS: of ros2-client, on RustDDS."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from scbm.nodes.buses.bus import SET_BOOL, TRIGGER, Bus, Client, MessageType, Scalar, Service, Topic
from support.loops import GUARD_S
from support.node_processes import PATIENCE
from support.peers import Peer, peer
from support.ros2_peers import ros2_peer_program as ros2_peer_program  # noqa: PLC0414 - a fixture, for pytest to find
from support.telling import Told, over_bus

pytestmark = pytest.mark.peer

SCAN = Service("/scanner/scan_item_a", TRIGGER)
LIGHT = Service("/scanner/light", SET_BOOL)
LATCH = Service("/latch", TRIGGER)
REQUESTS = Topic("/scanner/request")
REPLIES = Topic("/scanner/reply")
SEES = Topic("/scanner/sees", MessageType.BOOL, is_latched=True)

EXAMPLE = Path(__file__).parents[2] / "examples" / "robot_in_the_air"


async def until_matched(there: Peer, *topics: str) -> None:
    await asyncio.to_thread(there.says, *(f"matched {topic}" for topic in topics))


async def until_heard(probe: Callable[[], object], there: Peer, says: str, is_heard: Callable[[], bool]) -> None:
    """Probes, one after the other, until one is heard; from then on nothing is lost.

    Cyclone DDS matches a writer of RustDDS some milliseconds before it takes what that one sends.
    """
    while not is_heard():
        probe()
        await asyncio.to_thread(there.says, says)


async def until_answers(client: Client, fields: dict[str, Scalar], told: Told, there: Peer, name: str) -> None:
    """Until the calls of a service are answered."""
    await told.until(lambda: client.peers >= 1)
    await until_matched(there, f"rq{name}Request", f"rr{name}Reply")
    await until_heard(lambda: client.call(fields), there, "responded", lambda: bool(told.answers))


def test_it_lists_our_nodes(domain: int, ros2_peer_program: Path) -> None:
    async def story(_bus: Bus, _told: Told) -> None:
        with peer(ros2_peer_program, domain, "nodes", "/tester") as there:
            await asyncio.to_thread(there.says, "/tester")
            assert there.process.wait(GUARD_S) == 0

    over_bus(domain, story)


def test_it_answers_our_calls(domain: int, ros2_peer_program: Path) -> None:
    async def story(bus: Bus, told: Told) -> None:
        client = bus.client(LIGHT, told.answered, told.matched)
        with peer(ros2_peer_program, domain, "driver") as there:
            await until_answers(client, {"data": True}, told, there, LIGHT.name)
            call = client.call({"data": False})
            await told.until(lambda: told.answers[-1].call == call)

            assert client.peers == 1
            assert told.answers[0].fields == {"success": True, "message": "light true"}
            assert told.answers[-1].fields == {"success": False, "message": "light false"}

    over_bus(domain, story)


def test_none_of_a_thousand_calls_is_lost(domain: int, ros2_peer_program: Path) -> None:
    total, in_flight = 1000, 50

    async def story(bus: Bus, told: Told) -> None:
        client = bus.client(SCAN, told.answered, told.matched)
        with peer(ros2_peer_program, domain, "driver") as there:
            await until_answers(client, {}, told, there, SCAN.name)
            first = told.answers[0].call
            last = first
            while len(told.answers) < total:
                while last < min(first + total - 1, first + len(told.answers) + in_flight):
                    last = client.call({})
                await told.until_answers(len(told.answers) + 1)
            assert sorted(answer.call for answer in told.answers) == list(range(first, first + total))

    over_bus(domain, story)


def test_another_one_answers_when_the_first_was_killed(domain: int, ros2_peer_program: Path) -> None:
    async def story(bus: Bus, told: Told) -> None:
        client = bus.client(SCAN, told.answered, told.matched)
        with peer(ros2_peer_program, domain, "driver") as there:
            await until_answers(client, {}, told, there, SCAN.name)
        # RustDDS has a lease of 50 seconds: so long the first one seems to be there.
        told.answers.clear()
        with peer(ros2_peer_program, domain, "driver") as there:
            await told.until(lambda: client.peers == 2)
            await until_answers(client, {}, told, there, SCAN.name)
        # What the first one took and did not acknowledge, this one asks for again: a second response is told.
        told.complaints = [what for what in told.complaints if "a second response" not in what]

    over_bus(domain, story)


def test_we_answer_its_calls(domain: int, ros2_peer_program: Path) -> None:
    total = 100

    async def story(bus: Bus, told: Told) -> None:
        served: list[int] = []

        def answer(_: object) -> dict[str, Scalar]:
            served.append(len(served) + 1)
            return {"success": True, "message": f"latched {served[-1]}"}

        bus.serve(LATCH, answer)
        sees = bus.subscribe(SEES, told.received, told.matched)
        start = bus.publisher(REQUESTS, told.matched)
        with peer(ros2_peer_program, domain, "call", LATCH.name) as there:
            await told.until(lambda: sees.peers == 1 and start.peers == 1)
            await until_matched(there, "rq/latchRequest", "rr/latchReply", "rt/scanner/request")
            await until_heard(lambda: start.publish("probe"), there, "called probe", lambda: bool(served))
            start.publish(str(total))
            await asyncio.to_thread(there.says, f"answered {total}")

            assert served[-1] >= total

    over_bus(domain, story)


def test_it_speaks_the_protocol_of_drivers(domain: int, ros2_peer_program: Path) -> None:
    async def story(bus: Bus, told: Told) -> None:
        requests = bus.publisher(REQUESTS, told.matched)
        replies = bus.subscribe(REPLIES, told.received, told.matched)
        with peer(ros2_peer_program, domain, "driver") as there:
            await told.until(lambda: requests.peers == 1 and replies.peers == 1)
            await until_matched(there, "rt/scanner/request", "rt/scanner/reply")
            request = json.dumps({"id": "ü-7", "request": {"scanner_command": "scan_item_a"}}, ensure_ascii=False)
            await until_heard(lambda: requests.publish(request), there, f"took {request}", lambda: bool(told.messages))

            assert json.loads(str(told.messages[0].data)) == {"id": "ü-7", "succeeded": True}

    over_bus(domain, story)


def test_its_latched_measurement_arrives(domain: int, ros2_peer_program: Path) -> None:
    async def story(bus: Bus, told: Told) -> None:
        with peer(ros2_peer_program, domain, "driver") as there:
            await asyncio.to_thread(there.says, "ready")
            bus.subscribe(SEES, told.received, told.matched)
            await told.until(lambda: bool(told.messages))
            assert [message.data for message in told.messages] == [True]

    over_bus(domain, story)


def test_its_types_have_the_names_that_ours_have(domain: int, ros2_peer_program: Path) -> None:
    wrong = Service(LIGHT.name, TRIGGER)

    async def story(bus: Bus, told: Told) -> None:
        client = bus.client(wrong, told.answered, told.matched)
        # These are behind the service there: who is matched with them knows of it.
        requests = bus.publisher(REQUESTS, told.matched)
        replies = bus.subscribe(REPLIES, told.received, told.matched)
        with peer(ros2_peer_program, domain, "driver"):
            await told.until(lambda: requests.peers == 1 and replies.peers == 1)
            assert client.peers == 0
            assert "std_srvs/srv/SetBool" in str(bus.why_unmatched(wrong))

    over_bus(domain, story)


def test_a_cell_is_listed_and_works_with_it(domain: int, ros2_peer_program: Path) -> None:
    names = ["/scbm_controller", "/scbm_resources", "/scbm_tester"]
    bindings = EXAMPLE / "ros2" / "bindings.yaml"
    words = ["--cases", "1", "--seed", "1", "--json", "--transport", "dds", "--domain", domain, "--real", "scanner"]
    words += PATIENCE
    command = [sys.executable, "-m", "scbm", "test", EXAMPLE / "after.yaml", "--bindings", bindings, *words]
    with peer(ros2_peer_program, domain, "nodes", *names) as lists, peer(ros2_peer_program, domain, "driver") as driver:
        lists.says("ready")
        driver.says("ready")
        tested = subprocess.run(
            [str(word) for word in command], capture_output=True, text=True, timeout=2 * GUARD_S, check=False
        )

        assert tested.returncode == 0, tested.stderr
        assert [case["verdict"] for case in json.loads(tested.stdout)["cases"]] == ["reached"]
        lists.says(*names)
        driver.says(f"matched rq{SCAN.name}Request", f"matched rr{SCAN.name}Reply")
