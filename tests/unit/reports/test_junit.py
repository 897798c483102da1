"""JUnit XML: valid for Jenkins' schema, and read by a library that is not ours."""

from __future__ import annotations

from pathlib import Path

import pytest
from junitparser import Error, JUnitXml, TestCase, TestSuite
from lxml import etree
from msgspec.structs import replace

from scbm.cases.trace import End
from scbm.reports.ci.junit import junit_xml
from scbm.store import History
from scbm.testing import Failure, FailureKind, Verdict
from support.histories import EXAMPLE, history_of, with_lost_cases
from support.wording import Wording

TESTS = Path(__file__).parents[2]
FAILS = TESTS / "models/fails_at_run"
SCHEMA = etree.XMLSchema(etree.parse(TESTS / "foreign/junit-10.xsd"))


def read(history: History) -> tuple[TestSuite, list[TestCase]]:
    """The suite of a file that the schema allows, and its cases."""
    text = junit_xml(history)
    SCHEMA.assertValid(etree.fromstring(text.encode()))
    (suite,) = JUnitXml.fromstring(text.encode())
    return suite, list(suite)


def failing(history: History, *failures: Failure) -> History:
    """The history with its first case failed."""
    first, *others = history.cases
    return replace(history, cases=(replace(first, verdict=Verdict(End.REACHED, failures)), *others))


def test_each_case_is_a_test() -> None:
    history = history_of(EXAMPLE / "after.yaml", 20, written=sorted((EXAMPLE / "cases").glob("*.yaml")))
    suite, cases = read(history)
    assert suite.name == "robot_in_the_air"
    assert (suite.tests, suite.failures, suite.errors, suite.skipped) == (len(history.cases), 0, 0, 0)
    assert suite.time == pytest.approx(history.ended_ns / 1e9, abs=1e-3)
    assert suite.timestamp == "2026-11-21T12:00:00"
    assert [(case.name, case.classname) for case in cases] == [(label, "robot_in_the_air") for label in history.labels]
    assert [case.time for case in cases] == [pytest.approx(c.ended_ns / 1e9, abs=1e-3) for c in history.cases]
    assert all(case.is_passed for case in cases)


def test_the_suite_says_what_it_comes_from() -> None:
    suite, _ = read(history_of(EXAMPLE / "before.yaml", 20, seed=7))
    read_properties = suite.properties()  # type: ignore[no-untyped-call] # the library says no type of it
    properties = {each.name: each.value for each in read_properties}
    assert properties["model_file"] == "examples/robot_in_the_air/before.yaml"
    assert properties["command"].startswith("scbm test examples/robot_in_the_air/before.yaml --cases 20 --seed 7")
    assert properties["seed"] == "7"
    visited, of = int(properties["obligations_visited"]), int(properties["obligations"])
    assert properties["scbm_ias"] == f"{100 * visited / of:.2f} %"


@pytest.mark.parametrize("kind", ["requirement", "livelock", "model_error", "unsolvable", "time_limit"])
def test_a_case_that_failed_says_why_and_how_to_see_it(kind: str) -> None:
    history = history_of(FAILS / f"{kind}.yaml", 2)
    suite, (case, _) = read(history)
    assert (suite.failures, suite.errors) == (2, 0)
    (failure,) = case.result
    shown = history.cases[0].verdict.failures[0]
    assert failure.type == shown.kind.value
    assert failure.message == shown.message
    assert shown.message in failure.text
    assert f"again: scbm run {history.source.path} --seed 1 --case 1" in failure.text


def test_several_failures_of_a_case_are_all_reported(wording: Wording) -> None:
    failures = (
        Failure(FailureKind.REQUIREMENT, "first", "first is broken"),
        Failure(FailureKind.EXPECTATION, "final", "expected a at the end"),
    )
    _, (case, _) = read(failing(history_of(FAILS / "requirement.yaml", 2), *failures))
    (failure,) = case.result
    wording(failure.message)
    assert "".join(f"{each.kind.value} {each.subject}: {each.message}\n" for each in failures) in failure.text


def test_characters_that_xml_forbids_become_escapes() -> None:
    odd = Failure(FailureKind.EXPECTATION, "<final>", '"a" < b & c\x00\x1b[31m\ud800 ü 模\x7f')
    _, (case, _) = read(failing(history_of(FAILS / "requirement.yaml", 2), odd))
    (failure,) = case.result
    assert failure.message == '"a" < b & c\\x00\\x1b[31m\\ud800 ü 模\\x7f'
    assert "expectation <final>: " in failure.text


def test_no_cases_are_an_empty_suite() -> None:
    suite, cases = read(replace(history_of(EXAMPLE / "before.yaml", 1), cases=()))
    assert cases == []
    assert (suite.tests, suite.time) == (0, 0)


def test_a_case_of_an_earlier_model_names_no_command() -> None:
    history = history_of(FAILS / "requirement.yaml", 1)
    _, (case,) = read(replace(history, cases=(replace(history.cases[0], is_earlier=True),)))
    assert "again" not in case.result[0].text


def test_of_several_runs_the_last_is_reported(wording: Wording) -> None:
    history = history_of(EXAMPLE / "before.yaml", 1)
    (first,) = history.runs
    last = replace(first, id="2", started="2026-11-22T13:14:15.600000Z", command="scbm test later.yaml")
    suite, _ = read(replace(history, runs=(first, last)))
    assert suite.timestamp == "2026-11-22T13:14:15"
    read_properties = suite.properties()  # type: ignore[no-untyped-call] # the library says no type of it
    wording([each.value for each in read_properties if each.name == "command"])


def test_a_case_that_was_lost_is_an_error_as_it_was_not_carried_out(wording: Wording) -> None:
    history = with_lost_cases(history_of(EXAMPLE / "before.yaml", 4), 2)
    suite, cases = read(history)
    assert (suite.tests, suite.failures, suite.errors) == (4, 0, 2)
    for case in cases[:2]:
        (error,) = case.result
        assert isinstance(error, Error)
        assert error.type == "lost"
        wording(error.message)
        wording(error.text)
        assert "again:" not in error.text
    assert all(case.is_passed for case in cases[2:])
