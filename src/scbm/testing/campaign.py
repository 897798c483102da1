"""Campaigns: many cases, run one by one, judged, and added up (paper, Section VI, steps 4 and 5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.cases.coverage import Coverage, Obligations

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.cases import Case
    from scbm.model import BehaviorModel
    from scbm.testing.verdicts import Verdict


@dataclass(frozen=True, slots=True)
class CaseResult:
    """The result of a case in a campaign: without trace and draws, which running the case again gives.

    Attributes:
        case: the case as it was given.
        requests: how many requests its run sent.
        verdict: how it ended.
        ended_ns: how long it took, in simulated time.
        visited: the obligations that it visited, as bits.
        unused: what the case says and nothing came of.
    """

    case: Case
    requests: int
    verdict: Verdict
    ended_ns: int
    visited: int
    unused: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Campaign:
    """The results of many cases of one model."""

    model: BehaviorModel
    results: tuple[CaseResult, ...]
    coverage: Coverage

    @property
    def simulated_ns(self) -> int:
        """The simulated time of all runs together."""
        return sum(result.ended_ns for result in self.results)

    @staticmethod
    def of(model: BehaviorModel, results: Iterable[CaseResult]) -> Campaign:
        """Return a campaign with the sum of results."""
        kept = tuple(results)
        visited = tuple((result.case.name, result.visited) for result in kept)
        return Campaign(model, kept, Coverage(Obligations.of(model), visited))

    @property
    def failed(self) -> tuple[CaseResult, ...]:
        """The cases that failed."""
        return tuple(result for result in self.results if not result.verdict.passed)
