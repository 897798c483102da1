"""Each report that counts cases says how many passed short of their goal, and why."""

from __future__ import annotations

import re

import pytest
from msgspec.structs import replace

from scbm.cases.trace import End
from scbm.reports.ci.history_json import history_json
from scbm.reports.ci.junit import junit_xml
from scbm.reports.ci.markdown import markdown
from scbm.reports.figure_table import short_of_goal_in_words
from scbm.reports.html import html_report
from scbm.reports.terminal.store_report import stored_report
from scbm.store import History
from scbm.testing import Excuse, Failure, FailureKind, Verdict
from support.histories import EXAMPLE, history_of
from support.wording import Wording

WORDS = "3 cases, 2 by a fault, 1 by the verdict that the case expects"


@pytest.fixture
def history() -> History:
    """Five cases: three passed short of their goal, one reached it, and one failed."""
    failure = Failure(FailureKind.BUILT_IN, "no_orphan", "no_orphan is violated")
    verdicts = (
        Verdict(End.ABORTED, (), (Excuse.FAULT,)),
        Verdict(End.UNSOLVABLE, (), (Excuse.EXPECTED,)),
        Verdict(End.REACHED),
        Verdict(End.TIME_LIMIT, (), (Excuse.FAULT,)),
        Verdict(End.ABORTED, (failure,), (Excuse.FAULT,)),
    )
    found = history_of(EXAMPLE / "after.yaml", len(verdicts))
    pairs = zip(found.cases, verdicts, strict=True)
    return replace(found, cases=tuple(replace(case, verdict=verdict) for case, verdict in pairs))


def test_failed_cases_do_not_count(history: History) -> None:
    assert (history.short_count, history.short) == (3, {Excuse.FAULT: 2, Excuse.EXPECTED: 1})


def test_the_terminal_says_it(history: History, wording: Wording) -> None:
    (line,) = [text for line in stored_report(history, "cov.db") if WORDS in (text := str(line))]
    wording(line)


@pytest.mark.longer
def test_markdown_and_the_page_say_it(history: History, wording: Wording) -> None:
    for text in (markdown(history), html_report(history, lambda _: None)):
        wording(re.findall(rf"\w[\w ]*: {WORDS}", text))


def test_the_page_sets_names_as_code(history: History) -> None:
    case = replace(history.cases[0], verdict=Verdict(End.ABORTED, (), (Excuse.MAY_END,)))
    text = html_report(replace(history, cases=(case,)), lambda _: None)
    assert "by <code>may_end</code>" in text


def test_junit_says_it_of_the_suite_and_of_each_case(history: History, wording: Wording) -> None:
    text = junit_xml(history)
    assert f'name="cases_short_of_goal" value="{WORDS}"' in text
    wording(excused := re.findall(r">(.*, excused by .*)<", text))
    assert len(excused) == 3


def test_json_has_the_number_and_the_reasons(history: History) -> None:
    data = history_json(history)
    assert data["short_of_goal"] == 3
    assert [case["excused"] for case in data["cases"]] == [["fault"], ["expected"], [], ["fault"], ["fault"]]


def test_one_reason_needs_no_number_of_its_own() -> None:
    assert short_of_goal_in_words(2, {Excuse.MAY_END: 2}) == "2 cases, by `may_end`"
    assert not short_of_goal_in_words(0, {})


def test_missed_goals_are_counted_where_cases_have_several(wording: Wording) -> None:
    words = short_of_goal_in_words(2, {Excuse.FAULT: 2, Excuse.MAY_END: 1})
    assert words.startswith("2 cases with 3 missed")
    wording(words)


def test_a_case_that_missed_an_earlier_goal_is_not_counted_as_reached(history: History) -> None:
    verdicts = [Verdict(End.REACHED), Verdict(End.REACHED, (), (Excuse.MAY_END,)), Verdict(End.TIME_LIMIT)]
    pairs = zip(history.cases, verdicts, strict=False)
    several = replace(history, cases=tuple(replace(case, verdict=verdict) for case, verdict in pairs))
    ends = "1 reached, 1 reached with an earlier goal missed, 1 time limit"
    assert any(str(line).endswith(f": {ends}") for line in stored_report(several, "cov.db"))
    assert f"3 cases: {ends}; " in markdown(several)


def test_reports_name_the_requirements_that_are_off(history: History, wording: Wording) -> None:
    assert history_json(history)["requirements_off"] == {}
    reasons = {"recovers": "a person clears faults"}
    off = replace(history, model=replace(history.model, requirements_off=tuple(reasons.items())))
    (line,) = [text for line in stored_report(off, "cov.db") if "off:" in (text := str(line))]
    wording(line)
    assert history_json(off)["requirements_off"] == reasons
