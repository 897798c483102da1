"""Campaigns: what is kept of each case, and that a case alone decides its run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from scbm.cases import Recorded
from scbm.notation import load_model
from scbm.testing import Campaign, RandomCases, Tester, campaign_json
from scbm.trace import write_trace

EXAMPLE = Path(__file__).parents[3] / "examples" / "robot_in_the_air"


@pytest.mark.parametrize("name", ["before", "after"])
def test_a_case_replays_to_the_same_trace_byte_for_byte(name: str) -> None:
    model = load_model(EXAMPLE / f"{name}.yaml")
    for case in RandomCases(model).first(15, seed=2):
        first = Tester(model).execute(case)
        assert first.reactions
        again = Tester(model).execute(replace(first.closed_case, origin=None))
        assert write_trace(again.trace) == write_trace(first.trace)
        assert (again.reactions, again.verdict, again.visited) == (first.reactions, first.verdict, first.visited)
        assert first.recorded_case.recorded == Recorded(first.verdict.end.value, again.digest)


def test_results_do_not_depend_on_the_order_of_the_cases() -> None:
    model = load_model(EXAMPLE / "before.yaml")
    cases = list(RandomCases(model).first(12, seed=7))
    forwards, backwards = list(Tester(model).results(cases)), list(Tester(model).results(cases[::-1]))
    assert forwards == backwards[::-1]


def test_two_halves_add_up_to_the_whole() -> None:
    model = load_model(EXAMPLE / "before.yaml")
    results = list(Tester(model).results(RandomCases(model).first(20, seed=1)))
    whole = Campaign.of(model, results)
    halves = Campaign.of(model, results[:10]).coverage + Campaign.of(model, results[10:]).coverage
    assert halves == whole.coverage
    assert campaign_json(whole, 1, (), ())["coverage"]["visited"] == halves.figure.visited
