"""What closing came to, for people: short where all is good, and always with the command that goes on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from scbm.cases import Case
from scbm.cases.coverage import Aspect
from scbm.cases.trace import End
from scbm.closing import Closing, Suggestion, SuggestionKind
from scbm.closing.closing_files import ClosingFiles
from scbm.closing.failing_cases import FailedCase, FoundFault
from scbm.files import load_model, parse_predicate, read_case, read_model
from scbm.files.language.scope import Scope
from scbm.reports.terminal.closing_report import ClosingSetting, closing_report
from support.closings import closing_of, obligation
from support.models import scan_cell

CELL = scan_cell()
EVERYTHING = ["scan_box/disabled", "scan_box/timedout"]


def _case(name: str, more: str = "") -> Case:
    return read_case(f"case: {name}\ngoal: scanned\n{more}", CELL)


SCANS = _case("scans")
FAILS = _case("fails", "outcomes: {scan: [fail]}\n")
TIMES_OUT = _case("times_out", "outcomes: {scan: [timeout]}\n")
WAITS = _case("waits", "injections: [{when: current.name == scan_box, set: {scan_req_state: failed}, hold: 1 s}]\n")


def _told(closing: Closing, setting: ClosingSetting | None = None) -> list[str]:
    lines = [line.plain for line in closing_report(closing, setting or ClosingSetting("cell.yaml"))]
    assert all(line == line.rstrip() for line in lines), "no line has blanks at its end"
    return lines


def _section(lines: list[str], head: str) -> list[str]:
    """The lines below a heading."""
    begin = next(index for index, line in enumerate(lines) if line.startswith(head))
    return [*lines[begin + 1 :], ""][: [*lines[begin + 1 :], ""].index("")]


def test_the_figure_goes_from_before_to_after_and_the_bar_shows_all_parts() -> None:
    lines = _told(closing_of(CELL, [FAILS], suite=[SCANS], undecided=["scan_box/disabled"]))
    bar = lines[2].removeprefix("  SCBM-IAS: 33.33 % → 66.67 %  ")
    assert bar == "█" * 17 + "▓" * 17 + "░" * 8 + "?" * 8
    assert lines[3].strip().split("   ") == ["█ before", "▓ new cases", "░ uncoverable", "? undecided"]
    assert lines[3].index("█") == lines[2].index("█")
    assert lines[4] == "  Decided:  4 covered, 1 uncoverable, 1 undecided of 6; 80.00 % of what can be covered"
    assert lines[5] == "  Queued:   1 of 1 in a plan  (beside the figure)"
    assert lines[6] == "  Before:   nothing"


def test_it_is_short_where_all_is_covered() -> None:
    lines = _told(closing_of(CELL, suite=[SCANS, FAILS, TIMES_OUT, WAITS]), ClosingSetting("cell.yaml", "4 cases"))
    assert lines == [
        "Closing report: scan_cell",
        "",
        f"  SCBM-IAS: 100.00 %  {'█' * 50}",
        f"{' ' * 22}█ before",
        "  Decided:  6 covered, 0 uncoverable, 0 undecided of 6",
        "  Queued:   1 of 1 in a plan  (beside the figure)",
        "  Before:   4 cases",
    ]


def test_new_cases_are_a_table_with_what_each_adds() -> None:
    lines = _told(closing_of(CELL, [SCANS, FAILS, TIMES_OUT]))
    assert _section(lines, "New cases: 3, 10.000 s simulated") == [
        "  name       goal     ends        after  adds",
        "  scans      scanned  reached   0.000 s     2",
        "      scan_box: executing, completed, queued",
        "  fails      scanned  reached   0.000 s     2",
        "      scan_box: failed",
        "      automatic/scan_failed",
        "  times_out  scanned  reached  10.000 s     1",
        "      scan_box: timedout",
    ]


def test_what_is_uncoverable_is_told_once_for_each_reason() -> None:
    assert _section(_told(closing_of(CELL, [SCANS])), "Proved uncoverable: 4") == [
        "  scan_box: disabled, failed, timedout",
        "      it has no way there",
        "  automatic/scan_failed",
        "      it has no way there",
    ]
    assert "Proved uncoverable: 6, and 1 queued" in _told(closing_of(CELL))


def test_what_is_undecided_is_told_with_what_stopped_it() -> None:
    lines = _told(closing_of(CELL, [SCANS, FAILS, WAITS], undecided=["scan_box/timedout"]))
    assert _section(lines, "Undecided: 1") == [
        "  scan_box: timedout",
        "      not all runs were looked at",
        "  --max-states says how many situations of runs may be looked at",
    ]


def test_suggestions_have_the_command_that_writes_them() -> None:
    about = tuple(obligation(CELL, name) for name in EVERYTHING)
    goal = parse_predicate("light == red", Scope.of(CELL))
    goals = [Suggestion(about, SuggestionKind.GOAL, "a goal needs it", name, goal) for name in ("one", "two")]
    guard = Suggestion(about[:1], SuggestionKind.GUARD, "a guard is in the way", blamed=("light == red",))
    setting = ClosingSetting("my cell.yaml", closing=" --suite cases")
    lines = _told(closing_of(CELL, [SCANS], suggestions=[goals[0], guard]), setting)
    assert _section(lines, "What would change that") == [
        "  scan_box: disabled, timedout",
        "      a goal needs it",
        "      scbm close 'my cell.yaml' --suite cases --write one",
        "  scan_box: disabled",
        "      a guard is in the way",
    ]
    lines = _told(closing_of(CELL, [SCANS], suggestions=goals), setting)
    assert _section(lines, "What would change that")[-2:] == [
        "  all of these goals",
        "      scbm close 'my cell.yaml' --suite cases --write all",
    ]


def test_what_failed_comes_first_with_the_command_that_shows_it() -> None:
    failed = (FailedCase("scans", ("expected the moon",), "scbm replay scans.yaml"),)
    lines = _told(closing_of(CELL, [SCANS]), ClosingSetting("cell.yaml", failed=failed))
    assert _section(lines, "Failed: 1 case") == [
        "  scans",
        "    expected the moon",
        "    again: scbm replay scans.yaml",
    ]
    assert lines.index("Failed: 1 case") < lines.index("New cases: 1, 0.000 s simulated")


def test_what_new_cases_found_on_their_way_has_its_own_section() -> None:
    fault = FoundFault("scans", End.LIVELOCK, "ends in a livelock: a -> a", "scbm replay scans.yaml")
    lines = _told(closing_of(CELL, [SCANS]), ClosingSetting("cell.yaml", found=(fault,)))
    assert _section(lines, "Found on the way") == [
        "  scans ends in a livelock: a -> a",
        "    again: scbm replay scans.yaml",
    ]
    assert "Found on the way" not in _told(closing_of(CELL, [SCANS]))


def test_the_same_reason_of_several_automatic_transitions_is_told_once() -> None:
    closing = closing_of(
        scan_cell(("automatic_transitions:\n", "automatic_transitions:\n  x: {g: true, a: [count += 1]}\n"))
    )
    decided = [
        replace(each, reason=f"no run takes {each.obligation}; all runs to the only goal were followed")
        for each in closing.decided
        if each.obligation.aspect is Aspect.TAKEN
    ]
    lines = _told(replace(closing, decided=tuple(decided)))
    assert _section(lines, "Proved uncoverable: 2") == [
        "  automatic/x, automatic/scan_failed",
        "      no run takes it; all runs to the only goal were followed",
    ]


def test_goals_that_were_written_are_told() -> None:
    setting = ClosingSetting("cell.yaml", written=("red: light == red",))
    assert "  Written:  goal red: light == red, into cell.yaml" in _told(closing_of(CELL), setting)
    setting = ClosingSetting("cell.yaml", already=("red: light == red",))
    assert "  Written:  goal red: light == red is in cell.yaml already" in _told(closing_of(CELL), setting)


def test_where_nothing_is_saved_the_command_that_does_is_told() -> None:
    (line,) = _section(_told(closing_of(CELL, [SCANS])), "Save it")
    assert line == "  scbm close cell.yaml --out closed   writes 1 case and 1 certificate"


def test_what_was_written_is_told_with_the_commands_that_repeat_it() -> None:
    cases, certificates = {"fails": Path("out/cases/fails.yaml")}, {"structure": Path("out/certificates/s.json")}
    output = ClosingFiles(Path("out"), cases, certificates, (Path("out/cases/old.yaml"),))
    setting = ClosingSetting("cell.yaml", "suite", " mine", " --cases 3 --seed 1", output=output)
    lines = _told(closing_of(CELL, [FAILS], suite=[SCANS]), setting)
    head = "Written: 1 case and 1 certificate below out; 1 file of an earlier closing removed"
    assert _section(lines, head) == [
        "  scbm test cell.yaml mine out --cases 3 --seed 1 --fail-under 66.66   runs all cases",
        "  scbm close --check out/certificates/s.json   checks the proofs",
    ]
    lines = _told(closing_of(CELL), ClosingSetting("cell.yaml", output=ClosingFiles(Path("out"), {}, {})))
    assert _section(lines, "Written: nothing below out") == []


def test_a_model_without_obligations_has_no_bar() -> None:
    text = "behavior_model: empty\nvariables: {a: {domain: bool, initial: false}}\noperations: {}\n"
    lines = _told(closing_of(read_model(text)))
    assert lines[2:4] == ["  SCBM-IAS: not measurable", "  Decided:  0 covered, 0 uncoverable, 0 undecided of 0"]


def test_a_long_list_of_names_is_broken_into_lines() -> None:
    model = load_model(Path(__file__).parents[3] / "examples" / "robot_in_the_air" / "before.yaml")
    lines = _told(closing_of(model))
    assert max(map(len, lines)) <= 120
    assert "    robot_move_to_agv" in "\n".join(lines)
