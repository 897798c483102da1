"""The bus between processes, and next to its neighbours of ROS 2."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from typing import TypeAlias

import pytest

from scbm.nodes.buses.bus import BusError, Received, Topic
from scbm.nodes.buses.dds.dds_bus import DdsBus
from support import loops
from support.domains import LOOPBACK
from support.kept import Kept
from support.wording import Wording

Complain: TypeAlias = Callable[[str], None]

TALK = Topic("/cell/talk")
SENT = 2_000

SPEAKER = f"""
import asyncio, sys
from scbm.nodes.buses.bus import Topic
from scbm.nodes.buses.dds import open_dds

async def main(domain):
    bus = open_dds("speaker", domain, print)
    met = asyncio.Event()
    publisher = bus.publisher(Topic("/cell/talk"), lambda count: met.set())
    await met.wait()
    for number in range({SENT}):
        publisher.publish({{"data": str(number)}})
    print("sent", flush=True)
    await asyncio.to_thread(sys.stdin.readline)
    await bus.close()

asyncio.run(main(int(sys.argv[1])))
"""


@contextmanager
def speaker(domain: int) -> Iterator[subprocess.Popen[str]]:
    """A process that sends, writes a line, and leaves the bus when it gets one."""
    command = [sys.executable, "-c", SPEAKER, str(domain)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


@asynccontextmanager
async def ears(domain: int, warn: Complain) -> AsyncIterator[DdsBus]:
    """A bus that is closed after a failure too: the next test may have the same domain in this process."""
    bus = DdsBus.open("ears", domain, warn)
    try:
        yield bus
    finally:
        await bus.close()


@pytest.fixture
def long_lease(domain: int, monkeypatch: pytest.MonkeyPatch) -> int:
    """The domain, with a lease that processes keep on a busy machine too: what loses its lease loses messages."""
    uri = LOOPBACK.replace("</Discovery>", "<LeaseDuration>10s</LeaseDuration></Discovery>")
    monkeypatch.setenv("CYCLONEDDS_URI", uri)
    return domain


@pytest.mark.dds
@pytest.mark.parametrize("ends", ["closes", "is killed"])
def test_a_process_is_heard_to_its_end_and_its_end_is_noticed(long_lease: int, warn: Complain, ends: str) -> None:
    async def scenario() -> list[Received | int]:
        events = Kept[Received | int]()
        async with ears(long_lease, warn) as bus:
            bus.subscribe(TALK, events, left=events)
            with speaker(long_lease) as process:
                await events.first(SENT)
                if ends == "is killed":
                    process.kill()
                else:
                    process.communicate("leave\n")
                await events.first(SENT + 1)
                assert process.wait() == (0 if ends == "closes" else -9)
        return events.all

    *messages, last = loops.run(scenario())
    assert [came.message.data for came in messages if isinstance(came, Received)] == [
        str(number) for number in range(SENT)
    ]
    assert [last] == sorted({came.source for came in messages if isinstance(came, Received)})


@pytest.mark.slow
def test_a_loop_that_is_busy_loses_nothing(long_lease: int, warn: Complain) -> None:
    async def scenario() -> list[Received]:
        received = Kept[Received]()
        lines: list[str] = []

        def busy(came: Received) -> None:
            received(came)
            if len(received.all) == 1:
                # Until all has been sent, the loop does nothing else.
                assert process.stdout is not None
                lines.append(process.stdout.readline())

        async with ears(long_lease, warn) as bus:
            with speaker(long_lease) as process:
                bus.subscribe(TALK, busy)
                await received.first(SENT)
        assert lines == ["sent\n"]
        return received.all

    assert [came.message.data for came in loops.run(scenario())] == [str(number) for number in range(SENT)]


def test_it_says_where_it_is(domain: int, warn: Complain) -> None:
    async def scenario() -> str:
        bus = DdsBus.open("ours", domain, warn)
        await bus.close()
        return bus.words

    assert loops.run(scenario()) == f"DDS domain {domain}"


def test_a_node_has_a_name_that_ros_can_have(domain: int, warn: Complain, wording: Wording) -> None:
    async def scenario() -> None:
        with wording.raises(BusError):
            DdsBus.open("no name", domain, warn)
        # Nothing is left of the first: with an index for one process alone there would be no place.
        bus = DdsBus.open("a_name", domain, warn)
        await bus.close()

    loops.run(scenario())


def test_what_cyclone_warns_of_is_reported(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    old = "<General><NetworkInterfaceAddress>lo</NetworkInterfaceAddress></General>"
    monkeypatch.setenv("CYCLONEDDS_URI", f"<CycloneDDS><Domain>{old}</Domain></CycloneDDS>")

    async def scenario() -> list[str]:
        complaints = Kept[str]()
        bus = DdsBus.open("ours", domain, complaints)
        await complaints.first(1)
        await bus.close()
        return complaints.all

    (complaint,) = loops.run(scenario())
    assert complaint.startswith("Cyclone DDS: ")
    assert "deprecated" in complaint


WITHOUT = """
import asyncio, sys
sys.modules["cyclonedds"] = None
from scbm.nodes.buses.bus import BusError
from scbm.nodes.buses.dds import open_dds
try:
    open_dds("node", 0, print)
except BusError as error:
    print(error.message, error.remedy, sep="|")
"""


def test_without_cyclonedds_it_says_how_to_get_it(wording: Wording) -> None:
    ran = subprocess.run([sys.executable, "-c", WITHOUT], capture_output=True, text=True, check=True)
    assert ran.stderr == ""
    wording(ran.stdout)
