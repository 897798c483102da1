"""A process with an action server, `/fibonacci`, whose goals go from phase to phase when they are told to.

`phased_server.py DOMAIN` prints `asked N`, `accepted N`, `fed N` and `over N` for its N-th goal. It leaves each of the
first three phases after a line `go PHASE N` on its standard input; after `free`, it waits for none any more. A goal
that is to be cancelled is over at once after its acceptance, as `cancelled N`. `overlap N` says that a goal came while
another was active.
"""

from __future__ import annotations

import asyncio
import sys
from itertools import count
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from scbm.nodes.buses.dds import open_dds
from scbm.nodes.links.goals import GoalStatus
from support.action_servers import ActionServer
from support.fibonacci import FIBONACCI


def say(*words: object) -> None:
    sys.stdout.write(f"{' '.join(map(str, words))}\n")
    sys.stdout.flush()


class Phases:
    """What the lines of the standard input allow."""

    def __init__(self) -> None:
        self._lines: list[str] = []
        self._changed = asyncio.Event()

    async def read(self) -> None:
        while line := await asyncio.to_thread(sys.stdin.readline):
            self._lines.append(line.strip())
            self._changed.set()

    async def leave(self, phase: str, number: int) -> None:
        """Say that a goal is in a phase, and wait until it may leave."""
        say(phase, number)
        while not {f"go {phase} {number}", "free"} & {*self._lines}:
            self._changed.clear()
            await self._changed.wait()


async def serve(server: ActionServer, phases: Phases, number: int) -> None:
    """Go through the phases of a goal."""
    await server.until(lambda: len(server.goals) >= number)
    which = list(server.goals)[number - 1]
    await phases.leave("asked", number)
    server.accept(which)
    work = asyncio.create_task(execute(server, phases, number))
    cancelled = asyncio.create_task(server.until(lambda: which in server.cancels))
    done, _ = await asyncio.wait([work, cancelled], return_when=asyncio.FIRST_COMPLETED)
    cancelled.cancel()
    work.cancel()
    if len(server.goals) > number:
        say("overlap", number + 1)
    say("over" if work in done else "cancelled", number)
    server.end(which, GoalStatus.SUCCEEDED if work in done else GoalStatus.CANCELED)


async def execute(server: ActionServer, phases: Phases, number: int) -> None:
    await phases.leave("accepted", number)
    server.feed_back(list(server.goals)[number - 1], sequence=[1, 1, 1])
    await phases.leave("fed", number)


async def main(domain: int) -> None:
    bus = open_dds("phased_server", domain, lambda what: say("warning", what))
    server = ActionServer(bus, "/fibonacci", FIBONACCI)
    server.accepts = None
    say("up")
    phases = Phases()
    reading = asyncio.create_task(phases.read())
    for number in count(1):
        await serve(server, phases, number)
        assert not reading.done()


asyncio.run(main(int(sys.argv[1])))
