"""Opens the files that commands read: regular files only, as a pipe would block and a device may never end."""

from __future__ import annotations

import errno
import os
import stat
from typing import IO, TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

_KINDS = (
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


def open_input(path: Path) -> IO[bytes]:
    """Open a regular file, or a symbolic link to one, for reading.

    Raises:
        OSError: the file cannot be opened, or is no regular file. The kind of the file is known before it is opened, as
            opening a pipe waits for a writer.
    """
    mode = path.stat().st_mode
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(mode):
        kind = next((noun for is_kind, noun in _KINDS if is_kind(mode)), "no file")
        raise OSError(errno.EINVAL, f"it is {kind}, and only regular files are read", str(path))
    return path.open("rb")
