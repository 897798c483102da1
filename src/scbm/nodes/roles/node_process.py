"""Nodes as processes: this one serves until it is stopped, and then leaves its cell; others are child processes.

A process notices that it did not run for a while: it was stopped, or its machine slept. Others have missed it then, and
it may have missed them. What two participants of DDS know of each other after that is not always whole again; a new
participant has no such history.

Child processes are started, watched, restarted and ended.
"""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from asyncio.subprocess import DEVNULL, PIPE, Process
from dataclasses import dataclass, field
from math import inf
from signal import Signals
from threading import Event, Thread
from time import monotonic_ns
from typing import TYPE_CHECKING, Protocol

from scbm.nodes.buses.bus import BusError

if TYPE_CHECKING:
    from asyncio import AbstractEventLoop
    from collections.abc import Awaitable, Callable, Mapping, Sequence

    from scbm.nodes.buses.bus import Bus
    from scbm.nodes.roles.cell_topics import Membership


_LOOK_S = 0.2
_ANNOUNCEMENTS = 5
"""Each node announces itself so often in one lease. Peers count the lease from the last announcement they heard."""


def _missed_after_ns(lease_ns: int | None) -> float:
    """Return how long a process may be stopped before its peers may count it as lost."""
    return inf if lease_ns is None else lease_ns - lease_ns // _ANNOUNCEMENTS


class AbsenceWatch:
    """Detects by a clock in a thread of its own that the process was stopped; a busy event loop does not count."""

    def __init__(self, loop: AbstractEventLoop, lease_ns: int | None, was_away: Callable[[], None]) -> None:
        """Start. `was_away` is called once, on the loop; never if there is no lease."""
        self._loop = loop
        self._missed_after_ns = _missed_after_ns(lease_ns)
        self._was_away = was_away
        self._is_over = Event()
        self._last_ns = monotonic_ns()
        Thread(target=self._look, name="absence", daemon=True).start()

    @property
    def has_noticed(self) -> bool:
        """Whether the process was stopped, even if the callback has not run yet."""
        return monotonic_ns() - self._last_ns > self._missed_after_ns

    def close(self) -> None:
        """Stop."""
        self._is_over.set()

    def _look(self) -> None:
        while not self._is_over.wait(_LOOK_S):
            now_ns = monotonic_ns()
            if now_ns - self._last_ns > self._missed_after_ns:
                self._loop.call_soon_threadsafe(self._was_away)
                return
            self._last_ns = now_ns


_SWITCH_S = 0.0005
"""The switch interval while a thread plans: Python's own 5 ms would delay every message by that much."""


class ServedNode(Protocol):
    """A node that a process serves."""

    membership: Membership

    async def close(self) -> None:
        """Give up the run."""
        ...


async def serve(
    open_bus: Callable[[], Awaitable[Bus]],
    make: Callable[[Bus], ServedNode],
    *,
    report: Callable[[str], None],
    until_eof: bool,
    alone: str | None = None,
) -> bool:
    """Serve a node until SIGINT or SIGTERM, or until the standard input ends.

    It also ends, and has to be served again, when the process was stopped for so long that its peers may have lost it.

    Args:
        open_bus: joins the cell.
        make: creates the node.
        report: gets a line when the node has joined.
        until_eof: whether the end of the standard input ends it too.
        alone: what to report if no other node is found; `None` for nothing.

    Returns:
        Whether the node is to join its cell again.

    Raises:
        BusError: the bus cannot be opened, or an older node has this one's place in the cell.
    """
    sys.setswitchinterval(_SWITCH_S)
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for name in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(name, stop.set)
    was_away = asyncio.Event()

    def leave() -> None:
        was_away.set()
        stop.set()

    bus = await open_bus()
    watch = AbsenceWatch(loop, bus.lease_ns, leave)
    try:
        node = make(bus)
        node.membership.report_if_alone(alone, report)
        node.membership.changed = lambda: stop.set() if node.membership.rival() else None
        if until_eof:
            _watch_stdin(stop)
        report(f"{node.membership.own.role} of `{node.membership.own.model}`, {bus.words}")
        await stop.wait()
        await node.close()
        if was_away.is_set():
            report("it was stopped for a while, and rejoins the cell")
            return True
        rival = node.membership.rival()
        if rival is not None:
            raise BusError(
                f"{_place(rival.role, rival.resources)} of `{rival.model}` is already in {bus.words}: {rival.words}",
                "stop it, or choose another domain with `--domain`",
            )
    finally:
        watch.close()
        await bus.close()
    return False


def _place(role: str, resources: tuple[str, ...]) -> str:
    return f"a {role}" if role != "resources" else f"a node of {', '.join(resources)}"


def _watch_stdin(stop: asyncio.Event) -> None:
    try:
        asyncio.get_running_loop().add_reader(sys.stdin.fileno(), _drain, stop)
    except PermissionError:  # a file, or /dev/null: no process holds it open that could end
        stop.set()


def _drain(stop: asyncio.Event) -> None:
    if not os.read(sys.stdin.fileno(), 4096):
        asyncio.get_running_loop().remove_reader(sys.stdin.fileno())
        stop.set()


@dataclass
class Children:
    """Child processes by name, each with its command line; they end with this process, however it ends.

    Attributes:
        commands: they take the end of their standard input as the end.
        end_s: so long they may take to end before they are killed.
    """

    commands: Mapping[str, Sequence[str]]
    end_s: float = 5.0
    _running: dict[str, Process] = field(default_factory=dict)

    async def start(self) -> tuple[str, ...]:
        """Start the children that do not run; return the names of those that had ended by themselves."""
        ended = []
        for name, command in self.commands.items():
            process = self._running.get(name)
            if process is not None and process.returncode is None:
                continue
            if process is not None:
                ended.append(f"{name} {_end(process.returncode)}")
            # In a process group of its own: Ctrl-C at the terminal is for this process alone, which ends its children.
            self._running[name] = await asyncio.create_subprocess_exec(
                *command, stdin=PIPE, stdout=DEVNULL, process_group=0
            )
        return tuple(ended)

    @property
    def broken(self) -> str | None:
        """The child that ended by itself, with the reason that it printed; `None` if there is none."""
        codes = ((name, process.returncode) for name, process in self._running.items())
        return next((f"{name} {_end(code)}" for name, code in codes if code is not None and code > 0), None)

    async def one_ends(self) -> None:
        """Wait until a child ends by itself."""
        waits = [asyncio.ensure_future(process.wait()) for process in self._running.values()]
        try:
            await asyncio.wait(waits, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for wait in waits:
                wait.cancel()

    async def end(self) -> None:
        """End all children: close their standard input, and kill those that still run after a timeout."""
        for process in self._running.values():
            if process.stdin is not None:
                process.stdin.close()
        for process in self._running.values():
            try:
                async with asyncio.timeout(self.end_s):
                    await process.wait()
            except TimeoutError:
                process.kill()
                await process.wait()


def _end(code: int | None) -> str:
    return f"was ended by {Signals(-code).name}" if code is not None and code < 0 else f"ended with exit code {code}"
