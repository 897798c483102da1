"""Summaries of batches: merging them gives the summary of the whole, however the cases are divided."""

from __future__ import annotations

from collections.abc import Sequence
from functools import reduce
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.cases.trace import End
from scbm.testing import Failure, FailureKind, Verdict
from scbm.testing.batches import batch_summary
from scbm.testing.batches.batch_summary import BatchSummary, CaseOutcome, SummaryBuilder, merge
from support.wording import Wording

OBLIGATIONS = 6
WRITTEN = 2

FAILURES = st.sampled_from(
    [
        Failure(FailureKind.REQUIREMENT, "safe", "broken at 1 s"),
        Failure(FailureKind.REQUIREMENT, "safe", "broken at 2 s"),
        Failure(FailureKind.LIVELOCK, "livelock", "round and round"),
        Failure(FailureKind.EXPECTATION, "verdict", "another end"),
    ]
)
VERDICTS = st.builds(
    Verdict, st.sampled_from([End.REACHED, End.ABORTED, End.LIVELOCK]), st.lists(FAILURES, max_size=2).map(tuple)
)


@st.composite
def outcomes(draw: st.DrawFn) -> list[CaseOutcome]:
    return [
        CaseOutcome(
            position,
            draw(VERDICTS),
            draw(st.integers(0, 5)),
            draw(st.integers(0, 3)),
            draw(st.integers(0, 2**OBLIGATIONS - 1)),
            draw(st.lists(st.sampled_from(["a rule", "an injection"]), max_size=2).map(tuple)),
        )
        for position in range(1, draw(st.integers(0, 14)) + 1)
    ]


def summary_of(cases: Sequence[CaseOutcome], first: int = 1, *, lists_all: bool = True) -> BatchSummary:
    builder = SummaryBuilder(OBLIGATIONS, WRITTEN, first, lists_all)
    for outcome in cases:
        builder.add(outcome)
    return builder.summary()


@given(outcomes(), st.lists(st.integers(0, 14)))
def test_the_division_into_batches_does_not_matter(cases: list[CaseOutcome], cuts: list[int]) -> None:
    ends = sorted({cut for cut in cuts if cut < len(cases)} | {0, len(cases)})
    parts = [cases[begin:end] for begin, end in pairwise(ends)]
    summaries = [summary_of(part, part[0].position) for part in parts]
    whole = summary_of(cases)
    assert reduce(merge, summaries, BatchSummary(WRITTEN)) == whole or not cases
    assert (
        reduce(lambda right, left: merge(left, right), reversed(summaries), BatchSummary(WRITTEN)) == whole or not cases
    )


@pytest.mark.longer
@given(outcomes(), st.lists(st.integers(0, 14)))
def test_of_many_cases_the_same_notable_ones_are_listed_however_they_are_divided(
    cases: list[CaseOutcome], cuts: list[int]
) -> None:
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(batch_summary, "MAX_LISTED", 5)
        patched.setattr(batch_summary, "MAX_EXAMPLES", 2)
        limit = WRITTEN + 5
        ends = sorted({cut for cut in cuts if cut < len(cases)} | {0, min(limit, len(cases)), len(cases)})
        parts = [cases[begin:end] for begin, end in pairwise(ends) if begin < end]
        summaries = [summary_of(p, p[0].position, lists_all=p[-1].position <= limit) for p in parts]
        whole = summary_of(cases, lists_all=len(cases) <= limit)
        merged = reduce(merge, summaries, BatchSummary(WRITTEN))
        assert merged.outcomes == whole.outcomes
        assert merged.failed_positions == whole.failed_positions
        assert [(c.count, c.positions[:2]) for c in merged.causes] == [(c.count, c.positions[:2]) for c in whole.causes]


def test_only_adjacent_batches_are_merged(wording: Wording) -> None:
    one = summary_of([CaseOutcome(1, Verdict(End.REACHED), 1, 1, 1, ())])
    three = summary_of([CaseOutcome(3, Verdict(End.REACHED), 1, 1, 1, ())], 3)
    with wording.raises(ValueError):
        merge(one, three)


def test_what_no_earlier_case_visited_is_new() -> None:
    visits = [0b001, 0b001, 0b011, 0b010, 0b100]
    cases = [CaseOutcome(n, Verdict(End.REACHED), 1, 1, visited, ()) for n, visited in enumerate(visits, start=1)]
    halves = merge(summary_of(cases[:3]), summary_of(cases[3:], 4))
    assert [position for position, _ in halves.news] == [1, 3, 5]
    assert (halves.last_new, halves.visited, halves.visits[:3]) == (5, 0b111, (3, 2, 1))
