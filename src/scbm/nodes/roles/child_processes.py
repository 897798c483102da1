"""The other nodes of a cell as child processes: started, watched, restarted, ended."""

from __future__ import annotations

import asyncio
from asyncio.subprocess import DEVNULL, PIPE, Process
from dataclasses import dataclass, field
from signal import Signals
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


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
    return f"was ended by {Signals(-code).name}" if code is not None and code < 0 else f"ended with {code}"
