"""The processes of a cell: started, restarted, asked to end, and killed."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from pathlib import Path

from scbm.nodes import Children
from support.loops import run
from support.wording import Wording

LISTENS = [sys.executable, "-c", "import sys; sys.stdin.read()"]
IS_DEAF = [sys.executable, "-c", "import signal; open({path!r}, 'w').close(); signal.pause()"]


def ends_with(code: int) -> list[str]:
    return [sys.executable, "-c", f"raise SystemExit({code})"]


def writes(path: Path) -> list[str]:
    """Prints its identity, once for each start, and ends when it is asked to."""
    return [
        sys.executable,
        "-c",
        f"import os, sys; open({str(path)!r}, 'a').write(f'{{os.getpid()}} '); sys.stdin.read()",
    ]


def pids(path: Path) -> list[int]:
    return [int(word) for word in path.read_text().split()]


def test_all_are_started_once_and_end_when_their_standard_input_does(tmp_path: Path) -> None:
    async def scene() -> None:
        first, second = tmp_path / "first", tmp_path / "second"
        children = Children({"one": writes(first), "two": writes(second)})
        assert await children.start() == ()
        assert await children.start() == ()
        await children.end()
        assert (len(pids(first)), len(pids(second))) == (1, 1)
        assert children.broken is None

    run(scene())


def test_a_terminal_interrupts_none_of_them(tmp_path: Path) -> None:
    async def scene() -> None:
        path = tmp_path / "pids"
        children = Children({"one": writes(path), "two": writes(path)})
        await children.start()
        groups = [os.getpgid(process.pid) for process in children._running.values()]
        assert os.getpgrp() not in groups  # the terminal of ours sends SIGINT to all of this group
        await children.end()

    run(scene())


def test_one_that_was_killed_is_started_again_and_reported(tmp_path: Path, wording: Wording) -> None:
    async def scene() -> None:
        path = tmp_path / "pids"
        children = Children({"the controller": writes(path), "other": LISTENS})
        await children.start()
        running = children._running["the controller"]
        running.send_signal(signal.SIGKILL)
        await children.one_ends()
        assert children.broken is None  # a user stopped it
        (sentence,) = await children.start()
        wording(sentence)
        await children.end()
        assert pids(path)[-1] != running.pid

    run(scene())


def test_one_that_ended_by_itself_with_an_error_cannot_work(wording: Wording) -> None:
    async def scene() -> None:
        children = Children({"the controller": ends_with(3), "other": LISTENS})
        await children.start()
        await children.one_ends()
        assert children.broken is not None
        wording(children.broken)
        await children.end()

    run(scene())


def test_nobody_ends_unless_somebody_does() -> None:
    async def scene() -> None:
        children = Children({"one": LISTENS})
        await children.start()
        waiting = asyncio.ensure_future(children.one_ends())
        await asyncio.sleep(0)
        assert not waiting.done()
        await children.end()
        await waiting

    run(scene())


def test_one_that_does_not_listen_is_killed(tmp_path: Path) -> None:
    async def scene() -> None:
        path = str(tmp_path / "there")
        children = Children({"deaf": [part.format(path=path) for part in IS_DEAF]}, end_s=0.01)
        await children.start()
        await children.end()
        assert children._running["deaf"].returncode == -signal.SIGKILL

    run(scene())
