"""Free choices of a run: how resources react, how the network delivers messages, which plans there are (semantics 7.1).

A case can fix any of them. The others are drawn, or plain where there is no source of random numbers. All choices are
recorded, so that a case can be made from a run that leaves nothing open. Messages travel on `Links` between the runner
and simulated resources.
"""

from __future__ import annotations

from collections import deque
from enum import StrEnum
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Protocol

from msgspec.structs import replace

from scbm.cases import AT_ONCE, LOST, FaultAction, MessageInTransit, Network, OutcomeRule, Reaction
from scbm.model import Outcome
from scbm.running.simulation.default_reactions import plainly_measured

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from random import Random

    from scbm.cases import AnyNetworkFault, Delivery
    from scbm.model import Resource
    from scbm.planning import PlanSource
    from scbm.running.simulation.environment_moves import EnvironmentMoves


_MICROSECOND_NS = 1_000
_WIDE_NS = 1_000_000
_ON_MESSAGES = (FaultAction.CUT, FaultAction.LOSE, FaultAction.DELAY, FaultAction.COPY)


class DrawnChance:
    """Decides about messages at random."""

    def __init__(self, random: Random) -> None:
        self._draw = random.random

    def happens(self, probability: Fraction | float) -> bool:
        """Return true with a probability."""
        return self._draw() < probability

    def up_to(self, most_ns: int) -> int:
        """Return a time from 0 to `most_ns`, in whole microseconds, which are easy to read; finer in a narrow range."""
        if not most_ns:
            return 0
        step_ns = _MICROSECOND_NS if most_ns >= _WIDE_NS else 1
        return int(self._draw() * most_ns) // step_ns * step_ns


class Links:
    """One link to each resource and one back. On each, messages keep their order unless one is held back."""

    def __init__(self, network: Network, random: Random | None) -> None:
        self._network = network
        self._chance = None if random is None else DrawnChance(random)
        self._last_ns: dict[tuple[str, bool], int] = {}
        # Shares as floats, as the conversion takes longer than all other work on a message.
        faults: list[tuple[AnyNetworkFault, Any]] = [
            (fault, float(value) if isinstance(value, Fraction) else value) for fault, value in network.faults()
        ]
        self._cutting, self._losing, self._delaying, self._copying = (
            [(fault, value) for fault, value in faults if fault.action is action] for action in _ON_MESSAGES
        )
        self.are_whole = not self._cutting
        self.are_plain = not (self._losing or self._delaying or self._copying)

    def message(self, resource: str, now_ns: int, *, inward: bool) -> MessageInTransit:
        """Return a message that is sent now; `inward` is from the resource to the runner."""
        return MessageInTransit(resource, now_ns, self._network, self._chance, inward=inward)

    def cut(self, message: MessageInTransit) -> bool:
        """Return whether the network loses a message whatever the rules of the case say."""
        return _loses(self._cutting, message)

    def deliver(self, message: MessageInTransit) -> Delivery:
        """Decide how a message travels: it is lost, or delayed, and then perhaps copied."""
        if _loses(self._losing, message):
            return LOST
        for fault, value in self._delaying:
            fault.disturb(value, message)
        if message.keeps_order:
            link = (message.resource, message.inward)
            arrives_ns = self._last_ns[link] = max(message.now_ns + message.delay_ns, self._last_ns.get(link, 0))
            message.delay_ns = arrives_ns - message.now_ns
        for fault, value in self._copying:
            fault.disturb(value, message)
        first_ns = message.delay_ns
        return (first_ns, *[first_ns + later_ns for later_ns in message.later_ns]) if message.later_ns else (first_ns,)


def _loses(faults: Iterable[tuple[AnyNetworkFault, Any]], message: MessageInTransit) -> bool:
    for fault, value in faults:
        fault.disturb(value, message)
        if message.is_lost:
            return True
    return False


class MessageKind(StrEnum):
    """The kinds of messages between the runner and a resource."""

    REQUEST = "request"
    REPLY = "reply"
    CANCEL = "cancel"


class Reactions(Protocol):
    """Decides how a resource reacts to a request that the case leaves open."""

    def react(self, resource: Resource) -> Reaction:
        """Return the reaction to the next request to `resource`."""
        ...


class Choices:
    """Decides all free choices of one run.

    Attributes:
        needs_operation: whether rules ask for the operation that executes.
        environment: decides what the environment changes; `None` if it changes nothing.
        plans: decides which plans the run gets; `None` if the planner does.
    """

    def __init__(  # noqa: PLR0913 - one argument for each kind of choice
        self,
        reactions: Reactions,
        forced: Sequence[OutcomeRule] = (),
        network: Network = Network(),  # noqa: B008 - an immutable value
        random: Random | None = None,
        environment: EnvironmentMoves | None = None,
        *,
        plans: PlanSource | None = None,
    ) -> None:
        """Prepare the choices of one run.

        Args:
            reactions: decides the reactions that the case leaves open.
            forced: the rules of the case.
            network: decides how messages travel that the case leaves open.
            random: the source of random numbers for messages; required if `network` draws.
            environment: decides what the environment changes; `None` if it changes nothing.
            plans: decides which plans the run gets; `None` if the planner does.

        Raises:
            ValueError: `network` draws, and `random` is missing.
        """
        if network.draws and random is None:
            raise ValueError("the faults of the network are drawn at random, but `random` is missing")
        self._reactions = reactions
        self._rules = _OutcomeRules(forced)
        self._links = Links(network, random)
        self._taken: list[Reaction] = []
        self.needs_operation = bool(forced)
        self.environment = environment
        self.plans = plans
        self._all_at_once = self._links.are_plain and self._links.are_whole and not forced

    @property
    def is_plain(self) -> bool:
        """Whether every message arrives at once, and only once."""
        return self._all_at_once

    @property
    def taken(self) -> tuple[Reaction, ...]:
        """The reactions decided so far, request by request."""
        return tuple(self._taken)

    def taken_by(self, request: int) -> Reaction:
        """Return the reaction decided for a request of the run, counted from 1."""
        return self._taken[request - 1]

    def react(self, resource: Resource, operation: str | None) -> Reaction:
        """Decide the reaction to the next request of the run, without its messages.

        Args:
            resource: where the request goes.
            operation: the operation that executes, as far as `needs_operation` asks for it.
        """
        reaction = self._reactions.react(resource)
        for rule in self._rules.of_next(resource.name, operation):
            reaction = _follow(reaction, rule, resource)
        self._taken.append(reaction)
        return reaction

    def travel(self, request: int, message: MessageKind, now_ns: int) -> Delivery:
        """Decide how a message travels that is sent now. All copies of a reply travel alike."""
        if self._all_at_once:
            return AT_ONCE
        reaction = self._taken[request - 1]
        links, inward = self._links, message is MessageKind.REPLY
        if not links.are_whole and links.cut(links.message(reaction.resource, now_ns, inward=inward)):
            return LOST
        given: Delivery | None = getattr(reaction, message.value)
        if given is not None:
            return given
        if links.are_plain:
            return AT_ONCE
        delivery = links.deliver(links.message(reaction.resource, now_ns, inward=inward))
        decided: dict[str, Any] = {message.value: delivery}
        self._taken[request - 1] = replace(reaction, **decided)
        return delivery


class _OutcomeRules:
    """The rules of a case, and how many requests each subject had so far."""

    def __init__(self, rules: Iterable[OutcomeRule]) -> None:
        self._rules: dict[str, deque[OutcomeRule]] = {}
        for rule in rules:
            self._rules.setdefault(rule.subject, deque()).append(rule)
        self._counts = dict.fromkeys(self._rules, 0)

    def of_next(self, resource: str, operation: str | None) -> list[OutcomeRule]:
        """Return the rules for the next request: that of the operation last, so that it overrides the other."""
        if not self._rules:
            return []
        rules = (self._next(subject) for subject in (resource, operation) if subject in self._rules)
        return [rule for rule in rules if rule is not None]

    def _next(self, subject: str) -> OutcomeRule | None:
        self._counts[subject] += 1
        number, rules = self._counts[subject], self._rules[subject]
        while rules and rules[0].last is not None and rules[0].last < number:  # so that long lists cost nothing
            rules.popleft()
        return next((r for r in rules if r.first <= number and (r.last is None or number <= r.last)), None)


def _follow(reaction: Reaction, rule: OutcomeRule, resource: Resource) -> Reaction:
    """Return the reaction with everything that a rule fixes."""
    outcome = reaction.outcome if rule.outcome is None else rule.outcome
    measured = reaction.measured if rule.measured is None else rule.measured
    if outcome is Outcome.TIMEOUT:
        measured = None
    elif outcome is Outcome.FAIL and rule.outcome is None:  # only a rule that makes it fail says what it measures then
        measured = reaction.measured
    elif rule.measured is None and reaction.outcome is not outcome:
        measured = plainly_measured(resource, outcome)
    return Reaction(
        reaction.resource,
        outcome,
        reaction.latency_ns if rule.latency_ns is None else rule.latency_ns,
        measured,
        reaction.request if rule.request is None else rule.request,
        reaction.reply if rule.reply is None else rule.reply,
        reaction.cancel if rule.cancel is None else rule.cancel,
    )


def leave_nothing_open(reactions: Iterable[Reaction]) -> tuple[OutcomeRule, ...]:
    """Return rules that fix all requests of a run, resource by resource in the order of first requests."""
    by_resource: dict[str, list[OutcomeRule]] = {}
    for reaction in reactions:
        rules = by_resource.setdefault(reaction.resource, [])
        rules.append(_rule(reaction, len(rules) + 1))
    return tuple(rule for rules in by_resource.values() for rule in rules)


def _rule(reaction: Reaction, number: int) -> OutcomeRule:
    answered = reaction.outcome is not Outcome.TIMEOUT
    reply = reaction.reply if answered else None
    deliveries = (None if delivery == AT_ONCE else delivery for delivery in (reaction.request, reply, reaction.cancel))
    return OutcomeRule(
        reaction.resource,
        number,
        number,
        reaction.outcome,
        reaction.latency_ns if answered else None,
        reaction.measured,
        *deliveries,
    )
