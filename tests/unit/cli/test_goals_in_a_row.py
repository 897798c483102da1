"""`--goals N`: random cases with several goals in a row (semantics 7.5)."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import pytest

from support.models import STOPPED
from support.wording import Wording

TWO_GOALS = f"{STOPPED}  gripped: {{goal: item == gripped, may_end: [aborted]}}\n"


class Ran(Protocol):
    code: int
    out: str
    err: str


Scbm = Callable[..., Ran]


@pytest.fixture
def stopped(tmp_path: Path) -> str:
    (tmp_path / "stopped.yaml").write_text(TWO_GOALS)
    return str(tmp_path / "stopped.yaml")


def goals_of(scbm: Scbm, *arguments: str) -> list[list[str]]:
    cases = json.loads(scbm("test", *arguments, "--no-shrink", "--json").out)["cases"]
    return [each["goal"].split(", then ") for each in cases]


def test_a_random_case_has_up_to_three_goals_unless_asked_otherwise(scbm: Scbm, stopped: str) -> None:
    drawn, one, five = (goals_of(scbm, stopped, *more) for more in ((), ("--goals", "1"), ("--goals", "5")))
    assert {len(goals) for goals in drawn} == {1, 2, 3}
    assert [goals[0] for goals in drawn] == [goals[0] for goals in one] == [goals[0] for goals in five]
    assert {len(goals) for goals in one} == {1}
    assert max(len(goals) for goals in five) > 3


def test_a_model_with_single_goals_has_one_unless_asked_otherwise(scbm: Scbm, stopped: str) -> None:
    with Path(stopped).open("a") as file:
        file.write("runs: {goals: single}\n")
    assert {len(goals) for goals in goals_of(scbm, stopped)} == {1}
    assert max(len(goals) for goals in goals_of(scbm, stopped, "--goals", "2")) == 2


def test_commands_that_repeat_a_case_have_the_number_of_goals(scbm: Scbm, stopped: str, tmp_path: Path) -> None:
    """The case has several goals; `run` repeats it, from the report of the cases as from that of a store."""
    store = str(tmp_path / "cov.db")
    done = json.loads(scbm("test", stopped, "--goals", "4", "--no-shrink", "--store", store, "--json").out)
    stored = json.loads(scbm("report", store, "--json").out)["cases"]
    again = next(finding["again"] for finding in done["findings"] if finding["subject"] == "non_blocking")
    assert again.endswith("--goals 4")
    for case in stored:
        assert case["again"].endswith("--goals 4")
        assert case["recipe"]["goals"] == 4
        repeated = json.loads(scbm(*case["again"].split()[1:], "--json").out)
        assert (repeated["goal"], repeated["verdict"]) == (case["goal"], case["verdict"])
    default = json.loads(scbm("test", stopped, "--no-shrink", "--json").out)
    assert "--goals" not in default["findings"][0]["again"]


def test_a_saved_case_has_its_goals_and_gives_the_same_run(scbm: Scbm, stopped: str, tmp_path: Path) -> None:
    scbm("test", stopped, "--cases", "5", "--seed", "1", "--no-shrink", "--save", str(tmp_path / "saved"))
    files = sorted((tmp_path / "saved").glob("*.yaml"))
    assert len(files) == 5
    assert any("then" in json.loads(scbm("replay", str(each), "--json").out)["goal"] for each in files)
    assert all(json.loads(scbm("replay", str(each), "--json").out)["is_recorded_run"] for each in files)


def test_a_latch_is_found_by_random_cases_and_made_small(scbm: Scbm, stopped: str, tmp_path: Path) -> None:
    done = json.loads(scbm("test", stopped, "--seed", "1", "--failures", str(tmp_path / "failures"), "--json").out)
    (found,) = [each for each in done["findings"] if each["subject"] == "non_blocking"]
    assert found["smallest"]["goal"] in ("placed", "gripped")
    assert "preempt == asked" in found["failures"][0]


def test_a_number_of_goals_needs_random_cases(scbm: Scbm, stopped: str, wording: Wording) -> None:
    for command in (("run", stopped, "--goal", "placed"), ("test", stopped, "--cases", "0"), ("trace", stopped)):
        ran = scbm(*command, "--goals", "2", *(["--perfetto", "x.json"] if command[0] == "trace" else []))
        assert ran.code == 2
        wording(ran.err.replace(stopped, "stopped.yaml"))
