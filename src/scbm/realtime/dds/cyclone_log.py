"""What Cyclone DDS says while it starts: it gives codes that say nothing, and writes the reason to stderr."""

from __future__ import annotations

import os
import re
import sys
from contextlib import contextmanager
from tempfile import TemporaryFile
from threading import Lock
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

_STDERR = 2
_LINE = re.compile(r"\d+\.\d+ \[\d*\] +[^:]*: (.*)")
"""`1795295511.554664 [99]     python: Failed to find a free participant index for domain 99`"""

_STDERR_IS_ONE = Lock()
"""There is one stderr in a process, and what two threads do to it must not cross."""


@contextmanager
def heard(lines: list[str]) -> Iterator[None]:
    """Puts the lines that Cyclone DDS writes meanwhile into a list, when the block is left, by an error too.

    The library has no other way out for them; what others write there meanwhile goes there when the block is left.
    """
    with _STDERR_IS_ONE, TemporaryFile() as file:
        kept = os.dup(_STDERR)
        os.dup2(file.fileno(), _STDERR)
        try:
            yield
        finally:
            os.dup2(kept, _STDERR)
            os.close(kept)
            file.seek(0)
            for line in file.read().decode(errors="replace").splitlines():
                _sort(line, lines)


def _sort(line: str, lines: list[str]) -> None:
    match = _LINE.fullmatch(line)
    if match is None:
        sys.stderr.write(f"{line}\n")
    else:
        lines.append(match[1])
