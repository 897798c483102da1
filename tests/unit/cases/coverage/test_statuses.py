"""The statuses of obligations, and the figure of what can be covered."""

from __future__ import annotations

from scbm.cases.coverage import Decision, Figure, count_statuses, coverable_figure, status_counts_in_words


def test_statuses_stand_in_the_order_in_which_they_apply() -> None:
    assert [status.value for status in Decision] == [
        "covered",
        "uncoverable",
        "excluded",
        "waived",
        "forced",
        "undecided",
    ]


def test_what_can_be_covered_leaves_out_uncoverable_excluded_and_waived_obligations() -> None:
    counts = count_statuses([*Decision, Decision.COVERED])
    assert coverable_figure(counts) == Figure(2, 4)


def test_statuses_that_are_rare_are_named_only_where_they_occur() -> None:
    counts = count_statuses([Decision.COVERED, Decision.COVERED])
    assert status_counts_in_words(counts) == "2 covered, 0 uncoverable, 0 undecided of 2"
    counts = count_statuses(Decision)
    assert status_counts_in_words(counts) == (
        "1 covered, 1 uncoverable, 1 excluded by the planner, 1 waived, 1 covered by a forced state, 1 undecided of 6"
    )
