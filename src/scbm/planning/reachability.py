"""Which planning states can be reached from some states, within a limit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.planning.task import Task


@dataclass(frozen=True, slots=True)
class Reach:
    """What an exploration found.

    Attributes:
        states: packed states, in the order in which they were found.
        complete: whether these are all; `False` if the limit cut the exploration off.
    """

    states: tuple[int, ...]
    complete: bool


def explore(task: Task, starts: Iterable[int], limit: int) -> Reach:
    """All states that the operations can reach from `starts`, but no more than about `limit` of them."""
    found = dict.fromkeys(starts)
    frontier = list(found)
    while frontier and len(found) <= limit:
        successors = dict.fromkeys(state for parent in frontier for _, state in task.successors(parent))
        frontier = [state for state in successors if state not in found]
        found.update(dict.fromkeys(frontier))
    return Reach(tuple(found), not frontier)
