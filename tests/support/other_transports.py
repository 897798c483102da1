"""Transports that tests enter in `TRANSPORTS`, which names their functions as text."""

from __future__ import annotations

import asyncio
import os
import signal
from collections.abc import Callable

from scbm.nodes.buses.bus import Bus, BusError, Join
from scbm.nodes.buses.loopback import LoopbackHub


def connect_for_a_moment(_: int, __: Callable[[str], None], ___: str | None) -> Join:
    """A transport whose node is stopped as soon as it is there."""
    hub = LoopbackHub()

    def join(node: str) -> Bus:
        asyncio.get_running_loop().call_soon(os.kill, os.getpid(), signal.SIGINT)
        return hub.join(node)

    return join


def connect_without_middleware(_: int, __: Callable[[str], None], ___: str | None) -> Join:
    """A transport whose middleware is not installed."""
    raise BusError("pyzmq is not installed", "pip install pyzmq", where="ZeroMQ")
