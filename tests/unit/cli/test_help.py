"""The help of each verb: options in sections, within the width of the terminal, and where the documentation is."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import pytest

from conftest import Ran
from scbm.cli.options.help_sections import HelpSection
from scbm.cli.verb_registry import VERBS

ROOT = Path(__file__).parents[3]
COMMAND_LINES = ("", *VERBS)
TITLE = re.compile(r"^(\S.*):$", re.MULTILINE)
OPTION = re.compile(r"^  (?:-\w, )?(-[\w-]+)", re.MULTILINE)


def sections(page: str) -> dict[str, list[str]]:
    """Return the options of a help by the titles of their sections, in the order of the help."""
    parts = TITLE.split(page)
    return {title: OPTION.findall(text) for title, text in zip(parts[1::2], parts[2::2], strict=True)}


def help_of(verb: str, scbm: Callable[..., Ran]) -> str:
    page: str = scbm(*verb.split(), "--help").out
    return page


@pytest.mark.parametrize("columns", [60, 80])
@pytest.mark.parametrize("verb", COMMAND_LINES)
def test_help_fits_the_terminal(
    verb: str, columns: int, scbm: Callable[..., Ran], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    assert [line for line in help_of(verb, scbm).splitlines() if len(line) > columns] == []


@pytest.mark.parametrize("verb", COMMAND_LINES)
def test_help_ends_with_pages_that_exist(verb: str, scbm: Callable[..., Ran]) -> None:
    pages = re.findall(r"[\w/-]+\.md", help_of(verb, scbm).rpartition("Documentation")[2])
    assert pages
    assert [page for page in pages if not (ROOT / page).is_file()] == []


@pytest.mark.parametrize("verb", VERBS)
def test_the_registry_has_the_docstring_of_each_verb(verb: str) -> None:
    described = inspect.getdoc(import_module(VERBS[verb].module).command)
    assert described is not None
    assert " ".join(described.split()) == VERBS[verb].summary


@pytest.mark.parametrize("verb", VERBS)
def test_many_options_are_divided_into_sections(verb: str, scbm: Callable[..., Ran]) -> None:
    """Only an option for another way to work, and `--help`, may stand outside of them."""
    found = {title: options for title, options in sections(help_of(verb, scbm)).items() if title != "Arguments"}
    if sum(map(len, found.values())) <= 8:
        assert [*found] == ["Options"]
        return
    titles: list[str] = [section.value for section in HelpSection]
    assert [*found] == [title for title in titles if title in found]
    assert [option for option in found[HelpSection.OTHER] if option not in ("--check", "--help")] == []


def test_the_help_of_test_has_the_sections_that_it_needs(scbm: Callable[..., Ran]) -> None:
    found = sections(help_of("test", scbm))
    for option, section in (
        ("--cases", HelpSection.CASES),
        ("--require", HelpSection.VERDICTS),
        ("--jobs", HelpSection.RUNNING),
        ("--planner", HelpSection.PLANNER),
        ("--transport", HelpSection.NODES),
        ("--json", HelpSection.OUTPUT),
    ):
        assert option in found[section]


@pytest.mark.parametrize(
    ("words", "completed"),
    [
        ("scbm te", ["test"]),
        ("scbm test --see", ["--seed"]),
        ("scbm init --example pa", ["packml", "paper"]),
        ("scbm import p", ["pddl"]),
        ("scbm import pddl --ra", ["--range"]),
    ],
)
def test_a_shell_completes_verbs_options_and_values(
    words: str, completed: list[str], scbm: Callable[..., Ran], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("_SCBM_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split()) - 1))
    ran = scbm()
    assert (ran.code, ran.out.split()) == (0, completed)
