"""The requests in flight, and which replies belong to none of them (semantics 6.2)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection

    from scbm.running.program import RequestLine

_MAX_REMEMBERED = 1_024
"""So many answered requests are remembered, to tell a repeated reply from a late one."""


class Requests:
    """At most one request in flight for each resource; ids are never used twice."""

    def __init__(self) -> None:
        self._lines: dict[int, RequestLine] = {}
        self._answered: dict[int, None] = {}
        self._last = 0
        self.dropped = {"late": 0, "repeated": 0, "unknown": 0}

    @property
    def in_flight(self) -> Collection[RequestLine]:
        """The resources that a reply is awaited from, in the order of asking."""
        return self._lines.values()

    def send(self, line: RequestLine) -> int:
        """A fresh id for a request to a resource."""
        self._last += 1
        self._lines[self._last] = line
        return self._last

    def cancel(self, line: RequestLine) -> int | None:
        """The id of the request that is in flight to a resource, which from now on is not."""
        for request, other in self._lines.items():
            if other is line:
                del self._lines[request]
                return request
        return None

    def answer(self, request: int) -> RequestLine | str:
        """Whom a reply came from; or why it is dropped, which is counted: `late`, `repeated` or `unknown`."""
        line = self._lines.pop(request, None)
        if line is not None:
            self._answered[request] = None
            if len(self._answered) > _MAX_REMEMBERED:
                del self._answered[next(iter(self._answered))]
            return line
        why = "repeated" if request in self._answered else "late" if 0 < request <= self._last else "unknown"
        self.dropped[why] += 1
        return why
