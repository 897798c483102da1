"""Campaigns: many cases, run one by one, judged, and added up (paper, Section VI, steps 4 and 5)."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.coverage import (
    Coverage,
    Obligations,
    Unnamed,
    bits_of,
)
from scbm.cases.trace import End
from scbm.testing.batches.batch_summary import BatchSummary, CaseOutcome, SummaryBuilder
from scbm.testing.batches.campaign_work import ListedCases
from scbm.testing.batches.forecast import Forecast, forecast

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.cases import Case
    from scbm.model import BehaviorModel
    from scbm.running.simulation.device_hazards import Hazard
    from scbm.testing.batches.campaign_work import CaseSource
    from scbm.testing.continuations.unjudged import Unjudged
    from scbm.testing.verdicts import Verdict


class CaseResult(Struct, frozen=True):
    """The result of a case in a campaign: without trace and draws, which running the case again gives.

    Attributes:
        case: the case as it was given.
        requests: how many requests its run sent.
        verdict: how it ended.
        ended_ns: how long it took, in simulated time.
        visited: the obligations that it visited, as bits.
        unused: what the case says and nothing came of.
        forced: of the visited obligations those that it visited only after its state was forced, as bits.
        excluded: over nodes the number of values that drivers sent and the model excludes.
        hazards: in a simulation what devices did and the controller did not know.
        unjudged: why `non_blocking` does not judge the case; `None` if it does, or is switched off.
    """

    case: Case
    requests: int
    verdict: Verdict
    ended_ns: int
    visited: int
    unused: tuple[str, ...] = ()
    forced: int = 0
    excluded: int = 0
    hazards: tuple[Hazard, ...] = ()
    unjudged: Unjudged | None = None

    def outcome(self, position: int) -> CaseOutcome:
        """Return the result without its case, which has this position in its campaign."""
        visits = (self.visited, self.unused, self.forced, self.excluded, self.hazards, self.unjudged)
        return CaseOutcome(position, self.verdict, self.ended_ns, self.requests, *visits)


class Campaign(Struct, frozen=True, dict=True):
    """The results of many cases of one model.

    Attributes:
        model: what was tested.
        source: the cases by their positions.
        summary: what the cases did; it lists all of them, or of many random ones only the notable ones.
    """

    model: BehaviorModel
    source: CaseSource
    summary: BatchSummary

    @staticmethod
    def of(model: BehaviorModel, results: Iterable[CaseResult]) -> Campaign:
        """Return a campaign with the sum of results, which it lists all."""
        kept = tuple(results)
        builder = SummaryBuilder(len(Obligations.of(model).all), written=len(kept))
        for position, result in enumerate(kept, start=1):
            builder.add(result.outcome(position))
        return Campaign(model, ListedCases(tuple(result.case for result in kept)), builder.summary())

    @property
    def count(self) -> int:
        """The number of cases."""
        return self.summary.count

    @property
    def drawn(self) -> int:
        """The number of random cases; they come last."""
        return max(0, self.count - self.summary.written)

    @property
    def failed_count(self) -> int:
        """The number of cases that failed."""
        return self.summary.failed

    @property
    def simulated_ns(self) -> int:
        """The simulated time of all runs together."""
        return self.summary.ended_ns

    @cached_property
    def results(self) -> tuple[CaseResult, ...]:
        """The results of the listed cases."""
        return tuple(map(self.result, self.summary.outcomes))

    @property
    def failed(self) -> tuple[CaseResult, ...]:
        """The results of the listed cases that failed."""
        return tuple(self.result(o) for o in self.summary.outcomes if not o.verdict.passed)

    def reached_from(self, position: int) -> int:
        """Return how many cases from a position on reached their last goal; all cases before it are listed."""
        total = sum(count for words, count in self.summary.ends if words.startswith(End.REACHED.value))
        return total - sum(o.position < position and o.verdict.end is End.REACHED for o in self.summary.outcomes)

    def result(self, outcome: CaseOutcome) -> CaseResult:
        """Return an outcome with its case."""
        case = self.source.case(outcome.position)
        return CaseResult(case, outcome.requests, outcome.verdict, outcome.ended_ns, *outcome[4:])

    @cached_property
    def forced(self) -> int:
        """The obligations that listed cases visit only after their states were forced, as bits."""
        freely = 0
        for outcome in self.summary.outcomes:
            freely |= outcome.visited & ~outcome.forced
        return self.coverage.visited & ~freely

    @property
    def visited_freely(self) -> tuple[tuple[str, int], ...]:
        """The name of each listed case with what it visited before its state was forced, as bits."""
        return tuple((self.source.name(o.position), o.visited & ~o.forced) for o in self.summary.outcomes)

    @property
    def forecast(self) -> Forecast | None:
        """The forecast for ten times as many random cases; `None` where there is no estimate."""
        return forecast(self.summary, Obligations.of(self.model))

    @cached_property
    def coverage(self) -> Coverage:
        """The union of the visits of the cases; the listed cases have names there."""
        obligations = Obligations.of(self.model)
        named = tuple((self.source.name(o.position), o.visited) for o in self.summary.outcomes)
        rest = list(self.summary.visits or (0,) * len(obligations.all))
        for _, visited in named:
            for bit in bits_of(visited):
                rest[bit] -= 1
        unnamed = Unnamed(self.count - len(named), tuple(rest)) if len(named) < self.count else Unnamed()
        return Coverage(obligations, named, unnamed)
