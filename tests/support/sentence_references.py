"""When a run violates a sentence: slow references, straight from the definitions (semantics 7.3), for each form."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from scbm.model import AfterAlways, Always, Before, LeadsTo, Never, Predicate, RequirementForm, Value

States: TypeAlias = Sequence[tuple[int, dict[str, Value]]]
"""All states of a run, each with its time in nanoseconds."""


def _always(sentence: Always, states: States) -> int | None:
    return next((at for at, state in states if not sentence.predicate.holds(state)), None)


def _never(sentence: Never, states: States) -> int | None:
    return next((at for at, state in states if sentence.predicate.holds(state)), None)


def _before(sentence: Before, states: States) -> int | None:
    for index, (at, state) in enumerate(states):
        if sentence.second.holds(state) and not any(sentence.first.holds(early) for _, early in states[: index + 1]):
            return at
    return None


def _after_always(sentence: AfterAlways, states: States) -> int | None:
    for index, (at, state) in enumerate(states):
        if not sentence.predicate.holds(state) and _is_active(sentence.start, sentence.stop, states[: index + 1]):
            return at
    return None


def _is_active(start: Predicate, stop: Predicate, states: States) -> bool:
    """Whether some state with `start` has no state with `stop` from it on."""
    return any(
        start.holds(state) and not any(stop.holds(later) for _, later in states[index:])
        for index, (_, state) in enumerate(states)
    )


def _leads_to(sentence: LeadsTo, states: States) -> int | None:
    """The first moment at which a cause is seen not to be followed by its effect in time; the end at the latest."""
    end, within = states[-1][0], sentence.within_ns
    moments = []
    for index, (at, state) in enumerate(states):
        if not sentence.cause.holds(state):
            continue
        answered = next((later for later, other in states[index:] if sentence.effect.holds(other)), None)
        if within is None and answered is None:
            moments.append(end)
        elif within is not None and (end if answered is None else answered) - at > within:
            moments.append(at + within)
    return min(moments, default=None)


SENTENCE_REFERENCES: dict[type[RequirementForm], Callable[[Any, States], int | None]] = {
    Always: _always,
    Never: _never,
    LeadsTo: _leads_to,
    Before: _before,
    AfterAlways: _after_always,
}
"""The slow reference of each form: the time of the first violation, or `None`."""
