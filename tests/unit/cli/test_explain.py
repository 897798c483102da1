"""`scbm explain` as a user meets it: why an obligation ended as it did, in sentences and as JSON."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import Ran
from scbm.files import load_model, read_case
from scbm.testing import Tester
from support.wording import Wording

BEFORE = "examples/robot_in_the_air/before.yaml"
AFTER = "examples/robot_in_the_air/after.yaml"
CASES = "examples/robot_in_the_air/cases"

Scbm = Callable[..., Ran]

pytestmark = pytest.mark.usefixtures("shared_closings")


def test_a_covered_obligation_is_reported_with_its_run(scbm: Scbm, golden: Callable[[str, str], None]) -> None:
    ran = scbm("explain", BEFORE, "automatic/abort_if_scanning_timedout_5_times")
    assert (ran.code, ran.err) == (0, "")
    golden("explain.txt", ran.out)


@pytest.mark.slow
def test_the_case_that_is_shown_visits_it(scbm: Scbm) -> None:
    model = load_model(AFTER)
    for name in ("place_item_a/failed", "robot_unmount_gripper/timedout", "automatic/clear_scan_timeouts"):
        report = json.loads(scbm("explain", AFTER, name, "--json").out)
        (entry,), (case,) = report["obligations"], report["cases"]
        execution = Tester(model).execute(read_case(case["text"], model))
        assert execution.verdict.passed
        assert entry["case"] == case["name"]
        record = execution.trace.records[entry["visit"]["record"]]
        assert record.at_ns == entry["visit"]["at_ns"]


def test_a_case_of_the_suite_is_reported_with_its_file_and_command(scbm: Scbm) -> None:
    ran = scbm("explain", AFTER, "automatic/clear_scan_timeouts", "--suite", CASES)
    assert ran.code == 0
    assert f", in {CASES}/" in ran.out
    command = next(line for line in ran.out.splitlines() if line.startswith("Again: ")).removeprefix("Again: scbm ")
    assert scbm(*shlex.split(command)).code == 0


@pytest.mark.slow
def test_what_was_made_to_go_wrong_is_reported(scbm: Scbm, wording: Wording) -> None:
    for options in (("scanner_scan_item_a/disabled", "--suite", CASES), ("gripper_close/timedout",)):
        story, _, _ = scbm("explain", AFTER, *options).out.partition("\ncase: ")
        wording(story)


def test_an_uncoverable_obligation_is_reported_with_what_was_looked_at(scbm: Scbm, wording: Wording) -> None:
    ran = scbm("explain", BEFORE, "robot_move_to_home/failed")
    assert ran.code == 0
    first, reason, looked_at, *_ = ran.out.splitlines()
    wording(first)
    wording(reason)
    wording(looked_at)
    (entry,) = json.loads(scbm("explain", BEFORE, "robot_move_to_home/failed", "--json").out)["obligations"]
    assert entry["looked_at"] == {"initial_states": 12, "goals": 4, "situations": 123}
    assert "visit" not in entry


def test_what_follows_from_the_model_file_says_so(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    text = Path(BEFORE).read_text(encoding="utf-8")
    path = tmp_path / "cell.yaml"
    path.write_text(text.replace("    deadline: 10 seconds\n", "").replace("    timedout:", "    #"), encoding="utf-8")
    ran = scbm("explain", path, "pick_item_a/timedout")
    assert ran.code == 0
    wording(ran.out)
    (entry,) = json.loads(scbm("explain", path, "pick_item_a/timedout", "--json").out)["obligations"]
    assert (entry["decision"], "looked_at" in entry) == ("uncoverable", False)


@pytest.mark.slow
def test_an_undecided_obligation_is_reported_with_the_option_that_helps(scbm: Scbm) -> None:
    ran = scbm("explain", BEFORE, "robot_move_to_home/failed", "--max-states", 5, "--planner", "greedy")
    assert ran.code == 1
    assert "robot_move_to_home/failed  undecided\n" in ran.out
    assert "--max-states" in ran.out


@pytest.mark.slow
def test_a_name_alone_stands_for_all_of_its_obligations(scbm: Scbm, wording: Wording) -> None:
    report = json.loads(scbm("explain", AFTER, "gripper_open", "--json").out)["obligations"]
    aspects = ["disabled", "executing", "failed", "timedout", "completed", "queued"]
    assert [entry["name"] for entry in report] == [f"gripper_open/{aspect}" for aspect in aspects]
    (entry,) = json.loads(scbm("explain", AFTER, "robot_failed", "--json").out)["obligations"]
    assert entry["name"] == "automatic/robot_failed"
    ran = scbm("explain", BEFORE, "robot_move_to_home")
    wording(ran.out)


STEPS = """
behavior_model: steps
variables:
  at: {domain: 0..9, initial: 0}
  done: {domain: bool, initial: false}
operations:
  move: {pre: {g: at < 9}, post: {g: true, a: [at += 1]}}
  finish: {pre: {g: at == 9}, post: {g: true, a: [done <- true]}}
  spare: {pre: {g: at == 3 && at == 0}, post: {g: true}}
goals:
  finished: done == true
"""


def test_of_an_operation_nothing_is_reported_twice(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    path = tmp_path / "steps.yaml"
    path.write_text(STEPS, encoding="utf-8")
    out = scbm("explain", path, "finish").out
    names = re.findall(r"\n  (finished-[0-9a-f]{6}) is a new case", out)
    assert names
    assert [out.count(f"\ncase: {name}\n") for name in names] == [1] * len({*names}) == [1] * len(names)
    wording(out)
    out = scbm("explain", path, "spare").out
    assert out.count("at == 3 && at == 0") == 1
    wording(out)


def test_cases_with_one_name_are_equal_whatever_was_asked_for(scbm: Scbm, tmp_path: Path) -> None:
    path = tmp_path / "steps.yaml"
    path.write_text(STEPS, encoding="utf-8")
    texts: dict[str, str] = {}
    scbm("close", path, "--out", tmp_path / "out")
    for file in (tmp_path / "out" / "cases").iterdir():
        texts[file.stem] = re.sub(r"(?m)^(#|model:).*\n", "", file.read_text("utf-8"))
    closed = len(texts)
    for asked in ("move", "move/executing", "move/completed", "finish/executing", "finish/completed", "finish"):
        for case in json.loads(scbm("explain", path, asked, "--json").out)["cases"]:
            text = re.sub(r"(?m)^model:.*\n", "", case["text"])
            assert texts.setdefault(case["name"], text) == text
    assert len(texts) > closed


def test_a_plan_of_nothing_is_not_reported(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    path = tmp_path / "steps.yaml"
    text = STEPS.replace("finished: done == true", "finished: at == 0")
    path.write_text(text + "automatic_transitions:\n  ring: {g: plan.state == completed, a: [done <- true]}\n", "utf-8")
    out = scbm("explain", path, "automatic/ring").out
    wording(out)


@pytest.mark.parametrize(
    ("text", "nearest"),
    [
        ("gripper_open/complete", "`gripper_open/completed`"),
        ("gripper_open/bogus", "the obligations of gripper_open are: gripper_open/disabled, "),
        ("griper_open/failed", "`gripper_open/failed`"),
        ("griper_open", "`gripper_open`"),
        ("automatic/clear_scan_timeout", "`automatic/clear_scan_timeouts`"),
        ("", "robot_move_to_home/disabled, "),
    ],
)
def test_a_wrong_name_is_located(scbm: Scbm, text: str, nearest: str, wording: Wording) -> None:
    ran = scbm("explain", BEFORE, text)
    assert (ran.code, ran.out) == (2, "")
    assert "error[unknown-obligation]" in ran.err
    wording(ran.err)
    assert nearest in ran.err.partition("\n    = ")[2]
