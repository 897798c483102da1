"""`--planner` and its limits on every verb that plans, and `planner:` in the model."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scbm.files import digest_of, load_model, read_model, write_model
from scbm.model import InputError, PlannerChoice
from scbm.planning import PLANNERS, Answer, PlanLimits, PlannerEntry, PlanProblem
from scbm.planning.plan_answers import raise_if_cancelled
from support.models import scan_cell

BEFORE = Path("examples/robot_in_the_air/before.yaml")


@pytest.fixture
def noted(monkeypatch: pytest.MonkeyPatch) -> list[PlanLimits]:
    """A planner `noting`, which plans as the canonical one; the result has the limits of all its searches."""
    limits_asked: list[PlanLimits] = []

    def search(problem: PlanProblem, limits: PlanLimits) -> Answer:
        limits_asked.append(limits)
        raise_if_cancelled(problem.should_continue)
        return PLANNERS["canonical"].search(problem, limits)

    monkeypatch.setitem(PLANNERS, "noting", PlannerEntry("1", search, "canonical plans"))
    return limits_asked


@pytest.mark.parametrize(
    "command",
    [
        ("plan", BEFORE, "--goal", "item_a_scanned"),
        ("run", BEFORE, "--goal", "item_a_scanned"),
        ("test", BEFORE, "--cases", "2", "--no-shrink"),
        ("replay", "examples/robot_in_the_air/cases/delivery_among_others.yaml"),
        ("close", BEFORE, "--cases", "1", "--max-states", "10"),
    ],
    ids=lambda command: str(command[0]),
)
def test_every_verb_that_plans_takes_a_planner_and_its_limits(
    command: tuple[object, ...], noted: list[PlanLimits], scbm: Callable[..., Any], tmp_path: Path
) -> None:
    failures = ("--failures", tmp_path) if command[0] == "test" else ()
    ran = scbm(*command, *failures, "--planner", "noting", "--max-length", 77, "--max-expanded", 7777)
    assert ran.code in (0, 1), ran.err
    assert {(limits.length, limits.expansions) for limits in noted} == {(77, 7777)}
    noted.clear()
    scbm(*command, *failures)
    assert noted == []


@pytest.mark.parametrize("verb", ["plan", "run", "test", "replay", "close", "node controller"])
def test_an_unknown_planner_is_refused_with_a_suggestion(verb: str, scbm: Callable[..., Any]) -> None:
    goal = ("--goal", "item_a_scanned") if verb in ("plan", "run") else ()
    file = "examples/robot_in_the_air/cases/delivery_among_others.yaml" if verb == "replay" else BEFORE
    ran = scbm(*verb.split(), file, *goal, "--planner", "cannonical")
    assert ran.code == 2
    assert "--planner:1:1: error[unknown-planner]" in ran.err
    assert "did you mean `canonical`?" in ran.err


def _with_planner(text: str) -> str:
    return f"{write_model(scan_cell())}planner: {text}\n"


@pytest.mark.parametrize(
    ("text", "choice"),
    [
        ("canonical", PlannerChoice("canonical")),
        ("{name: canonical, max_length: 3}", PlannerChoice("canonical", 3)),
        ("{max_expanded: 10}", PlannerChoice(None, None, 10)),
    ],
)
def test_a_model_names_its_planner(text: str, choice: PlannerChoice) -> None:
    model = read_model(_with_planner(text))
    assert model.planner == choice
    assert read_model(write_model(model)) == model
    assert digest_of(model) == digest_of(scan_cell())


@pytest.mark.parametrize(
    ("text", "slug"),
    [
        ("canonicle", "unknown-planner"),
        ("{name: canonicle}", "unknown-planner"),
        ("{name: canonical, max_lenght: 3}", "unknown-key"),
        ("{max_length: 0}", "bad-number"),
        ("[canonical]", "wrong-shape"),
        ("", "wrong-shape"),
        ("{name: outside, max_expanded: 3}", "contradiction"),
    ],
)
def test_a_wrong_planner_of_a_model_has_a_place(text: str, slug: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(PLANNERS, "outside", PlannerEntry("1", PLANNERS["canonical"].search, "", is_external=True))
    with pytest.raises(InputError) as raised:
        read_model(_with_planner(text))
    (found,) = raised.value.diagnostics
    assert (found.slug.value, found.place.line > 1) == (slug, True)


def test_the_command_line_overrides_the_model(
    noted: list[PlanLimits], scbm: Callable[..., Any], tmp_path: Path
) -> None:
    file = tmp_path / "cell.yaml"
    file.write_text(_with_planner("{name: noting, max_length: 5}"), encoding="utf-8")
    plan = ("plan", file, "--goal", "scanned", "--json")
    assert json.loads(scbm(*plan).out)["planner"]["name"] == "noting"
    assert json.loads(scbm(*plan, "--max-expanded", "9").out)["status"] == "solved"
    assert [(limits.length, limits.expansions) for limits in noted] == [(5, 1_000_000), (5, 9)]
    assert json.loads(scbm(*plan, "--planner", "canonical").out)["planner"]["name"] == "canonical"
    assert load_model(file).planner.name == "noting"


def test_commands_that_repeat_a_run_name_the_planner(
    noted: list[PlanLimits], scbm: Callable[..., Any], tmp_path: Path
) -> None:
    arguments = ("--cases", 3, "--require", "never robot_at == agv", "--failures", tmp_path, "--no-shrink")
    ran = scbm("test", BEFORE, *arguments, "--planner", "noting", "--max-length", "50")
    assert ran.code == 1
    again = next(line for line in ran.out.splitlines() if "scbm run " in line)
    more = next(line for line in ran.out.splitlines() if "scbm test " in line)
    assert " --planner noting --max-length 50" in again
    assert more.endswith(" --planner noting --max-length 50")
    assert noted


@pytest.mark.parametrize(
    ("options", "limit", "remedy"),
    [(("--max-time", "1 ns"), "time", "--max-time"), (("--max-memory", "1 kB"), "memory", "--max-memory")],
)
def test_time_and_memory_limit_a_plan(
    options: tuple[str, ...], limit: str, remedy: str, noted: list[PlanLimits], scbm: Callable[..., Any]
) -> None:
    command = ("plan", BEFORE, "--goal", "item_a_scanned", "--planner", "noting", *options)
    answer = json.loads(scbm(*command, "--json").out)
    assert (answer["status"], answer["limit"], len(noted)) == ("limit_reached", limit, 1)
    assert f"set another limit with {remedy}" in scbm(*command).out


@pytest.mark.parametrize(
    ("options", "place"),
    [
        (("--max-time", "soon"), "--max-time:1:1: error[bad-duration]"),
        (("--max-time", "0 s"), "--max-time:1:1: error[bad-duration]"),
        (("--max-memory", "2 cups"), "--max-memory:1:1: error[bad-option]"),
        (("--max-memory", "0 MB"), "--max-memory:1:1: error[bad-option]"),
    ],
)
def test_a_limit_that_cannot_be_read_is_refused(options: tuple[str, ...], place: str, scbm: Callable[..., Any]) -> None:
    ran = scbm("plan", BEFORE, "--goal", "item_a_scanned", *options)
    assert (ran.code, place in ran.err) == (2, True)


def test_another_program_takes_no_limits_that_it_would_ignore(
    scbm: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(PLANNERS, "outside", PlannerEntry("1", PLANNERS["canonical"].search, "", is_external=True))
    ran = scbm("plan", BEFORE, "--goal", "item_a_scanned", "--planner", "outside", "--max-expanded", "9")
    assert (ran.code, "--max-expanded: error[bad-option]" in ran.err) == (2, True)


def test_a_case_is_replayed_with_the_planner_of_its_recorded_run(scbm: Callable[..., Any], tmp_path: Path) -> None:
    campaign = ("--cases", 6, "--require", "never robot_at == agv", "--failures", tmp_path)
    scbm("test", BEFORE, *campaign, "--planner", "greedy")
    (case, *_) = sorted(tmp_path.glob("*.yaml"))
    assert "planner: greedy 1" in case.read_text(encoding="utf-8")
    ran = scbm("replay", case, "--model", BEFORE, "--trace", tmp_path / "trace.jsonl", "--json")
    assert json.loads(ran.out)["is_recorded_run"] is True
    header = json.loads((tmp_path / "trace.jsonl").read_text(encoding="utf-8").splitlines()[0])
    assert header["planner"] == {"name": "greedy", "version": "1"}
    case.write_text(case.read_text(encoding="utf-8").replace("greedy 1", "gone 3"), encoding="utf-8")
    gone = scbm("replay", case, "--model", BEFORE)
    assert (gone.code, "error[unknown-planner]" in gone.err) == (2, True)
    assert scbm("replay", case, "--model", BEFORE, "--planner", "greedy").code == 1
