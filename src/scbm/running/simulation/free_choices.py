"""Free choices of a run: how resources react, and how the network delivers messages (semantics 7.1, decision 11).

A case can fix any of them. The others are drawn, or plain where there is no source of random numbers. All choices are
recorded, so that a case can be made from a run that leaves nothing open. Messages travel on `Links` between the runner
and simulated resources.
"""

from __future__ import annotations

from collections import deque
from dataclasses import replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Protocol

from scbm.cases import AT_ONCE, LOST, Network, OutcomeRule, Reaction
from scbm.model import Outcome
from scbm.running.simulation.default_reactions import plainly_measured

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from random import Random

    from scbm.cases import Delivery
    from scbm.model import Resource


_MICROSECOND_NS = 1_000
_WIDE_NS = 1_000_000


class Links:
    """One link to each resource and one back. On each, messages keep their order unless one is held back."""

    def __init__(self, network: Network, random: Random | None) -> None:
        self._network = network
        self._random = random
        self._last_ns: dict[tuple[str, bool], int] = {}
        self.are_plain = not network.latency_ns and not network.draws

    def cuts(self, resource: str, now_ns: int) -> bool:
        """Return whether a partition cuts the resource off now."""
        return any(
            cut.at_ns <= now_ns < cut.at_ns + cut.for_ns and cut.resource in (None, resource)
            for cut in self._network.partitions
        )

    def deliver(self, resource: str, now_ns: int, *, inward: bool) -> Delivery:
        """Decide how a message travels that is sent now; `inward` is from the resource to the runner.

        Only what can happen is drawn: whether it is lost, its jitter, whether it is held back, whether it is doubled.
        """
        network = self._network
        if self._happens(float(network.loss)):
            return LOST
        arrives_ns = now_ns + network.latency_ns + self._up_to(network.jitter_ns)
        if self._happens(float(network.reordering)):
            arrives_ns += self._up_to(network.held_back_ns)
        else:
            link = (resource, inward)
            arrives_ns = self._last_ns[link] = max(arrives_ns, self._last_ns.get(link, 0))
        copies = (arrives_ns - now_ns,)
        if self._happens(float(network.duplication)):
            return (*copies, copies[0] + self._up_to(network.held_back_ns))
        return copies

    def _happens(self, probability: float) -> bool:
        return bool(probability) and self._draw() < probability

    def _up_to(self, most_ns: int) -> int:
        """Round to whole microseconds, which are easy to read; finer in a narrow range."""
        if not most_ns:
            return 0
        step_ns = _MICROSECOND_NS if most_ns >= _WIDE_NS else 1
        return int(self._draw() * most_ns) // step_ns * step_ns

    def _draw(self) -> float:
        assert self._random is not None  # noqa: S101 - `Choices` sees to it
        return self._random.random()


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
    """Decides all free choices of one run."""

    def __init__(
        self,
        reactions: Reactions,
        forced: Sequence[OutcomeRule] = (),
        network: Network = Network(),  # noqa: B008 - an immutable value
        random: Random | None = None,
    ) -> None:
        """Prepare the choices of one run.

        Args:
            reactions: decides the reactions that the case leaves open.
            forced: the rules of the case.
            network: decides how messages travel that the case leaves open.
            random: the source of random numbers for messages; required if `network` draws.

        Raises:
            ValueError: `network` draws, and `random` is missing.
        """
        if network.draws and random is None:
            raise ValueError("the faults of the network are a matter of chance, and there is nothing to draw from")
        self._reactions = reactions
        self._rules = _OutcomeRules(forced)
        self._links = Links(network, random)
        self._taken: list[Reaction] = []
        self.needs_operation = bool(forced)
        self._all_at_once = self._links.are_plain and not forced and not network.partitions

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
        if self._links.cuts(reaction.resource, now_ns):
            return LOST
        given: Delivery | None = getattr(reaction, message.value)
        if given is not None:
            return given
        if self._links.are_plain:
            return AT_ONCE
        delivery = self._links.deliver(reaction.resource, now_ns, inward=message is MessageKind.REPLY)
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
    if outcome is not Outcome.SUCCEED:
        measured = None
    elif rule.measured is None and reaction.outcome is not Outcome.SUCCEED:
        measured = plainly_measured(resource)
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
