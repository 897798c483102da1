"""The bus between processes, and next to its neighbours of ROS 2."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from typing import TypeAlias

import pytest

from scbm.nodes.buses.bus import BusError, Received, Topic
from scbm.nodes.buses.dds.dds_bus import DdsBus
from support import loops
from support.kept import Kept
from support.wording import Wording

Complain: TypeAlias = Callable[[str], None]

TALK = Topic("/cell/talk")
SENT = 2_000

SPEAKER = f"""
import asyncio, sys
from scbm.nodes.buses.bus import Topic
from scbm.nodes.buses.dds import open_dds

async def main(domain, closes):
    bus = open_dds("speaker", domain, print)
    met = asyncio.Event()
    publisher = bus.publisher(Topic("/cell/talk"), lambda count: met.set())
    await met.wait()
    for number in range({SENT}):
        publisher.publish(str(number))
    if not closes:
        await asyncio.Event().wait()
    await bus.close()

asyncio.run(main(int(sys.argv[1]), sys.argv[2] == "closes"))
"""


def speaker(domain: int, ends: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen([sys.executable, "-c", SPEAKER, str(domain), ends], env=dict(os.environ))


@pytest.mark.dds
@pytest.mark.parametrize("ends", ["closes", "is killed"])
def test_a_process_is_heard_to_its_end_and_its_end_is_noticed(domain: int, warn: Complain, ends: str) -> None:
    async def scenario() -> list[Received | int]:
        bus = DdsBus.open("ears", domain, warn)
        events = Kept[Received | int]()
        bus.subscribe(TALK, events, left=events)
        process = speaker(domain, ends)
        await events.first(SENT)
        if ends == "is killed":
            process.kill()
        await events.first(SENT + 1)
        assert process.wait() == (0 if ends == "closes" else -9)
        await bus.close()
        return events.all

    *messages, last = loops.run(scenario())
    assert [came.data for came in messages if isinstance(came, Received)] == [str(number) for number in range(SENT)]
    assert [last] == sorted({came.source for came in messages if isinstance(came, Received)})


@pytest.mark.slow
def test_a_loop_that_is_busy_loses_nothing(domain: int, warn: Complain) -> None:
    async def scenario() -> list[Received]:
        bus = DdsBus.open("ears", domain, warn)
        received = Kept[Received]()
        is_over: list[bool] = []

        def busy(came: Received) -> None:
            received(came)
            if len(received.all) == 1:
                # Until all has been sent, the loop does nothing else.
                is_over.append(process.wait() == 0)

        bus.subscribe(TALK, busy)
        process = speaker(domain, "closes")
        await received.first(SENT)
        await bus.close()
        assert is_over == [True]
        return received.all

    assert [came.data for came in loops.run(scenario())] == [str(number) for number in range(SENT)]


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
