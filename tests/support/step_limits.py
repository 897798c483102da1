"""A limit on the steps of Python code, so that a test finds a hang without looking at a clock."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType


@contextmanager
def step_limit(calls: int) -> Iterator[None]:
    """Raise `AssertionError` in the code within once it has made more than `calls` calls of functions.

    Code that catches the error does not hide it: it is raised again at the end.
    """
    left = calls
    last = ""

    def count(frame: FrameType, event: str, _: object) -> None:
        nonlocal left, last
        if event == "call":
            left -= 1
            if left < 0:
                last = frame.f_code.co_qualname
                raise AssertionError

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        yield
    finally:
        sys.setprofile(before)
        if last:
            raise AssertionError(f"more than {calls:,} calls, the last one of {last}")
