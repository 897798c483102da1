"""What closing came to, for people: short where all is good, and always with the command that goes on."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases import Case
from scbm.cases.coverage import Aspect
from scbm.closing import Closing, Suggestion, SuggestionKind
from scbm.closing.closing_files import ClosingFiles
from scbm.closing.closing_result import ClosingResult
from scbm.closing.decisions import Stage, StageEnd
from scbm.files import load_model, parse_predicate, parse_requirement, read_case, read_model
from scbm.files.language.scope import Scope
from scbm.model import Requirement
from scbm.reports.terminal.closing_report import closing_report
from scbm.testing import Campaign, Tester, WrittenCase
from support.campaigns import suite_of
from support.closings import closing_of, obligation, result_of
from support.models import scan_cell
from support.wording import Wording

CELL = scan_cell()
EVERYTHING = ["scan_box/disabled", "scan_box/timedout"]


def _case(name: str, more: str = "") -> Case:
    return read_case(f"case: {name}\ngoal: scanned\n{more}", CELL)


SCANS = _case("scans")
FAILS = _case("fails", "outcomes: {scan: [fail]}\n")
TIMES_OUT = _case("times_out", "outcomes: {scan: [timeout]}\n")
WAITS = _case("waits", "injections: [{when: current.name == scan_box, set: {scan_req_state: failed}, hold: 1 s}]\n")


def _report_lines(closed: Closing | ClosingResult, columns: int = 80) -> list[str]:
    result = result_of(closed) if isinstance(closed, Closing) else closed
    lines = [line.plain for line in closing_report(result, columns)]
    assert all(line == line.rstrip() for line in lines), "no line has blanks at its end"
    return lines


def _section(lines: list[str], head: str) -> list[str]:
    """The lines of the section whose heading has a word."""
    begin = next(i for i, line in enumerate(lines) if line[:1].strip() and head in line.partition(":")[0].split())
    return [*lines[begin:], ""][: [*lines[begin:], ""].index("")]


def test_the_figure_goes_from_before_to_after_and_the_bar_shows_all_parts(wording: Wording) -> None:
    closing = closing_of(CELL, [FAILS], suite=[SCANS], undecided=["scan_box/disabled"])
    lines = _report_lines(closing, 100)
    bar = lines[2].removeprefix("  SCBM-IAS: 33.33 % → 66.67 %  ")
    assert bar == "█" * 17 + "▓" * 17 + "░" * 8 + "?" * 8
    assert [part[0] for part in lines[3].strip().split("   ")] == ["█", "▓", "░", "?"]
    assert lines[3].index("█") == lines[2].index("█")
    wording(lines[3:7])


@pytest.mark.parametrize("columns", [60, 80])
def test_the_bar_fits_the_width_of_the_report(columns: int) -> None:
    closing = closing_of(CELL, [FAILS], suite=[SCANS], undecided=["scan_box/disabled"])
    lines = _report_lines(closing, columns)
    assert len(lines[2]) == columns
    assert [mark for mark, _ in groupby(lines[2].rpartition("  ")[2])] == ["█", "▓", "░", "?"]


def test_it_is_short_where_all_is_covered(wording: Wording) -> None:
    written = [WrittenCase(case, Path(f"{case.name}.yaml"), None) for case in (SCANS, FAILS, TIMES_OUT, WAITS)]
    closing = closing_of(CELL, suite=[each.case for each in written])
    wording(_report_lines(result_of(closing, suite_of(CELL, written=written))))


def test_new_cases_are_a_table_with_what_each_adds(wording: Wording) -> None:
    lines = _report_lines(closing_of(CELL, [SCANS, FAILS, TIMES_OUT]))
    wording(_section(lines, "New"))


def test_what_is_uncoverable_is_reported_once_for_each_reason(wording: Wording) -> None:
    wording(_section(_report_lines(closing_of(CELL)), "Proved"))


def test_stages_that_ended_early_are_reported_with_what_helps(wording: Wording) -> None:
    ended = (
        StageEnd(Stage.RANDOM, "no case got a plan from the planner canonical", "--planner"),
        StageEnd(Stage.SEARCH, "2 changed cases were run", "--max-changes"),
        StageEnd(Stage.GRAPH, "a reply has too many combinations of measured values"),
        StageEnd(Stage.SUGGESTIONS, "it was interrupted", is_interrupted=True),
    )
    wording(_section(_report_lines(replace(closing_of(CELL), ended=ended)), "early"))


def test_what_is_undecided_is_reported_with_what_stopped_it(wording: Wording) -> None:
    lines = _report_lines(closing_of(CELL, [SCANS, FAILS, WAITS], undecided=["scan_box/timedout"]))
    wording(_section(lines, "Undecided"))


def test_suggestions_have_the_command_that_writes_them(wording: Wording) -> None:
    about = tuple(obligation(CELL, name) for name in EVERYTHING)
    goal = parse_predicate("light == red", Scope.of(CELL))
    goals = [Suggestion(about, SuggestionKind.GOAL, "a goal needs it", name, goal) for name in ("one", "two")]
    guard = Suggestion(about[:1], SuggestionKind.GUARD, "a guard is in the way", blamed=("light == red",))
    suite = suite_of(CELL, "my cell.yaml", paths=[Path("cases")])
    lines = _report_lines(result_of(closing_of(CELL, [SCANS], suggestions=[goals[0], guard]), suite))
    wording(_section(lines, "Suggested"))
    lines = _report_lines(result_of(closing_of(CELL, [SCANS], suggestions=goals), suite))
    wording(_section(lines, "Suggested")[-2:])


def test_what_failed_comes_first_with_the_command_that_shows_it(wording: Wording) -> None:
    moon = Requirement("idle", parse_requirement("never scan_req_state == executing", Scope.of(CELL)))
    failing = [replace(SCANS, name=name, requirements=(moon,)) for name in ("one", "two")]
    written = [WrittenCase(case, Path(f"{case.name}.yaml"), Path("cell.yaml")) for case in failing]
    suite, campaign = suite_of(CELL, written=written), Campaign.of(CELL, Tester(CELL).results(failing))
    lines = _report_lines(result_of(closing_of(CELL, [SCANS]), suite, campaign))
    first, second = _section(lines, "Failed"), _section(lines, "New")
    wording(first)
    assert lines.index(first[0]) < lines.index(second[0])


def test_what_new_cases_found_on_their_way_has_its_own_section(wording: Wording) -> None:
    model = scan_cell(("deadline: 10 seconds", "deadline: 2 h"))
    waits = read_case("case: waits\ngoal: scanned\noutcomes: {scan: [timeout]}\nexpect: {verdict: time_limit}\n", model)
    found = _section(_report_lines(closing_of(model, [waits])), "Failures")
    wording(found)
    assert found[0] not in _report_lines(closing_of(CELL, [SCANS]))


def test_the_same_reason_of_several_automatic_transitions_is_reported_once(wording: Wording) -> None:
    closing = closing_of(
        scan_cell(("automatic_transitions:\n", "automatic_transitions:\n  x: {g: true, a: [count += 1]}\n"))
    )
    decided = [
        replace(each, reason=f"no run takes {each.obligation}; all runs to the only goal were explored")
        for each in closing.decided
        if each.obligation.aspect is Aspect.TAKEN
    ]
    lines = _report_lines(replace(closing, decided=tuple(decided)))
    wording(_section(lines, "Proved"))


def test_goals_that_were_written_are_reported(wording: Wording) -> None:
    closed, goals = result_of(closing_of(CELL)), {"red": "light == red"}
    for result in (replace(closed, written=goals), replace(closed, already=goals)):
        wording(line for line in _report_lines(result) if "red: light == red" in line)


def test_where_nothing_is_saved_the_command_that_does_is_reported(wording: Wording) -> None:
    _, line = _section(_report_lines(closing_of(CELL, [SCANS])), "Save")
    assert line.startswith("  scbm close cell.yaml --out ")
    wording(line)


def test_what_was_written_is_reported_with_the_commands_that_repeat_it(wording: Wording) -> None:
    cases, certificates = {"fails": Path("out/cases/fails.yaml")}, {"structure": Path("out/certificates/s.json")}
    output = ClosingFiles(Path("out"), cases, certificates, (Path("out/cases/old.yaml"),))
    suite = suite_of(CELL, random=3, paths=[Path("mine")])
    lines = _report_lines(replace(result_of(closing_of(CELL, [FAILS], suite=[SCANS]), suite), output=output))
    wording(_section(lines, "Written"))
    lines = _report_lines(replace(result_of(closing_of(CELL)), output=ClosingFiles(Path("out"), {}, {})))
    wording(_section(lines, "Written"))


def test_a_model_without_obligations_has_no_bar(wording: Wording) -> None:
    text = "behavior_model: empty\nvariables: {a: {domain: bool, initial: false}}\noperations: {}\n"
    lines = _report_lines(closing_of(read_model(text)))
    wording(lines[2:4])


def test_a_long_list_of_names_is_broken_into_lines() -> None:
    model = load_model(Path(__file__).parents[3] / "examples" / "robot_in_the_air" / "before.yaml")
    lines = _report_lines(closing_of(model))
    assert max(map(len, lines)) <= 80
    assert any(line.startswith("    robot_") for line in lines)
