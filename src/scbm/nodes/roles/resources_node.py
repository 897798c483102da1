"""Simulated resources in a process of their own: they reply to requests as a tester decides, or as drawn."""

from __future__ import annotations

import asyncio
import json
from fractions import Fraction
from typing import TYPE_CHECKING, Any, assert_never

from msgspec import UNSET, Struct, UnsetType, field

from scbm.cases import AT_ONCE, Condition, Reaction, condition_kind
from scbm.model import Outcome
from scbm.model.json_reader import JsonError, JsonRecord, Values, read_record
from scbm.nodes.links.link import Correlation
from scbm.nodes.links.topic_link import RequestId, id_text, read_id
from scbm.nodes.node_messages import (
    Abandon,
    Answering,
    Become,
    Busy,
    Fate,
    Forgot,
    Go,
    Prepare,
    Prepared,
    React,
    Refused,
    RestartResource,
    decode,
    encode,
    read_object,
)
from scbm.nodes.roles.cell_topics import CellTopics, Membership, is_of_tester
from scbm.nodes.roles.served_tester import ServedTester
from scbm.nodes.roles.wall_clock import Clock
from scbm.running.simulation.simulated_resources import Job, SimulatedResource

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.model import Resource
    from scbm.nodes.buses.bus import Bus, Received
    from scbm.nodes.roles.cell_topics import NodeContext
    from scbm.running.simulation import Reactions

_MAX_WAITING = 1_000
"""The maximum number of early requests that are kept; a run has one at a time for each resource."""


class ResourcesNode:
    """Simulates resources of one model."""

    def __init__(self, context: NodeContext, reactions: Reactions) -> None:
        """Join the cell, on the running event loop.

        Args:
            context: its bus, model and status; it simulates the `resources` of the status.
            reactions: decides the reactions to requests without a tester.
        """
        bus, model, status = context.bus, context.model, context.status
        self._warn = context.warn
        self.report = context.report
        self._loop = asyncio.get_running_loop()
        self._reactions = reactions
        self._run: _AnsweredRun | None = None
        self._tester = ServedTester(context, self._forget)
        topics = CellTopics.of(model)
        self.membership = Membership(bus, topics, status)
        self._to_tester = bus.publisher(topics.simulated)
        by_name = {resource.name: resource for resource in model.resources}
        self._queues = {name: _RequestQueue(self, bus, topics, by_name[name]) for name in status.resources}
        bus.subscribe(topics.case, self._hear, left=self._lose_tester)

    async def close(self) -> None:
        """Drop all jobs. The caller closes the bus."""
        self.membership.close()
        self._forget()

    @property
    def run(self) -> _AnsweredRun | None:
        """The run that a tester announced."""
        return self._run

    def say(self, message: Answering | Prepared | Forgot | Refused | Busy) -> None:
        """Send a message to the tester."""
        self._to_tester.publish({"data": encode(message)})

    def react(self, resource: Resource) -> Reaction:
        """Decide the reaction to a request without a tester."""
        return self._reactions.react(resource)

    def later(self, delay_ns: int, work: Callable[[], None]) -> None:
        """Run some work after a time of the run; at once for a time of 0."""
        run = self._run
        wall_ns = delay_ns if run is None else run.clock.lasts_ns(delay_ns)
        if wall_ns:
            self._loop.call_later(wall_ns / 1e9, work)
        else:
            work()

    def warn(self, words: str) -> None:
        """Warn of a message that cannot be handled."""
        self._warn(words)

    # the tester

    def _hear(self, received: Received) -> None:
        try:
            message = decode(received.message.data)
        except JsonError as error:
            self._warn(f"a message of a tester was dropped: {error}")
            return
        run = self._run
        if isinstance(message, Prepare):
            if self.membership.own.node in message.nodes:
                self._prepare(message, received.source)
        elif run is None or getattr(message, "run", None) != run.id:
            if isinstance(message, React) and message.resource in self._queues:
                self.say(Forgot(message.run, self.membership.own.node))
        elif isinstance(message, Abandon):
            self._forget()
        elif isinstance(message, Go):
            self._tester.start()
        elif isinstance(message, React | Fate | Become | RestartResource) and message.resource in self._queues:
            self._direct(message)

    def _prepare(self, message: Prepare, tester: int) -> None:
        """Confirm once replies reach the controller; until then the tester asks again."""
        run = self._run
        if run is None or run.id != message.run:
            if (refusal := self._tester.refusal(message, tester)) is not None:
                self.say(refusal)
                return
            self._run = _AnsweredRun(message.run, Clock(0, Fraction(message.time_scale)), message.is_relayed)
            self._tester.hold(message, tester)
            for queue in self._queues.values():
                queue.begin(message.run)
        if all(queue.is_heard for name, queue in self._queues.items() if name not in message.real):
            self.say(Prepared(message.run, self.membership.own.node))

    def _direct(self, message: React | Fate | Become | RestartResource) -> None:
        try:
            self._queues[message.resource].hear_tester(message)
        except ValueError as error:
            self._warn(f"a `{message.kind}` of a tester was dropped: {error}")

    def _lose_tester(self, source: int) -> None:
        if self._tester.source == source:
            self._forget()

    def _forget(self) -> None:
        self._run = None
        self._tester.release()
        for queue in self._queues.values():
            queue.begin(None)


class _AnsweredRun(Struct, frozen=True):
    """The run that a tester announced."""

    id: str
    clock: Clock
    is_relayed: bool


class _PendingRequest(Struct):
    """A request: its sender, once it has arrived, and the fate of each copy, once that is decided.

    `number` is unique among all requests of the resource, in this run and in others.
    """

    id: Correlation
    number: int
    source: int | None = None
    reaction: Reaction | None = None
    copies: tuple[int, ...] = ()
    is_cancelled: bool = False


class _Answer(Struct):
    """A reply whose fate the tester has not decided yet."""

    request: Correlation
    text: str


class _RequestProgress(Struct):
    """The state of a resource in one run."""

    resource: SimulatedResource
    requests: dict[Correlation, _PendingRequest] = field(default_factory=dict)
    numbered: dict[int, _PendingRequest] = field(default_factory=dict)
    last: int = 0
    answers: dict[int, _Answer] = field(default_factory=dict)
    jobs: int = 0

    def request(self, known_as: Correlation) -> _PendingRequest:
        """Return the state of a request; a new one if it is unknown."""
        if known_as not in self.requests:
            self.last += 1
            self.requests[known_as] = self.numbered[self.last] = _PendingRequest(known_as, self.last)
        return self.requests[known_as]

    def forget_oldest(self, most: int) -> None:
        """Keep a bounded number of requests; drop the jobs of older ones."""
        while len(self.requests) > most:
            oldest = self.requests.pop(next(iter(self.requests)))
            del self.numbered[oldest.number]
            self.resource.cancel(oldest.number)


class _RequestQueue:
    """The topics of one resource."""

    def __init__(self, node: ResourcesNode, bus: Bus, topics: CellTopics, resource: Resource) -> None:
        self._node = node
        self._resource = resource
        self._run: str | None = None
        self._early: dict[Correlation, int] = {}
        self._state = _RequestProgress(SimulatedResource.of(resource))
        self._unheard: list[str] = []
        self._replies = bus.publisher(topics.reply(resource.name), self._matched)
        self._topic = topics.request(resource.name).name
        self._requests = bus.subscribe(topics.request(resource.name), self._hear_controller, left=self._lose_controller)

    @property
    def is_heard(self) -> bool:
        """Whether requests of a controller reach the resource, and replies the controller."""
        return bool(self._requests.peers and self._replies.peers)

    def begin(self, run: str | None) -> None:
        """Reset the state for a run, and keep requests of that run that came early."""
        self._state = _RequestProgress(SimulatedResource.of(self._resource))
        self._run = run
        self._unheard.clear()
        early, self._early = self._early, {}
        for request, source in early.items():
            if request.run == run:
                self._take(request, source)

    # the controller

    def _hear_controller(self, received: Received) -> None:
        try:
            request, is_cancel = _read_request(received.message.data)
        except JsonError as error:
            self._node.warn(f"a message on `{self._topic}` was dropped: {error}")
            return
        if is_cancel:
            self._early.pop(request, None)
            if not self._is_relayed(request):
                self._give_up(request)
        elif self._run is not None and request.run == self._run:
            self._take(request, received.source)
        elif is_of_tester(request.run):
            if len(self._early) < _MAX_WAITING:  # its run is announced soon
                self._early[request] = received.source
            else:
                self._node.warn(f"request `{id_text(request)}` was dropped: too many of runs that are not announced")
        else:
            self._state.forget_oldest(_MAX_WAITING)  # such a client does not announce its last request
            self._take(request, received.source)
            self._decide(request, self._node.react(self._resource), AT_ONCE)

    def _is_relayed(self, request: Correlation) -> bool:
        """Return whether the tester decides how messages of the run travel."""
        run = self._node.run
        return run is not None and run.is_relayed and run.id == request.run

    def _take(self, request: Correlation, source: int) -> None:
        taken = self._state.request(request)
        if taken.source is None:  # nothing is done twice
            taken.source = source
            self._work_on(taken)

    def _lose_controller(self, source: int) -> None:
        """Drop the requests of a controller that is gone; not those of a person, who may leave at once."""
        for request in list(self._state.requests.values()):
            if request.source == source and is_of_tester(request.id.run):
                self._give_up(request.id)
        self._early = {request: other for request, other in self._early.items() if other != source}

    def _give_up(self, request: Correlation) -> None:
        """Cancel the request, even if its reaction is not decided yet."""
        if request in self._state.requests:
            self._state.requests[request].is_cancelled = True
            self._cancel(request)

    def _cancel(self, request: Correlation) -> None:
        self._state.resource.cancel(self._state.request(request).number)

    # the tester

    def hear_tester(self, message: React | Fate | Become | RestartResource) -> None:
        """Handle a decision of the tester."""
        resource = self._state.resource
        match message:
            case React():
                self._react(message)
            case Fate():
                self._travel(message)
            case Become():
                condition = Condition(condition_kind(message.condition), Fraction(message.factor))
                for job, latency_ns in resource.become(condition):
                    self._begin(job, latency_ns, self._state.numbered[job.request].id)
            case RestartResource():
                resource.downs = int(message.is_down)
                resource.forget()
            case _:
                assert_never(message)

    def _react(self, message: React) -> None:
        measured = None if message.measured is None else tuple(message.measured.items())
        reaction = Reaction(message.resource, Outcome(message.outcome), message.latency_ns, measured)
        self._decide(Correlation(message.run, message.request), reaction, message.copies)

    def _decide(self, request: Correlation, reaction: Reaction, copies: tuple[int, ...]) -> None:
        taken = self._state.request(request)
        if taken.reaction is None:
            taken.reaction, taken.copies = reaction, copies
            self._work_on(taken)

    def _work_on(self, taken: _PendingRequest) -> None:
        """Start a request when both have arrived: the request and its reaction."""
        reaction = taken.reaction
        if taken.source is None or reaction is None:
            return
        for delay_ns in taken.copies:
            self._after(delay_ns, lambda: self._arrive(taken.id, reaction))

    def _arrive(self, request: Correlation, reaction: Reaction) -> None:
        taken = self._state.request(request)
        if taken.is_cancelled:
            return
        begun = self._state.resource.receive(taken.number, reaction)
        self._node.report(f"{self._resource.name} gets {id_text(request)}")
        if begun is not None:
            self._begin(*begun, request)

    # answers

    def _begin(self, job: Job, latency_ns: int, request: Correlation) -> None:
        self._after(latency_ns, lambda: self._finish(job, request))

    def _finish(self, job: Job, request: Correlation) -> None:
        state = self._state
        if not state.resource.finish(job):
            return
        measured = dict(job.measured)
        reply: dict[str, Any] = {"id": id_text(request), "succeeded": job.succeeds}
        text = json.dumps({**reply, "measured": measured} if measured else reply, ensure_ascii=False)
        self._node.report(f"{self._resource.name} answers {id_text(request)}: {_word(job)}")
        if not self._is_relayed(request):
            self._answer(request, text)
            return
        state.jobs += 1
        state.answers[state.jobs] = _Answer(request, text)
        self._node.say(Answering(request.run, request.number, self._resource.name, state.jobs))

    def _travel(self, fate: Fate) -> None:
        if not fate.job:
            for delay_ns in fate.copies:
                self._after(delay_ns, lambda: self._cancel(Correlation(fate.run, fate.request)))
            return
        answer = self._state.answers.pop(fate.job, None)
        if answer is not None:
            for delay_ns in fate.copies:
                self._after(delay_ns, lambda: self._answer(answer.request, answer.text))

    def _answer(self, request: Correlation, text: str) -> None:
        """Reply once the controller is matched: a node that joins during a run may get a request before that."""
        if self._replies.peers or not is_of_tester(request.run):
            self._replies.publish({"data": text})
        elif len(self._unheard) < _MAX_WAITING:
            self._unheard.append(text)
        else:
            self._node.warn(f"the answer to `{id_text(request)}` was dropped: too many wait for a client")

    def _matched(self, _: int) -> None:
        if self._replies.peers:
            unheard, self._unheard = self._unheard, []
            for text in unheard:
                self._replies.publish({"data": text})

    def _after(self, delay_ns: int, work: Callable[[], None]) -> None:
        """Run some work after a time of the run, unless the run is over by then."""
        state = self._state
        self._node.later(delay_ns, lambda: work() if state is self._state else None)


def _word(job: Job) -> str:
    return "succeeded" if job.succeeds else "failed"


class _ResourceRequest(JsonRecord, frozen=True):
    """What a controller sends to a resource: a request with its values, or that it is cancelled."""

    id: RequestId
    request: Values | UnsetType = UNSET
    cancel: bool | UnsetType = UNSET


def _read_request(text: object) -> tuple[Correlation, bool]:
    """Return a request, and whether it is cancelled. Raises `JsonError`."""
    message: _ResourceRequest = read_record(read_object(text), _ResourceRequest, "the request")
    if (message.request is UNSET) == (message.cancel is UNSET) or message.cancel is False:
        raise JsonError('a request is {"id": …, "request": {…}} or {"id": …, "cancel": true}')
    return read_id(message.id), message.cancel is not UNSET
