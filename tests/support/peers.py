"""Programs that know nothing of scbm, for tests to speak with: built from `tests/peers` once per session."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import Empty, Queue
from threading import Thread

import pytest

from support.domains import LOOPBACK
from support.loops import LINE_GUARD_S

SOURCES = Path(__file__).parents[1] / "peers"
TOOLS = ("cc", "idlc")

LEASE_1S = LOOPBACK.replace("</Discovery>", "<LeaseDuration>1s</LeaseDuration></Discovery>")
"""For `CYCLONEDDS_URI`: a process that is killed is noticed within a second."""

FLAGS = ("-std=c11", "-D_GNU_SOURCE", "-O1", "-Wall", "-Wextra", "-Werror")


@pytest.fixture(scope="session")
def scanner_program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The driver of the example's scanner, built.

    Without a compiler, Debian's `cyclonedds-tools` or its `cyclonedds-dev` the tests that need it are skipped; with
    SCBM_ALL_TOOLS=1 they fail.
    """
    missing = [tool for tool in TOOLS if shutil.which(tool) is None]
    if not missing and not _compiles("#include <dds/dds.h>"):
        missing = ["cyclonedds-dev"]
    if missing and os.environ.get("SCBM_ALL_TOOLS") == "1":
        pytest.fail(f"not installed: {', '.join(missing)}; SCBM_ALL_TOOLS=1 says that it is there")
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)}")
    return _built(tmp_path_factory.mktemp("peers"))


def _compiles(text: str) -> bool:
    command = ["cc", "-E", "-x", "c", "-o", os.devnull, "-"]
    return subprocess.run(command, input=text, text=True, capture_output=True, check=False).returncode == 0


def _built(directory: Path) -> Path:
    program = directory / "scanner"
    # -t: without type information. Cyclone DDS 0.10 does not understand that of 11, and matches no peer that has it if
    # it has some itself. ROS 2 has none either.
    for command in (
        ["idlc", "-t", "-l", "c", str(SOURCES / "messages.idl")],
        ["cc", *FLAGS, "-I.", "-o", str(program), str(SOURCES / "scanner.c"), "messages.c", "-lddsc"],
    ):
        subprocess.run(command, cwd=directory, check=True)
    return program


class Peer:
    """A program at work.

    Attributes:
        process: of the operating system.
    """

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self._lines: Queue[str | None] = Queue()
        self._reader = Thread(target=self._read, name="lines of a peer", daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._lines.put(line.rstrip("\n"))
        self._lines.put(None)

    def kill(self) -> None:
        """End it at once, if it has not ended, without a goodbye."""
        self.process.kill()
        self.process.wait()
        self._reader.join()

    def says(self, *texts: str, guard_s: float = LINE_GUARD_S) -> None:
        """Wait for these lines of output, in any order, and drop the lines between them.

        Fail if the peer ends, or does not print them in time.
        """
        received: list[str] = []
        until = time.monotonic() + guard_s
        while not all(text in received for text in texts):
            try:
                line = self._lines.get(timeout=max(0.0, until - time.monotonic()))
            except Empty:
                raise AssertionError(f"for {guard_s:g} s the peer printed {received}, and not {texts}") from None
            if line is None:
                raise AssertionError(f"the peer ended, and its output was {received} instead of {texts}")
            received.append(line)


@contextmanager
def peer(program: Path, domain: int, *options: object, uri: str = LOOPBACK) -> Iterator[Peer]:
    """Starts it in a domain, and kills it at the end."""
    command = [str(program), "--domain", str(domain), *map(str, options)]
    environment = {**os.environ, "CYCLONEDDS_URI": uri}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment) as process:
        started = Peer(process)
        try:
            yield started
        finally:
            started.kill()
