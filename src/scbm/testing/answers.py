"""How resources answered what they were asked, counted in the traces of runs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.trace import ReplyReceived, RequestSent

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from scbm.trace import Record


@dataclass(frozen=True, slots=True)
class Answers:
    """What came of the requests to one resource.

    Attributes:
        resource: its name.
        sent: how many requests went to it.
        succeeded: how many of them it carried out, as it said while somebody waited for it.
        failed: how many it said that it could not carry out.
    """

    resource: str
    sent: int = 0
    succeeded: int = 0
    failed: int = 0

    @property
    def unanswered(self) -> int:
        """How many had no answer in time: they were given up, or the run ended before."""
        return self.sent - self.succeeded - self.failed

    @property
    def is_silent(self) -> bool:
        """Whether it was asked, and did nothing of it."""
        return self.sent > 0 and self.succeeded == 0

    def after(self, records: Iterable[Record]) -> Answers:
        """These, and those of one more run."""
        sent, succeeded, failed = self.sent, self.succeeded, self.failed
        for record in records:
            if isinstance(record, RequestSent) and record.resource == self.resource:
                sent += 1
            elif isinstance(record, ReplyReceived) and record.resource == self.resource:
                succeeded += record.succeeded
                failed += not record.succeeded
        return Answers(self.resource, sent, succeeded, failed)


def count_answers(resources: Iterable[str], runs: Sequence[Iterable[Record]]) -> tuple[Answers, ...]:
    """How each of the resources answered in all of these runs."""
    counts = tuple(Answers(resource) for resource in resources)
    for records in runs:
        counts = tuple(count.after(records) for count in counts)
    return counts
