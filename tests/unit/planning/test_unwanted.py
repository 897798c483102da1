"""A search that its caller cancels stops, and leaves no answer behind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pytest

from scbm.files import read_model
from scbm.model import BehaviorModel
from scbm.planning import Answer, PlanCache, PlanLimits, Planner, SearchCancelledError, Solved

DIGITS = range(4)


def digits() -> BehaviorModel:
    """Ten thousand states; the goal is the last that a search finds."""
    variables = "".join(f"  d{digit}: {{domain: 0..9, initial: 0}}\n" for digit in DIGITS)
    operations = "".join(
        f"  count_{d}: {{pre: {{g: d{d} < 9, a: [d{d} += 1]}}, post: {{g: true, a: []}}}}\n" for d in DIGITS
    )
    goal = " && ".join(f"d{digit} == 9" for digit in DIGITS)
    goals = f"goals: {{all: {goal}, one: d0 == 1}}\n"
    return read_model(f"behavior_model: digits\nvariables:\n{variables}operations:\n{operations}{goals}")


MODEL = digits()
START, GOALS = MODEL.nominal_state, dict(MODEL.goals)
LIMITS = PlanLimits()


@dataclass
class Patience:
    """A caller that cancels its search after so many questions whether it still wants the answer."""

    most: int
    asked: int = 0

    def __call__(self) -> bool:
        self.asked += 1
        return self.asked <= self.most


def searched(should_continue: Callable[[], bool]) -> Answer:
    return Planner(MODEL).plan(START, GOALS["all"], LIMITS, should_continue)


def test_as_long_as_it_is_wanted_a_search_goes_on_and_what_is_soon_found_is_not_asked_about() -> None:
    patience = Patience(100)
    answer = searched(patience)
    assert isinstance(answer, Solved)
    assert len(answer.plan) == 36
    assert answer.expanded // 1_000 <= patience.asked < 100
    hasty = Patience(0)
    assert Planner(MODEL).plan(START, GOALS["one"], LIMITS, hasty) == Solved(("count_0",), 1)
    assert hasty.asked == 0


@pytest.mark.parametrize("most", [0, 3])
def test_once_it_is_unwanted_a_search_ends(most: int) -> None:
    patience = Patience(most)
    with pytest.raises(SearchCancelledError):
        searched(patience)
    assert patience.asked == most + 1


def test_a_limit_that_comes_first_is_the_answer() -> None:
    limits = PlanLimits(expansions=1_000)
    answer = Planner(MODEL).plan(START, GOALS["all"], limits, Patience(0))
    assert (answer.status, answer.expanded) == ("limit_reached", 1_000)


@pytest.mark.parametrize("most", [0, 3, 8])
@pytest.mark.parametrize("first_budget", [1, 20_000], ids=["all at once", "one by one"])
def test_nothing_is_remembered_of_a_search_that_was_stopped(first_budget: int, most: int) -> None:
    plans, fresh = PlanCache(Planner(MODEL), first_budget), PlanCache(Planner(MODEL), first_budget)
    near = START.replace({f"d{digit}": 8 for digit in DIGITS})
    for other in (plans, fresh):
        other.plan(near, GOALS["all"])  # behind a budget of one its distances are worked out
    for _ in range(2):
        with pytest.raises(SearchCancelledError):
            plans.plan(START, GOALS["all"], LIMITS, Patience(most))
    answer = plans.plan(START, GOALS["all"])
    assert answer == fresh.plan(START, GOALS["all"])
    assert isinstance(answer, Solved)
    assert len(answer.plan) == 36


@pytest.mark.slow
def test_distances_that_were_not_worked_out_to_their_end_are_worked_out_again() -> None:
    stopped, fresh = Planner(MODEL).policy(GOALS["all"]), Planner(MODEL).policy(GOALS["all"])
    start = stopped.task.pack(START)
    for most in range(12):
        with pytest.raises(SearchCancelledError):
            stopped.plan(start, Patience(most))
    answer = stopped.plan(start)
    assert answer == fresh.plan(start)
    assert isinstance(answer, Solved)
    assert len(answer.plan) == 36
