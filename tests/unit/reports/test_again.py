"""The commands that run stored cases again: they give the same run."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import pytest
from msgspec.structs import replace

from scbm.reports.stored_cases import again
from scbm.reports.terminal.store_report import stored_report
from scbm.store import Drawn, StoredCase, Written
from support.histories import EXAMPLE, history_of, with_lost_cases

MODEL = "examples/robot_in_the_air/before.yaml"
CASE = "case: scans\ngoal: item_a_scanned\ninitial: {robot_at: toolbox_scanner}\n"
RUNS = history_of(EXAMPLE / "before.yaml", 1).runs


class Ran(Protocol):
    code: int
    out: str


Scbm = Callable[..., Ran]


def drawn(recipe: Drawn) -> StoredCase:
    return replace(history_of(EXAMPLE / "before.yaml", 1).cases[0], recipe=recipe)


def test_a_drawn_case_is_drawn_again(scbm: Scbm) -> None:
    stored = history_of(EXAMPLE / "before.yaml", 3, seed=7).cases[2]
    words = shlex.split(again(stored, MODEL, RUNS))
    assert words == ["scbm", "run", MODEL, "--seed", "7", "--case", "3"]
    report = json.loads(scbm(*words[1:], "--json").out)
    assert (report["case"], report["simulated_seconds"]) == (stored.name, stored.ended_ns / 1e9)


def test_all_that_decides_a_drawn_case_is_reported(scbm: Scbm) -> None:
    requirements = (
        ("required_1", "never robot_at == home"),
        ("required_2", "always mounted == none || gripper_act == open"),
    )
    stored = drawn(Drawn(-3, 2, "loss: 2 %, jitter: 20 ms", requirements, 523_123_000_000))
    words = shlex.split(again(stored, MODEL, RUNS))
    assert words[2:] == [
        *(MODEL, "--seed", "-3", "--case", "2", "--network", "loss: 2 %, jitter: 20 ms"),
        *("--time-limit", "523.123 s", "--require", "never robot_at == home"),
        *("--require", "always mounted == none || gripper_act == open"),
    ]
    report = json.loads(scbm(*words[1:], "--json").out)
    assert report["case"] == "seed--3-case-2"


def test_a_written_case_is_replayed_wherever_it_is(scbm: Scbm, tmp_path: Path) -> None:
    path = tmp_path / "it's <here> & there.yaml"
    path.write_text(CASE, encoding="utf-8")
    stored = history_of(EXAMPLE / "before.yaml", 0, written=[path]).cases[0]
    words = shlex.split(again(stored, MODEL, RUNS))
    assert words == ["scbm", "replay", str(path), "--model", MODEL]
    assert json.loads(scbm(*words[1:], "--json").out)["case"] == stored.name


def test_a_path_is_never_taken_for_an_option() -> None:
    stored = replace(drawn(Drawn(1, 1)), recipe=Written(CASE, "-x.yaml"))
    assert shlex.split(again(stored, "-m.yaml", RUNS)) == ["scbm", "replay", "./-x.yaml", "--model", "./-m.yaml"]


def test_nothing_runs_a_case_of_an_earlier_model_again() -> None:
    assert not again(replace(drawn(Drawn(1, 1)), is_earlier=True), MODEL, RUNS)


def test_a_case_that_a_test_says_is_run_again_by_that_test() -> None:
    stored = replace(history_of(EXAMPLE / "before.yaml", 1).cases[0], recipe=Written(CASE, "tests/test_cell.py"))
    assert again(stored, MODEL, RUNS) == "pytest tests/test_cell.py"


@pytest.mark.parametrize(
    ("planner", "text", "options"),
    [
        ("greedy 1", "", "--planner greedy"),
        ("canonical 1, max_length 50, max_expanded 9", "", "--planner canonical --max-length 50 --max-expanded 9"),
        ("canonical 1", "planner: greedy\n", "--planner canonical"),
        ("canonical 1", "", ""),
    ],
)
def test_a_case_is_planned_by_the_planner_of_its_run(planner: str, text: str, options: str) -> None:
    run = replace(RUNS[0], planner=planner, source=replace(RUNS[0].source, text=text))
    assert shlex.split(again(drawn(Drawn(1, 2)), MODEL, (run,)))[7:] == ["--goals", "1", *shlex.split(options)]
    written = replace(drawn(Drawn(1, 2)), recipe=Written(CASE, "one.yaml"))
    assert shlex.split(again(written, MODEL, (run,)))[5:] == shlex.split(options)
    with_plans = replace(written, recipe=Written(f"{CASE}plans: [unsolvable]\n", "one.yaml"))
    assert shlex.split(again(with_plans, MODEL, (run,)))[5:] == []
    recorded = replace(written, recipe=Written(f"{CASE}recorded: {{planner: greedy 1}}\n", "one.yaml"))
    assert shlex.split(again(recorded, MODEL, (run,)))[5:] == shlex.split(options or "--planner canonical")
    of_test = replace(written, recipe=Written(CASE, "tests/test_cell.py"))
    words = shlex.split(again(of_test, MODEL, (run,)))[2:]
    assert words == shlex.split(options.replace("--", "--scbm-"))


def test_nothing_shows_a_lost_case_again() -> None:
    history = with_lost_cases(history_of(EXAMPLE / "before.yaml", 2), 1)
    assert [bool(again(case, MODEL, history.runs)) for case in history.cases] == [False, True]
    shown = [str(line) for line in stored_report(history, "cov.db")]
    (failure,) = history.cases[0].verdict.failures
    assert f"    {failure.message}" in shown
    assert not any("again:" in line for line in shown)
