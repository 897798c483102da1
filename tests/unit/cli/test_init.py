"""`scbm init`: a new folder that passes all commands."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from conftest import Ran
from scbm.cli.verbs.init import EXAMPLES, project_files
from scbm.files import digest_of, load_model, open_case, read_model
from support.wording import Wording

pytest_plugins = "pytester"

Scbm = Callable[..., Ran]


@pytest.mark.parametrize("example", EXAMPLES)
def test_a_project_has_a_model_with_the_goal_and_cases_of_it(example: str, scbm: Scbm, tmp_path: Path) -> None:
    folder = tmp_path / "cell"
    ran = scbm("init", folder, "--example", example)
    assert ran.code == 0
    assert [line for line in ran.out.splitlines() if line.startswith(str(folder))] == [
        str(folder / name) for name in project_files(EXAMPLES[example])
    ]
    model = load_model(folder / "model.yaml")
    assert model.goal(EXAMPLES[example].goal) is not None
    cases = sorted((folder / "cases").iterdir())
    assert cases
    for case in cases:
        open_case(case).read(model)


@pytest.mark.parametrize("example", ["cnc", "paper"])
def test_a_model_with_short_forms_names_the_command_that_writes_it_out(
    example: str, scbm: Scbm, tmp_path: Path
) -> None:
    assert scbm("init", tmp_path / "cell", "--example", example).code == 0
    model = tmp_path / "cell" / "model.yaml"
    text = model.read_text(encoding="utf-8")
    assert "`scbm show model.yaml --expanded`" in text
    written = scbm("show", model, "--expanded").out
    assert len(written.splitlines()) > len(text.splitlines()) * 3 / 2
    assert digest_of(load_model(model)) == digest_of(read_model(written))


def test_the_ci_job_is_yaml_and_uses_the_files(scbm: Scbm, tmp_path: Path) -> None:
    scbm("init", tmp_path / "cell")
    job = YAML(typ="safe").load(tmp_path / "cell" / ".github" / "workflows" / "scbm.yaml")
    commands = [step["run"] for step in job["jobs"]["test"]["steps"] if "run" in step]
    assert "scbm check --strict model.yaml" in commands


PIP = """#!/bin/sh
echo "$@" > "$(dirname "$0")/installed"
"""


def run_job(folder: Path, tools: Path) -> subprocess.CompletedProcess[str]:
    """Run the steps of the CI job as an empty runner does, with another `pip`."""
    job = YAML(typ="safe").load(folder / ".github" / "workflows" / "scbm.yaml")
    steps = [(step["run"], "if" in step) for step in job["jobs"]["test"]["steps"] if "run" in step]
    script = "".join(f"[ $failed = 1 ] || ( {run}\n) || failed=1\n" for run, is_always in steps if not is_always)
    script += "".join(f"( {run}\n) || failed=1\n" for run, is_always in steps if is_always)
    (tools / "pip").write_text(PIP, encoding="utf-8")
    (tools / "pip").chmod(0o755)
    path = f"{tools}{os.pathsep}{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    given = os.environ | job["env"] | {"PATH": path, "GITHUB_STEP_SUMMARY": str(tools / "summary.md")}
    script = f"set -e; failed=0\n{script}exit $failed\n"
    bash = shutil.which("bash") or "bash"
    return subprocess.run([bash, "-c", script], cwd=folder, env=given, capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_the_ci_job_passes_once_one_line_says_where_scbm_comes_from(scbm: Scbm, tmp_path: Path) -> None:
    folder, tools = tmp_path / "cell", tmp_path / "tools"
    tools.mkdir()
    scbm("init", folder)
    workflow = folder / ".github" / "workflows" / "scbm.yaml"
    text = workflow.read_text(encoding="utf-8")
    (marked,) = [line for line in text.splitlines() if "FILL IN" in line]
    text = text.replace(marked, "  SCBM: git+https://example.org/scbm.git").replace("--cases 1000", "--cases 20")
    workflow.write_text(text, encoding="utf-8")
    done = run_job(folder, tools)
    assert done.returncode == 0, done.stdout + done.stderr
    assert (tools / "installed").read_text().split() == ["install", "git+https://example.org/scbm.git", "pytest"]
    assert "SCBM-IAS" in (tools / "summary.md").read_text(encoding="utf-8")
    assert (folder / "report.html").exists()


def test_the_ci_job_says_what_to_fill_in(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    tools = tmp_path / "tools"
    tools.mkdir()
    scbm("init", tmp_path / "cell")
    done = run_job(tmp_path / "cell", tools)
    assert done.returncode == 1
    assert not (tools / "installed").exists()
    wording(done.stdout.splitlines()[0])


def test_the_folder_has_the_name_of_the_example_unless_there_is_another(
    scbm: Scbm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scbm("schema")  # the fixture changes the directory, and this test changes it once more
    monkeypatch.chdir(tmp_path)
    assert scbm("init", "--example", "paper").code == 0
    assert (tmp_path / "paper" / "model.yaml").exists()


def test_nothing_that_exists_is_touched(scbm: Scbm, tmp_path: Path) -> None:
    (tmp_path / "model.yaml").write_text("mine")
    ran = scbm("init", tmp_path)
    assert (ran.code, ran.out) == (2, "")
    assert "error[bad-option]" in ran.err
    assert [path.name for path in tmp_path.iterdir()] == ["model.yaml"]
    ran = scbm("init", tmp_path / "model.yaml")
    assert ran.code == 2
    assert (tmp_path / "model.yaml").read_text() == "mine"


def test_an_empty_folder_is_filled(scbm: Scbm, tmp_path: Path) -> None:
    assert scbm("init", tmp_path).code == 0
    assert (tmp_path / "README.md").exists()


@pytest.mark.slow
@pytest.mark.parametrize("example", EXAMPLES)
def test_a_project_passes_all_commands(example: str, scbm: Scbm, tmp_path: Path) -> None:
    scbm("init", tmp_path / "cell", "--example", example)
    model, cases, closed = (tmp_path / "cell" / name for name in ("model.yaml", "cases", "closed"))
    goal = EXAMPLES[example].goal
    store = tmp_path / "coverage.db"
    for arguments in (
        ("check", "--strict", model),
        ("plan", model, "--goal", goal),
        ("run", model, "--goal", goal),
        ("test", model, cases, "--cases", "20", "--seed", "1", "--store", store),
        ("report", store),
        ("close", model, "--out", closed),
        ("test", model, closed, "--certificates", closed, "--fail-under", "coverable=100"),
        ("mutate", model, cases, "--operators", "transitions", "--no-equivalence"),
        ("replay", min(cases.iterdir())),
    ):
        ran = scbm(*arguments)
        assert ran.code == 0, (arguments, ran.err)


@pytest.mark.slow
@pytest.mark.parametrize("example", EXAMPLES)
def test_the_commands_of_the_readme_end_well(
    example: str, scbm: Scbm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scbm("init", tmp_path / "cell", "--example", example)
    monkeypatch.chdir(tmp_path / "cell")
    text = Path("README.md").read_text(encoding="utf-8")
    commands = re.findall(r"(?:^    |^\| `)scbm ([^`>\n]*)", text, re.MULTILINE)
    assert {words.split()[0] for words in commands} == {
        *("check", "run", "test", "close", "show", "replay", "explain", "mutate", "schema")
    }
    for words in commands:
        if not words.startswith("mutate"):  # takes minutes, and the test of all commands has a short one
            ran = scbm(*words.split())
            assert ran.code == 0, (words, ran.err)


@pytest.mark.slow
@pytest.mark.parametrize("example", EXAMPLES)
def test_a_project_passes_its_own_tests(example: str, pytester: pytest.Pytester) -> None:
    files = project_files(EXAMPLES[example])
    for name, text in files.items():
        path = pytester.path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    cases = [name for name in files if name.startswith("cases/")]
    pytester.runpytest_subprocess("-p", "no:cacheprovider").assert_outcomes(passed=3 + len(cases))


@pytest.mark.slow
def test_a_project_fails_with_the_smallest_run_and_a_command(
    pytester: pytest.Pytester, scbm: Scbm, monkeypatch: pytest.MonkeyPatch
) -> None:
    files = project_files(EXAMPLES["gripper"])
    model = files["model.yaml"].replace("requirements:\n", "requirements:\n  idle: never robot_at == machine\n")
    (pytester.path / "model.yaml").write_text(model, encoding="utf-8")
    (pytester.path / "test_model.py").write_text(files["test_model.py"], encoding="utf-8")
    monkeypatch.chdir(pytester.path)
    result = pytester.runpytest_subprocess("-p", "no:cacheprovider")
    result.assert_outcomes(failed=3)
    result.stdout.fnmatch_lines(["E *seed-1-case-1, *", "E *smallest: *", "E *✗ idle: *", "E *again: scbm run *"])
    result.stdout.no_fnmatch_line("*Execution(*")
    again = next(line.partition("again: scbm ")[2] for line in result.stdout.lines if "again: scbm " in line)
    ran = scbm(*again.split())
    assert ran.code == 1
    assert "idle" in ran.out
