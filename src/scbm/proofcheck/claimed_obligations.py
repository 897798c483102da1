"""The names of obligations in certificates (semantics 8.1, 8.2), defined a second time for the checker.

`scbm.cases.coverage` has the names for everything else. A test compares the two.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.model import BehaviorModel


class ClaimedAspect(StrEnum):
    """What of an operation or of an automatic transition is claimed never to be visited."""

    DISABLED = "disabled"
    EXECUTING = "executing"
    FAILED = "failed"
    TIMEDOUT = "timedout"
    COMPLETED = "completed"
    QUEUED = "queued"
    TAKEN = "taken"


@dataclass(frozen=True, slots=True)
class ClaimedObligation:
    """One aspect of an operation, or the taking of an automatic transition."""

    subject: str
    aspect: ClaimedAspect

    def __str__(self) -> str:
        return f"automatic/{self.subject}" if self.aspect is ClaimedAspect.TAKEN else f"{self.subject}/{self.aspect}"


def claimable_obligations(model: BehaviorModel) -> tuple[ClaimedObligation, ...]:
    """Return everything that a certificate for a model may claim."""
    aspects = [aspect for aspect in ClaimedAspect if aspect is not ClaimedAspect.TAKEN]
    of_operations = [ClaimedObligation(operation.name, aspect) for operation in model.operations for aspect in aspects]
    return (*of_operations, *(ClaimedObligation(t.name, ClaimedAspect.TAKEN) for t in model.automatic_transitions))
