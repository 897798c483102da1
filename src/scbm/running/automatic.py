"""Chains of automatic transitions, and the cycle in one that does not end (semantics 5.1)."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.running.program import Step


def next_automatic(steps: Sequence[Step], state: int) -> tuple[Step, int] | None:
    """The automatic transition that is taken in a state, with the state afterwards; `None` if none is."""
    for step in steps:
        after = step.take(state)
        if after is not None and after != state:
            return step, after
    return None


def find_cycle(steps: Sequence[Step], state: int, bound: int) -> tuple[str, ...]:
    """The names of the transitions that go round from `state` on, each as often as in one round.

    Empty if the chain ends. If no state comes back within `bound`, each name of the chain once.
    """
    seen: dict[int, int] = {}
    names: list[str] = []
    while state not in seen:
        if len(names) > bound:
            return tuple(dict.fromkeys(names))
        seen[state] = len(names)
        taken = next_automatic(steps, state)
        if taken is None:
            return ()
        names.append(taken[0].name)
        state = taken[1]
    return tuple(names[seen[state] :])
