"""The command line as a user meets it: output, exit codes, and errors that are never tracebacks."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import jsonschema
import pytest

import scbm.cli.verbs.check
from conftest import Ran
from support.wording import Wording, diagnostic_heads

BEFORE = "examples/robot_in_the_air/before.yaml"
AFTER = "examples/robot_in_the_air/after.yaml"

Scbm = Callable[..., Ran]


def test_check_reports_what_is_in_a_good_model(scbm: Scbm, golden: Callable[[str, str], None]) -> None:
    ran = scbm("check", BEFORE, AFTER)
    assert (ran.code, ran.err) == (0, "")
    golden("check.txt", ran.out)


def test_check_reports_all_errors_of_all_files(scbm: Scbm, tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("behavior_model: x\nvariables: {a: {domain: bool, initial: 3}}\noperationz: {}\n")
    ran = scbm("check", wrong, tmp_path / "missing.yaml", BEFORE)
    assert ran.code == 2
    for slug in ("different-kinds", "unknown-key", "file-missing"):
        assert f"error[{slug}]" in ran.err
    assert "good" in ran.out


def test_check_looks_at_bindings_beside_a_model(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    bindings = "examples/robot_in_the_air/ros2/bindings.yaml"
    ran = scbm("check", AFTER, "--bindings", bindings)
    assert (ran.code, ran.err) == (0, "")
    assert ran.out.endswith(f"\n{bindings}: good\n  robot_in_the_air: 1 bound resource of 4: scanner\n")
    (report,) = json.loads(scbm("check", AFTER, "--bindings", bindings, "--json").out)["models"]
    assert report["bindings"] == {"file": bindings, "errors": [], "bound": ["scanner"]}
    empty = tmp_path / "empty.yaml"
    empty.write_text("bindings_of: robot_in_the_air\nresources: {}\n", encoding="utf-8")
    ran = scbm("check", AFTER, "--bindings", empty)
    assert ran.out.endswith(f"\n{empty}: good\n  robot_in_the_air: 0 bound resources of 4\n")
    wrong = tmp_path / "wrong.yaml"
    wrong.write_text("bindings_of: robot_in_the_air\nresources: {skanner: {}}\n", encoding="utf-8")
    ran = scbm("check", AFTER, "--bindings", wrong)
    assert (ran.code, f"{wrong}:2:13: error[unknown-resource]" in ran.err) == (2, True)
    assert ran.out.startswith(f"{AFTER}: good\n")
    ran = scbm("check", AFTER, "--bindings", wrong, "--json")
    (error,) = json.loads(ran.out)["models"][0]["bindings"]["errors"]
    assert (ran.code, error["slug"], error["line"]) == (2, "unknown-resource", 2)
    ran = scbm("check", BEFORE, AFTER, "--bindings", bindings)
    assert (ran.code, ran.out) == (2, "")
    assert "error[bad-option]" in ran.err
    wording(ran.err)


def test_check_says_that_bindings_are_not_checked_without_the_extra(
    scbm: Scbm, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr("scbm.nodes.bindings.binding_keys.has_library", lambda: False)
    bound, bindings = "tests/models/valid/bindings.yaml", "examples/robot_in_the_air/ros2/bindings.yaml"
    for words in ((bound,), (AFTER, "--bindings", bindings)):
        ran = scbm("check", *words)
        assert ran.code == 0
        wording(ran.out)
    (report,) = json.loads(scbm("check", bound, "--json").out)["models"]
    assert report["bindings_checked"] is False
    (report,) = json.loads(scbm("check", AFTER, "--bindings", bindings, "--json").out)["models"]
    assert (report["bindings"]["bindings_checked"], "bindings_checked" in report) == (False, False)


def test_check_exits_with_1_for_warnings_only_if_asked(scbm: Scbm, tmp_path: Path) -> None:
    doubtful = tmp_path / "doubtful.yaml"
    doubtful.write_text("behavior_model: x\nvariables: {a: {domain: bool, initial: false}}\noperations: {}\n")
    assert scbm("check", doubtful).code == 0
    assert scbm("check", "--strict", doubtful).code == 1
    ran = scbm("check", "--json", doubtful)
    report = json.loads(ran.out)["models"][0]
    assert [(warning["slug"], warning["line"]) for warning in report["warnings"]] == [("unused-variable", 2)]


def test_plan_numbers_its_operations(scbm: Scbm, golden: Callable[[str, str], None]) -> None:
    ran = scbm("plan", AFTER, "--goal", "mounted == scanner && item_a_at == agv")
    assert ran.code == 0
    golden("plan.txt", ran.out)


def test_an_error_in_a_part_has_its_file_in_json(scbm: Scbm, tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").write_text("behavior_model: cell\ninclude: part.yaml\n", encoding="utf-8")
    (tmp_path / "part.yaml").write_text("part: p\nvariables: {a: {domain: 3}}\n", encoding="utf-8")
    (report,) = json.loads(scbm("check", tmp_path / "cell.yaml", "--json").out)["models"]
    assert [(Path(each["file"]).name, each["line"]) for each in report["errors"] if "domain" in each["message"]] == [
        ("part.yaml", 2)
    ]


def test_plan_as_json(scbm: Scbm) -> None:
    ran = scbm("plan", BEFORE, "--goal", "item_a_at == agv && robot_at == box_a", "--json")
    plan = json.loads(ran.out)
    assert (plan["status"], len(plan["plan"]), plan["limit"]) == ("solved", 16, None)
    assert plan["expanded"] == 132


def test_plan_says_why_there_is_none(scbm: Scbm, wording: Wording) -> None:
    ran = scbm("plan", BEFORE, "--goal", "mounted == gripper && item_a_at == gripper && gripper_act == open")
    assert ran.code == 1
    wording(ran.out)
    assert json.loads(scbm("plan", BEFORE, "--goal", "scan_timeouts == 3", "--json").out)["status"] == "unsolvable"


def test_plan_distinguishes_a_limit_from_a_proof(scbm: Scbm) -> None:
    ran = scbm("plan", BEFORE, "--goal", "item_a_scanned", "--max-length", 4, "--json")
    answer = json.loads(ran.out)
    assert (ran.code, answer["status"], answer["limit"], answer["plan"]) == (1, "limit_reached", "plan length", None)


def test_plan_from_another_state(scbm: Scbm, wording: Wording) -> None:
    ran = scbm("plan", BEFORE, "--goal", "item_a_scanned", "--state", "robot_at=box_a", "--state", "mounted=scanner")
    wording(ran.out.splitlines()[0])


@pytest.mark.parametrize(
    ("arguments", "slug"),
    [
        (("--goal", "item_a_scaned"), "unknown-goal"),
        (("--goal", "robot_at == hme"), "value-outside-domain"),
        (("--goal", "robot_at = home"), "predicate-syntax"),
        (("--goal", "plan.state == idle"), "runner-variable"),
        (("--goal", ""), "predicate-syntax"),
        (("--goal", "item_a_scanned", "--state", "robot_ta=home"), "unknown-variable"),
        (("--goal", "item_a_scanned", "--state", "robot_at=hme"), "value-outside-domain"),
        (("--goal", "item_a_scanned", "--state", "robot_at"), "bad-option"),
        (("--goal", "item_a_scanned", "--state", "scanned_a=true", "--state", "scanned_a=false"), "assigned-twice"),
    ],
)
def test_wrong_options_are_located(scbm: Scbm, arguments: tuple[str, ...], slug: str) -> None:
    ran = scbm("plan", BEFORE, *arguments)
    assert (ran.code, ran.out) == (2, "")
    assert f"error[{slug}]" in ran.err
    assert ran.err.startswith("--")


def test_run_draws_a_timeline(scbm: Scbm, golden: Callable[[str, str], None]) -> None:
    ran = scbm("run", BEFORE, "--goal", "scanned_a == true", "--seed", 5)
    assert ran.code == 0
    golden("timeline.txt", ran.out)


def test_run_shows_every_variable_if_asked(scbm: Scbm) -> None:
    few = scbm("run", BEFORE, "--goal", "item_a_scanned", "--seed", 1).out
    many = scbm("run", BEFORE, "--goal", "item_a_scanned", "--seed", 1, "--all").out
    assert "robot_req_state = succeeded" not in few
    assert "robot_req_state = succeeded" in many


def test_run_repeats_a_case_of_a_campaign(scbm: Scbm) -> None:
    cases = json.loads(scbm("test", BEFORE, "--cases", 6, "--seed", 9, "--json").out)["cases"]
    for number in (2, 6):
        case, ran = cases[number - 1], json.loads(scbm("run", BEFORE, "--seed", 9, "--case", number, "--json").out)
        assert ran["case"] == case["name"]
        assert (ran["goal"], ran["verdict"]) == (case["goal"], case["verdict"])
        assert ran["simulated_seconds"] == case["simulated_seconds"]


def test_run_writes_its_trace(scbm: Scbm, tmp_path: Path, golden: Callable[[str, str], None]) -> None:
    path = tmp_path / "trace.jsonl"
    assert scbm("run", BEFORE, "--goal", "item_a_scanned", "--seed", 5, "--trace", path).code == 0
    golden("trace.jsonl", path.read_text(encoding="utf-8"))
    unwritable = scbm("run", BEFORE, "--goal", "item_a_scanned", "--trace", tmp_path / "no" / "trace")
    assert (unwritable.code, "error[bad-option]" in unwritable.err) == (2, True)


@pytest.mark.parametrize("arguments", [(), ("--goal", "item_a_scanned", "--case", 1), ("--case", 1, "--state", "a=b")])
def test_run_wants_a_goal_or_a_case(scbm: Scbm, arguments: tuple[object, ...]) -> None:
    ran = scbm("run", BEFORE, *arguments)
    assert (ran.code, "error[bad-option]" in ran.err) == (2, True)


@pytest.mark.slow
def test_test_draws_the_report(scbm: Scbm, golden: Callable[[str, str], None]) -> None:
    ran = scbm("test", BEFORE, "--cases", 20, "--seed", 1)
    assert ran.code == 0
    golden("report.txt", ran.out)


def test_test_as_json(scbm: Scbm, golden: Callable[[str, str], None]) -> None:
    ran = scbm("test", BEFORE, "--cases", 20, "--seed", 1, "--json")
    golden("report.json", ran.out)
    report = json.loads(ran.out)
    coverage = report["coverage"]
    assert report["format_version"] == 5
    assert coverage["obligations"] == 86
    states = coverage["by_state"].values()
    assert coverage["visited"] == sum(s["visited"] for s in states) + coverage["automatic"]["visited"]
    assert len(coverage["missed"]) == 86 - coverage["visited"]
    assert coverage["missed_queued"] == ["robot_move_to_home/queued", "robot_unmount_gripper/queued"]
    assert len(report["cases"]) == 20


def test_fail_under_decides_on_the_exact_figure(scbm: Scbm, wording: Wording) -> None:
    coverage = json.loads(scbm("test", BEFORE, "--cases", 5, "--json").out)["coverage"]
    exact = 100 * coverage["visited"] / 86
    assert scbm("test", BEFORE, "--cases", 5, "--fail-under", f"{exact - 0.001:.6f}").code == 0
    under = scbm("test", BEFORE, "--cases", 5, "--fail-under", f"{exact + 0.001:.6f}")
    assert under.code == 1
    wording(under.err)


def test_no_cases_visit_nothing(scbm: Scbm) -> None:
    assert json.loads(scbm("test", BEFORE, "--cases", 0, "--json").out)["coverage"]["percent"] == 0


def test_a_model_without_obligations_is_not_measurable(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    empty = tmp_path / "empty.yaml"
    empty.write_text(
        "behavior_model: x\nvariables: {a: {domain: bool, initial: false}}\noperations: {}\ngoals: {g: a == false}\n"
    )
    ran = scbm("test", empty, "--cases", 2)
    wording(ran.out.splitlines()[2])
    assert json.loads(scbm("test", empty, "--cases", 2, "--json").out)["coverage"]["percent"] is None
    assert scbm("test", empty, "--cases", 2, "--fail-under", 50).code == 1


def test_a_failed_case_is_reported_with_the_command_that_repeats_it(
    scbm: Scbm, tmp_path: Path, wording: Wording
) -> None:
    text = Path(BEFORE).read_text(encoding="utf-8")
    broken = tmp_path / "broken.yaml"
    broken.write_text(text + "\nrequirements:\n  home: always gantry_req_state == executing -> robot_at == home\n")
    ran = scbm("test", broken, "--cases", 5, "--seed", 3, "--failures", tmp_path / "failures")
    assert ran.code == 1
    command = next(line for line in ran.out.splitlines() if "again:" in line).split("again: scbm ")[1]
    again = scbm(*command.split())
    assert again.code == 1
    assert "FAILED  home " in again.out
    wording(line for line in again.out.splitlines() if "✗ home: " in line)


def test_a_model_without_goals_cannot_draw_cases(scbm: Scbm, tmp_path: Path) -> None:
    aimless = tmp_path / "aimless.yaml"
    aimless.write_text("behavior_model: x\nvariables: {a: {domain: bool, initial: false}}\noperations: {}\n")
    ran = scbm("test", aimless)
    assert (ran.code, "error[no-goals]" in ran.err) == (2, True)


def test_an_impossible_initial_state_is_an_error_and_not_an_endless_loop(scbm: Scbm, tmp_path: Path) -> None:
    text = Path(BEFORE).read_text(encoding="utf-8")
    impossible = tmp_path / "impossible.yaml"
    impossible.write_text(text + "\ninitial_states: robot_at == agv\n")
    ran = scbm("test", impossible)
    assert (ran.code, "error[no-initial-state]" in ran.err) == (2, True)
    ran = scbm("run", impossible, "--goal", "item_a_scanned")
    assert (ran.code, "error[initial-state-not-allowed]" in ran.err) == (2, True)


def test_a_time_limit_is_simulated_time(scbm: Scbm) -> None:
    ran = scbm("run", BEFORE, "--goal", "item_a_scanned", "--time-limit", "2 s", "--json")
    assert json.loads(ran.out)["verdict"] == "time_limit"
    assert json.loads(ran.out)["simulated_seconds"] == 2
    ends = [c["verdict"] for c in json.loads(scbm("test", BEFORE, "--time-limit", "2 s", "--json").out)["cases"]]
    assert "time_limit" in ends
    for wrong in ("2", "0 s", "soon", ""):
        ran = scbm("run", BEFORE, "--goal", "item_a_scanned", "--time-limit", wrong)
        assert (ran.code, "error[bad-duration]" in ran.err) == (2, True)


def test_the_schema_is_printed(scbm: Scbm) -> None:
    for kind in ((), ("model",), ("case",)):
        jsonschema.Draft202012Validator.check_schema(json.loads(scbm("schema", *kind).out))
    assert scbm("schema").out == scbm("schema", "model").out != scbm("schema", "case").out


def test_the_version_and_the_help(scbm: Scbm) -> None:
    assert scbm("--version").out.startswith("scbm 0.")
    for verb in ("check", "plan", "run", "test", "replay", "schema"):
        assert verb in scbm("--help").out
        assert scbm(verb, "--help").code == 0


@pytest.mark.parametrize(
    "arguments", [("fly",), ("test",), ("test", BEFORE, "--cases", "many"), ("test", BEFORE, "--cases", "-1")]
)
def test_wrong_usage_exits_with_2(scbm: Scbm, arguments: tuple[str, ...]) -> None:
    ran = scbm(*arguments)
    assert ran.code == 2
    assert "Traceback" not in ran.err


def test_a_fault_of_scbm_itself_exits_with_3(scbm: Scbm, monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    def explode(*_: object) -> None:
        raise RuntimeError("cheese")

    monkeypatch.setattr(scbm_check, "check_model", explode)
    ran = scbm("check", BEFORE)
    assert ran.code == 3
    assert "RuntimeError: cheese" in ran.err
    wording(ran.err.splitlines()[-1])


scbm_check = scbm.cli.verbs.check


def test_an_option_with_one_value_is_given_once(scbm: Scbm, wording: Wording) -> None:
    ran = scbm("test", BEFORE, "--cases", 2, "--cases=3", "--seed", 1, "--seed", 1, "--json", "--json")
    assert (ran.code, ran.out) == (2, "")
    wording(ran.err.splitlines())


def test_an_option_with_several_values_is_given_as_often_as_one_likes(scbm: Scbm) -> None:
    asked = ("--require", "always scan_timeouts < 4", "--require", "always scan_timeouts < 5")
    assert scbm("test", BEFORE, "--cases", 2, *asked).code == 0


def test_a_value_behind_two_dashes_is_no_option(scbm: Scbm) -> None:
    assert diagnostic_heads(scbm("report", "--html", "x.html", "--", "--html").err) == ["--html: error[file-missing]"]
