"""Logs of runs over nodes as a store keeps them: the text of a log file, compressed."""

from __future__ import annotations

from zlib import compress, decompressobj
from zlib import error as damaged

MAX_BYTES = 256 * 1024 * 1024
"""A log may be so large, as in a file."""


def packed_log(text: str) -> bytes:
    """A log, compressed. Raises `ValueError` if it is larger than any that is read."""
    data = text.encode()
    if len(data) > MAX_BYTES:
        raise ValueError("the log is too large")
    return compress(data)


def unpacked_log(packed: bytes) -> str:
    """The text of a log. Raises `ValueError` if this is none, is damaged, or would be too large."""
    unpacking = decompressobj()
    try:
        data = unpacking.decompress(packed, MAX_BYTES)
    except damaged:
        raise ValueError("the log is damaged") from None
    if not unpacking.eof or unpacking.unused_data:
        raise ValueError("the log is cut off, or too large")
    return data.decode()
