"""A resource that is reached by actions: a goal is a request, and its end the reply.

An action is three services and two topics, over every bus: rcl_action adds nothing of its own.
"""

from __future__ import annotations

import asyncio
from collections import deque
from itertools import chain
from typing import TYPE_CHECKING
from uuid import UUID

from msgspec import Struct, field

from scbm.nodes.bindings.ros_binding import ActionCall, binding_of, request_values
from scbm.nodes.buses.bus import BusError, Service, Topic, Unmatched, UnmatchedKind
from scbm.nodes.links.goals import (
    CANCEL_TOO_LATE,
    Goal,
    GoalStatus,
    active_among,
    goal_id,
    id_at,
    position_of,
    statuses_of,
)
from scbm.nodes.links.link import Measurement, PresenceMonitor, Reply
from scbm.nodes.links.measured_topics import outcome_of, values_of
from scbm.nodes.types.definitions import CANCEL_GOAL, GOAL_STATUS_ARRAY
from scbm.testing.real_drivers import GoalFate

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.cases.trace import Changes
    from scbm.nodes.buses.bus import Answered, Bus, Client, Received, Subscription
    from scbm.nodes.links.link import Correlation, LinkContext

_MAX_DONE = 100
"""The number of own goals that are known when they are over."""

_SETTLES_S = 1.0
"""Maximum time in which the latched status of a server comes; one that has never had a goal sends none."""

_ENDS: dict[int, GoalFate] = {
    GoalStatus.SUCCEEDED: GoalFate.SUCCEEDED,
    GoalStatus.CANCELED: GoalFate.CANCELLED,
    GoalStatus.ABORTED: GoalFate.ABORTED,
}


class ActionLink:
    """Sends goals, and passes their results on as replies.

    - A goal waits until its server is there and has no other active goal, unless it is cancelled before; then it is
      sent, once. A goal of another program that is active counts as a resource that is not there.
    - After a cancellation the request is over for the model, and the link cancels the goal: at once, or as soon as it
      is accepted. It keeps watching the goal, and the next goal to this server waits until that is over. If that goal
      goes on after its run, the resource counts as not there.
    - A server that is lost gives no reply, as with services; the deadlines of the model decide.
    - A request that carries a value without an action has failed.
    """

    def __init__(self, context: LinkContext) -> None:
        """Made once for each resource that is bound to actions, on the event loop of the bus."""
        binding = binding_of(context.resource).requests
        assert binding is not None  # noqa: S101 - checked by the caller
        self._requests = binding
        self._context = context
        self._presence = PresenceMonitor(context.resource.name, context.listener, lambda: self.is_there)
        self._servers = {call.name: _ActionServer(call, self) for call in binding.actions}
        for server in self._servers.values():
            server.open(context.bus)

    @property
    def is_there(self) -> bool:
        """Whether all parts of all actions have one server, with no active goal of another program or earlier run."""
        return all(server.is_free for server in self._servers.values())

    @property
    def missing(self) -> tuple[str, ...]:
        """The services and topics without a server."""
        return tuple(part.name for server in self._servers.values() for part in server.lonely())

    def send(self, request: Correlation, values: Changes) -> None:
        """Send the goal of a request, as soon as its server is there and free."""
        call = self._requests.call_for(values)
        if not isinstance(call, ActionCall):
            asyncio.get_running_loop().call_soon(self.reply, request, self._context.now_ns())
            return
        goal = Goal(request, call, request_values(call.goal, dict(values)), goal_id(request))
        self._servers[call.name].send(goal)

    def cancel(self, request: Correlation) -> None:
        """Cancel a request: its goal is not sent, or is cancelled at its server."""
        for server in self._servers.values():
            server.cancel(request)

    def end_run(self) -> bool:
        """Cancel the goals of a run that is over; return whether one of them is active."""
        return sum(server.end_run() for server in self._servers.values()) > 0

    def why_unmatched(self) -> Unmatched | None:
        """Return why a part has no server, if it is known, that it has several, or whose goal keeps a server busy."""
        reasons = chain.from_iterable(server.troubles() for server in self._servers.values())
        lonely = (part for server in self._servers.values() for part in server.lonely())
        return Unmatched.by_all([*reasons, *map(self._context.bus.why_unmatched, lonely)])

    # callbacks of servers

    def reply(self, request: Correlation, stamp_ns: int, measured: Changes = (), *, succeeded: bool = False) -> None:
        """Pass a reply on."""
        name = self._context.resource.name
        self._context.listener.on_reply(name, Reply(request, succeeded, measured, stamp_ns))

    def measure(self, values: Changes, stamp_ns: int) -> None:
        """Pass on what feedback measures."""
        self._context.listener.on_values(self._context.resource.name, Measurement(values, stamp_ns))

    def count(self, goal: Goal, fate: GoalFate | None) -> None:
        """Pass on what became of a goal; nothing for an end that its server does not know."""
        if fate is not None:
            self._context.count(goal.request, fate)

    def within_s(self, goal: Goal) -> float:
        """Return how long a goal may go on after its cancellation."""
        return self._context.within_s(goal.request)

    def look(self) -> None:
        """Handle a change of presence."""
        self._presence.update()

    def warn(self, words: str) -> None:
        """Warn of what is wrong with the server."""
        self._context.warn(f"`{self._context.resource.name}`: {words}")


class _ActionServer(Struct, eq=False):
    """One action with the goal that is sent, and those that wait.

    Attributes:
        action: the action.
        link: gets replies, feedback and warnings.
        goal: the goal that was sent last, until it is over.
        waiting: the others, in the order in which they came.
        sent: the goal of each call that sends one, by the number of the call.
        asked: the goal of each call for a result.
        cancelled: the goal of each call that cancels one.
        others: the ids of active goals of other programs; `None` until they are known.
        done: the last own goals that are over, which a late status may list as active.
        is_whole: whether each part has one server.
        was_crowded: whether several servers have been there since there was one: that of the goal may have left.
    """

    action: ActionCall
    link: ActionLink
    goal: Goal | None = None
    waiting: list[Goal] = field(default_factory=list)
    sent: dict[int, Goal] = field(default_factory=dict)
    asked: dict[int, Goal] = field(default_factory=dict)
    cancelled: dict[int, Goal] = field(default_factory=dict)
    others: tuple[UUID, ...] | None = None
    done: deque[bytes] = field(default_factory=lambda: deque(maxlen=_MAX_DONE))
    is_whole: bool = False
    was_crowded: bool = False
    _clients: tuple[tuple[Service, Client], ...] = ()
    _topics: tuple[tuple[Topic, Subscription], ...] = ()

    def open(self, bus: Bus) -> None:
        """Make the endpoints."""
        name, kind = f"{self.action.name}/_action", self.action.type
        services = (
            (Service(f"{name}/send_goal", kind.send_goal), self._answered),
            (Service(f"{name}/get_result", kind.get_result), self._resulted),
            (Service(f"{name}/cancel_goal", CANCEL_GOAL), self._cancel_answered),
        )
        self._clients = tuple((which, bus.client(which, receive, self._matched)) for which, receive in services)
        feedback = Topic(f"{name}/feedback", kind.feedback_message)
        status = Topic(f"{name}/status", GOAL_STATUS_ARRAY, is_latched=True, is_raw=True)
        self._topics = (
            (feedback, bus.subscribe(feedback, self._fed_back, self._matched)),
            (status, bus.subscribe(status, self._has_status, self._status_matched)),
        )

    # presence

    @property
    def _parts(self) -> tuple[tuple[Service | Topic, Client | Subscription], ...]:
        return (*self._clients, *self._topics)

    @property
    def is_free(self) -> bool:
        """Whether goals can be sent, but for own ones that are active in a run."""
        return self.is_whole and self.others == () and (self.goal is None or not self.goal.is_left)

    def lonely(self) -> Iterator[Service | Topic]:
        """Yield the parts without a server."""
        yield from (part for part, end in self._parts if not end.peers)

    def troubles(self) -> Iterator[Unmatched]:
        """Yield that a part has several servers, and that a goal is active that must be over first."""
        most = max((end.peers for _, end in self._parts), default=0)
        if most > 1:
            names = ", ".join(self._clients[0][1].server_names())
            why = f"`{self.action.name}` has {most} servers, and each would carry out every goal"
            yield Unmatched(f"{why}: {names}" if names else why, UnmatchedKind.CROWDED)
        if self.is_whole and self.others is None:
            yield Unmatched(f"it is not known yet whether `{self.action.name}` has active goals")
        busy = f"`{self.action.name}` is busy with goal"
        for other in self.others or ():
            yield Unmatched(f"{busy} {other} of another program", UnmatchedKind.BUSY)
        if self.goal is not None and self.goal.is_left:
            of = f"of request {self.goal.request.number} of an earlier run"
            yield Unmatched(f"{busy} {self.goal.id} {of}, which was cancelled and is not over", UnmatchedKind.BUSY)

    def _matched(self, _: int) -> None:
        if self.goal is not None and any(not end.peers for _, end in self._clients):
            self.link.warn(f"the server of `{self.action.name}` is lost with {self.goal.words}")
            self._finish()
        peers = [end.peers for _, end in self._parts]
        self.is_whole = bool(self._topics) and {*peers} == {1}
        self.was_crowded |= max(peers) > 1
        if self.is_whole and self.was_crowded:
            self.was_crowded = False
            self._look_for_goal()
        if self.is_whole and self.others is None:
            asyncio.get_running_loop().call_later(_SETTLES_S, self._settle)
        self._advance()
        self.link.look()

    def _look_for_goal(self) -> None:
        """Ask the server that is left whether it has the goal. It need not know one that it has not accepted yet."""
        goal = self.goal
        if goal is not None and goal.is_accepted:
            self._call(1, {"goal_id": _uuid(goal)}, self.asked, goal)
        elif goal is not None:
            asyncio.get_running_loop().call_later(self.link.within_s(goal), self._forget, goal)

    def _forget(self, goal: Goal) -> None:
        """Take a goal for lost that has never been accepted."""
        if goal is self.goal and not goal.is_accepted:
            self.link.warn(f"the server of `{self.action.name}` was replaced, and is lost with {goal.words}")
            self._finish()
            self.done.pop()  # if it is accepted yet, its status makes the server busy
            self._matched(1)

    def _status_matched(self, peers: int) -> None:
        """Forget goals of a lost server; a first status may come before this callback."""
        if not peers:
            self.others = None
        self._matched(peers)

    def _settle(self) -> None:
        """Take it that there are no goals, as no status came."""
        if self.is_whole and self.others is None:
            self.others = ()
            self._advance()
            self.link.look()

    # requests of the link

    def end_run(self) -> bool:
        """Drop waiting goals, and cancel the one that is sent; return whether there is one."""
        self.waiting.clear()
        if self.goal is not None and not self.goal.is_left:
            self.goal.is_left = True
            self.link.count(self.goal, GoalFate.OUTLIVED)
            self.cancel(self.goal.request)
            self.link.look()
        return self.goal is not None

    def send(self, goal: Goal) -> None:
        """Send a goal once the server is there and free."""
        self.waiting.append(goal)
        self._advance()

    def cancel(self, request: Correlation) -> None:
        """Drop a waiting goal, or cancel the one that is sent."""
        self.waiting = [goal for goal in self.waiting if goal.request != request]
        goal = self.goal
        if goal is None or goal.request != request or not goal.is_wanted:
            return
        goal.is_wanted = False
        goal.timer = asyncio.get_running_loop().call_later(self.link.within_s(goal), self._ignored, goal)
        if goal.is_accepted:
            self._send_cancel(goal)

    def _advance(self) -> None:
        while self.goal is None and self.waiting and self.is_free:
            goal = self.goal = self.waiting.pop(0)
            self._call(0, {"goal_id": _uuid(goal), "goal": goal.values}, self.sent, goal)

    def _send_cancel(self, goal: Goal) -> None:
        self._call(2, {"goal_info": {"goal_id": _uuid(goal)}}, self.cancelled, goal)

    def _call(self, part: int, values: dict[str, object], calls: dict[int, Goal], goal: Goal) -> None:
        try:
            calls[self._clients[part][1].call(values)] = goal
        except BusError as error:
            self.link.warn(f"{goal.words} is lost: {error.message}")
            self._finish()

    def _finish(self) -> None:
        """Forget the goal, which is over or lost."""
        if self.goal is not None:
            if self.goal.timer is not None:
                self.goal.timer.cancel()
            self.done.append(self.goal.id.bytes)
        self.goal = None

    # callbacks of the bus

    def _answered(self, answered: Answered) -> None:
        """Handle the response to a goal."""
        goal = self.sent.pop(answered.call, None)
        if goal is not None and goal is not self.goal and answered.message.accepted:
            self._send_cancel(goal)
        if goal is None or goal is not self.goal:
            return
        self.link.count(goal, GoalFate.ACCEPTED if answered.message.accepted else GoalFate.REJECTED)
        if answered.message.accepted:
            goal.is_accepted = True
            self._call(1, {"goal_id": _uuid(goal)}, self.asked, goal)
            if not goal.is_wanted:
                self._send_cancel(goal)
            return
        self._end(goal, answered.stamp_ns)

    def _resulted(self, answered: Answered) -> None:
        """Handle the response that comes when a goal is over."""
        goal, message = self.asked.pop(answered.call, None), answered.message
        if goal is None or goal is not self.goal:
            return
        self.link.count(goal, _ENDS.get(message.status))
        is_done = message.status == GoalStatus.SUCCEEDED
        succeeded, measured = outcome_of(goal.call, message.result) if is_done else (False, ())
        self._end(goal, answered.stamp_ns, measured, succeeded=succeeded)

    def _end(self, goal: Goal, stamp_ns: int, measured: Changes = (), *, succeeded: bool = False) -> None:
        self._finish()
        if goal.is_wanted:
            self.link.reply(goal.request, stamp_ns, measured, succeeded=succeeded)
        self._advance()
        self.link.look()

    def _cancel_answered(self, answered: Answered) -> None:
        """Handle the response to a cancellation; rclpy refuses one by a list without the goal, with the code 0."""
        goal, message = self.cancelled.pop(answered.call, None), answered.message
        if goal is None or goal is not self.goal or message.return_code == CANCEL_TOO_LATE:
            return
        if goal.id not in (_id_of(each.goal_id) for each in message.goals_canceling):
            if goal.timer is not None:
                goal.timer.cancel()  # a refused cancellation is not ignored, too
            self.link.count(goal, GoalFate.CANCEL_REFUSED)
            self.link.warn(f"the cancellation of {goal.words} is refused; the next goal waits until it is over")

    def _ignored(self, goal: Goal) -> None:
        if goal is self.goal:
            self.link.count(goal, GoalFate.CANCEL_IGNORED)
            within = f"within {self.link.within_s(goal):g} s"
            self.link.warn(f"the cancellation of {goal.words} is ignored: it is not over {within}")

    def _fed_back(self, received: Received) -> None:
        goal, message = self.goal, received.message
        which = _id_of(message.goal_id)
        if goal is None or which != goal.id:
            if self.others is not None and which not in self.others and which.bytes not in self.done:
                self.link.warn(f"feedback for goal {which}, which is not active, is dropped")
        elif not goal.is_accepted:
            self.link.warn(f"feedback for {goal.words} came before the goal was accepted, and is dropped")
        elif goal.is_wanted and goal.call.feedback:
            self.link.measure(values_of(goal.call.feedback, message.feedback), received.stamp_ns)

    def _has_status(self, received: Received) -> None:
        """Handle the statuses of all goals."""
        own = None if self.goal is None else self.goal.id.bytes
        statuses, entries = statuses_of(received.message)
        active = [id_at(entries, position) for position in active_among(statuses)]
        others = [which for which in active if which != own and which not in self.done]
        if own is not None and own not in active:
            position = position_of(entries, own)
            self._is_over(None if position is None else statuses[position])
        self.others = tuple(UUID(bytes=which) for which in others)
        self._advance()
        self.link.look()

    def _is_over(self, status: int | None) -> None:
        """Handle the end of the goal by its status; the result of a goal that the model waits for is still to come."""
        if self.goal is not None and not self.goal.is_wanted and status is not None:
            self.link.count(self.goal, _ENDS.get(status))
            self._finish()


def _uuid(goal: Goal) -> dict[str, object]:
    return {"uuid": goal.id.bytes}


def _id_of(message: object) -> UUID:
    return UUID(bytes=bytes(message.uuid))  # type: ignore[attr-defined]  # of any bus
