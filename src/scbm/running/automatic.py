"""Chains of automatic transitions, and the cycle in one that does not end (semantics 5.1)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.running.program import CompiledStep, Program, RunnableOperation


class AutomaticMove(NamedTuple):
    """The micro-step in which an automatic transition is taken.

    Attributes:
        transition: the transition.
        failed: the current operation, if the transition fails it.
        after: the packed state afterwards.
    """

    transition: CompiledStep
    failed: RunnableOperation | None
    after: int


def next_automatic(program: Program, state: int) -> AutomaticMove | None:
    """Return the first automatic transition in the file whose guard holds and that changes a packed state."""
    for mask, bits, step in program.automatic_cubes:  # most are ruled out without a call
        if state & mask != bits or not step.test(state):
            continue
        after = step.update(state)
        if after is None or after == state:
            continue
        return (
            AutomaticMove(step, *program.fail_current(after))
            if step.fails_operation
            else AutomaticMove(step, None, after)
        )
    return None


def find_cycle(program: Program, state: int, bound: int) -> tuple[str, ...]:
    """Return `name_cycle` of the chain of automatic transitions from `state`; empty if it ends within `bound`."""
    taken: list[tuple[str, int]] = []
    seen: dict[int, None] = {}
    while len(taken) <= bound:
        following = next_automatic(program, state)
        if following is None:
            return ()
        state = following.after
        taken.append((following.transition.name, state))
        if state in seen:
            break
        seen[state] = None
    return name_cycle(taken)


def name_cycle(taken: Sequence[tuple[str, int]]) -> tuple[str, ...]:
    """Return the names of the transitions of a chain that is too long.

    If the last state occurred before, these are the names of one cycle, with the first name again at the end. Otherwise
    the chain has no cycle, and each name occurs once.

    Args:
        taken: the transitions, each with the packed state after it.
    """
    *before, (_, state) = taken
    for index in range(len(before) - 1, -1, -1):
        if before[index][1] == state:
            return _round([name for name, _ in taken[index + 1 :]], [name for name, _ in taken])
    return tuple(dict.fromkeys(name for name, _ in taken))


def _round(names: list[str], taken: list[str]) -> tuple[str, ...]:
    """Return the names of a cycle from the one that was taken first, with that one again at the end."""
    first = min(range(len(names)), key=lambda index: taken.index(names[index]))
    return (*names[first:], *names[:first], names[first])


NO_TIME_PASSES = "no time passes"
"""Replaces the names of a cycle where requests are sent and answered without end at one moment."""


def describe_cycle(names: Sequence[str]) -> str:
    """Return the result of `name_cycle` as a sentence."""
    if tuple(names) == (NO_TIME_PASSES,):
        return "requests are sent and answered without end, and no time passes: give the resources a latency"
    if len(names) > 1 and names[0] == names[-1]:
        return f"automatic transitions go round without end: {' -> '.join(names)}"
    return f"too many automatic transitions in a row, though they do not go round: {', '.join(names)}"
