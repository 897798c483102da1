"""The log of Cyclone DDS: the reasons why it does not start, and warnings later.

Its error codes do not give the reasons. It writes them to the `stderr` that C has when it logs for the first time, and
what a domain has to say to the one that C has when the first participant of the domain is created.
"""

from __future__ import annotations

import ctypes
import os
import re
import sys
from contextlib import contextmanager
from functools import cache
from tempfile import TemporaryFile
from threading import Lock
from typing import TYPE_CHECKING

from scbm.nodes.buses.bus import BusError

if TYPE_CHECKING:
    from collections.abc import Iterator

LOG_FILE = "SCBM_DDS_LOG"
"""The environment variable that names a file for the log of Cyclone DDS; without it later warnings are lost."""

_LINE = re.compile(r"\d+\.\d+ \[\d*\] +[^:]*: (.*)")
"""`1795295511.554664 [99]     python: Failed to find a free participant index for domain 99`"""

_STDERR = 2

_STDERR_IS_ONE = Lock()
"""There is one `stderr` in a process, and what two threads do to it must not cross."""


@contextmanager
def captured_log(lines: list[str]) -> Iterator[None]:
    """Collect the lines that Cyclone DDS logs in the block, also if the block ends by an error.

    What it logs later, through a domain that was created in the block, goes to the file of `SCBM_DDS_LOG`, and never to
    the terminal. Lines of others in the block go to the terminal when it is left.

    Raises `BusError` if there can be no such file.
    """
    with _STDERR_IS_ONE, TemporaryFile() as file:
        asked = _asked_file()
        terminal = os.dup(_STDERR)
        os.dup2(file.fileno(), _STDERR)
        try:
            with _stderr_of_domains(file.fileno(), asked):
                yield
        finally:
            os.dup2(terminal, _STDERR)
            os.close(terminal)
            file.seek(0)
            text = file.read()
            os.write(asked, text)
            os.close(asked)
            for line in text.decode(errors="replace").splitlines():
                _sort(line, lines)


def _asked_file() -> int:
    """Return the descriptor of the file that the user asks for, or of one that keeps nothing."""
    path = os.environ.get(LOG_FILE) or os.devnull
    try:
        return os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    except OSError as error:
        why = (error.strerror or str(error)).lower()
        raise BusError(f"`{path}` cannot have the log of Cyclone DDS: {why}", f"correct `{LOG_FILE}`") from error


@contextmanager
def _stderr_of_domains(now: int, later: int) -> Iterator[None]:
    """Give domains that are created in the block a `stderr` of C that writes to `now`, and to `later` after the block.

    Python, other libraries and child processes keep theirs. Windows has no such variable.
    """
    if sys.platform == "win32":
        yield
        return
    own, stream = _own_stream()
    stderr = ctypes.c_void_p.in_dll(ctypes.CDLL(None), "__stderrp" if sys.platform == "darwin" else "stderr")
    before, stderr.value = stderr.value, stream
    os.dup2(now, own)
    try:
        yield
    finally:
        stderr.value = before
        os.dup2(later, own)


@cache
def _own_stream() -> tuple[int, int]:
    """Return the descriptor and the C stream of Cyclone DDS, which keeps the first one that it gets."""
    library = ctypes.CDLL(None)
    library.fdopen.restype = ctypes.c_void_p
    library.setvbuf.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int, ctypes.c_size_t)
    own = os.dup(_STDERR)
    stream: int = library.fdopen(own, b"a")
    library.setvbuf(stream, None, _UNBUFFERED, 0)
    return own, stream


_UNBUFFERED = 2
"""`_IONBF` of C, on all systems that have `fdopen`."""


def _sort(line: str, lines: list[str]) -> None:
    match = _LINE.fullmatch(line)
    if match is None:
        sys.stderr.write(f"{line}\n")
    else:
        lines.append(match[1])
