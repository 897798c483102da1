"""A process that serves a controller on `loopback`: `serving.py plain|eof|rival`. It says what it does."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from scbm.nodes import Bus, BusError, ControllerNode, NodeContext, new_status, serve
from scbm.nodes.buses.loopback import LoopbackBus, LoopbackHub
from support.models import scan_cell

MODEL = scan_cell()


def say(words: str) -> None:
    sys.stdout.write(f"{words}\n")
    sys.stdout.flush()


class _ReportingController(ControllerNode):
    async def close(self) -> None:
        await super().close()
        say("node closed")


class _ReportingBus(LoopbackBus):
    async def close(self) -> None:
        await super().close()
        say("bus closed")


async def main(mode: str) -> None:
    hub = LoopbackHub()

    def make(bus: Bus) -> ControllerNode:
        return _ReportingController(NodeContext(bus, MODEL, new_status("controller", MODEL, "d" * 64), say))

    async def open_bus() -> Bus:
        if mode == "rival":
            make(hub.join("older"))
        return _ReportingBus(hub, "controller", asyncio.get_running_loop())

    try:
        await serve(open_bus, make, report=say, until_eof=mode == "eof")
    except BusError as error:
        say(f"{error.message}; {error.remedy}")


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1]))
