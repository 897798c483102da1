"""No output option of any verb replaces a file that an input option names. New options are found by themselves."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from inspect import signature
from pathlib import Path
from shutil import copyfile, copytree
from typing import Any, get_args

import pytest
from typer.models import OptionInfo

from conftest import ROOT, Ran
from scbm.cli.options.command_inputs import input_marks
from scbm.cli.options.registry_options import with_registry_options
from scbm.cli.verb_registry import VERBS
from support.wording import Wording, diagnostic_heads

Scbm = Callable[..., Ran]
GATE = """\
behavior_model: gate
parts: {lamp: {use: lamp.yaml}}
variables: {door: {domain: [open, closed], initial: closed}}
operations:
  open_door: {pre: {g: door == closed, a: [door <- open]}, post: {g: 'true'}}
  shut: {pre: {g: door == open && door == closed}, post: {g: 'true'}}
goals: {opened: door == open}
"""
LAMP = """\
part: lamp
variables: {is_lit: {domain: bool, initial: false}}
operations: {light: {pre: {g: is_lit == false, a: [is_lit <- true]}, post: {g: 'true'}}}
"""
WAIVERS = """\
waivers_of: gate
waivers: [{obligation: lamp.light/failed, reason: none fails, author: A. Smith, date: 2026-01-01}]
"""
PDDL = ROOT / "examples/delivery"

COMMANDS: dict[str, str] = {
    "run": "run {model} --goal opened",
    "test": "test {model} {case} --waivers {waivers} --bindings {bindings} --certificates {certificates}",
    "mutate": "mutate {model} {case}",
    "console": "console {model} {case} --store {store}",
    "close": "close {model} --suite {case} --waivers {waivers}",
    "replay": "replay {case} --model {model}",
    "trace": "trace {case} --model {model}",
    "report": "report {store} --waivers {waivers} --certificates {certificates}",
    "combine": "combine {store}",
    "import pddl": "import pddl {domain} {problem}",
    "export pddl": "export pddl {model}",
    "node tester": "node tester {model} {case} --waivers {waivers} --certificates {certificates}",
}
"""A command line of each verb that has inputs and outputs, with all of its inputs."""

FURTHER = {("test", "--logs"): "--transport loopback", ("report", "--save"): "--minimize"}
"""What some output options need."""

NOT_FIRST = {("test", "--failures"), ("node tester", "--failures")}
"""Directories that a command may never write into, so that they are not checked before its work."""

IN_PLACE = {("combine", "--out", "store")}
"""Outputs that may be an input."""


def parameters(verb: str) -> dict[str, Any]:
    command = with_registry_options(import_module(VERBS[verb].module).command)
    return dict(signature(command, eval_str=True).parameters)


def outputs(verb: str) -> Iterator[str]:
    """Yield the options of a verb with paths that are not marked as inputs."""
    marks = input_marks(with_registry_options(import_module(VERBS[verb].module).command))
    for name, parameter in parameters(verb).items():
        kind, *info = get_args(parameter.annotation) or (None,)
        option = next((each for each in info if isinstance(each, OptionInfo)), None)
        if name not in marks and option is not None and Path in (kind, *get_args(kind)):
            words = (option.default, *(option.param_decls or ()))  # in annotations the first name is the default
            yield next(str(word) for word in words if str(word).startswith("--"))


def inputs(command: str) -> list[str]:
    """Return the inputs of a command line, and the files that they lead to."""
    named = [word.strip("{}") for word in command.split() if word.startswith("{")]
    further = {"model": ["part"], "certificates": ["certificate", "reasons"], "store": ["model", "part", "case"]}
    found = [each for name in named for each in (name, *further.get(name, ()))]
    return [name for name in dict.fromkeys(found) if name != "certificates"]


CROSSED = [
    (verb, option, name)
    for verb, command in COMMANDS.items()
    for option in outputs(verb)
    for name in inputs(command)
    if (verb, option) not in NOT_FIRST and (verb, option, name) not in IN_PLACE
]


FILES = {
    "model": "gate.yaml",
    "part": "lamp.yaml",
    "case": "case.yaml",
    "waivers": "waivers.yaml",
    "bindings": "bindings.yaml",
    "store": "s.db",
    "certificates": "closed/certificates",
    "certificate": "closed/certificates/structure.json",
    "reasons": "closed/certificates/structure.reasons",
    "domain": "domain.pddl",
    "problem": "problem.pddl",
}
TEXTS = {
    "model": GATE,
    "part": LAMP,
    "waivers": WAIVERS,
    "case": "case: c\nmodel: gate.yaml\ngoal: opened\n",
    "bindings": "bindings_of: gate\nresources: {}\n",
}


@pytest.fixture(scope="module")
def prepared(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("prepared")


@pytest.fixture
def folder(prepared: Path, tmp_path: Path, scbm: Scbm, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The present directory, with all files; they are made once and copied for each test."""
    if not any(prepared.iterdir()):
        monkeypatch.chdir(prepared)
        for name, text in TEXTS.items():
            Path(FILES[name]).write_text(text, encoding="utf-8")
        for name in ("domain", "problem"):
            copyfile(PDDL / f"{name}.pddl", FILES[name])
        assert scbm("close", FILES["model"], "--out", "closed").code == 0
        assert scbm("test", FILES["model"], FILES["case"], "--store", FILES["store"]).code == 0
    copytree(prepared, tmp_path / "copy")
    monkeypatch.chdir(tmp_path / "copy")
    return tmp_path / "copy"


def contents(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(("verb", "option", "name"), CROSSED, ids=str)
def test_no_output_replaces_an_input(verb: str, option: str, name: str, folder: Path, scbm: Scbm) -> None:
    before = contents(folder)
    further = FURTHER.get((verb, option), "")
    ran = scbm(*f"{COMMANDS[verb]} {further} {option} {FILES[name]}".format(**FILES).split())
    assert contents(folder) == before
    place = FILES[name] if verb == "combine" else option  # an error of a store names the store
    assert (ran.code, [head.partition(":")[0] for head in diagnostic_heads(ran.err)]) == (2, [place])


@pytest.mark.parametrize(
    ("command", "name"),
    [
        ("run {model} --goal opened --trace nowhere/../{model}", "model"),
        ("test {model} --cases 1 --save nowhere/../.", "model"),
        ("report {store} --junit nowhere/../{store}", "store"),
        ("report {store} --html nowhere/../{model}", "model"),
        ("run {model} --goal opened --trace nowhere/../new.jsonl", "model"),
    ],
)
def test_a_path_through_a_missing_directory_is_no_other_file(command: str, name: str, folder: Path, scbm: Scbm) -> None:
    before = (folder / FILES[name]).read_bytes()
    ran = scbm(*command.format(**FILES).split())
    assert (folder / FILES[name]).read_bytes() == before
    assert not (folder / "new.jsonl").exists()
    if "--save" not in command:
        assert ran.code == 2


def test_each_verb_with_inputs_and_outputs_is_tested_with_all_of_them() -> None:
    for verb in VERBS:
        marks = input_marks(with_registry_options(import_module(VERBS[verb].module).command))
        if marks and list(outputs(verb)):
            assert verb in COMMANDS
            assert len(marks) <= COMMANDS[verb].count("{")


@pytest.mark.parametrize("name", ["model", "part", "case"])
def test_a_report_in_another_directory_replaces_no_input_of_the_cases(
    name: str, folder: Path, scbm: Scbm, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder.parent)
    before = contents(folder)
    ran = scbm("report", f"copy/{FILES['store']}", "--html", f"copy/{FILES[name]}")
    assert (ran.code, diagnostic_heads(ran.err)) == (2, ["--html: error[bad-option]"])
    assert contents(folder) == before


def test_a_report_replaces_neither_of_two_files_that_may_be_the_model(
    folder: Path, scbm: Scbm, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder.parent)
    copyfile(folder / FILES["model"], FILES["model"])
    for path in (Path(FILES["model"]), folder / FILES["model"]):
        assert scbm("report", folder / FILES["store"], "--html", path).code == 2
        assert path.read_text(encoding="utf-8") == GATE


def test_a_report_in_another_directory_suggests_commands_with_paths_that_exist(
    folder: Path, scbm: Scbm, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    here = scbm("report", FILES["store"])
    monkeypatch.chdir(folder.parent)
    beside = scbm("report", f"copy/{FILES['store']}")
    assert beside.out.replace("copy/", "") == here.out
    assert f"scbm close copy/{FILES['model']}" in beside.out
    assert (here.err, beside.err) == ("", "")
    moved = Path("elsewhere/s.db")
    moved.parent.mkdir()
    copyfile(f"copy/{FILES['store']}", moved)
    wording(scbm("report", moved).err)


def test_a_report_says_that_the_file_of_a_case_is_gone(folder: Path, scbm: Scbm, wording: Wording) -> None:
    (folder / FILES["case"]).unlink()
    ran = scbm("report", FILES["store"], "--html", "r.html")
    assert ran.code == 0
    wording(ran.err)
    assert "case: c" in Path("r.html").read_text(encoding="utf-8")
