"""What reports of all sorts say of cases that ran over nodes."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path

import pytest
from lxml import etree
from msgspec.structs import replace

from scbm.cases.coverage import smallest_cover
from scbm.cases.trace import End
from scbm.reports.ci.history_json import history_json
from scbm.reports.ci.junit import junit_xml
from scbm.reports.ci.markdown import markdown
from scbm.reports.ci.sarif import sarif_log
from scbm.reports.html import html_report
from scbm.reports.stored_cases import again, again_words, durations, place_counts, place_of, sort_of_place
from scbm.reports.terminal.store_report import stored_report
from scbm.reports.terminal.visitors_report import smallest_report
from scbm.store import History, Replays
from scbm.testing import Failure, FailureKind, RandomCases, Verdict
from support.histories import EXAMPLE, history_of
from support.real_runs import with_real_runs
from support.wording import Wording

SCHEMA = etree.XMLSchema(etree.parse(Path(__file__).parents[2] / "foreign/junit-10.xsd"))
PLACE = "over DDS domain 7; real: scanner"
COMMAND = "scbm test cell.yaml --cases 20 --transport dds --domain 7 --store cov.db"
FAILURE = Failure(FailureKind.REQUIREMENT, "required_1", "violated")


@lru_cache
def both(real: tuple[str, ...] = ("scanner",)) -> History:
    """Three simulated cases, and the first two of them over nodes."""
    history = history_of(EXAMPLE / "before.yaml", 3)
    return with_real_runs(history, tuple(RandomCases(history.model).first(2, 1)), real)


def only_nodes() -> History:
    return replace(both(), cases=both().cases[3:])


def failed(history: History) -> History:
    """The history with all of its cases failed."""
    verdict = Verdict(End.REACHED, (FAILURE,))
    return replace(history, cases=tuple(replace(case, verdict=verdict) for case in history.cases))


def terminal(history: History) -> list[str]:
    return [line.plain for line in stored_report(history, "cov.db")]


def test_where_a_case_ran_is_reported_with_what_was_real(wording: Wording) -> None:
    simulated, over_nodes = both().cases[0], both().cases[3]
    assert (place_of(simulated, both()), place_of(over_nodes, both())) == ("", PLACE)
    none_real = both(())
    wording(place_of(none_real.cases[3], none_real))
    sorts = [sort_of_place(case) for case in (simulated, over_nodes, none_real.cases[3])]
    assert len({*sorts}) == 3
    wording(sorts)


def test_durations_are_distinguished(wording: Wording) -> None:
    history = both()
    simulated = sum(case.ended_ns for case in history.cases[:3]) / 1e9
    over_nodes = sum(case.ended_ns for case in history.cases[3:]) / 1e9
    assert durations(history) == f"{simulated:.2f} s simulated, {over_nodes:.2f} s over nodes"
    assert durations(only_nodes()) == f"{over_nodes:.2f} s over nodes"
    wording(durations(history_of(EXAMPLE / "before.yaml", 0)))


def test_places_are_counted_and_not_more_than_five_named(wording: Wording) -> None:
    history = both()
    assert list(place_counts(history)) == [f"2 cases {PLACE}"]
    first, *_, last = history.cases
    many = [replace(last, recipe=replace(last.recipe, real=("r",) * number)) for number in range(1, 8)]
    shown = list(place_counts(replace(history, cases=(first, *many))))
    assert len(shown) == 6
    wording(shown[-1])


def test_the_terminal_says_where_cases_ran_and_the_command_of_a_run_once(wording: Wording) -> None:
    lines = terminal(failed(both()))
    wording(line for line in lines if durations(both()) in line or line.endswith(f"2 cases {PLACE}"))
    first, second = both().labels[3:]
    assert lines[lines.index(f"  {first}") :][:8] == [
        f"  {first}",
        "    violated",
        f"    ran {PLACE}",
        f"    {again_words(both().cases[3])}: {COMMAND}",
        f"  {second}",
        "    violated",
        f"    ran {PLACE}",
        f"    again, as {first}",
    ]


def test_the_command_of_a_case_over_nodes_is_that_of_its_run(wording: Wording) -> None:
    history = both()
    stored = history.cases[3]
    assert again(stored, "cell.yaml", history.runs) == COMMAND
    wording((again_words(stored), again_words(history.cases[0])))
    assert again(replace(stored, is_earlier=True), "cell.yaml", history.runs) == ""


def test_the_smallest_suite_has_the_command_of_a_run_once_and_says_that_it_is_of_all(wording: Wording) -> None:
    history = replace(only_nodes(), cases=tuple(replace(c, visited=1 << n) for n, c in enumerate(only_nodes().cases)))
    lines = [line.plain for line in smallest_report(history, smallest_cover([1, 2]))]
    assert (lines[-2], lines.count(lines[-2])) == (f"  {COMMAND}", 1)
    wording(lines[-1])
    earlier = replace(history, cases=tuple(replace(case, is_earlier=True) for case in history.cases))
    lines = [line.plain for line in smallest_report(earlier, smallest_cover([1, 2]))]
    assert f"  {COMMAND}" not in lines
    wording(lines[-2:])


def test_json_has_where_and_what_was_real() -> None:
    report = history_json(both())
    assert [case["nodes"] for case in report["cases"]] == [
        *[None] * 3,
        *[{"where": "over DDS domain 7", "real": ["scanner"], "excluded_values": 0}] * 2,
    ]
    assert [run["nodes"] for run in report["runs"]] == [None, "over DDS domain 7"]
    assert report["over_nodes_seconds"] == both().over_nodes_ns / 1e9
    assert report["simulated_seconds"] == both().ended_ns / 1e9
    assert report["cases"][3]["again"] == COMMAND


@pytest.mark.parametrize("is_failed", [True, False])
def test_junit_says_where_each_test_ran(is_failed: bool) -> None:  # noqa: FBT001
    root = etree.fromstring(junit_xml(failed(both()) if is_failed else both()).encode())
    SCHEMA.assertValid(root)
    assert [test.findtext("system-out") for test in root.iter("testcase")] == [*[None] * 3, *[f"ran {PLACE}"] * 2]
    assert root.findall(".//property[@name='cases_over_nodes'][@value='2']")
    if is_failed:
        texts = [failure.text or "" for failure in root.iter("failure")]
        assert texts[0].splitlines()[2].endswith(" s simulated")
        assert texts[3].splitlines()[2].endswith(f" s {PLACE}")
        assert texts[3].splitlines()[3] == f"{again_words(both().cases[3])}: {COMMAND}"


def test_junit_of_simulated_cases_has_none_of_it() -> None:
    text = junit_xml(history_of(EXAMPLE / "before.yaml", 2))
    assert "over_nodes" not in text
    assert "system-out" not in text


def test_sarif_says_how_to_see_it_again() -> None:
    assert f"\\nran {PLACE}\\n{again_words(both().cases[3])}: {COMMAND}" in sarif_log(failed(only_nodes()))
    assert "\\nran " not in sarif_log(failed(history_of(EXAMPLE / "before.yaml", 2)))


def test_markdown_says_how_to_see_it_again(wording: Wording) -> None:
    text = markdown(failed(only_nodes()))
    (row,) = (line for line in text.splitlines() if COMMAND in line)
    wording(row)
    assert f"; {durations(only_nodes())}\n" in text


@pytest.mark.slow
def test_the_page_has_where_cases_ran(wording: Wording) -> None:
    history = failed(both())
    text = html_report(history, Replays(history).execute)
    simulated, over_nodes = (sort_of_place(history.cases[number]) for number in (0, 3))
    assert f'"places":[["{simulated}",""],["{over_nodes}","{PLACE}"]]' in text
    assert '"place":[0,0,0,1,1]' in text
    assert f"5 cases, {durations(history)}" in text
    alone = html_report(failed(only_nodes()), lambda _: None)
    wording(re.findall(rf"\w[\w ]* {PLACE}\.", alone))
    wording(re.findall("Reproduce [a-z ]+:", alone))
