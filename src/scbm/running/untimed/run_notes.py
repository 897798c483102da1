"""Notes about the steps of runs, for what obligations do not show: requests, and how operations and runs end."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from scbm.cases.trace import End
    from scbm.model import OperationState


class NoteKind(Enum):
    """The kind of a note."""

    BECOMES_CURRENT = "an operation becomes current while requests are left"
    ASKS_PLAN = "a plan is asked for while requests are left"
    REACHES_GOAL = "the goal is reached while requests are left"
    TRIGGERS = "an operation makes a trigger true"
    ENDS_OPERATION = "an operation completes, fails, times out or is given up"
    SENDS = "a request is sent"
    SENDS_AFTER_END = "a request is sent after an abort, or while no goal is pursued"
    ENDS_RUN = "a run ends by itself, and not by the time limit"
    MAY_BE_CUT_OFF = "a limit of plans can end the run here"

    @property
    def is_moment(self) -> bool:
        """Whether requests are judged at it (semantics 7.12)."""
        return self in _MOMENTS


_MOMENTS = (NoteKind.BECOMES_CURRENT, NoteKind.ASKS_PLAN, NoteKind.REACHES_GOAL)


class RunNote(NamedTuple):
    """A note about a micro-step.

    Attributes:
        kind: what is noted.
        operation: the operation that it is about.
        resource: the number of the resource that it is about.
        ended: how the operation ended; `DISABLED` if it was given up.
        end: how the run ended.
        state: the packed state before it, for moments and ends of runs.
    """

    kind: NoteKind
    operation: str = ""
    resource: int = -1
    ended: OperationState | None = None
    end: End | None = None
    state: int = 0
