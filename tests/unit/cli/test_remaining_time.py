"""How long an activity with a limit takes at most, by its rate so far."""

from __future__ import annotations

from scbm.cli.output.progress import RemainingTime
from scbm.closing.counted_activity import CountedActivity
from support.wording import Wording


def test_the_rate_of_an_activity_gives_its_longest_time(wording: Wording) -> None:
    seconds = 0.0
    remaining = RemainingTime(lambda: seconds)

    def at(now_s: float, name: str, done: int) -> str:
        nonlocal seconds
        seconds = now_s
        return remaining.of(CountedActivity.of(name, done, 300_000, "situations").behind("3 of 9 open; "))

    assert at(5.0, "exploring", 0) == ""
    wording(at(7.0, "exploring", 20_000))
    wording(at(10.0, "exploring", 30_000))
    assert at(11.0, "exploring more", 10_000) == ""
    wording(at(12.0, "exploring more", 110_000))
    assert remaining.of("looking for suggestions") == ""


def test_an_activity_names_its_counts(wording: Wording) -> None:
    wording(CountedActivity.of("exploring", 20_000, 300_000, "situations").behind("3 of 9 open; "))
