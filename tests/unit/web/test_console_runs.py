"""Runs of a console: limits, moments, facts, and the trace of `scbm replay --json`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from scbm.planning import PlanCache
from scbm.web.console_runs import ConsoleRequest, ConsoleRuns
from support.consoles import CELL, COMMENTED

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Ran

AIR = "examples/robot_in_the_air/after.yaml"
LIVELOCK = Path(__file__).parents[2] / "models/fails_at_run/livelock.yaml"


@pytest.fixture
def runs(tmp_path: Path) -> ConsoleRuns:
    (tmp_path / "cell.yaml").write_text(CELL, encoding="utf-8")
    return ConsoleRuns(tmp_path / "cell.yaml")


def answer(runs: ConsoleRuns, name: str, /, **fields: Any) -> dict[str, Any]:  # noqa: ANN401 - any field
    return runs.answer(name, ConsoleRequest(**fields))


def test_the_trace_is_that_of_replay(scbm: Callable[..., Ran], tmp_path: Path) -> None:
    text = "case: a\ngoal: item_a_scanned\noutcomes: {scanner: [timeout, fail]}\n"
    (tmp_path / "a.yaml").write_text(text, encoding="utf-8")
    replayed = json.loads(scbm("replay", tmp_path / "a.yaml", "--model", AIR, "--json").out)
    found = answer(ConsoleRuns(Path(AIR)), "trace", text=text) | {"is_recorded_run": None}
    assert json.loads(json.dumps(found)) == replayed


def test_a_long_run_is_ended_and_its_beginning_shown(runs: ConsoleRuns, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scbm.web.console_runs.MAX_RECORDS", 10)
    run = answer(runs, "run", text=COMMENTED)["run"]
    assert run["limit"]
    assert not run["passed"]
    assert run["timeline"]["cases"] == 1
    clicked = answer(runs, "edit", text=COMMENTED, edit="fail", target="1", record=8)
    assert "run" in clicked


def test_a_planner_that_does_not_end_is_ended(runs: ConsoleRuns, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scbm.web.console_runs.MAX_SECONDS", 0)
    assert answer(runs, "run", text=COMMENTED)["run"]["limit"]


@pytest.mark.longer
def test_a_planner_that_asks_for_nothing_is_interrupted(runs: ConsoleRuns, monkeypatch: pytest.MonkeyPatch) -> None:
    def plan(*_: object) -> None:
        while True:
            pass

    monkeypatch.setattr("scbm.web.console_runs.MAX_SECONDS", 0.2)
    monkeypatch.setattr("scbm.web.console_runs._PATIENCE_S", 0.1)
    with monkeypatch.context() as patched:
        patched.setattr(PlanCache, "plan", plan)
        run = answer(runs, "run", text="case: a\ngoal: gripped\n")["run"]
    assert run["limit"]
    assert answer(runs, "moment", text="case: a\ngoal: gripped\n", record=1)["record"] == 1, "the part before is shown"
    monkeypatch.undo()
    assert answer(runs, "run", text="case: b\ngoal: gripped\n")["run"]["passed"]


def test_a_livelock_ends_by_itself_with_all_its_records() -> None:
    found = ConsoleRuns(LIVELOCK)
    text = f"case: a\ngoal: {answer(found, 'facts')['goals'][0]}\n"
    run = answer(found, "run", text=text)["run"]
    assert (run["end"], run["passed"], run["limit"]) == ("livelock", False, "")
    last = 10**9
    record = answer(found, "moment", text=text, record=last)["record"]
    assert 1_000 < record < last


def test_a_moment_has_the_clauses_of_guards_and_what_can_happen(runs: ConsoleRuns) -> None:
    text = "case: a\ngoal: gripped\n"
    moments = [answer(runs, "moment", text=text, record=record, target="release") for record in range(8)]
    roles = {guard["role"]: guard for guard in moments[5]["guards"]}
    assert roles["chosen"]["operation"] == "release"
    assert ["gripped == true", False, "gripped = false"] in roles["chosen"]["clauses"]
    offers = {offer["target"] for moment in moments for offer in moment["offers"]}
    assert {"arrive:", ":door=open"} <= offers


def test_no_operation_is_next_once_a_new_plan_is_needed() -> None:
    found = ConsoleRuns(Path(AIR))
    text = "case: a\ngoal: item_a_scanned\noutcomes: {gantry_move_to_box_a: [timeout]}\n"
    trace = answer(found, "trace", text=text)["trace"]
    back = next(number for number, each in enumerate(trace) if each.get("source") == "timedout")
    roles = [
        [guard["role"] for guard in answer(found, "moment", text=text, record=record)["guards"]]
        for record in (back - 2, back)
    ]
    assert roles == [["current", "next"], []]


def test_another_user_takes_a_shared_resource(runs: ConsoleRuns) -> None:
    text = "case: a\ngoal: gripped\noutcomes: {grip: [{outcome: fail}]}\nenvironment: [{at: 9 s, by: arrive}]\n"
    records = range(40)
    offers = [
        each["target"] for record in records for each in answer(runs, "moment", text=text, record=record)["offers"]
    ]
    shared = [each for each in offers if "gripper_req_state" in each]
    clicked = [answer(runs, "edit", text=text, edit="happen", target=each, record=0) for each in shared[:1]]
    assert all("text" in each for each in clicked)


def test_facts_name_everything_that_can_be_clicked(runs: ConsoleRuns) -> None:
    facts = answer(runs, "facts")
    assert facts["goals"] == ["gripped", "released"]
    assert {edit["target"] for edit in facts["edits"]} == {
        "request",
        "variable",
        "resource",
        "change",
        "initial",
        "goal",
    }
    assert [each["name"] for each in facts["variables"] if each["is_initial"]] == ["door", "belt", "gripped"]


def test_a_picture_marks_the_present_value(runs: ConsoleRuns) -> None:
    pictures = [answer(runs, "picture", target="belt", name=value)["svg"] for value in ("empty", "part", "nothing")]
    assert [picture.count("fill-opacity") for picture in pictures] == [1, 1, 0]
    assert answer(runs, "picture", target="nothing")["svg"] == ""
