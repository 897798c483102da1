"""An action server that does what a test says, over any bus: three services and two topics."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import TypeAlias
from uuid import UUID

from scbm.nodes.buses.bus import Bus, Service, Topic
from scbm.nodes.links.goals import GoalStatus
from scbm.nodes.types.cdr import Message
from scbm.nodes.types.definitions import CANCEL_GOAL, GOAL_STATUS_ARRAY, ActionDefinition

Values: TypeAlias = Mapping[str, object]


class ActionServer:
    """A server that keeps what it is asked, and answers when it is told to.

    Attributes:
        goals: the ids of the goals in the order in which they came, with their fields.
        cancels: the ids of the goals that are to be cancelled.
        watched: the ids of the goals whose results are asked for, once they are accepted.
        accepts: whether goals are accepted or rejected at once; `None` if a test says so later.
        refuses_cancel: whether cancellations are refused.
    """

    def __init__(self, bus: Bus, name: str, kind: ActionDefinition, *, says_status: bool = True) -> None:
        """Serve; `says_status` is whether it says that it has no goals, which those of rclpy do not."""
        self.goals: dict[UUID, Message] = {}
        self.cancels: list[UUID] = []
        self.watched: list[UUID] = []
        self.accepts: bool | None = True
        self.refuses_cancel = False
        self._asked = asyncio.Event()
        self._accepted: dict[UUID, asyncio.Future[Values]] = {}
        self._results: dict[UUID, asyncio.Future[Values]] = {}
        self._statuses: dict[UUID, GoalStatus] = {}
        bus.serve(Service(f"{name}/_action/send_goal", kind.send_goal), self._take)
        bus.serve(Service(f"{name}/_action/get_result", kind.get_result), self._result)
        bus.serve(Service(f"{name}/_action/cancel_goal", CANCEL_GOAL), self._cancel)
        self._feedback = bus.publisher(Topic(f"{name}/_action/feedback", kind.feedback_message))
        self._status = bus.publisher(Topic(f"{name}/_action/status", GOAL_STATUS_ARRAY, is_latched=True))
        if says_status:
            self._status.publish({"status_list": []})

    async def until(self, is_so: Callable[[], bool]) -> None:
        """Wait until something is so that only a request can make so."""
        while not is_so():
            self._asked.clear()
            await self._asked.wait()

    def accept(self, which: UUID, *, accepted: bool = True) -> None:
        """Answer a goal."""
        if accepted:
            self.has(which, GoalStatus.EXECUTING)
        self._accepted[which].set_result({"accepted": accepted})

    def end(self, which: UUID, status: GoalStatus, **result: object) -> None:
        """End a goal, with its status and its result."""
        self.has(which, status)
        self._results[which].set_result({"status": int(status), "result": result})

    def has(self, which: UUID, status: GoalStatus) -> None:
        """Publish the status of a goal."""
        self._statuses[which] = status
        entries = [_entry(known, int(each)) for known, each in self._statuses.items()]
        self._status.publish({"status_list": entries})

    def feed_back(self, which: UUID, **feedback: object) -> None:
        """Publish feedback for a goal."""
        self._feedback.publish({"goal_id": {"uuid": which.bytes}, "feedback": feedback})

    def _take(self, request: Message) -> asyncio.Future[Values]:
        which = UUID(bytes=bytes(request.goal_id.uuid))
        assert which not in self.goals, "a goal came twice"
        self.goals[which] = request.goal
        self._asked.set()
        self._accepted[which] = asyncio.get_running_loop().create_future()
        self._results[which] = asyncio.get_running_loop().create_future()
        if self.accepts is not None:
            self.accept(which, accepted=self.accepts)
        return self._accepted[which]

    def _result(self, request: Message) -> Values | asyncio.Future[Values]:
        which = UUID(bytes=bytes(request.goal_id.uuid))
        if which not in self._results:
            return {"status": int(GoalStatus.UNKNOWN)}
        self.watched.append(which)
        self._asked.set()
        return self._results[which]

    def _cancel(self, request: Message) -> Values:
        which = UUID(bytes=bytes(request.goal_info.goal_id.uuid))
        self.cancels.append(which)
        self._asked.set()
        if self.refuses_cancel:
            return {"return_code": 1}
        self.has(which, GoalStatus.CANCELING)
        return {"return_code": 0, "goals_canceling": [{"goal_id": {"uuid": which.bytes}}]}


def _entry(which: UUID, status: int) -> Values:
    return {"goal_info": {"goal_id": {"uuid": which.bytes}}, "status": status}
