"""The choices of a case, each with the case that lacks it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

from scbm.model import format_duration, format_value
from scbm.testing.case_sizes import MESSAGES

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.cases import Case, OutcomeRule
    from scbm.model import BehaviorModel, Value

_Part = TypeVar("_Part")


@dataclass(frozen=True, slots=True)
class Choice:
    """One choice of a case; without it the case does not fail for the same reason.

    Attributes:
        text: what was chosen.
        otherwise: what was tried in its place.
    """

    text: str
    otherwise: str

    def __str__(self) -> str:
        return f"{self.text}; it does not fail {self.otherwise}"


def choices_of(case: Case, model: BehaviorModel) -> Iterator[tuple[Choice, Case]]:
    """Yield each choice of a case with the case that lacks it."""
    for variable in model.space:
        value = case.initial[variable.name]
        if value != variable.initial:
            choice = Choice(_set(variable.name, value), f"with {format_value(variable.initial)}")
            yield choice, replace(case, initial=case.initial.replace({variable.name: variable.initial}))
    for index, injection in enumerate(case.injections):
        choice = Choice(f"injection {injection.name}", "without it")
        yield choice, replace(case, injections=_without(case.injections, index))
    for index, rule in enumerate(case.outcomes):
        yield Choice(_rule_words(rule), "without it"), replace(case, outcomes=_without(case.outcomes, index))
    if case.limits.time_ns is not None:
        choice = Choice(f"limit of {format_duration(case.limits.time_ns)}", "without it")
        yield choice, replace(case, limits=replace(case.limits, time_ns=None))
    if case.limits.plans is not None:
        choice = Choice(f"limit of {case.limits.plans} plans", "without it")
        yield choice, replace(case, limits=replace(case.limits, plans=None))
    network = case.network
    for index, partition in enumerate(network.partitions):
        cut = partition.resource or "all resources"
        choice = Choice(f"partition of {cut} at {format_duration(partition.at_ns)}", "without it")
        yield choice, replace(case, network=replace(network, partitions=_without(network.partitions, index)))
    for index, restart in enumerate(network.restarts):
        choice = Choice(f"restart of {restart.resource} at {format_duration(restart.at_ns)}", "without it")
        yield choice, replace(case, network=replace(network, restarts=_without(network.restarts, index)))


def _set(name: str, value: Value) -> str:
    return f"{name} = {format_value(value)} at the beginning"


def _rule_words(rule: OutcomeRule) -> str:
    """Return a rule of outcomes in words."""
    numbers = f"request {rule.first}" if rule.first == rule.last else f"requests {rule.first} to {rule.last}"
    numbers = f"requests from {rule.first} on" if rule.last is None else numbers
    said = [str(rule.outcome.value)] if rule.outcome is not None else []
    said += [f"after {format_duration(rule.latency_ns)}"] if rule.latency_ns is not None else []
    said += [f"{name} = {format_value(value)} measured" for name, value in rule.measured or ()]
    for name in MESSAGES:
        delivery = getattr(rule, name)
        if delivery is not None:
            copies = ", ".join(format_duration(delay_ns) for delay_ns in delivery)
            said.append(f"{name} lost" if not delivery else f"{name} under way for {copies}")
    return f"{numbers} of {rule.subject}: {', '.join(said)}"


def _without(parts: tuple[_Part, ...], index: int) -> tuple[_Part, ...]:
    return (*parts[:index], *parts[index + 1 :])
