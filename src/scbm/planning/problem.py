"""A goal, and the packed task in which it can be told apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.model import BehaviorModel, Predicate
    from scbm.planning.task import Task


@dataclass(frozen=True, slots=True)
class Problem:
    """What is planned for; the state from which is still open.

    Attributes:
        is_goal: whether the goal holds in a packed state of the task.
    """

    model: BehaviorModel
    goal: Predicate
    task: Task
    is_goal: Callable[[int], bool]
