"""`scbm test --record` and `--update`: results of runs in case files, and the differences that users read."""

from __future__ import annotations

import json
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scbm.files import load_model, open_case
from support.wording import Wording, diagnostic_heads, paragraphs

Scbm = Callable[..., Any]

MODEL = """\
behavior_model: press
variables:
  part: {domain: [raw, pressed], initial: raw}
  tries: {domain: 0..3, initial: 0}
resources:
  press: {simulation: {latency: 1 s}}
operations:
  press_part:
    deadline: 5 s
    pre: {g: part == raw && press_req_state == initial, a: [press_req_trigger <- true]}
    post:
      g: true
      gr: press_req_state == succeeded
      a: [press_req_state <- initial, press_req_trigger <- false, part <- pressed]
    failed: {g: press_req_state == failed, a: [press_req_state <- initial, press_req_trigger <- false, tries += 1]}
    timedout: [press_req_trigger <- false]
goals: {pressed: part == pressed}
"""
PLAIN = "# the usual case\ncase: plain\nmodel: ../press.yaml\ngoal: pressed   # always\n"
FAILING = "case: failing\nmodel: ../press.yaml\ngoal: pressed\noutcomes: {press: [fail]}\n"
WRONG = "case: wrong\nmodel: ../press.yaml\ngoal: pressed\nexpect: {verdict: aborted}\n"
RESULT = """\
recorded:
  end: reached
  time: 1 s
  visits:
    press_part: [executing, completed, queued]
  order: [press_part]
  final: {part: pressed, tries: 0}
"""


class Cell:
    """A model file and a directory with its cases."""

    def __init__(self, directory: Path) -> None:
        self.model = directory / "press.yaml"
        self.cases = directory / "cases"
        self.cases.mkdir()
        self.write_model("tries += 1")

    def write_model(self, action: str) -> None:
        self.model.write_text(MODEL.replace("tries += 1", action), encoding="utf-8")

    def case(self, name: str, text: str | None = None) -> str:
        path = self.cases / f"{name}.yaml"
        if text is not None:
            path.write_text(text, encoding="utf-8")
        return path.read_text(encoding="utf-8")


@pytest.fixture
def cell(tmp_path: Path) -> Cell:
    cell = Cell(tmp_path)
    cell.case("plain", PLAIN)
    cell.case("failing", FAILING)
    return cell


def shown(cell: Cell, text: str) -> str:
    """A text with the directory of the test left out, up to the report."""
    return text.replace(f"{cell.model.parent}/", "").partition("Coverability report")[0]


def test_results_are_added_and_the_rest_of_the_files_stays(cell: Cell, scbm: Scbm, wording: Wording) -> None:
    ran = scbm("test", cell.model, cell.cases, "--record")
    assert ran.code == 0
    assert cell.case("plain") == PLAIN + RESULT
    wording(shown(cell, ran.out))
    again = scbm("test", cell.model, cell.cases, "--record")
    assert shown(cell, again.out) == "Recorded: 0 case files; 2 have a recorded result already\n\n"
    assert scbm("test", cell.model, cell.cases, "--update").code == 0
    assert cell.case("plain") == PLAIN + RESULT


@pytest.mark.parametrize("time", ["1500 ms", "1.5 s", "1.500 seconds", "1500000 us"])
def test_recorded_times_are_compared_by_their_values(cell: Cell, scbm: Scbm, time: str) -> None:
    slow = MODEL.replace("latency: 1 s", "latency: 1500 ms")
    cell.model.write_text(slow, encoding="utf-8")
    recorded = PLAIN + RESULT.replace("time: 1 s", f"time: {time}")
    cell.case("plain", recorded)
    assert scbm("test", cell.model, cell.cases / "plain.yaml").code == 0
    assert scbm("test", cell.model, cell.cases / "plain.yaml", "--update").code == 0
    assert cell.case("plain") == recorded, "an equal result leaves the file as it is"
    cell.case("plain", PLAIN)
    assert scbm("test", cell.model, cell.cases / "plain.yaml", "--record").code == 0
    assert cell.case("plain") == PLAIN + RESULT.replace("time: 1 s", "time: 1.5 s")


def test_a_change_of_the_model_is_noticed_and_can_be_accepted(cell: Cell, scbm: Scbm, wording: Wording) -> None:
    scbm("test", cell.model, cell.cases, "--record")
    before = cell.case("failing")
    cell.write_model("tries += 2")
    failed = scbm("test", cell.model, cell.cases)
    assert failed.code == 1
    assert cell.case("failing") == before
    updated = scbm("test", cell.model, cell.cases, "--update")
    assert updated.code == 0
    assert cell.case("failing") == before.replace("tries: 1", "tries: 2")
    assert cell.case("plain") == PLAIN + RESULT
    assert scbm("test", cell.model, cell.cases).code == 0
    report = failed.out.partition("Failed:")[2].replace(f"{cell.model.parent}/", "")
    wording(f"{shown(cell, updated.out)}---\nFailed:{report}")


def test_a_case_that_fails_records_nothing(cell: Cell, scbm: Scbm, wording: Wording) -> None:
    cell.case("wrong", WRONG)
    ran = scbm("test", cell.model, cell.cases, "--record")
    assert ran.code == 1
    assert cell.case("wrong") == WRONG
    assert cell.case("plain") == PLAIN + RESULT
    wording(shown(cell, ran.out))
    recorded = WRONG.replace("aborted", "reached") + RESULT
    cell.case("wrong", recorded.replace("tries: 0", "tries: 3").replace("reached}", "aborted}"))
    before = cell.case("wrong")
    assert scbm("test", cell.model, cell.cases, "--update").code == 1
    assert cell.case("wrong") == before


def test_update_leaves_files_without_a_result(cell: Cell, scbm: Scbm, wording: Wording) -> None:
    ran = scbm("test", cell.model, cell.cases, "--update")
    assert ran.code == 0
    wording(paragraphs(ran.out, "Without a recorded"))
    assert cell.case("plain") == PLAIN
    assert scbm("test", cell.model, cell.cases, "--update", "--record").code == 0
    assert cell.case("plain") == PLAIN + RESULT


def test_selected_cases_alone_are_recorded(cell: Cell, scbm: Scbm) -> None:
    assert scbm("test", cell.model, cell.cases, "--record", "-k", "plain").code == 0
    assert cell.case("plain") == PLAIN + RESULT
    assert cell.case("failing") == FAILING


def test_a_saved_case_keeps_its_trace_and_random_cases_need_no_file(cell: Cell, scbm: Scbm) -> None:
    assert scbm("test", cell.model, "--cases", 2, "--save", cell.cases).code == 0
    saved = cell.case("seed-0-case-1")
    cell.case("seed-0-case-1", saved.replace("tries: 0", "tries: 1"))
    cell.case("seed-0-case-2", saved.replace("case-1", "case-2").partition("  time")[0])
    ran = scbm("test", cell.model, cell.cases, "--record", "--update", "--cases", 3, "--seed", 7)
    assert ran.code == 0
    assert cell.case("seed-0-case-1") == saved
    assert "  trace: " in cell.case("seed-0-case-2")
    assert "  visits:" in cell.case("seed-0-case-2")
    assert json.loads(scbm("replay", cell.cases / "seed-0-case-1.yaml", "--json").out)["is_recorded_run"] is True


def test_a_part_that_a_person_removed_stays_away(cell: Cell, scbm: Scbm) -> None:
    without = PLAIN + RESULT.replace("  order: [press_part]\n", "")
    cell.case("plain", without.replace("tries: 0", "tries: 2"))
    assert scbm("test", cell.model, cell.cases, "--update").code == 0
    assert cell.case("plain") == without


def test_a_record_of_another_planner_is_left_until_it_is_updated(cell: Cell, scbm: Scbm, wording: Wording) -> None:
    scbm("test", cell.model, cell.cases, "--record")
    ran = scbm("test", cell.model, cell.cases, "--planner", "greedy")
    assert ran.code == 0
    wording(paragraphs(ran.out, "plain: "))
    ran = scbm("test", cell.model, cell.cases, "--planner", "greedy", "--update")
    assert "    planner: it was `canonical 1` and is `greedy 1`\n" in ran.out
    assert "  planner: greedy 1\n" in cell.case("plain")
    assert scbm("replay", cell.cases / "plain.yaml").code == 0


def test_several_goals_are_recorded_one_by_one(cell: Cell, scbm: Scbm) -> None:
    text = PLAIN.replace("goal: pressed   # always", "goals:\n  - goal: pressed\n  - goal: part == pressed # still")
    cell.case("plain", text)
    assert scbm("test", cell.model, cell.cases, "--record").code == 0
    case = open_case(cell.cases / "plain.yaml").read(load_model(cell.model))
    assert case.recorded is not None
    assert [goal.order for goal in case.recorded.goals] == [("press_part",), ()]
    assert cell.case("plain").startswith(
        f"{text}recorded:\n  end: reached\n  goals:\n    - end: reached\n      time: 1 s\n      visits:\n"
    )


def test_a_store_has_the_cases_as_they_are_recorded(cell: Cell, scbm: Scbm, tmp_path: Path) -> None:
    store = tmp_path / "press.scbm"
    scbm("test", cell.model, cell.cases, "--record")
    cell.write_model("tries += 2")
    assert scbm("test", cell.model, cell.cases, "--update", "--store", store).code == 0
    report = json.loads(scbm("report", store, "--json").out)
    assert report["passed"] is True


def test_changes_are_in_the_json(cell: Cell, scbm: Scbm) -> None:
    scbm("test", cell.model, cell.cases, "--record")
    cell.write_model("tries += 2")
    report = json.loads(scbm("test", cell.model, cell.cases, "--update", "--json").out)
    assert report["passed"] is True
    words = "tries was 1 and is 2"
    assert [(each["name"], each["status"], each["differences"]) for each in report["recording"]] == [
        ("failing", "updated", [{"part": "final", "message": words}]),
        ("plain", "equal", []),
    ]
    assert "recording" not in json.loads(scbm("test", cell.model, cell.cases, "--json").out)


@pytest.mark.parametrize(
    "options",
    [
        ("--record",),
        ("--record", "--update", "--cases", 3),
        ("CASES", "--update", "--time-limit", "3 s"),
        ("CASES", "--record", "--update", "--transport", "loopback"),
    ],
)
def test_where_nothing_can_be_recorded_an_error_says_so(
    cell: Cell, scbm: Scbm, options: tuple[object, ...], wording: Wording
) -> None:
    ran = scbm("test", cell.model, *(cell.cases if option == "CASES" else option for option in options))
    assert ran.code == 2
    assert diagnostic_heads(ran.err)
    assert cell.case("plain") == PLAIN
    wording(ran.err)


def test_no_file_is_written_if_one_cannot_be_edited(cell: Cell, scbm: Scbm, wording: Wording) -> None:
    odd = FAILING + "? recorded\n: {end: reached}\n"
    cell.case("failing", odd)
    ran = scbm("test", cell.model, cell.cases, "--record")
    assert ran.code == 2
    assert "failing.yaml" in ran.err
    wording(ran.err)
    assert (cell.case("failing"), cell.case("plain")) == (odd, PLAIN)


def test_a_file_keeps_its_permissions_and_a_link_stays_one(cell: Cell, scbm: Scbm, tmp_path: Path) -> None:
    real = tmp_path / "linked.yaml"
    real.write_text(FAILING.replace("failing", "linked"), encoding="utf-8")
    real.chmod(0o640)
    (cell.cases / "linked.yaml").symlink_to(real)
    assert scbm("test", cell.model, cell.cases, "--record").code == 0
    assert (cell.cases / "linked.yaml").is_symlink()
    assert "recorded:" in real.read_text(encoding="utf-8")
    assert stat.S_IMODE(real.stat().st_mode) == 0o640
