"""The tester that a node serves: one at a time, and none that prepares a run without starting it."""

from __future__ import annotations

import asyncio
from collections import deque
from typing import TYPE_CHECKING

from scbm.nodes.node_messages import Busy, Refused

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.nodes.node_messages import Prepare
    from scbm.nodes.roles.cell_topics import NodeContext

_MAX_DROPPED = 1_000
"""Maximum number of dropped runs that are refused if they are prepared again."""


class ServedTester:
    """The tester whose run a node has prepared or carries out, if there is one.

    Attributes:
        source: identifies the tester among the publishers of its topic; `None` while the node serves none.
    """

    def __init__(self, context: NodeContext, drop: Callable[[], None]) -> None:
        """`drop` is called when the tester has not started its run in time; it gives up the run."""
        self.source: int | None = None
        self._node = context.status.node
        self._now_ns = context.now_ns
        self._start_within_s = context.start_within_s
        self._report = context.report
        self._drop = drop
        self._name = ""
        self._since_ns = 0
        self._timer: asyncio.TimerHandle | None = None
        self._dropped: deque[str] = deque(maxlen=_MAX_DROPPED)

    def refusal(self, message: Prepare, source: int) -> Busy | Refused | None:
        """Return the answer to a tester whose run cannot be prepared now; `None` if it can."""
        if message.run in self._dropped:
            return Refused(message.run, self._node, f"it was not started within {self._start_within_s:g} s")
        if self.source in (None, source):
            return None
        return Busy(message.run, self._node, self._name, self._now_ns() - self._since_ns)

    def hold(self, message: Prepare, source: int) -> None:
        """Serve a tester that prepares a run, until `release`; drop it unless `start` follows in time."""
        self.release()
        self.source, self._name, self._since_ns = source, message.tester, self._now_ns()
        self._timer = asyncio.get_running_loop().call_later(self._start_within_s, self._drop_run, message.run)

    def start(self) -> None:
        """Serve the tester as long as its run lasts."""
        if self._timer is not None:
            self._timer.cancel()

    def release(self) -> None:
        """Serve no tester."""
        self.start()
        self.source = None

    def _drop_run(self, run: str) -> None:
        self._report(f"another tester can come: {self._name} has not started its run within {self._start_within_s:g} s")
        self._dropped.append(run)
        self._drop()
