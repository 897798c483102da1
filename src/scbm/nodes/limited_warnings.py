"""Warnings of nodes, few of each kind: any program of the domain can send messages that nodes complain about."""

from __future__ import annotations

import re
from time import monotonic_ns
from typing import TYPE_CHECKING

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Callable

_MAX_AT_ONCE = 5
"""The number of warnings of a kind that are all shown."""

_PERIOD_NS = 10 * 10**9
"""Beyond them one is shown in each period."""

_MAX_KINDS = 50
"""The number of kinds that are distinguished; the texts of messages could make any number of them."""

_DETAILS = re.compile(r"`[^`]*`|[0-9]+")


class _ShownWarnings(Struct):
    """The warnings of one kind: how many were shown, how many were not since then, and when the last one was shown."""

    shown: int = 0
    hidden: int = 0
    shown_ns: int = 0


class LimitedWarnings:
    """Shows warnings, and counts those of a kind that has too many. A kind is the text before a colon, less details."""

    def __init__(self, show: Callable[[str], None], now_ns: Callable[[], int] = monotonic_ns) -> None:
        self._show = show
        self._now_ns = now_ns
        self._kinds: dict[str, _ShownWarnings] = {}

    def __call__(self, words: str) -> None:
        """Show a warning, or count it."""
        kind = _DETAILS.sub("…", words.partition(": ")[0])
        if len(self._kinds) >= _MAX_KINDS and kind not in self._kinds:
            kind = "others"
        known, now_ns = self._kinds.setdefault(kind, _ShownWarnings()), self._now_ns()
        if known.shown >= _MAX_AT_ONCE and now_ns - known.shown_ns < _PERIOD_NS:
            known.hidden += 1
            return
        self._show(f"{words} (and {known.hidden} more of this kind before)" if known.hidden else words)
        known.shown, known.hidden, known.shown_ns = known.shown + 1, 0, now_ns

    def close(self) -> None:
        """Show how many warnings were not shown."""
        for kind, known in self._kinds.items():
            if known.hidden:
                self._show(f"{known.hidden} more of this kind: {kind}")
        self._kinds.clear()
