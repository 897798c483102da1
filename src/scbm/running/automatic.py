"""Chains of automatic transitions, and the cycle in one that does not end (semantics 5.1)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.running.program import CompiledStep


def next_automatic(steps: Sequence[CompiledStep], state: int) -> tuple[CompiledStep, int] | None:
    """The automatic transition that is taken in a state, with the state afterwards; `None` if none is."""
    for step in steps:
        after = step.take(state)
        if after is not None and after != state:
            return step, after
    return None


def find_cycle(steps: Sequence[CompiledStep], state: int, bound: int) -> tuple[str, ...]:
    """What `name_cycle` says of the chain that begins in `state`; empty if it ends within `bound`."""
    taken: list[tuple[str, int]] = []
    seen: dict[int, None] = {}
    while len(taken) <= bound:
        following = next_automatic(steps, state)
        if following is None:
            return ()
        step, state = following
        taken.append((step.name, state))
        if state in seen:
            break
        seen[state] = None
    return name_cycle(taken)


def name_cycle(taken: Sequence[tuple[str, int]]) -> tuple[str, ...]:
    """The names of a chain of transitions, each with the state behind it, that is too long.

    If the last state was there before, the names of one round, the first of them again at the end. Else there is no
    round, and each name stands there once.
    """
    *before, (_, state) = taken
    for index in range(len(before) - 1, -1, -1):
        if before[index][1] == state:
            return _round([name for name, _ in taken[index + 1 :]], [name for name, _ in taken])
    return tuple(dict.fromkeys(name for name, _ in taken))


def _round(names: list[str], taken: list[str]) -> tuple[str, ...]:
    """One round, begun with the transition that was taken first of all, which stands at its end again."""
    first = min(range(len(names)), key=lambda index: taken.index(names[index]))
    return (*names[first:], *names[:first], names[first])


NO_TIME_PASSES = "no time passes"
"""Stands in the place of a cycle where requests are sent and answered for ever at one moment."""


def describe_cycle(names: Sequence[str]) -> str:
    """What `name_cycle` found, as a sentence."""
    if tuple(names) == (NO_TIME_PASSES,):
        return "requests are sent and answered without end, and no time passes: give the resources a latency"
    if len(names) > 1 and names[0] == names[-1]:
        return f"automatic transitions go round without end: {' -> '.join(names)}"
    return f"too many automatic transitions in a row, though they do not go round: {', '.join(names)}"
