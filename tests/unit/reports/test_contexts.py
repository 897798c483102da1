"""Contexts and the smallest suite on the terminal."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

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


def test_what_no_case_visits_is_counted() -> None:
    missed = len(HISTORY.obligations.all) - HISTORY.coverage.visited.bit_count()
    assert f"  {missed} obligations more, which no case visits" in plain(contexts_report(HISTORY))


def test_cases_that_alone_visit_something_are_shown_and_the_rest_is_counted(wording: Wording) -> None:
    lines = plain(contexts_report(HISTORY))
    begin = next(number for number, line in enumerate(lines) if line.startswith("Case"))
    wording(lines[begin + 1 :])


def test_the_contexts_of_many_cases_are_not_long(wording: Wording) -> None:
    many = replace(HISTORY, cases=HISTORY.cases * 100)
    assert len(plain(contexts_report(many))) < 80
    wording(plain(contexts_report(many))[-1])


def test_the_smallest_suite_says_what_each_case_brings_and_how_to_run_it() -> None:
    opened = "gripper_open/executing, gripper_open/completed, gripper_open/queued"
    assert smallest(HISTORY) == [
        "Smallest suite: 6 of 20 cases",
        "",
        "  Visits the same: 46.51 %",
        "  Proved: no smaller suite visits the same",
        "  It takes 72 of 180 requests, 57.548 s of 151.283 s",
        "",
        "Case              visits   adds  needed for",
        "  seed-1-case-2       14     14           2",
        "      gantry_move_to_box_a/failed, automatic/gantry_failed",
        "  seed-1-case-5       20     10           2",
        "      scanner_scan_item_a/failed, automatic/scanner_failed",
        "  seed-1-case-6       28      8           2",
        "      robot_move_to_toolbox_gripper/failed, robot_move_to_agv/failed",
        "  seed-1-case-7       27      2           2",
        "      robot_move_to_box_a/failed, robot_unmount_scanner/failed",
        "  seed-1-case-10      20      3           3",
        f"      robot_move_to_toolbox_scanner/failed, {opened}",
        "  seed-1-case-11      12      3           3",
        "      robot_mount_gripper/failed, gripper_close/executing, gripper_close/completed, gripper_close/queued",
        "",
        "Run them again",
        *(
            f"  scbm run examples/robot_in_the_air/before.yaml --seed 1 --case {number}"
            for number in (2, 5, 6, 7, 10, 11)
        ),
    ]


def test_what_is_not_proved_is_not_said_to_be() -> None:
    cover = smallest_cover([case.visited for case in HISTORY.cases])
    lines = smallest(HISTORY, replace(cover, at_least=4))
    assert "  No fewer than 4 can visit the same; whether 4 can is open" in lines
    assert not any("Proved" in line for line in lines)


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
