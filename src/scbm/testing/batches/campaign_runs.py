"""Run a campaign batch by batch: one function for a batch, and a fold over batches in their order (decision 37)."""

from __future__ import annotations

from contextlib import closing
from time import perf_counter
from typing import TYPE_CHECKING, Protocol

from msgspec import Struct
from msgspec.structs import replace

from scbm.model import InputError
from scbm.testing.batches.batch_summary import MAX_LISTED, BatchSummary, SummaryBuilder, merge
from scbm.testing.campaign import Campaign
from scbm.testing.tester import Tester

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator

    from scbm.testing.batches.campaign_work import CampaignWork

_BATCH_S = 0.2
"""The wall time that a batch should take: short enough for progress, long enough to pay for its summary."""

_MAX_BATCH = 2_000
"""Maximum number of cases in a batch, so that a batch takes little memory wherever it runs."""


class StopRule(Struct, frozen=True):
    """When a campaign ends before its last case.

    Attributes:
        at_failure: after the first case that failed.
        dry: after so many random cases in a row that visited nothing new; `None` for never.
    """

    at_failure: bool = False
    dry: int | None = None

    def end(self, total: BatchSummary) -> int | None:
        """Return the position of the last case; `None` if the cases so far do not end the campaign."""
        ends = [total.failed_positions[0]] if self.at_failure and total.failed else []
        if self.dry is not None:
            ends += _dry_ends(total, self.dry)
        return min(ends, default=None)


def _dry_ends(total: BatchSummary, dry: int) -> Iterator[int]:
    """Yield the positions at which so many random cases in a row have visited nothing new."""
    before = total.written
    for new in (*(position for position, _ in total.news if position > before), total.last + 1):
        if new - before > dry:
            yield before + dry
        before = new


class BatchRequest(Struct, frozen=True):
    """A range of cases to run.

    Attributes:
        first, last: positions of the first and of the last case.
        stops_at_failure: whether the batch ends with the first case that failed.
        lists_all: whether its summary lists all cases.
    """

    first: int
    last: int
    stops_at_failure: bool = False
    lists_all: bool = False


class BatchResult(Struct, frozen=True):
    """The result of a batch.

    Attributes:
        summary: of the cases that were run.
        ended: what ended it before its last case: an error in drawing a case, or Ctrl-C.
        seconds: the wall time that it took, to choose the size of later batches.
    """

    summary: BatchSummary
    ended: InputError | KeyboardInterrupt | None = None
    seconds: float = 0.0


def tester_of(work: CampaignWork) -> Tester:
    """Return a new tester for a campaign."""
    return Tester(work.model)


def run_batch(work: CampaignWork, tester: Tester, request: BatchRequest) -> BatchResult:
    """Run the cases of a batch in this process."""
    begun_s = perf_counter()
    builder = SummaryBuilder(len(tester.obligations.all), len(work.written), request.first, request.lists_all)
    ended: InputError | KeyboardInterrupt | None = None
    try:
        for position in range(request.first, request.last + 1):
            outcome = tester.execute(work.case(position)).result.outcome(position)
            builder.add(outcome)
            if request.stops_at_failure and not outcome.verdict.passed:
                break
    except (InputError, KeyboardInterrupt) as error:
        ended = error
    return BatchResult(builder.summary(), ended, perf_counter() - begun_s)


class BatchSizes:
    """Chooses the sizes of batches from the time that earlier ones took; results never depend on the sizes."""

    def __init__(self, seconds: float = _BATCH_S, most: int = _MAX_BATCH) -> None:
        self._seconds = seconds
        self._most = most
        self._next = 1.0

    def next(self) -> int:
        """Return the size of the next batch."""
        return max(1, min(int(self._next), self._most))

    def observe(self, count: int, seconds: float) -> None:
        """Adapt the next size to the duration of a batch; it at most doubles."""
        if count:
            self._next = min(2.0 * self.next(), count * self._seconds / max(seconds, 1e-9))


class BatchPlan(Struct, frozen=True):
    """The batches that an executor makes of a campaign.

    Attributes:
        work: the campaign.
        rule: when it ends early; the fold decides that, batches at most end with their first failure.
        keeps_all: whether every case is needed, as for a store; else cases beyond `MAX_LISTED` are only counted.
        start: the position of the first case.
    """

    work: CampaignWork
    rule: StopRule
    keeps_all: bool
    start: int = 1

    def after(self, done: int) -> BatchPlan:
        """Return the plan without the first cases, which are done."""
        return replace(self, start=self.start + done)

    def request(self, first: int, size: int) -> BatchRequest:
        """Return the batch of at most `size` cases that begins at a position."""
        limit = len(self.work.written) + MAX_LISTED
        last = min(first + size - 1, self.work.count)
        if first <= limit < last:
            last = limit  # so that a batch lists either all of its cases or only the notable ones
        return BatchRequest(first, last, self.rule.at_failure, self.keeps_all or first <= limit)


class Executor(Protocol):
    """Runs the batches of a campaign."""

    def results(self, plan: BatchPlan) -> Generator[BatchResult, None, None]:
        """Yield the results of adjacent batches in the order of the cases. Closing the generator cancels the rest."""
        ...


class InProcess:
    """Runs batches one after the other in this process."""

    def __init__(self, tester: Tester | None = None) -> None:
        """Take a tester of the model; by default a new one is made."""
        self._tester = tester

    def results(self, plan: BatchPlan) -> Generator[BatchResult, None, None]:
        """Yield the results of the batches."""
        tester = self._tester or tester_of(plan.work)
        sizes, first = BatchSizes(), plan.start
        while first <= plan.work.count:
            request = plan.request(first, sizes.next())
            result = run_batch(plan.work, tester, request)
            sizes.observe(result.summary.count, result.seconds)
            first = request.last + 1
            yield result


class CampaignStep(Struct, frozen=True):
    """The state of a campaign after a batch.

    Attributes:
        batch: the cases of the batch.
        total: all cases so far.
    """

    batch: BatchSummary
    total: BatchSummary


def run_steps(
    work: CampaignWork,
    executor: Executor | None = None,
    rule: StopRule = StopRule(),
    *,
    keeps_all: bool = False,
) -> Generator[CampaignStep, None, None]:
    """Run a campaign; yield its state after each batch.

    Args:
        work: the cases.
        executor: where they run; by default in this process.
        rule: when the campaign ends before its last case.
        keeps_all: whether the batches list every case.

    Raises:
        InputError: a case could not be drawn, or the executor failed. The cases before are yielded first.
        KeyboardInterrupt: the user interrupted a batch. The same.
    """
    plan = BatchPlan(work, rule, keeps_all)
    total = BatchSummary(written=len(work.written))
    with closing((executor or InProcess()).results(plan)) as results:
        for result in results:
            batch, merged = result.summary, merge(total, result.summary)
            end = rule.end(merged)
            if end is not None and end < merged.last:
                batch = _again(plan, batch, end)
                merged = merge(total, batch)
            total = merged
            if batch.count:
                yield CampaignStep(batch, total)
            if end is not None:
                return
            if result.ended is not None:
                raise result.ended


def run_campaign(
    work: CampaignWork,
    executor: Executor | None = None,
    rule: StopRule = StopRule(),
) -> Campaign:
    """Run a campaign to its end; the parameters, and what it raises, are those of `run_steps`."""
    total = BatchSummary(written=len(work.written))
    with closing(run_steps(work, executor, rule)) as steps:
        for step in steps:
            total = step.total
    return Campaign(work.model, work, total)


def _again(plan: BatchPlan, batch: BatchSummary, end: int) -> BatchSummary:
    """Return the summary of a batch up to a position: the cases are run again, as a summary cannot be divided."""
    request = plan.request(batch.first, end - batch.first + 1)
    return run_batch(plan.work, tester_of(plan.work), request).summary
