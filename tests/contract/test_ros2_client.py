"""What we speak over DDS, next to a node of ROS 2 that has nothing of Cyclone DDS: of ros2-client, on RustDDS."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from scbm.nodes.buses.bus import Bus, Client, Service, Topic
from scbm.nodes.types.definitions import BOOL, SET_BOOL, TRIGGER, Scalar
from support.bus_callbacks import BusCallbacks, over_bus
from support.loops import GUARD_S
from support.node_processes import PATIENCE
from support.peers import Peer, peer
from support.ros2_peers import ros2_peer_program as ros2_peer_program  # noqa: PLC0414 - a fixture, for pytest to find

pytestmark = pytest.mark.peer

SCAN = Service("/scanner/scan_item_a", TRIGGER)
LIGHT = Service("/scanner/light", SET_BOOL)
LATCH = Service("/latch", TRIGGER)
REQUESTS = Topic("/scanner/request")
REPLIES = Topic("/scanner/reply")
SEES = Topic("/scanner/sees", BOOL, is_latched=True)

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


async def until_answers(
    client: Client, fields: dict[str, Scalar], callbacks: BusCallbacks, there: Peer, name: str
) -> None:
    """Until the calls of a service are answered."""
    await callbacks.until(lambda: client.peers >= 1)
    await until_matched(there, f"rq{name}Request", f"rr{name}Reply")
    await until_heard(lambda: client.call(fields), there, "responded", lambda: bool(callbacks.answers))


def test_it_lists_our_nodes(domain: int, ros2_peer_program: Path) -> None:
    async def story(_bus: Bus, _reported: BusCallbacks) -> None:
        with peer(ros2_peer_program, domain, "nodes", "/tester") as there:
            await asyncio.to_thread(there.says, "/tester")
            assert there.process.wait(GUARD_S) == 0

    over_bus(domain, story)


def test_it_answers_our_calls(domain: int, ros2_peer_program: Path) -> None:
    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        client = bus.client(LIGHT, callbacks.answered, callbacks.matched)
        with peer(ros2_peer_program, domain, "driver") as there:
            await until_answers(client, {"data": True}, callbacks, there, LIGHT.name)
            call = client.call({"data": False})
            await callbacks.until(lambda: callbacks.answers[-1].call == call)

            assert client.peers == 1
            assert vars(callbacks.answers[0].message) == {"success": True, "message": "light true"}
            assert vars(callbacks.answers[-1].message) == {"success": False, "message": "light false"}

    over_bus(domain, story)


def test_none_of_a_thousand_calls_is_lost(domain: int, ros2_peer_program: Path) -> None:
    total, in_flight = 1000, 50

    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        client = bus.client(SCAN, callbacks.answered, callbacks.matched)
        with peer(ros2_peer_program, domain, "driver") as there:
            await until_answers(client, {}, callbacks, there, SCAN.name)
            first = callbacks.answers[0].call
            last = first
            while len(callbacks.answers) < total:
                while last < min(first + total - 1, first + len(callbacks.answers) + in_flight):
                    last = client.call({})
                await callbacks.until_answers(len(callbacks.answers) + 1)
            assert sorted(answer.call for answer in callbacks.answers) == list(range(first, first + total))

    over_bus(domain, story)


def test_another_one_answers_when_the_first_was_killed(domain: int, ros2_peer_program: Path) -> None:
    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        client = bus.client(SCAN, callbacks.answered, callbacks.matched)
        with peer(ros2_peer_program, domain, "driver") as there:
            await until_answers(client, {}, callbacks, there, SCAN.name)
        # RustDDS has a lease of 50 seconds: so long the first one seems to be there.
        callbacks.answers.clear()
        with peer(ros2_peer_program, domain, "driver") as there:
            await callbacks.until(lambda: client.peers == 2)
            await until_answers(client, {}, callbacks, there, SCAN.name)
        # The second one asks again for what the first took and did not acknowledge: a second response is reported.
        callbacks.complaints = [what for what in callbacks.complaints if "a second response" not in what]

    over_bus(domain, story)


def test_we_answer_its_calls(domain: int, ros2_peer_program: Path) -> None:
    total = 100

    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        served: list[int] = []

        def answer(_: object) -> dict[str, Scalar]:
            served.append(len(served) + 1)
            return {"success": True, "message": f"latched {served[-1]}"}

        bus.serve(LATCH, answer)
        sees = bus.subscribe(SEES, callbacks.received, callbacks.matched)
        start = bus.publisher(REQUESTS, callbacks.matched)
        with peer(ros2_peer_program, domain, "call", LATCH.name) as there:
            await callbacks.until(lambda: sees.peers == 1 and start.peers == 1)
            await until_matched(there, "rq/latchRequest", "rr/latchReply", "rt/scanner/request")
            await until_heard(lambda: start.publish({"data": "probe"}), there, "called probe", lambda: bool(served))
            start.publish({"data": str(total)})
            await asyncio.to_thread(there.says, f"answered {total}")

            assert served[-1] >= total

    over_bus(domain, story)


def test_it_speaks_the_protocol_of_drivers(domain: int, ros2_peer_program: Path) -> None:
    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        requests = bus.publisher(REQUESTS, callbacks.matched)
        replies = bus.subscribe(REPLIES, callbacks.received, callbacks.matched)
        with peer(ros2_peer_program, domain, "driver") as there:
            await callbacks.until(lambda: requests.peers == 1 and replies.peers == 1)
            await until_matched(there, "rt/scanner/request", "rt/scanner/reply")
            request = json.dumps({"id": "ü-7", "request": {"scanner_command": "scan_item_a"}}, ensure_ascii=False)
            await until_heard(
                lambda: requests.publish({"data": request}), there, f"took {request}", lambda: bool(callbacks.messages)
            )

            assert json.loads(str(callbacks.messages[0].message.data)) == {"id": "ü-7", "succeeded": True}

    over_bus(domain, story)


def test_its_latched_measurement_arrives(domain: int, ros2_peer_program: Path) -> None:
    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        with peer(ros2_peer_program, domain, "driver") as there:
            await asyncio.to_thread(there.says, "ready")
            bus.subscribe(SEES, callbacks.received, callbacks.matched)
            await callbacks.until(lambda: bool(callbacks.messages))
            assert [message.message.data for message in callbacks.messages] == [True]

    over_bus(domain, story)


def test_its_types_have_the_names_that_ours_have(domain: int, ros2_peer_program: Path) -> None:
    wrong = Service(LIGHT.name, TRIGGER)

    async def story(bus: Bus, callbacks: BusCallbacks) -> None:
        client = bus.client(wrong, callbacks.answered, callbacks.matched)
        # These are behind the service there: who is matched with them knows of it.
        requests = bus.publisher(REQUESTS, callbacks.matched)
        replies = bus.subscribe(REPLIES, callbacks.received, callbacks.matched)
        with peer(ros2_peer_program, domain, "driver"):
            await callbacks.until(lambda: requests.peers == 1 and replies.peers == 1)
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
