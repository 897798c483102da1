"""The real drivers of a campaign: their replies in the traces of runs, and their values that the model excludes."""

from __future__ import annotations

from collections.abc import Mapping  # noqa: TC003 - of a field of a struct
from enum import StrEnum
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases.trace import RequestOutcome, spans_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.cases.trace import Record
    from scbm.running.simulation.excluded_values import ExcludedValue
    from scbm.testing.tester import Execution


class GoalFate(StrEnum):
    """What became of a goal of an action, or of its cancellation; a goal may have several of these."""

    ACCEPTED = "accepted"
    REJECTED = "rejected"
    SUCCEEDED = "succeeded"
    ABORTED = "aborted"
    CANCELLED = "cancelled"
    CANCEL_REFUSED = "cancel_refused"
    CANCEL_IGNORED = "cancel_ignored"
    OUTLIVED = "outlived_run"


class Answers(Struct, frozen=True):
    """The results of the requests to one resource.

    Attributes:
        resource: its name.
        sent: how many requests went to it.
        succeeded: the number of successful replies that came in time.
        failed: the number of replies that reported a failure.
        timed_out: how many it had not answered as the deadline of the operation passed that had sent them.
        goals: the numbers of goals by each `GoalFate`; empty for a resource that got none.
    """

    resource: str
    sent: int = 0
    succeeded: int = 0
    failed: int = 0
    timed_out: int = 0
    goals: Mapping[str, int] = {}

    @property
    def given_up(self) -> int:
        """The number of requests that were cancelled early, or were open when the run ended."""
        return self.sent - self.succeeded - self.failed - self.timed_out

    @property
    def is_silent(self) -> bool:
        """Whether the resource got requests and none of them succeeded; those given up do not count."""
        return self.succeeded == 0 and self.failed + self.timed_out > 0

    def after(self, records: Sequence[Record]) -> Answers:
        """Return these counts with those of one more run added.

        A request without a reply timed out if the operation that sent it did. A later reply counts if the model still
        waits for it.
        """
        requests = [span for span in spans_of(records).requests if span.resource == self.resource]
        outcomes = [span.outcome for span in requests]
        unanswered = (RequestOutcome.CANCELLED, RequestOutcome.UNANSWERED)
        return replace(
            self,
            sent=self.sent + len(requests),
            succeeded=self.succeeded + outcomes.count(RequestOutcome.SUCCEEDED),
            failed=self.failed + outcomes.count(RequestOutcome.FAILED),
            timed_out=self.timed_out + sum(s.missed_deadline and s.outcome in unanswered for s in requests),
        )


class ExcludedVariable(Struct, frozen=True):
    """The values of one variable that drivers sent in a campaign and the model excludes.

    Attributes:
        variable: the variable.
        count: the number of these values.
        cases: the number of cases in which they were sent.
        first_case: the name of the first of these cases.
        first: the first of these values.
    """

    variable: str
    count: int
    cases: int
    first_case: str
    first: ExcludedValue


def with_excluded(known: Mapping[str, ExcludedVariable], execution: Execution) -> dict[str, ExcludedVariable]:
    """Return what is known of variables with excluded values, by their names, with one more run added."""
    found = dict(known)
    for name in dict.fromkeys(each.variable for each in execution.excluded):
        values = [each for each in execution.excluded if each.variable == name]
        before = known.get(name, ExcludedVariable(name, 0, 0, execution.case.name, values[0]))
        found[name] = replace(before, count=before.count + len(values), cases=before.cases + 1)
    return found
