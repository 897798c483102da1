"""Short lists of obligations."""

from __future__ import annotations

from scbm.cases.coverage import STATE_ASPECTS, Aspect, Obligation
from scbm.closing.summaries import aspects_in_words, in_few_words, plan_in_words
from support.wording import Wording


def test_operations_with_equal_aspects_are_reported_together_and_automatic_ones_last() -> None:
    shown = in_few_words(
        [
            Obligation("give_up", Aspect.TAKEN),
            Obligation("pick", Aspect.COMPLETED),
            Obligation("scan", Aspect.FAILED),
            Obligation("place", Aspect.COMPLETED),
            Obligation("scan", Aspect.DISABLED),
            Obligation("forget", Aspect.TAKEN),
        ]
    )
    assert shown == ("pick, place: completed", "scan: disabled, failed", "automatic/give_up, automatic/forget")


def test_all_states_are_reported_as_one(wording: Wording) -> None:
    every = aspects_in_words(STATE_ASPECTS)
    wording(every)
    assert aspects_in_words((Aspect.QUEUED, *STATE_ASPECTS)) == f"{every}, queued"
    assert aspects_in_words((Aspect.QUEUED, Aspect.EXECUTING)) == "executing, queued"


def test_nothing_is_reported_without_a_subject() -> None:
    assert in_few_words([]) == ()


def test_what_a_plan_does_several_times_in_a_row_is_reported_once() -> None:
    plan = [*["move"] * 20, "pick", "move", "move"]
    assert plan_in_words(plan, " -> ") == "move \N{MULTIPLICATION SIGN}20 -> pick -> move \N{MULTIPLICATION SIGN}2"
    assert plan_in_words([], " -> ") == ""
