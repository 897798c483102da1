"""`--planner` and its limits on every verb that plans, and `planner:` in the model."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scbm.cases.trace import read_trace
from scbm.files import digest_of, load_model, read_model, write_model
from scbm.model import InputError, PlannerChoice, PlannerIdentity
from scbm.planning import PLANNERS, Answer, PlanLimits, PlannerEntry, PlanProblem
from scbm.planning.plan_answers import raise_if_cancelled
from scbm.store import Replays, read_history
from support.models import scan_cell

BEFORE = Path("examples/robot_in_the_air/before.yaml")
FEW = ("--max-states", "10", "--max-random", "5", "--max-changes", "5")


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
        pytest.param(("close", BEFORE, "--cases", "1", *FEW), marks=pytest.mark.slow),
        ("explain", BEFORE, "robot_move_to_box_a/disabled", *FEW),
        ("trace", BEFORE, "--case", "1"),
        ("trace", "examples/robot_in_the_air/cases/delivery_among_others.yaml"),
    ],
    ids=lambda command: "-".join(map(str, command[:1])),
)
def test_every_verb_that_plans_takes_a_planner_and_its_limits(
    command: tuple[object, ...], noted: list[PlanLimits], scbm: Callable[..., Any], tmp_path: Path
) -> None:
    more = {"test": ("--failures", tmp_path), "trace": ("--perfetto", tmp_path / "trace.json")}.get(str(command[0]), ())
    ran = scbm(*command, *more, "--planner", "noting", "--max-length", 77, "--max-expanded", 7777)
    assert ran.code in (0, 1), ran.err
    assert {(limits.length, limits.expansions) for limits in noted} == {(77, 7777)}
    noted.clear()
    scbm(*command, *more)
    assert noted == []


@pytest.mark.parametrize("verb", ["plan", "run", "test", "replay", "close", "node controller", "explain", "trace"])
def test_an_unknown_planner_is_refused_with_a_suggestion(verb: str, scbm: Callable[..., Any]) -> None:
    needed = {"explain": ("robot_move_to_box_a/disabled",), "trace": ("--case", 1, "--perfetto", "trace.json")}
    goal = ("--goal", "item_a_scanned") if verb in ("plan", "run") else needed.get(verb, ())
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


_RECORDED = f"recorded: {{end: reached, trace: {'0' * 64}, planner: greedy 1}}\n"


@pytest.mark.parametrize(
    ("recorded", "options", "repeated"),
    [
        (_RECORDED, (), "--planner canonical"),
        (_RECORDED, ("--max-length", "50"), "--planner canonical --max-length 50"),
        (_RECORDED, ("--planner", "greedy"), "--planner greedy"),
        ("", (), ""),
        (f"plans: [[scan_box]]\n{_RECORDED}", ("--planner", "greedy"), ""),
    ],
)
def test_a_recorded_case_that_fails_is_repeated_with_the_planner_of_the_campaign(
    recorded: str, options: tuple[str, ...], repeated: str, scbm: Callable[..., Any], tmp_path: Path
) -> None:
    model, case = tmp_path / "cell.yaml", tmp_path / "case.yaml"
    model.write_text(write_model(scan_cell()), encoding="utf-8")
    failing = "case: fails\nmodel: cell.yaml\ngoal: scanned\nexpect: {verdict: aborted}\n"
    case.write_text(failing + recorded, encoding="utf-8")
    ran = scbm("test", model, case, *options, "--no-shrink")
    command = next(line for line in ran.out.splitlines() if "again: scbm" in line).partition("again: scbm ")[2]
    assert shlex.split(command) == ["replay", str(case), *shlex.split(repeated)]
    replayed = scbm(*shlex.split(command))
    assert (replayed.code, "FAILED" in replayed.out) == (1, True)


@pytest.mark.slow
def test_limits_of_the_command_line_are_recorded_and_give_the_same_run_again(
    scbm: Callable[..., Any], tmp_path: Path
) -> None:
    saved = tmp_path / "saved"
    campaign = ("--cases", 4, "--seed", 3, "--failures", tmp_path, "--no-shrink", "--save", saved)
    limits = ("--max-length", 3, "--max-expanded", 5000)
    scbm("test", BEFORE, *campaign, *limits, "--store", tmp_path / "cov.db")
    ends = []
    for case in sorted(saved.glob("*.yaml")):
        text = case.read_text(encoding="utf-8")
        assert text.startswith("# case ")
        assert " of seed 3, with --max-length 3 --max-expanded 5000\n" in text
        assert "  planner: canonical 1, max_length 3, max_expanded 5000\n" in text
        ran = scbm("replay", case, "--trace", tmp_path / "trace.jsonl", "--json")
        report = json.loads(ran.out)
        ends.append(report["verdict"])
        assert report["is_recorded_run"] is True
        trace = read_trace((tmp_path / "trace.jsonl").read_text(encoding="utf-8"))
        assert trace.planner == PlannerIdentity("canonical", "1", 3, 5000)
        assert json.loads(scbm("replay", case, "--max-length", 1000, "--json").out)["verdict"] == "reached"
    assert "planner_limit" in ends
    history = read_history(tmp_path / "cov.db")
    assert [run.planner for run in history.runs] == ["canonical 1, max_length 3, max_expanded 5000"]
    replays = Replays(history)
    executions = [replays.execute(stored) for stored in history.cases]
    assert sorted(execution.verdict.end.value for execution in executions if execution) == sorted(ends)


@pytest.mark.longer
def test_the_same_cases_with_other_limits_are_other_cases_of_a_store(scbm: Callable[..., Any], tmp_path: Path) -> None:
    campaign = ("--cases", 2, "--failures", tmp_path, "--no-shrink", "--store", tmp_path / "cov.db")
    scbm("test", BEFORE, *campaign)
    scbm("test", BEFORE, *campaign, "--max-length", 3)
    scbm("test", BEFORE, *campaign, "--max-length", 3)
    assert len(read_history(tmp_path / "cov.db").cases) == 4


def test_a_limit_of_the_model_is_recorded(scbm: Callable[..., Any], tmp_path: Path) -> None:
    file = tmp_path / "cell.yaml"
    file.write_text(_with_planner("{max_length: 5}"), encoding="utf-8")
    scbm("test", file, "--cases", 1, "--failures", tmp_path, "--save", tmp_path / "saved")
    (case,) = (tmp_path / "saved").glob("*.yaml")
    assert "planner: canonical 1, max_length 5" in case.read_text(encoding="utf-8")
    file.write_text(_with_planner("{max_length: 1000}"), encoding="utf-8")
    assert json.loads(scbm("replay", case, "--json").out)["is_recorded_run"] is True


def test_a_run_that_was_recorded_without_limits_is_replayed_without_limits(
    scbm: Callable[..., Any], tmp_path: Path
) -> None:
    file = tmp_path / "cell.yaml"
    file.write_text(Path(BEFORE).read_text(encoding="utf-8"), encoding="utf-8")
    scbm("test", file, "--cases", 1, "--seed", 1, "--failures", tmp_path, "--save", tmp_path / "saved")
    (case,) = (tmp_path / "saved").glob("*.yaml")
    file.write_text(f"{file.read_text(encoding='utf-8')}planner: {{max_length: 1}}\n", encoding="utf-8")
    assert scbm("test", file, case, "--failures", tmp_path, "--no-shrink").code == 1
    assert json.loads(scbm("replay", case, "--json").out)["is_recorded_run"] is True


@pytest.mark.parametrize(
    "identity",
    [
        PlannerIdentity("canonical", "1"),
        PlannerIdentity("greedy", "2", 5),
        PlannerIdentity("other", "1/0.3.1", None, 9),
        PlannerIdentity("other", "1/0.3.1", 0, 9),
    ],
    ids=str,
)
def test_a_planner_is_read_as_it_is_written(identity: PlannerIdentity) -> None:
    assert PlannerIdentity.parse(str(identity)) == identity


@pytest.mark.parametrize("text", ["", "canonical", "canonical 1,", "canonical 1, max_length", "canonical 1, most 3"])
def test_no_other_text_is_read_as_a_planner(text: str) -> None:
    with pytest.raises(ValueError, match="is not the name and the version"):
        PlannerIdentity.parse(text)


def test_explain_repeats_the_planner_in_its_commands(noted: list[PlanLimits], scbm: Callable[..., Any]) -> None:
    ran = scbm("explain", BEFORE, "robot_move_to_box_a/failed", "--planner", "noting", "--max-length", "60")
    (again,) = (line for line in ran.out.splitlines() if "scbm replay " in line)
    assert again.endswith(" --planner noting --max-length 60")
    assert noted
