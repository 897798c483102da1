"""`--plans` and `runs: {plans: drawn}` on the command line: what draws and what is refused, and repeated runs."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scbm.files import digest_of, load_model, read_case
from scbm.store import Replays, read_history
from scbm.testing.event_logs.event_log import open_event_log
from support.two_robots import two_robots_text
from support.wording import Wording


@pytest.fixture
def drawn(tmp_path: Path) -> Path:
    """The file of a model that draws plans."""
    file = tmp_path / "drawn.yaml"
    file.write_text(two_robots_text(), encoding="utf-8")
    return file


@pytest.fixture
def canonical(tmp_path: Path) -> Path:
    """The file of the same model with canonical plans."""
    file = tmp_path / "canonical.yaml"
    file.write_text(two_robots_text("canonical"), encoding="utf-8")
    return file


def _second(shown: str) -> bool:
    return "pick_2" in shown


def test_random_cases_use_both_robots_if_the_model_or_the_option_draws_plans(
    drawn: Path, canonical: Path, scbm: Callable[..., Any]
) -> None:
    run = ("run", "--goal", "served", "--seed", 1)
    assert _second(scbm(run[0], drawn, *run[1:]).out)
    assert not _second(scbm(run[0], canonical, *run[1:]).out)
    assert _second(scbm(run[0], canonical, *run[1:], "--plans", "drawn").out)
    assert not _second(scbm(run[0], drawn, *run[1:], "--plans", "canonical").out)
    figures = [
        json.loads(scbm("test", file, "--cases", 10, "--json", *more).out)["coverage"]["visited"]
        for file, more in ((canonical, ()), (drawn, ()), (canonical, ("--plans", "drawn")))
    ]
    assert figures == [4, 8, 8]


@pytest.mark.parametrize("verb", ["run", "test", "replay", "close", "explain", "trace", "node controller"])
@pytest.mark.parametrize(
    "wrong",
    [
        (("--plans", "any"), "--plans:1:1", "write `canonical` or `drawn`"),
        (("--planner", "greedy"), "--planner", "leave out `--planner`, or add `--plans canonical`"),
        (("--planner", "greedy", "--plans", "drawn"), "--plans", "leave out one of the two options"),
        (("--planner", "drawn"), "--planner:1:1", "declare `runs: {plans: drawn}`"),
    ],
)
def test_wrong_plans_are_refused_with_a_remedy(
    verb: str, wrong: tuple[tuple[str, ...], str, str], drawn: Path, scbm: Callable[..., Any]
) -> None:
    options, place, remedy = wrong
    case = drawn.with_name("case.yaml")
    case.write_text("case: one\nmodel: drawn.yaml\ngoal: served\n", encoding="utf-8")
    more: dict[str, tuple[object, ...]] = {
        "run": ("--goal", "served"),
        "explain": ("pick_1/failed",),
        "trace": ("--case", 1, "--perfetto", drawn.with_name("trace.json")),
    }
    ran = scbm(*verb.split(), case if verb == "replay" else drawn, *more.get(verb, ()), *options)
    assert ran.code == 2
    assert ran.err.startswith(f"{place}: error")
    assert remedy in ran.err


def test_plans_cannot_be_drawn_with_the_planner_of_a_model(
    tmp_path: Path, scbm: Callable[..., Any], wording: Wording
) -> None:
    file = tmp_path / "greedy.yaml"
    file.write_text(f"{two_robots_text('canonical')}planner: greedy\n", encoding="utf-8")
    ran = scbm("test", file, "--plans", "drawn")
    assert ran.code == 2
    assert "add `--planner canonical`" in ran.err
    wording(ran.err)
    assert scbm("test", file, "--plans", "drawn", "--planner", "canonical", "--cases", 1).code == 0


def test_a_plan_of_scbm_plan_is_never_drawn(drawn: Path, scbm: Callable[..., Any]) -> None:
    assert "pick_1" in scbm("plan", drawn, "--goal", "served").out
    assert scbm("plan", drawn, "--goal", "served", "--planner", "greedy").code == 0


@pytest.mark.slow
def test_saved_cases_are_replayed_with_their_plans(canonical: Path, tmp_path: Path, scbm: Callable[..., Any]) -> None:
    saved = tmp_path / "saved"
    assert scbm("test", canonical, "--cases", 6, "--plans", "drawn", "--save", saved).code == 0
    for file in sorted(saved.iterdir()):
        text = file.read_text(encoding="utf-8")
        assert "with --plans drawn" in text
        assert "planner: drawn 1" in text
        (plan,) = read_case(text, load_model(canonical)).plans
        ran = scbm("replay", file)
        assert (ran.code, _second(ran.out)) == (0, "pick_2" in plan.plan)
        file.write_text("".join(text.partition("plans:")[0]) + text[text.index("recorded:") :], encoding="utf-8")
        assert scbm("replay", file).code == 0  # they are drawn from the seed again
        refused = scbm("replay", file, "--plans", "canonical")
        assert refused.code == (1 if "pick_2" in plan.plan else 0)


def test_a_failure_is_repeated_by_the_command_of_the_report(
    canonical: Path, tmp_path: Path, scbm: Callable[..., Any]
) -> None:
    arguments = ("--cases", 6, "--plans", "drawn", "--require", "never box == held_2", "--failures", tmp_path / "f")
    ran = scbm("test", canonical, *arguments)
    again = shlex.split(ran.out.partition("again: ")[2].splitlines()[0])
    assert again[1] == "replay"
    repeated = scbm(*again[1:])
    assert (repeated.code, _second(repeated.out)) == (1, True)
    ran = scbm("test", canonical, *arguments, "--no-shrink")
    again = shlex.split(ran.out.partition("again: ")[2].splitlines()[0])
    assert again[-4:] == ["--plans", "drawn", "--require", "never box == held_2"]
    repeated = scbm(*again[1:])
    assert (repeated.code, _second(repeated.out)) == (1, True)


def test_a_store_draws_the_plans_of_a_random_case_again(
    canonical: Path, tmp_path: Path, scbm: Callable[..., Any]
) -> None:
    store = tmp_path / "runs.db"
    require = ("--require", "never box == held_2", "--no-shrink")
    scbm("test", canonical, "--cases", 6, "--plans", "drawn", "--store", store, *require)
    history = read_history(store)
    replays = Replays(history)
    for stored in history.cases:
        execution = replays.execute(stored)
        assert execution is not None
        assert execution.verdict.passed == stored.verdict.passed
        assert str(execution.trace.planner) == "drawn 1"
    assert [run.planner for run in history.runs] == ["drawn 1"]
    shown = scbm("report", store).out
    again = shlex.split(shown.partition("again: ")[2].splitlines()[0])
    assert again[-4:-2] == ["--plans", "drawn"]
    repeated = scbm(*again[1:])
    assert (repeated.code, _second(repeated.out)) == (1, True)


@pytest.mark.longer
def test_the_controller_of_a_cell_draws_for_random_cases(drawn: Path, tmp_path: Path, scbm: Callable[..., Any]) -> None:
    case = tmp_path / "plain.yaml"
    case.write_text("case: plain\nmodel: drawn.yaml\ngoal: served\n", encoding="utf-8")
    logs = tmp_path / "logs"
    nodes = ("--transport", "loopback", "--time-scale", 100, "--logs", logs)
    scbm("test", drawn, case, "--cases", 6, *nodes)  # a late reply changes no planner
    model = load_model(drawn)
    found = {path.name: open_event_log(path).read(model, digest_of(model)) for path in sorted(logs.iterdir())}
    assert str(found.pop("plain.log").planner) == "canonical 1"
    assert {str(log.planner) for log in found.values()} == {"drawn 1"}
    texts = [path.read_text(encoding="utf-8") for path in sorted(logs.iterdir())]
    assert {"pick_2" in text for text in texts} == {True, False}


@pytest.mark.slow
def test_workers_draw_the_same_plans(drawn: Path, scbm: Callable[..., Any]) -> None:
    outputs = [scbm("test", drawn, "--cases", 300, "--json", "-j", jobs).out for jobs in (1, 2)]
    assert outputs[0] == outputs[1]
