"""Summaries of batches: all that reports need of many cases, in memory that does not grow with their number.

`merge` is associative. Summaries are merged in the order of the cases, so the result depends neither on the size of the
batches nor on the process that ran each of them (decision 37).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeAlias, TypeVar

from msgspec import Struct, field
from msgspec.structs import replace

from scbm.cases.coverage import bits_of
from scbm.testing.verdicts import FailureKind

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.running.simulation.device_hazards import Hazard
    from scbm.testing.continuations.unjudged import Unjudged
    from scbm.testing.verdicts import Excuse, Failure, Verdict

_Counted = TypeVar("_Counted")
_Counts: TypeAlias = "tuple[tuple[_Counted, int], ...]"

MAX_LISTED = 10_000
"""Maximum number of random cases that are listed one by one; of more, a summary lists only the notable ones.

A case takes about 1 kB of memory, and 3 kB of JSON.
"""

MAX_EXAMPLES = 100
"""Maximum number of cases that are listed for one cause, where not all cases are listed."""

_MAX_UNUSED = 10
"""Maximum number of clauses without effect that are kept; a report shows no more."""


MAX_HAZARDS = 10
"""Maximum number of hazards at devices that a report lists."""


class CaseOutcome(NamedTuple):
    """The result of a case without the case itself, which its position gives.

    Attributes:
        position: the place of the case in its campaign, from 1.
        verdict: how it ended.
        ended_ns: how long it took, in simulated time.
        requests: how many requests it sent.
        visited: the obligations that it visited, as bits.
        unused: the clauses of the case that had no effect.
        forced: of the visited obligations those that it visited only after its state was forced, as bits.
        excluded: over nodes the number of values that drivers sent and the model excludes.
        hazards: in a simulation what devices did and the controller did not know.
        unjudged: why `non_blocking` does not judge the case; `None` if it does, or is switched off.
    """

    position: int
    verdict: Verdict
    ended_ns: int
    requests: int
    visited: int
    unused: tuple[str, ...]
    forced: int = 0
    excluded: int = 0
    hazards: tuple[Hazard, ...] = ()
    unjudged: Unjudged | None = None


class FailureCause(Struct, frozen=True):
    """One reason for failures; or all unmet expectations of one case.

    Attributes:
        failures: the reason, as the first case has it; or what the case expected.
        count: how many cases failed for it.
        positions: the first of these cases, at most `MAX_LISTED`.
    """

    failures: tuple[Failure, ...]
    count: int
    positions: tuple[int, ...]

    def is_like(self, other: FailureCause) -> bool:
        """Return whether the reason is the same. Unmet expectations are a reason of each case alone."""
        mine, theirs = self.failures[0], other.failures[0]
        return mine.kind is not FailureKind.EXPECTATION and mine.is_like(theirs)


class BatchSummary(Struct, frozen=True):
    """The results of the cases of one range, in bounded memory.

    Attributes:
        written: how many cases of the campaign are from files: the first ones. They are listed always.
        first: the position of the first case.
        count: the number of cases.
        failed: how many of them failed.
        ended_ns: the simulated time of all runs together.
        ends: how many cases ended in which way, in words, in the order of the first case of each.
        visits: for each obligation the number of cases that visited it; empty without cases.
        news: position and visited bits of each case that visited something that no earlier one did.
        causes: why cases failed, in the order of the first case of each.
        failed_positions: the cases that failed, at most `MAX_LISTED`.
        unused: position and sentence of clauses without effect, at most ten.
        unused_count: how many there are.
        outcomes: the listed cases: all, or the notable ones.
        excuses: how many missed goals were excused for which reason, in the order of the first case of each.
        short: the same for the cases that passed.
        short_count: how many cases passed although they missed a goal.
        hazards: position and hazard of the first ten hazards at devices.
        hazard_count: how many there are.
        unjudged: how many cases `non_blocking` does not judge for which reason, in the order of the first case of each.
    """

    written: int = 0
    first: int = 1
    count: int = 0
    failed: int = 0
    ended_ns: int = 0
    ends: tuple[tuple[str, int], ...] = ()
    visits: tuple[int, ...] = ()
    news: tuple[tuple[int, int], ...] = ()
    causes: tuple[FailureCause, ...] = ()
    failed_positions: tuple[int, ...] = ()
    unused: tuple[tuple[int, str], ...] = ()
    unused_count: int = 0
    outcomes: tuple[CaseOutcome, ...] = ()
    excuses: tuple[tuple[Excuse, int], ...] = ()
    short: tuple[tuple[Excuse, int], ...] = ()
    short_count: int = 0
    hazards: tuple[tuple[int, Hazard], ...] = ()
    hazard_count: int = 0
    unjudged: tuple[tuple[Unjudged, int], ...] = ()

    @property
    def last(self) -> int:
        """The position of the last case."""
        return self.first + self.count - 1

    @property
    def is_whole(self) -> bool:
        """Whether all cases are listed."""
        return len(self.outcomes) == self.count

    @property
    def visited(self) -> int:
        """The obligations that any case visited, as bits."""
        union = 0
        for _, visited in self.news:
            union |= visited
        return union

    @property
    def last_new(self) -> int:
        """The position of the last case that visited something new; the position before the first if none did."""
        return self.news[-1][0] if self.news else self.first - 1

    def notable(self) -> BatchSummary:
        """Return the summary with the notable cases alone.

        These are the cases from files, those that visited something new, and the first ones of each cause.
        """
        named = {position for position, _ in self.news}
        named.update(position for cause in self.causes for position in cause.positions[:MAX_EXAMPLES])
        return replace(
            self, outcomes=tuple(o for o in self.outcomes if o.position <= self.written or o.position in named)
        )


def merge(left: BatchSummary, right: BatchSummary) -> BatchSummary:
    """Return the summary of two adjacent ranges. Raise `ValueError` if `right` does not follow `left`."""
    if not left.count:
        return right
    if not right.count:
        return left
    if right.first != left.last + 1:
        raise ValueError(f"cases {left.first} to {left.last} are not followed by case {right.first}")
    merged = BatchSummary(
        left.written,
        left.first,
        left.count + right.count,
        left.failed + right.failed,
        left.ended_ns + right.ended_ns,
        _added(left.ends, right.ends),
        tuple(mine + others for mine, others in zip(left.visits, right.visits, strict=True)),
        _joined_news(left, right),
        _joined_causes(left.causes, right.causes),
        (*left.failed_positions, *right.failed_positions)[:MAX_LISTED],
        (*left.unused, *right.unused)[:_MAX_UNUSED],
        left.unused_count + right.unused_count,
        (*left.outcomes, *right.outcomes),
        _added(left.excuses, right.excuses),
        _added(left.short, right.short),
        left.short_count + right.short_count,
        (*left.hazards, *right.hazards)[:MAX_HAZARDS],
        left.hazard_count + right.hazard_count,
        _added(left.unjudged, right.unjudged),
    )
    is_short = merged.last - merged.written <= MAX_LISTED and left.is_whole and right.is_whole
    return merged if is_short else merged.notable()


def _added(left: tuple[tuple[_Counted, int], ...], right: tuple[tuple[_Counted, int], ...]) -> _Counts[_Counted]:
    counts = dict(left)
    for each, count in right:
        counts[each] = counts.get(each, 0) + count
    return tuple(counts.items())


def _joined_news(left: BatchSummary, right: BatchSummary) -> tuple[tuple[int, int], ...]:
    """Return the cases that are new in the whole: a case that is not new in its own range is new in none."""
    union, news = left.visited, list(left.news)
    for position, visited in right.news:
        if visited & ~union:
            union |= visited
            news.append((position, visited))
    return tuple(news)


def _joined_causes(left: tuple[FailureCause, ...], right: tuple[FailureCause, ...]) -> tuple[FailureCause, ...]:
    causes = list(left)
    for cause in right:
        _add_cause(causes, cause)
    return tuple(causes)


def _add_cause(causes: list[FailureCause], cause: FailureCause) -> None:
    for index, known in enumerate(causes):
        if known.is_like(cause):
            positions = (*known.positions, *cause.positions)[:MAX_LISTED]
            causes[index] = FailureCause(known.failures, known.count + cause.count, positions)
            return
    causes.append(cause)


class SummaryBuilder(Struct):
    """Builds the summary of one range, case by case.

    Attributes:
        obligations: how many obligations the model has.
        written: as in `BatchSummary`.
        first: the position of the first case.
        lists_all: whether all cases are listed.
    """

    obligations: int
    written: int = 0
    first: int = 1
    lists_all: bool = True
    _ended_ns: int = 0
    _union: int = 0
    _ends: dict[str, int] = field(default_factory=dict)
    _excuses: dict[Excuse, int] = field(default_factory=dict)
    _short: dict[Excuse, int] = field(default_factory=dict)
    _short_count: int = 0
    _sets: dict[int, int] = field(default_factory=dict)
    _news: list[tuple[int, int]] = field(default_factory=list)
    _causes: list[FailureCause] = field(default_factory=list)
    _failed: list[int] = field(default_factory=list)
    _unused: list[tuple[int, str]] = field(default_factory=list)
    _hazards: list[tuple[int, Hazard]] = field(default_factory=list)
    _unjudged: dict[Unjudged, int] = field(default_factory=dict)
    _outcomes: list[CaseOutcome] = field(default_factory=list)
    _count: int = 0

    def add(self, outcome: CaseOutcome) -> None:
        """Add the next case."""
        self._count += 1
        self._ended_ns += outcome.ended_ns
        end, visited = outcome.verdict.end_in_words, outcome.visited
        self._ends[end] = self._ends.get(end, 0) + 1
        self._short_count += outcome.verdict.is_short
        for excuse in outcome.verdict.excuses:
            self._excuses[excuse] = self._excuses.get(excuse, 0) + 1
            if outcome.verdict.is_short:
                self._short[excuse] = self._short.get(excuse, 0) + 1
        self._sets[visited] = self._sets.get(visited, 0) + 1
        self._unused += [(outcome.position, sentence) for sentence in outcome.unused]
        if outcome.unjudged is not None:
            self._unjudged[outcome.unjudged] = self._unjudged.get(outcome.unjudged, 0) + 1
        self._hazards += [(outcome.position, hazard) for hazard in outcome.hazards]
        is_new = bool(visited & ~self._union)
        if is_new:
            self._union |= visited
            self._news.append((outcome.position, visited))
        if not outcome.verdict.passed:
            self._failed.append(outcome.position)
            for failures in _reasons(outcome.verdict.failures):
                _add_cause(self._causes, FailureCause(failures, 1, (outcome.position,)))
        if self.lists_all or is_new or not outcome.verdict.passed or outcome.position <= self.written:
            self._outcomes.append(outcome)

    def summary(self) -> BatchSummary:
        """Return the summary of the cases so far."""
        built = BatchSummary(
            self.written,
            self.first,
            self._count,
            len(self._failed),
            self._ended_ns,
            tuple(self._ends.items()),
            self._visits() if self._count else (),
            tuple(self._news),
            tuple(self._causes),
            tuple(self._failed[:MAX_LISTED]),
            tuple(self._unused[:_MAX_UNUSED]),
            len(self._unused),
            tuple(self._outcomes),
            tuple(self._excuses.items()),
            tuple(self._short.items()),
            self._short_count,
            tuple(self._hazards[:MAX_HAZARDS]),
            len(self._hazards),
            tuple(self._unjudged.items()),
        )
        return built if self.lists_all else built.notable()

    def _visits(self) -> tuple[int, ...]:
        """Return the number of visits of each obligation. Many cases visit the same set, so sets are counted."""
        visits = [0] * self.obligations
        for visited, count in self._sets.items():
            for bit in bits_of(visited):
                visits[bit] += count
        return tuple(visits)


def _reasons(failures: Iterable[Failure]) -> list[tuple[Failure, ...]]:
    """Return the reasons of one case: each failure once, and all unmet expectations together.

    Runs for several goals of a case can fail for one reason.
    """
    reasons: list[tuple[Failure, ...]] = []
    expected = []
    for failure in failures:
        if failure.kind is FailureKind.EXPECTATION:
            expected.append(failure)
        elif not any(failure.is_like(first) for (first,) in reasons):
            reasons.append((failure,))
    return [*reasons, tuple(expected)] if expected else reasons
