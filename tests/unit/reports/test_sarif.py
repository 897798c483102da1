"""SARIF: valid for the schema of OASIS, and with what GitHub's code scanning asks for."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from msgspec.structs import replace

from scbm.cases.trace import End
from scbm.reports.ci.sarif import sarif_log
from scbm.store import Drawn, History, ModelSource, Written
from scbm.testing import Failure, FailureKind, Verdict
from support.histories import EXAMPLE, history_of, with_lost_cases
from support.wording import Wording

TESTS = Path(__file__).parents[2]
FAILS = TESTS / "models/fails_at_run"
SCHEMA = json.loads((TESTS / "foreign/sarif-schema-2.1.0.json").read_text(encoding="utf-8"))


def run_of(history: History) -> dict[str, Any]:
    """The run of a log that the schema allows."""
    log = json.loads(sarif_log(history))
    jsonschema.Draft4Validator(SCHEMA, format_checker=jsonschema.FormatChecker()).validate(log)
    (run,) = log["runs"]
    return dict(run)


def here(history: History, text: str | None = None) -> History:
    """The history of a model that lies in the directory of the command."""
    (last,) = history.runs
    source = ModelSource(Path(history.source.path).name, text or history.source.text)
    return replace(history, runs=(replace(last, source=source),))


def failing(*failures: Failure, cases: int = 1) -> History:
    """The example with cases that failed so."""
    history = history_of(EXAMPLE / "before.yaml", cases)
    verdict = Verdict(End.REACHED, failures)
    return replace(history, cases=tuple(replace(case, verdict=verdict) for case in history.cases))


def line(result: dict[str, Any]) -> int:
    (location,) = result["locations"]
    return int(location["physicalLocation"]["region"]["startLine"])


def test_without_failures_there_are_no_results() -> None:
    run = run_of(history_of(EXAMPLE / "before.yaml", 20))
    assert run["results"] == []
    assert [rule["id"] for rule in run["tool"]["driver"]["rules"]] == [kind.value for kind in FailureKind]
    assert run["artifacts"] == [
        {"location": {"uri": "examples/robot_in_the_air/before.yaml", "uriBaseId": "%SRCROOT%"}}
    ]


@pytest.mark.parametrize(
    ("model", "rule", "word"),
    [
        ("requirement", "requirement", "open_while_pumping"),
        ("livelock", "livelock", "automatic_transitions"),
        ("model_error", "model_error", "behavior_model"),
        ("unsolvable", "not_reached", "inside"),
        ("time_limit", "not_reached", "inside"),
    ],
)
def test_a_failure_is_reported_at_what_it_broke(model: str, rule: str, word: str) -> None:
    history = here(history_of(FAILS / f"{model}.yaml", 5))
    run = run_of(history)
    (result,) = run["results"]
    assert result["ruleId"] == rule
    assert run["tool"]["driver"]["rules"][result["ruleIndex"]]["id"] == rule
    assert result["level"] == "error"
    assert history.cases[0].verdict.failures[0].message in result["message"]["text"]
    assert ", ".join(history.labels[:3]) in result["message"]["text"]
    assert f"again: scbm run {model}.yaml --seed 1 --case 1" in result["message"]["text"]
    assert result["properties"]["cases"] == list(history.labels)
    place = result["locations"][0]["physicalLocation"]
    assert place["artifactLocation"] == {"uri": f"{model}.yaml", "uriBaseId": "%SRCROOT%"}
    region = place["region"]
    text = history.source.text.splitlines()[region["startLine"] - 1]
    assert text[region["startColumn"] - 1 : region["endColumn"] - 1] == word


def test_each_expectation_of_a_case_is_reported_in_its_file(tmp_path: Path) -> None:
    path = tmp_path / "two ways.yaml"
    path.write_text(
        "case: two_ways\ngoal: item_a_scanned\nexpect: {final: robot_at == agv, plan: []}\n", encoding="utf-8"
    )
    history = history_of(EXAMPLE / "before.yaml", 1, written=[path])
    run = run_of(history)
    assert [result["ruleId"] for result in run["results"]] == ["expectation", "expectation"]
    uri = f"file://{tmp_path}/two%20ways.yaml"
    for result in run["results"]:
        assert result["locations"] == [
            {"physicalLocation": {"artifactLocation": {"uri": uri}, "region": {"startLine": 1}}}
        ]
        assert result["properties"]["cases"] == ["two_ways"]
    assert run["artifacts"][1] == {"location": {"uri": uri}}


def test_a_requirement_that_is_not_of_the_model_is_reported_where_it_comes_from() -> None:
    history = failing(Failure(FailureKind.REQUIREMENT, "safe", "safe is violated"))
    written = replace(history.cases[0], recipe=Written("case: one", "cases/one.yaml"))
    (result,) = run_of(replace(history, cases=(written,)))["results"]
    assert result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == "cases/one.yaml"
    drawn = replace(history.cases[0], recipe=Drawn(1, 1, requirements=(("safe", "always false"),)))
    (result,) = run_of(replace(history, cases=(drawn,)))["results"]
    assert result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] == history.source.path
    assert line(result) == 1
    assert "--require 'always false'" in result["message"]["text"]


def test_causes_differ_by_kind_subject_goal_and_case() -> None:
    first = Failure(FailureKind.NOT_REACHED, "unsolvable", "not reached")
    history = failing(first, cases=4)
    goals = [case.goal for case in history.cases]
    results = run_of(history)["results"]
    assert [result["properties"]["goal"] for result in results] == list(dict.fromkeys(goals))
    assert [result["properties"]["cases"] for result in results] == [
        [label for label, goal in zip(history.labels, goals, strict=True) if goal == wanted]
        for wanted in dict.fromkeys(goals)
    ]
    places = {result["properties"]["goal"]: line(result) for result in results}
    texts = history.source.text.splitlines()
    assert all(texts[number - 1].strip().startswith(f"{goal}:") for goal, number in places.items())


def test_fingerprints_stay_when_lines_values_and_cases_change() -> None:
    history = here(history_of(FAILS / "requirement.yaml", 3))
    (before,) = run_of(history)["results"]
    moved = here(history_of(FAILS / "requirement.yaml", 1, seed=9), "# more\n\n" + history.source.text)
    later = replace(moved.cases[0].verdict.failures[0], message="open_while_pumping is violated at 7.000 s")
    verdict = Verdict(End.REACHED, (later,))
    (after,) = run_of(replace(moved, cases=(replace(moved.cases[0], verdict=verdict),)))["results"]
    assert before["message"] != after["message"]
    assert line(after) == line(before) + 2
    assert after["partialFingerprints"] == before["partialFingerprints"]
    other = Failure(FailureKind.REQUIREMENT, "other", "other is violated")
    first, second = run_of(failing(Failure(FailureKind.REQUIREMENT, "one", "violated"), other))["results"]
    assert first["partialFingerprints"] != second["partialFingerprints"]


def test_github_gets_what_it_needs() -> None:
    run = run_of(here(history_of(FAILS / "requirement.yaml", 3)))
    for rule in run["tool"]["driver"]["rules"]:
        assert all(rule[key]["text"] for key in ("shortDescription", "fullDescription", "help"))
    for result in run["results"]:
        assert result["partialFingerprints"]["primaryLocationLineHash"]
        assert len(result["message"]["text"]) > 0
    assert run["automationDetails"]["id"] == "scbm/requirement/"


@pytest.mark.parametrize(
    ("path", "uri"),
    [
        ("models\\cell.yaml", "models/cell.yaml"),
        ("./größe & 1.yaml", "gr%C3%B6%C3%9Fe%20%26%201.yaml"),
        ("a:b.yaml", "./a:b.yaml"),
        ("a:b/c.yaml", "./a:b/c.yaml"),
        ("a/b:c.yaml", "a/b:c.yaml"),
    ],
)
def test_addresses_are_relative_with_forward_slashes(path: str, uri: str) -> None:
    history = history_of(EXAMPLE / "before.yaml", 1)
    run = run_of(replace(history, runs=(replace(history.runs[0], source=ModelSource(path, history.source.text)),)))
    assert run["artifacts"] == [{"location": {"uri": uri, "uriBaseId": "%SRCROOT%"}}]


def test_a_drive_is_no_part_of_a_repository() -> None:
    history = history_of(EXAMPLE / "before.yaml", 1)
    run = run_of(
        replace(history, runs=(replace(history.runs[0], source=ModelSource("C:\\m.yaml", history.source.text)),))
    )
    assert run["artifacts"] == [{"location": {"uri": "file:///C:/m.yaml"}}]


def fingerprints(history: History) -> list[str]:
    return [result["partialFingerprints"]["scbmCause/v1"] for result in run_of(history)["results"]]


def test_fingerprints_distinguish_the_files_of_causes() -> None:
    history = here(history_of(FAILS / "requirement.yaml", 1))
    (last,) = history.runs
    moved = replace(last, source=ModelSource(f"other/{last.source.path}", last.source.text))
    assert fingerprints(history) != fingerprints(replace(history, runs=(moved,)))


def test_fingerprints_distinguish_the_cases_of_expectations() -> None:
    """A test in Python has several cases in one file, and files can have cases of one name."""
    history = failing(Failure(FailureKind.EXPECTATION, "final", "expected"), cases=3)
    tests = (("one", "test_cell.py"), ("two", "test_cell.py"), ("two", "test_other.py"))
    cases = tuple(
        replace(case, name=name, key=bytes([number]) * 16, recipe=Written(f"case: {name}", path))
        for number, (case, (name, path)) in enumerate(zip(history.cases, tests, strict=True))
    )
    assert len(dict.fromkeys(fingerprints(replace(history, cases=cases)))) == 3


def test_only_files_of_cases_that_failed_are_artifacts() -> None:
    history = history_of(EXAMPLE / "before.yaml", 2)
    failed = Verdict(End.REACHED, (Failure(FailureKind.EXPECTATION, "final", "expected"),))
    good, bad = history.cases
    cases = (
        replace(good, recipe=Written("case: good", "good.yaml")),
        replace(bad, recipe=Written("case: bad", "bad.yaml"), verdict=failed),
    )
    artifacts = run_of(replace(history, cases=cases))["artifacts"]
    assert [each["location"]["uri"] for each in artifacts] == [history.source.path, "bad.yaml"]


@pytest.mark.parametrize("cases", [2, 3, 4, 5])
def test_as_many_cases_are_counted_as_are_not_named(cases: int, wording: Wording) -> None:
    history = failing(Failure(FailureKind.LIVELOCK, "round", "goes round"), cases=cases)
    (result,) = run_of(history)["results"]
    assert len(result["properties"]["cases"]) == cases
    wording(result["message"]["text"].splitlines()[1])


def test_lost_cases_are_one_result_that_no_command_shows_again() -> None:
    run = run_of(with_lost_cases(history_of(EXAMPLE / "before.yaml", 3), 2))
    (result,) = run["results"]
    assert (result["ruleId"], result["properties"]["cases"]) == ("lost", ["seed-1-case-1", "seed-1-case-2"])
    assert run["tool"]["driver"]["rules"][result["ruleIndex"]]["id"] == "lost"
    assert "again" not in result["message"]["text"]
