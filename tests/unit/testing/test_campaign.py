"""Campaigns: what is kept of each case, and that a case alone decides its run."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.notation import load_model
from scbm.testing import RandomCases, Tester, campaign_json
from scbm.trace import write_trace

EXAMPLE = Path(__file__).parents[3] / "examples" / "robot_in_the_air"


@pytest.mark.parametrize("name", ["before", "after"])
def test_a_case_replays_to_the_same_trace_byte_for_byte(name: str) -> None:
    model = load_model(EXAMPLE / f"{name}.yaml")
    for case in RandomCases(model).first(15, seed=2):
        first = Tester(model).execute(case)
        assert first.case.reactions
        again = Tester(model).execute(first.case)
        assert write_trace(again.trace) == write_trace(first.trace)
        assert again == first


def test_results_do_not_depend_on_the_order_of_the_cases() -> None:
    model = load_model(EXAMPLE / "before.yaml")
    cases = list(RandomCases(model).first(12, seed=7))
    forwards, backwards = list(Tester(model).results(cases)), list(Tester(model).results(cases[::-1]))
    assert forwards == backwards[::-1]


def test_two_halves_add_up_to_the_whole() -> None:
    model = load_model(EXAMPLE / "before.yaml")
    tester = Tester(model)
    results = list(tester.results(RandomCases(model).first(20, seed=1)))
    whole = tester.campaign(results, seed=1)
    halves = tester.campaign(results[:10], 1).coverage + tester.campaign(results[10:], 1).coverage
    assert halves == whole.coverage
    assert campaign_json(whole)["coverage"]["visited"] == halves.figure.visited
