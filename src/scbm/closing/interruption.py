"""Ctrl-C and SIGTERM during closing: the first one ends what is searched for, not what is made of it."""

from __future__ import annotations

import signal
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType


class Interruption:
    """What a command does on Ctrl-C and SIGTERM, as far as it handles them.

    The first signal ends the stage that runs, and all later ones as soon as they show progress. What is done between
    stages is short, and goes on. The second signal raises `KeyboardInterrupt` wherever it comes. Without `handled`,
    Python raises it wherever the first Ctrl-C comes.

    Attributes:
        is_asked: whether a signal has come.
    """

    def __init__(self) -> None:
        self.is_asked = False
        self._stages = 0

    @contextmanager
    def handled(self) -> Iterator[None]:
        """Handle both signals in a block. Ctrl-C stays ignored where a shell ignores it, and so do threads."""
        before = {}
        try:
            for number in (signal.SIGINT, signal.SIGTERM):
                if signal.getsignal(number) is not signal.SIG_IGN:
                    before[number] = signal.signal(number, self._on_signal)
        except ValueError:  # in a thread, which gets no signals
            pass
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    @contextmanager
    def stage(self) -> Iterator[None]:
        """Let the first signal raise `KeyboardInterrupt` in a block."""
        self._stages += 1
        try:
            yield
        finally:
            self._stages -= 1

    def checked(self, progress: Callable[[str], None]) -> Callable[[str], None]:
        """Return a callback for progress that raises `KeyboardInterrupt` in a stage if a signal has come before it."""

        def show(text: str) -> None:
            self.check()
            progress(text)

        return show

    def check(self) -> None:
        """Raise `KeyboardInterrupt` in a stage if a signal has come."""
        if self.is_asked and self._stages:
            raise KeyboardInterrupt

    def _on_signal(self, _: int, __: FrameType | None) -> None:
        is_first, self.is_asked = not self.is_asked, True
        if self._stages or not is_first:
            raise KeyboardInterrupt
