"""Case files on the command line: `test` with files, saving, `replay`, requirements, faults, and what is wrong."""

from __future__ import annotations

import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import pytest

from support.profiles import share
from support.wording import Wording, diagnostic_heads

ROOT = Path(__file__).parents[3]
BEFORE = "examples/robot_in_the_air/before.yaml"
AFTER = "examples/robot_in_the_air/after.yaml"
CASES = "examples/robot_in_the_air/cases"
HOME = "always gantry_req_state == executing -> robot_at == home"

CASE = """\
case: scans
goal: item_a_scanned
initial: {robot_at: toolbox_scanner}
expect: {verdict: reached}
"""


class Ran(Protocol):
    code: int
    out: str
    err: str


Scbm = Callable[..., Ran]


def _write(directory: Path, name: str, text: str = CASE) -> Path:
    path = directory / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


# saving and replaying


@pytest.mark.slow
def test_every_saved_case_replays_to_the_same_trace(scbm: Scbm, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert scbm("test", BEFORE, "--cases", share(20), "--seed", 1, "--save", out).code == 0
    saved = sorted(out.iterdir())
    assert len(saved) == share(20)
    for path in saved:
        number = path.stem.rpartition("-")[2]
        drawn = scbm("run", BEFORE, "--seed", 1, "--case", number, "--trace", tmp_path / "drawn")
        replayed = scbm("replay", path, "--trace", tmp_path / "replayed")
        assert (replayed.code, replayed.out) == (drawn.code, drawn.out)
        assert (tmp_path / "replayed").read_bytes() == (tmp_path / "drawn").read_bytes()


@pytest.mark.slow
def test_cases_on_a_bad_network_replay_too(scbm: Scbm, tmp_path: Path) -> None:
    out = tmp_path / "out"
    options = ("--cases", share(30), "--seed", 5, "--network", "drawn", "--time-limit", "5 min")
    assert scbm("test", AFTER, *options, "--save", out).code == 0
    for path in sorted(out.iterdir()):
        assert json.loads(scbm("replay", path, "--json").out)["is_recorded_run"] is True


@pytest.mark.slow
def test_saved_cases_give_the_report_that_the_random_ones_gave(scbm: Scbm, tmp_path: Path) -> None:
    drawn = json.loads(scbm("test", BEFORE, "--cases", 10, "--seed", 4, "--save", tmp_path, "--json").out)
    written = json.loads(scbm("test", BEFORE, tmp_path, "--json").out)
    assert written["coverage"]["visited"] == drawn["coverage"]["visited"]
    by_name = {case["name"]: case for case in drawn["cases"]}
    assert {case["name"]: case for case in written["cases"]} == by_name


@pytest.mark.longer
def test_a_case_that_was_edited_is_not_the_recorded_run(scbm: Scbm, tmp_path: Path) -> None:
    scbm("test", BEFORE, "--cases", 1, "--seed", 1, "--save", tmp_path)
    path = next(tmp_path.iterdir())
    assert scbm("replay", path).code == 0
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("outcome: succeed, after: ", "outcome: fail, after: 1", 1), encoding="utf-8")
    ran = scbm("replay", path)
    assert (ran.code, "error[replay-differs]" in ran.err) == (1, True)
    path.write_text(path.read_text(encoding="utf-8").partition("recorded:")[0], encoding="utf-8")
    assert scbm("replay", path).code == 0


@pytest.mark.longer
def test_saving_never_loses_a_file_that_says_something_else(scbm: Scbm, tmp_path: Path) -> None:
    scbm("test", BEFORE, "--cases", 2, "--seed", 1, "--save", tmp_path)
    assert scbm("test", BEFORE, "--cases", 2, "--seed", 1, "--save", tmp_path).code == 0
    edited = _write(tmp_path, "seed-1-case-2.yaml", "mine\n")
    ran = scbm("test", BEFORE, "--cases", 3, "--seed", 1, "--save", tmp_path)
    assert (ran.code, "seed-1-case-2.yaml: error[bad-option]" in ran.err) == (2, True)
    assert "SCBM-IAS" in ran.out, "the report is not lost"
    assert edited.read_text(encoding="utf-8") == "mine\n"
    assert not (tmp_path / "seed-1-case-3.yaml").exists()
    assert scbm("test", BEFORE, "--cases", 1, "--save", edited / "below").code == 2


def test_a_replay_needs_a_model(scbm: Scbm, tmp_path: Path) -> None:
    path = _write(tmp_path, "scans.yaml")
    ran = scbm("replay", path)
    assert (ran.code, "error[model-missing]" in ran.err) == (2, True)
    assert scbm("replay", path, "--model", AFTER).code == 0
    wrong = _write(tmp_path, "wrong.yaml", CASE.replace("goal", "Goal").replace("case: scans", "case: scans\nModel: x"))
    ran = scbm("replay", wrong)
    assert (ran.code, ran.err.count("`model`"), "`goal`" in ran.err) == (2, 1, True)
    for model, slug in (("nowhere.yaml", "file-missing"), (".", "file-is-directory")):
        ran = scbm("replay", _write(tmp_path, "lost.yaml", f"model: {model}\n" + CASE + "limit: 3\n"))
        assert f"lost.yaml:1:8: error[{slug}]" in ran.err
        assert "error[unknown-key]" in ran.err


# case files


def test_the_cases_of_the_example_visit_everything(scbm: Scbm, wording: Wording) -> None:
    ran = scbm("test", AFTER, CASES, "--fail-under", 100)
    assert ran.code == 0
    wording(ran.out.splitlines()[2:5])


@pytest.mark.slow
def test_files_and_random_cases_may_be_mixed(scbm: Scbm, wording: Wording) -> None:
    ran = scbm("test", AFTER, CASES, "--cases", 3, "--seed", 9)
    wording(line for line in ran.out.splitlines() if "written cases" in line)
    assert len(json.loads(scbm("test", AFTER, CASES, "--cases", 3, "--seed", 9, "--json").out)["cases"]) == 10
    assert len(json.loads(scbm("test", AFTER, CASES, "--json").out)["cases"]) == 7


def test_all_errors_of_all_files_are_reported_at_once(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    _write(tmp_path, "a.yaml", CASE.replace("item_a_scanned", "item_a_scaned"))
    _write(tmp_path, "deep/b.yaml", CASE.replace("toolbox_scanner", "toolbox"))
    _write(tmp_path, "c.yml", "no case at all\n")
    _write(tmp_path, ".hidden/d.yaml", "no case at all\n")
    _write(tmp_path, "model.yaml", (ROOT / AFTER).read_text(encoding="utf-8"))
    ran = scbm("test", AFTER, tmp_path)
    assert ran.code == 2
    assert "error[unknown-goal]" in ran.err
    wording(ran.err)
    assert "error[value-outside-domain]" in ran.err
    assert "c.yml:1:1: error" in ran.err
    assert "3 errors" in ran.err


def test_two_cases_of_one_name_are_an_error(scbm: Scbm, tmp_path: Path) -> None:
    _write(tmp_path, "a.yaml")
    _write(tmp_path, "b.yaml")
    ran = scbm("test", AFTER, tmp_path)
    assert (ran.code, diagnostic_heads(ran.err)) == (2, [f"{tmp_path}/b.yaml: error[duplicate-name]"])
    assert f"{tmp_path}/a.yaml" in ran.err
    saved = tmp_path / "saved"
    scbm("test", AFTER, "--cases", 2, "--seed", 3, "--save", saved)
    ran = scbm("test", AFTER, saved, "--cases", 5, "--seed", 3)
    assert (ran.code, "error[duplicate-name]" in ran.err) == (2, True)


def test_a_directory_without_cases_is_an_error(scbm: Scbm, tmp_path: Path) -> None:
    ran = scbm("test", AFTER, tmp_path, tmp_path / "nowhere.yaml")
    assert (ran.code, "error[no-cases]" in ran.err) == (2, True)


def test_a_failed_expectation_is_shown_against_what_happened(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    text = CASE.replace("{verdict: reached}", "{verdict: aborted, final: robot_at == home}")
    path = _write(tmp_path, "scans.yaml", text)
    ran = scbm("test", AFTER, path)
    assert ran.code == 1
    place = ran.out.splitlines().index("  scans")
    wording(ran.out.splitlines()[place + 1 : place + 3])
    assert f"again: scbm replay {path}" in ran.out
    (finding,) = json.loads(scbm("test", AFTER, path, "--json").out)["findings"]
    assert (finding["kind"], finding["subject"], len(finding["failures"])) == ("expectation", "verdict", 2)
    assert scbm("replay", path, "--model", AFTER).code == 1


def test_what_one_case_expected_in_vain_is_one_finding(scbm: Scbm, tmp_path: Path) -> None:
    text = CASE.replace("{verdict: reached}", "{verdict: aborted, final: [robot_at == home, mounted == none]}")
    ran = scbm("test", AFTER, _write(tmp_path, "scans.yaml", text), "--json")
    (finding,) = json.loads(ran.out)["findings"]
    assert len(finding["failures"]) == 3
    assert finding["smallest"] is None


def test_what_a_case_says_without_effect_is_reported(scbm: Scbm, tmp_path: Path) -> None:
    path = _write(tmp_path, "scans.yaml", CASE + "outcomes: {scanner: [succeed, fail]}\n")
    unused = "the outcome of request 2 of scanner was not used: 1 request sent"
    ran = scbm("test", AFTER, path)
    assert (ran.code, f"Without effect\n  scans: {unused}" in ran.out) == (0, True)
    assert f"NO EFFECT  {unused}" in scbm("replay", path, "--model", AFTER).out


def test_a_model_is_not_taken_for_a_case_nor_a_case_for_a_model(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    case = _write(tmp_path, "scans.yaml")
    for arguments, place in (
        (("test", AFTER, BEFORE), f"{BEFORE}:4:1"),
        (("replay", AFTER), f"{AFTER}:3:1"),
        (("check", case), f"{case}:1:1"),
    ):
        ran = scbm(*arguments)
        assert (ran.code, diagnostic_heads(ran.err)) == (2, [f"{place}: error[wrong-shape]"])
        wording(ran.err)


# requirements and small cases


@pytest.mark.slow
def test_a_requirement_of_the_command_line_is_violated_and_the_case_made_small(scbm: Scbm, tmp_path: Path) -> None:
    ran = scbm("test", BEFORE, "--require", HOME, "--failures", tmp_path)
    assert ran.code == 1
    path = tmp_path / "robot_in_the_air-required_1-1.yaml"
    assert f"again: scbm replay {path}" in ran.out
    again = scbm("replay", path)
    assert again.code == 1
    assert "✗ required_1: gantry_req_state == executing -> robot_at == home does not hold" in again.out
    assert scbm("test", AFTER, "--require", HOME, "--cases", 50, "--failures", tmp_path).code == 0


@pytest.mark.slow
def test_without_shrinking_the_first_case_is_reported(scbm: Scbm, tmp_path: Path) -> None:
    ran = scbm("test", BEFORE, "--require", HOME, "--no-shrink", "--failures", tmp_path / "none")
    assert (ran.code, "smallest" in ran.out, list((tmp_path / "none").glob("*.yaml"))) == (1, False, [])
    command = next(line for line in ran.out.splitlines() if "again:" in line).split("again: scbm ")[1]
    assert command.startswith(f"run {BEFORE} --seed 0 --case ")
    assert command.endswith(f" --require '{HOME}'")
    ran = scbm("test", BEFORE, "--time-limit", "900 ms", "--no-shrink", "--seed", 1, "--failures", tmp_path)
    command = next(line for line in ran.out.splitlines() if "again:" in line).split("again: scbm ")[1]
    assert command.endswith(" --time-limit '900 ms'")


def test_small_cases_that_cannot_be_saved_are_reported_and_the_report_goes_on(scbm: Scbm, tmp_path: Path) -> None:
    file = _write(tmp_path, "file")
    ran = scbm("test", BEFORE, "--require", HOME, "--failures", file / "below")
    assert (ran.code, ran.err.count("error[bad-option]")) == (2, 1)
    assert "smallest: " in ran.out
    assert f"again: scbm run {BEFORE} --seed 0" in ran.out


def test_findings_as_json(scbm: Scbm, tmp_path: Path) -> None:
    ran = scbm(
        "test", BEFORE, "--require", HOME, "--require", "never robot_at == agv", "--failures", tmp_path, "--json"
    )
    first, second = json.loads(ran.out)["findings"]
    assert (first["kind"], first["subject"], second["subject"]) == ("requirement", "required_1", "required_2")
    assert first["smallest"]["size"]["operations"] == 1
    assert first["smallest"]["matters"]
    assert first["again"] == f"scbm replay {tmp_path}/{first['smallest']['case']}.yaml"


def test_wrong_requirements_are_reported_all_at_once(scbm: Scbm) -> None:
    ran = scbm("test", BEFORE, "--require", "always robot_at == moon", "--require", "sometimes true")
    assert (ran.code, ran.err.count("--require:1:")) == (2, 2)


def test_a_requirement_is_asked_of_a_case_that_has_one_of_the_same_name(scbm: Scbm, tmp_path: Path) -> None:
    text = CASE + "requirements: {required_1: always mounted != gripper}\n"
    path = _write(tmp_path, "scans.yaml", text)
    ran = scbm("test", AFTER, path, "--require", "never scanned_a == true", "--failures", tmp_path / "small")
    assert (ran.code, "required_2" in ran.out) == (1, True)
    model = _write(tmp_path, "model.yaml", (ROOT / BEFORE).read_text(encoding="utf-8"))
    with model.open("a", encoding="utf-8") as stream:
        stream.write("requirements: {required_2: always true}\n")
    ran = scbm("test", model, path, "--require", "never scanned_a == true", "--failures", tmp_path / "small")
    assert (ran.code, "required_3" in ran.out) == (1, True)
    assert scbm("replay", next((tmp_path / "small").glob("*required_3*"))).code == 1


def test_the_command_that_shows_a_failure_again_shows_it(scbm: Scbm, tmp_path: Path) -> None:
    path = _write(tmp_path, "my scans.yaml")
    required = ("--require", "never scanned_a == true", "--time-limit", "1 min", "--no-shrink")
    ran = scbm("test", AFTER, path, *required)
    line = next(line for line in ran.out.splitlines() if "again:" in line).split("again: scbm ")[1]
    again = scbm(*shlex.split(line))
    assert (again.code, "✗ required_1: " in again.out) == (1, True)
    named = _write(tmp_path, "named.yaml", f"model: {ROOT / AFTER}\n" + CASE.replace("reached", "aborted"))
    ran = scbm("test", AFTER, named)
    assert f"again: scbm replay {named}\n" in ran.out


def test_the_same_options_give_the_same_small_case(scbm: Scbm, tmp_path: Path) -> None:
    texts = []
    for _ in range(2):
        scbm("test", BEFORE, "--require", HOME, "--seed", 7, "--failures", tmp_path)
        texts.append(next(tmp_path.iterdir()).read_bytes())
    assert texts[0] == texts[1]


# the network


@pytest.mark.slow
def test_a_network_can_be_given_and_drawn(scbm: Scbm, wording: Wording) -> None:
    lossy = json.loads(scbm("test", AFTER, "--network", "loss: 20 %, latency: 5 ms", "--seed", 1, "--json").out)
    assert lossy["coverage"]["by_state"]["timedout"]["visited"] > 0
    slow = json.loads(scbm("test", AFTER, "--network", "latency: 1 ms", "--seed", 1, "--json").out)
    assert slow["coverage"]["by_state"]["timedout"]["visited"] == 0, "a latency loses nothing"
    drawn = json.loads(scbm("test", AFTER, "--network", "drawn", "--seed", 1, "--json").out)
    assert drawn["coverage"] != lossy["coverage"]
    ran = scbm("run", AFTER, "--goal", "item_a_scanned", "--network", "loss: 30 %", "--seed", 2)
    wording(line for line in ran.out.splitlines() if "request 6" in line)


@pytest.mark.parametrize("option", [("--network", "drawn"), ("--save", "out")])
def test_options_of_random_cases_need_some(scbm: Scbm, option: tuple[str, str]) -> None:
    ran = scbm("test", AFTER, CASES, *option)
    assert (ran.code, f"{option[0]}: error[bad-option]" in ran.err) == (2, True)


@pytest.mark.parametrize("verb", [("test",), ("run", "--goal", "item_a_scanned")])
def test_a_wrong_network_is_reported(scbm: Scbm, verb: tuple[str, ...]) -> None:
    ran = scbm(verb[0], AFTER, *verb[1:], "--network", "loss: 130 %, jiter: 3 ms")
    assert (ran.code, ran.err.count("--network:1:")) == (2, 2)
    assert "error[not-a-share]" in ran.err
    assert "`jitter`" in ran.err


# names of files that lead nowhere


@pytest.mark.parametrize("model", ["round.yaml", '"a\\0b.yaml"'])
def test_a_case_whose_model_can_be_no_file_runs_with_the_model_of_the_command(
    scbm: Scbm, tmp_path: Path, model: str
) -> None:
    (tmp_path / "round.yaml").symlink_to("round.yaml")
    path = _write(tmp_path, "scans.yaml", CASE.replace("reached", "aborted") + f"model: {model}\n")
    ran = scbm("test", AFTER, path)
    assert (ran.code, ran.err) == (1, "")
    assert f"scbm replay {path} --model {AFTER}" in ran.out
    alone = scbm("replay", path)
    assert (alone.code, diagnostic_heads(alone.err)) == (2, [f"{path}:5:8: error[file-missing]"])
