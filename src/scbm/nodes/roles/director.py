"""Decides the reactions to the requests of one run (decision 25).

The tester follows what the runner wants, in its order, and decides as a simulation does: `Choices` is the same, so the
n-th request of a case fares alike wherever its resource lives.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from msgspec.structs import replace

from scbm.cases import AT_ONCE, LOST, Condition, Reaction
from scbm.cases.trace import (
    NETWORK,
    BecameCurrent,
    MessageDisturbed,
    OperationStepped,
    ReplyDropped,
    ReplyReceived,
    RequestOutcome,
    ResourceChanged,
    spans_of,
)
from scbm.model import OperationState, Outcome
from scbm.nodes.node_messages import Become, Fate, React, RestartResource
from scbm.running import CancelRequest, ChangeResource, SendRequest
from scbm.running.simulation import MessageKind

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from scbm.cases import Delivery
    from scbm.cases.trace import Record
    from scbm.model import Resource
    from scbm.nodes.node_messages import Answering
    from scbm.running import Effect
    from scbm.running.simulation import Choices
    from scbm.testing.event_logs.event_records import Note


_OUTCOMES = {RequestOutcome.SUCCEEDED: Outcome.SUCCEED, RequestOutcome.FAILED: Outcome.FAIL}


class RequestStage(Protocol):
    """Receives the decisions."""

    def publish(self, message: React | Fate | Become | RestartResource) -> None:
        """Send a message to the node that simulates the resource."""
        ...

    def note(self, record: Note) -> None:
        """Add a record to the trace, with the time at which the controller receives it."""
        ...


class Director:
    """Decides the reactions of one run."""

    def __init__(
        self, run: str, resources: Mapping[str, Resource], real: Iterable[str], choices: Choices, stage: RequestStage
    ) -> None:
        """Made anew for each run.

        Args:
            run: its id.
            resources: all of the model, by their names.
            real: the resources whose reactions the tester cannot decide.
            choices: decides, as in a simulation.
            stage: where decisions go.
        """
        self._run = run
        self._resources = resources
        self._real = tuple(real)
        self._choices = choices
        self._stage = stage
        self._operation: str | None = None
        self._conditions: dict[str, Condition] = {}
        self._downs: dict[str, int] = {}
        self._open: dict[int, React] = {}
        self._asked: dict[int, str] = {}
        self._due: dict[int, int] = {}
        self._missed: list[int] = []

    @property
    def is_relayed(self) -> bool:
        """Whether messages of simulated resources can be delayed, lost or doubled."""
        return not self._choices.is_plain

    @property
    def has_requests(self) -> bool:
        """Whether the run has sent a request."""
        return bool(self._choices.taken)

    def follow(self, effects: Iterable[Effect], at_ns: int) -> None:
        """Handle the effects of the runner at a time of the run."""
        for effect in effects:
            match effect:
                case SendRequest(request, resource):
                    self._react(request, resource, at_ns)
                case CancelRequest(request, resource):
                    self._open.pop(request, None)
                    if self._due.pop(request, at_ns) < at_ns:
                        self._missed.append(request)
                    if self.is_relayed and resource not in self._real:
                        copies = self._travel(MessageKind.CANCEL, request, resource, at_ns)
                        self._stage.publish(Fate(self._run, request, resource, 0, copies))
                case ChangeResource(resource, condition):
                    self._conditions[resource] = condition
                    self._expect_nothing_of(resource)
                    self._stage.publish(self._become(resource, condition))
                case ReplyReceived() | ReplyDropped():
                    self._open.pop(effect.request, None)
                    self._due.pop(effect.request, None)
                case BecameCurrent():
                    self._operation = effect.operation
                case OperationStepped() if effect.target is OperationState.INITIAL:
                    self._operation = None
                case _:
                    pass

    def answering(self, asked: Answering, at_ns: int) -> None:
        """Decide how a reply of a simulated resource travels. Raises `ValueError` if it got no such request."""
        if asked.request not in self._asked or self._asked[asked.request] != asked.resource:
            raise ValueError(f"`{asked.resource[:40]}` has no request {asked.request}")
        copies = self._travel(MessageKind.REPLY, asked.request, asked.resource, at_ns)
        if self._due.pop(asked.request, None) is not None and copies:
            self._due[asked.request] = at_ns + min(copies)
        self._stage.publish(Fate(self._run, asked.request, asked.resource, asked.job, copies))

    def restart(self, resource: str, *, is_down: bool) -> None:
        """Take a resource down, or bring it up, as the case says; such times may overlap."""
        self._downs[resource] = downs = self._downs.get(resource, 0) + (1 if is_down else -1)
        self._expect_nothing_of(resource)
        self._stage.publish(RestartResource(self._run, resource, downs > 0))
        condition = "down" if downs else str(self._conditions.get(resource, Condition()))
        self._stage.note(ResourceChanged(0, NETWORK, resource, condition))

    def publish_again(self, resources: Iterable[str]) -> None:
        """Send a node that rejoined during the run the state of its resources."""
        for resource in resources:
            if resource in self._conditions:
                self._stage.publish(self._become(resource, self._conditions[resource]))
            if self._downs.get(resource, 0):
                self._stage.publish(RestartResource(self._run, resource, is_down=True))
            for message in self._open.values():
                if message.resource == resource:
                    self._stage.publish(message)

    def reactions(self, records: Sequence[Record]) -> tuple[Reaction, ...]:
        """Return the reactions to the requests of a run: as decided, or as observed where that differs.

        The tester decides nothing for real resources, and a simulated one may be lost before it reacts as decided.
        """
        seen = list(self._choices.taken)
        for span in spans_of(records).requests:
            if span.resource in self._real:
                outcome = _OUTCOMES.get(span.outcome, Outcome.TIMEOUT)
                latency_ns = 0 if outcome is Outcome.TIMEOUT else span.duration_ns
                seen[span.request - 1] = Reaction(span.resource, outcome, latency_ns)
        for request in self._missed:
            seen[request - 1] = replace(seen[request - 1], reply=LOST)
        return tuple(seen)

    def _react(self, request: int, resource: str, at_ns: int) -> None:
        reaction = self._choices.react(self._resources[resource], self._operation)
        if resource in self._real:
            return
        copies = self._travel(MessageKind.REQUEST, request, resource, at_ns)
        measured = None if reaction.measured is None else dict(reaction.measured)
        outcome = reaction.outcome.value
        message = React(self._run, request, resource, outcome, reaction.latency_ns, measured, copies)
        self._asked[request] = resource
        if copies and reaction.outcome is not Outcome.TIMEOUT and not self._is_troubled(resource):
            self._due[request] = at_ns + min(copies) + reaction.latency_ns
        self._open[request] = message
        self._stage.publish(message)

    def _is_troubled(self, resource: str) -> bool:
        return resource in self._conditions or self._downs.get(resource, 0) > 0

    def _expect_nothing_of(self, resource: str) -> None:
        """Forget the replies that are due from a resource, as the case itself delays or drops them."""
        self._due = {request: due for request, due in self._due.items() if self._asked[request] != resource}

    def _travel(self, message: MessageKind, request: int, resource: str, at_ns: int) -> Delivery:
        delivery = self._choices.travel(request, message, at_ns)
        if delivery is not AT_ONCE and len(delivery) != 1:
            self._stage.note(MessageDisturbed(0, request, resource, message.value, len(delivery)))
        return delivery

    def _become(self, resource: str, condition: Condition) -> Become:
        return Become(self._run, resource, condition.kind.value, str(condition.factor))
