"""Contexts and the smallest suite on the terminal."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from msgspec.structs import replace
from rich.text import Text

from scbm.cases.coverage import Cover, smallest_cover
from scbm.reports.terminal.visitors_report import contexts_report, smallest_report
from scbm.store import History
from support.histories import EXAMPLE, history_of
from support.wording import Wording

HISTORY = history_of(EXAMPLE / "before.yaml", 20)
NOTHING = """\
behavior_model: nothing
variables: {on: {domain: bool, initial: false}}
operations: {}
goals: {off: on == false}
"""


def plain(lines: Iterable[Text]) -> list[str]:
    return [line.plain for line in lines]


def smallest(history: History, cover: Cover | None = None) -> list[str]:
    found = cover or smallest_cover([case.visited for case in history.cases])
    return plain(smallest_report(history, found))


def test_each_visited_obligation_has_its_count_and_its_first_cases() -> None:
    lines = [line.split() for line in plain(contexts_report(HISTORY))]
    rows = {line[0]: line[1:] for line in lines if line and "/" in line[0] and len(line) > 1 and line[1].isdigit()}
    for obligation in HISTORY.obligations:
        visitors = list(HISTORY.coverage.visitors(obligation))
        if not visitors:
            assert str(obligation) not in rows
            continue
        count, *named = rows[str(obligation)]
        assert int(count) == len(visitors)
        assert [name.rstrip(",") for name in named[: len(visitors[:3])]] == visitors[:3]
        assert named[3:] == (["and", str(len(visitors) - 3), "more"] if len(visitors) > 3 else [])


def test_what_no_case_visits_is_counted(wording: Wording) -> None:
    missed = len(HISTORY.obligations.all) - HISTORY.coverage.visited.bit_count()
    (line,) = (line for line in plain(contexts_report(HISTORY)) if line.startswith(f"  {missed} "))
    wording(line)


def test_cases_that_alone_visit_something_are_shown_and_the_rest_is_counted(wording: Wording) -> None:
    lines = plain(contexts_report(HISTORY))
    begin = next(number for number, line in enumerate(lines) if line.startswith("Case"))
    wording(lines[begin + 1 :])


def test_the_contexts_of_many_cases_are_not_long(wording: Wording) -> None:
    many = replace(HISTORY, cases=HISTORY.cases * 100)
    assert len(plain(contexts_report(many))) < 80
    wording(plain(contexts_report(many))[-1])


def test_the_smallest_suite_says_what_each_case_brings_and_how_to_run_it(wording: Wording) -> None:
    lines = smallest(HISTORY)
    numbers = (2, 5, 6, 7, 10, 11)
    rows = [line.split() for line in lines if line.startswith("  seed-")]
    assert [row[0] for row in rows] == [f"seed-1-case-{number}" for number in numbers]
    assert sum(int(row[2]) for row in rows) == HISTORY.coverage.figure.visited
    command = "  scbm run examples/robot_in_the_air/before.yaml --seed 1 --case"
    assert lines[-6:] == [f"{command} {number}" for number in numbers]
    wording(lines)


def test_what_is_not_proved_is_not_reported_as_proved(wording: Wording) -> None:
    cover = smallest_cover([case.visited for case in HISTORY.cases])
    proved, unproved = smallest(HISTORY), smallest(HISTORY, replace(cover, at_least=4))
    (place,) = (number for number, (a, b) in enumerate(zip(proved, unproved, strict=True)) if a != b)
    wording((proved[place], unproved[place]))


def test_cases_of_an_earlier_model_are_not_run_again(wording: Wording) -> None:
    earlier = replace(HISTORY, cases=tuple(replace(case, is_earlier=True) for case in HISTORY.cases))
    wording(smallest(earlier)[-2:])


def test_a_model_with_nothing_to_visit_and_a_store_without_cases(tmp_path: Path, wording: Wording) -> None:
    path = tmp_path / "nothing.yaml"
    path.write_text(NOTHING, encoding="utf-8")
    empty = history_of(path, 2)
    wording(plain(contexts_report(empty)))
    wording(smallest(empty)[0])
    none = replace(HISTORY, cases=())
    wording(smallest(none)[0])
    wording(plain(contexts_report(none))[0])
