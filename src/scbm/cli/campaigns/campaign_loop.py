"""The loop of a campaign: add cases to a store as they finish, show progress, and end early with what is there."""

from __future__ import annotations

import sys
from contextlib import AbstractContextManager, closing, nullcontext
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.coverage import Obligations
from scbm.cli.output.progress import CampaignLines, CampaignProgress, bar
from scbm.cli.output.terminal import errors, print_progress
from scbm.model import InputError
from scbm.model.visible_text import counted
from scbm.testing import Campaign
from scbm.testing.batches.batch_summary import BatchSummary, SummaryBuilder, merge

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator

    from scbm.cases.coverage import AssertionEvidence
    from scbm.cli.campaigns.store_keeper import Keeper, Since
    from scbm.cli.options.campaign_options import CampaignOutput
    from scbm.testing import CaseResult, Execution
    from scbm.testing.batches.campaign_runs import CampaignStep
    from scbm.testing.decided_requirements import KnownDecision
    from scbm.testing.event_logs.event_log import EventLog
    from scbm.testing.suite import Suite

_SLOW = 500
"""Minimum number of simulated cases for a progress bar on a terminal; over nodes there always is one."""


class FirstFailure(Exception):  # noqa: N818 - it is no error, but what `-x` asks for
    """Raised to end a campaign at its first failure."""


class Finished(Struct, frozen=True):
    """Cases that have just finished.

    Attributes:
        total: all cases so far.
        results: yields their positions and results, each with the log of a run over nodes.
        last: the result of the last case, where cases are shown one by one.
    """

    total: BatchSummary
    results: Callable[[], Iterable[tuple[int, CaseResult, EventLog | None]]]
    last: CaseResult | None = None


def finished_batches(suite: Suite, steps: Generator[CampaignStep, None, None]) -> Generator[Finished, None, None]:
    """Yield the batches of a simulated campaign."""
    campaign = Campaign(suite.model, suite.work, BatchSummary())

    def results(step: CampaignStep) -> Iterator[tuple[int, CaseResult, None]]:
        return ((outcome.position, campaign.result(outcome), None) for outcome in step.batch.outcomes)

    with closing(steps):
        for step in steps:
            yield Finished(step.total, lambda step=step: results(step))  # type: ignore[misc] # mypy infers no lambda with a default


def finished_executions(suite: Suite, executions: Iterable[Execution]) -> Generator[Finished, None, None]:
    """Yield the cases of a campaign over nodes, one by one."""
    total = BatchSummary(written=len(suite.written))
    obligations = len(Obligations.of(suite.model).all)
    for position, execution in enumerate(executions, start=1):
        builder = SummaryBuilder(obligations, total.written, position)
        result, log = execution.result, execution.log
        builder.add(result.outcome(position))
        total = merge(total, builder.summary())
        entry = (position, result, log)
        yield Finished(total, lambda entry=entry: [entry], result)  # type: ignore[misc] # as above


def carry_out(
    suite: Suite,
    output: CampaignOutput,
    run: Callable[[Callable[[str], None]], Generator[Finished, None, None]],
    where: str | None = None,
) -> CampaignEnd:
    """Run the cases, add them to the store, and show the progress; return the results up to an interruption.

    Args:
        suite: the cases.
        output: the store that the cases are added to, if any, and whether the first failure ends the campaign.
        run: runs the cases, and calls its argument with the name of the current one.
        where: a description of the nodes that run the cases; `None` for simulation.

    Raises:
        InputError: an error ended the campaign before its first case was complete.
        KeyboardInterrupt: the user interrupted it before its first case was complete.
    """
    total = BatchSummary(written=len(suite.written))
    keeper: Keeper | None = None
    ended: InputError | KeyboardInterrupt | FirstFailure | None = None
    try:
        with (
            _store(output, suite, where) as keeper,
            _progress(suite, where) as progress,
            closing(run(progress.begin)) as running,
        ):
            for finished in running:
                if keeper is not None:
                    keeper.keep(finished.results(), suite.by_name, suite.network)
                total = finished.total
                progress.advance(total, finished.last)
                if output.stop and total.failed and total.count < suite.count:
                    raise FirstFailure  # noqa: TRY301 - the store must learn that its run is not finished
    except (InputError, KeyboardInterrupt, FirstFailure) as error:
        if not total.count:
            if isinstance(error, KeyboardInterrupt):
                errors().prose("scbm: interrupted before the first case was complete")
            raise
        ended = error
    return CampaignEnd(Campaign(suite.model, suite.work, total), suite.count, keeper, ended)


class CampaignEnd(Struct, frozen=True):
    """The results of a campaign.

    Attributes:
        campaign: the cases that were run.
        count: the number of selected cases.
        keeper: added the results to a store; `None` without a store.
        ended: the reason why the campaign ended early; `None` if it is complete.
    """

    campaign: Campaign
    count: int
    keeper: Keeper | None
    ended: InputError | KeyboardInterrupt | FirstFailure | None

    @property
    def since(self) -> Since | None:
        """Return the changes since the previous run in the store; `None` without one, or after an early end."""
        if self.keeper is None or self.ended is not None:
            return None
        return self.keeper.since(self.campaign.coverage)

    @property
    def evidence(self) -> AssertionEvidence | None:
        """The results of the store about asserted obligations; `None` without a store, or after an early end."""
        return None if self.keeper is None or self.ended is not None else self.keeper.evidence

    @property
    def decisions(self) -> tuple[KnownDecision, ...]:
        """The answers of the last closing about requirements; empty without a store, or after an early end."""
        return () if self.keeper is None or self.ended is not None else self.keeper.decisions

    @property
    def words(self) -> str:
        """Return how many cases ran before an early end; empty after a complete campaign."""
        if self.ended is None:
            return ""
        how = "Interrupted" if isinstance(self.ended, KeyboardInterrupt) else "Ended by an error"
        how = "Stopped at the first failure" if self.is_stopped else how
        return f"{how} after {self.campaign.count} of {counted(self.count, 'case')}"

    @property
    def is_stopped(self) -> bool:
        """Whether `-x` ended the campaign."""
        return isinstance(self.ended, FirstFailure)


def _store(output: CampaignOutput, suite: Suite, where: str | None) -> AbstractContextManager[Keeper | None]:
    """Return the store of the command line, if it names one."""
    if output.store is None:
        return nullcontext()
    from scbm.cli.campaigns.store_keeper import keeping  # noqa: PLC0415 - a database, which few runs need

    return keeping(output.store, suite, where, output.evidence)


def _progress(suite: Suite, where: str | None) -> AbstractContextManager[CampaignProgress]:
    """Return the progress display: a bar on a terminal, lines elsewhere."""
    is_over_nodes = where is not None
    obligations = Obligations.of(suite.model)
    if (is_over_nodes or suite.count >= _SLOW) and sys.stderr.isatty():
        return bar(suite.count, obligations)
    return nullcontext(CampaignLines(suite.count, obligations, print_progress, each_case=is_over_nodes))
