"""Logs of runs over nodes as stores keep them: the texts of log files, compressed."""

from __future__ import annotations

from zlib import compress, decompressobj
from zlib import error as damaged

MAX_LOG_BYTES = 256 * 1024 * 1024
"""A log may be so large, as in a file."""


def packed_log(text: str) -> bytes:
    """Return a log, compressed; raise `ValueError` if it is larger than any that is read."""
    data = text.encode()
    if len(data) > MAX_LOG_BYTES:
        raise ValueError("the log is too large")
    return compress(data)


def unpacked_log(packed: bytes) -> str:
    """Return the text of a log; raise `ValueError` if this is none, is damaged, or would be too large."""
    unpacking = decompressobj()
    try:
        data = unpacking.decompress(packed, MAX_LOG_BYTES)
    except damaged:
        raise ValueError("the log is damaged") from None
    if not unpacking.eof or unpacking.unused_data:
        raise ValueError("the log is cut off, or too large")
    return data.decode()
