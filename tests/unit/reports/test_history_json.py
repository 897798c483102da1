"""A store as JSON: all of it, and the same as the objects say."""

from __future__ import annotations

import json
from pathlib import Path

from msgspec.structs import replace

from scbm.cases.coverage.set_cover import Cover
from scbm.reports.ci.history_json import history_json, smallest_json
from scbm.store import Drawn
from scbm.testing.campaign_results_json import coverage_json
from support.histories import EXAMPLE, history_of, with_lost_cases

CASES = sorted((EXAMPLE / "cases").glob("*.yaml"))
FAILS = Path(__file__).parents[2] / "models/fails_at_run"


def test_it_holds_the_figures_the_runs_and_the_cases() -> None:
    history = history_of(EXAMPLE / "after.yaml", 5, written=CASES)
    report = json.loads(json.dumps(history_json(history)))
    assert (report["format_version"], report["model"], report["passed"]) == (4, "robot_in_the_air", True)
    assert report["model_file"] == "examples/robot_in_the_air/after.yaml"
    assert report["model_text"] == history.source.text
    assert report["coverage"] == coverage_json(history.coverage)
    assert report["simulated_seconds"] == history.ended_ns / 1e9
    assert [run["id"] for run in report["runs"]] == [history.runs[0].id]
    assert report["runs"][0]["visited"] == list(history.obligations.names(history.runs[0].visited))
    assert [case["label"] for case in report["cases"]] == list(history.labels)
    assert [case["key"] for case in report["cases"]] == [case.key.hex() for case in history.cases]
    assert {case["recipe"]["kind"] for case in report["cases"]} == {"written", "drawn"}


def test_who_visits_what_is_reported_from_both_sides() -> None:
    history = history_of(EXAMPLE / "after.yaml", 5, written=CASES)
    report = history_json(history)
    visited = {case["label"]: case["visited"] for case in report["cases"]}
    assert list(report["visited_by"]) == [str(obligation) for obligation in history.obligations]
    for obligation in history.obligations:
        name = str(obligation)
        assert report["visited_by"][name] == list(history.coverage.visitors(obligation))
        assert report["visited_by"][name] == [label for label, names in visited.items() if name in names]
    alone = {case["label"]: case["only_it_visits"] for case in report["cases"]}
    assert any(alone.values())
    assert [(name, label) for label, names in alone.items() for name in names] == [
        (name, labels[0])
        for label in history.labels
        for name, labels in report["visited_by"].items()
        if labels == [label]
    ]


def test_a_case_that_failed_says_why() -> None:
    report = history_json(history_of(FAILS / "requirement.yaml", 1))
    assert report["passed"] is False
    (case,) = report["cases"]
    assert (case["passed"], case["verdict"]) == (False, "reached")
    assert [(failure["kind"], failure["subject"]) for failure in case["failures"]] == [
        ("requirement", "open_while_pumping")
    ]
    assert case["again"].endswith("--seed 1 --case 1 --goals 1")


def test_what_a_drawn_case_was_drawn_from_is_reported() -> None:
    history = history_of(EXAMPLE / "before.yaml", 1)
    recipe = Drawn(3, 7, "loss=1 %", (("safe", "always false"),), 1_500_000_000)
    case = replace(history.cases[0], recipe=recipe, is_earlier=True)
    (report,) = history_json(replace(history, cases=(case,)))["cases"]
    assert report["recipe"] == {
        "kind": "drawn",
        "seed": 3,
        "number": 7,
        "network": "loss=1 %",
        "requirements": {"safe": "always false"},
        "time_limit_seconds": 1.5,
        "goals": 1,
    }
    assert (report["is_earlier"], report["again"]) == (True, None)


def test_the_smallest_suite_is_reported_by_its_labels() -> None:
    history = history_of(EXAMPLE / "before.yaml", 5)
    report = smallest_json(history, Cover((0, 3), 1))
    assert report == {
        "cases": ["seed-1-case-1", "seed-1-case-4"],
        "at_least": 1,
        "is_smallest": False,
        "requests": history.cases[0].requests + history.cases[3].requests,
        "simulated_seconds": (history.cases[0].ended_ns + history.cases[3].ended_ns) / 1e9,
    }


def test_each_case_names_the_run_that_had_it_last() -> None:
    history = history_of(EXAMPLE / "before.yaml", 3)
    (first,) = history.runs
    cases = tuple(replace(case, run=run) for case, run in zip(history.cases, (0, 1, 1), strict=True))
    report = history_json(replace(history, runs=(first, replace(first, id="2")), cases=cases))
    assert [run["id"] for run in report["runs"]] == [first.id, "2"]
    assert [case["run"] for case in report["cases"]] == [first.id, "2", "2"]


def test_a_lost_case_failed_and_no_command_shows_it_again() -> None:
    report = history_json(with_lost_cases(history_of(EXAMPLE / "after.yaml", 2), 1))
    lost, other = report["cases"]
    assert (lost["verdict"], lost["passed"], lost["again"], lost["visited"]) == ("lost", False, None, [])
    assert [failure["kind"] for failure in lost["failures"]] == ["lost"]
    assert other["again"]
