"""The requests in flight, and the replies that match none of them (semantics 6.2)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection

    from scbm.running.compiled_steps import RequestLine

_MAX_REMEMBERED = 1_024
"""Maximum number of answered requests that are kept, to distinguish a repeated reply from a late one."""


class Requests:
    """The requests in flight, at most one for each resource. An id is never used twice.

    Attributes:
        dropped: how many replies were dropped, by the reason: `late`, `repeated`, `unknown`.
    """

    def __init__(self) -> None:
        self._lines: dict[int, RequestLine] = {}
        self._answered: dict[int, None] = {}
        self._last = 0
        self.dropped = {"late": 0, "repeated": 0, "unknown": 0}

    @property
    def in_flight(self) -> Collection[RequestLine]:
        """The resources with a pending request, in the order of their requests."""
        return self._lines.values()

    def send(self, line: RequestLine) -> int:
        """Add a request to a resource, and return its new id."""
        self._last += 1
        self._lines[self._last] = line
        return self._last

    def cancel(self, line: RequestLine) -> int | None:
        """Remove the request in flight to a resource, and return its id; `None` if there is none."""
        for request, other in self._lines.items():
            if other is line:
                del self._lines[request]
                return request
        return None

    def answer(self, request: int) -> RequestLine | str:
        """Remove the request that a reply answers, and return its resource.

        If the reply answers no request in flight, count it as dropped and return why: `late`, `repeated` or `unknown`.
        """
        line = self._lines.pop(request, None)
        if line is not None:
            self._answered[request] = None
            if len(self._answered) > _MAX_REMEMBERED:
                del self._answered[next(iter(self._answered))]
            return line
        why = "repeated" if request in self._answered else "late" if 0 < request <= self._last else "unknown"
        self.dropped[why] += 1
        return why
