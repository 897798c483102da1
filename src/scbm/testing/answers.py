"""How a resource answered what it was asked, counted in the traces of runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.model import OperationState, Outcome
from scbm.trace import OperationStepped, ReplyReceived, RequestCancelled, RequestSent

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.trace import Record


@dataclass(frozen=True, slots=True)
class Answers:
    """What came of the requests to one resource.

    Attributes:
        resource: its name.
        sent: how many requests went to it.
        succeeded: how many of them it carried out, as it said while somebody waited for it.
        failed: how many it said that it could not carry out.
        timed_out: how many it had not answered as the deadline of the operation passed that had sent them.
    """

    resource: str
    sent: int = 0
    succeeded: int = 0
    failed: int = 0
    timed_out: int = 0

    @property
    def given_up(self) -> int:
        """How many nobody waited for as long as that: they were cancelled before, or the run ended."""
        return self.sent - self.succeeded - self.failed - self.timed_out

    @property
    def is_silent(self) -> bool:
        """Whether it had to do something, and did nothing. What was given up, it might have done."""
        return self.succeeded == 0 and self.failed + self.timed_out > 0

    def after(self, records: Iterable[Record]) -> Answers:
        """These, and those of one more run."""
        came = _outcomes(self.resource, records)
        return Answers(
            self.resource,
            self.sent + len(came),
            self.succeeded + came.count(Outcome.SUCCEED),
            self.failed + came.count(Outcome.FAIL),
            self.timed_out + came.count(Outcome.TIMEOUT),
        )


def _outcomes(resource: str, records: Iterable[Record]) -> list[Outcome | None]:
    """What came of each request of a run to a resource; `None` for what was given up.

    At most one is in flight, and at most one operation executes. A reply behind the deadline counts if the model still
    waits for it.
    """
    came: list[Outcome | None] = []
    is_awaited = False  # the last one is in flight, and was sent by the operation that executes
    for record in records:
        match record:
            case OperationStepped(target=OperationState.EXECUTING):
                is_awaited = False
            case OperationStepped(target=OperationState.TIMEDOUT) if is_awaited:
                came[-1] = Outcome.TIMEOUT
            case RequestSent() if record.resource == resource:
                came.append(None)
                is_awaited = True
            case RequestCancelled() if record.resource == resource:
                is_awaited = False
            case ReplyReceived() if record.resource == resource:
                came[-1] = Outcome.SUCCEED if record.succeeded else Outcome.FAIL
                is_awaited = False
    return came
