"""`src/scbm/cli/messages.md` has one section for each slug, in the order and the groups of `model/slugs.py`."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases.trace import read_trace
from scbm.cli.message_sections import message_groups
from scbm.files import load_model
from scbm.model import ScbmError, Slug
from scbm.store import read_history
from scbm.testing import RandomCases
from scbm.testing.event_logs.event_log import open_event_log, write_event_log
from support.capturing import captured
from support.stores import cell, results, store

SECTIONS = {slug: text for group in message_groups() for slug, text in group.sections.items()}


def test_sections_are_those_of_the_slugs_in_their_order() -> None:
    assert [slug.value for slug in Slug] == list(SECTIONS)


@pytest.mark.parametrize("slug", Slug)
def test_a_section_says_something_and_its_example_shows_the_slug(slug: Slug) -> None:
    text = SECTIONS[slug.value]
    assert not text.startswith("```")
    assert f"[{slug.value}]: " in text


def too_large(directory: Path) -> None:
    path = directory / "large.yaml"
    path.write_bytes(b"#" * (4 * 1024 * 1024 + 1))
    load_model(path)


def not_utf8(directory: Path) -> None:
    path = directory / "latin.yaml"
    path.write_bytes(b"behavior_model: cell\nvariables:\n  behaelt\xe4r: {domain: bool, initial: false}\n")
    load_model(path)


def too_long(directory: Path) -> None:
    path = directory / "long.yaml"
    goal = " && ".join(["on == true"] * 1_714)
    variables = "variables: {on: {domain: bool, initial: false}}\noperations: {}"
    path.write_text(f"behavior_model: lamp\n{variables}\ngoals: {{there: {goal}}}\n", encoding="utf-8")
    load_model(path)


def no_trace(_: Path) -> None:
    read_trace("{}\n", "run.jsonl")


def a_newer_trace(_: Path) -> None:
    read_trace('{"format": "scbm-trace", "version": 4}\n', "run.jsonl")


def _log() -> str:
    model = cell()
    log, _ = captured(model, RandomCases(model).case(1, 1))
    return write_event_log(replace(log, steps=12 * log.steps[:1], reactions=()), model)


def a_log_that_is_cut_off(directory: Path) -> None:
    path = directory / "run.log"
    path.write_text("".join(_log().splitlines(keepends=True)[:6]), encoding="utf-8")
    open_event_log(path)


def a_log_of_another_model(directory: Path) -> None:
    path = directory / "run.log"
    path.write_text(_log(), encoding="utf-8")
    open_event_log(path).read(cell(), "1" * 64)


def a_damaged_store(directory: Path) -> None:
    path = store(directory / "cov.db", 1, results(1, 1))
    with path.open("r+b") as stream:
        stream.truncate(path.stat().st_size - 1)
    read_history(path)


def an_empty_store(directory: Path) -> None:
    path = directory / "cov.db"
    path.touch()
    read_history(path)


def an_older_store(directory: Path) -> None:
    path = store(directory / "cov.db", 1, results(1, 1))
    connection = sqlite3.connect(path)
    connection.execute("PRAGMA user_version = 8")
    connection.close()
    read_history(path)


PROVOKING = [
    too_large,
    not_utf8,
    too_long,
    no_trace,
    a_newer_trace,
    a_log_that_is_cut_off,
    a_log_of_another_model,
    a_damaged_store,
    an_empty_store,
    an_older_store,
]


@pytest.mark.parametrize("provoke", PROVOKING)
def test_messages_that_no_command_of_the_page_prints_are_those_of_the_page(provoke: object, tmp_path: Path) -> None:
    assert callable(provoke)
    with pytest.raises(ScbmError) as caught:
        provoke(tmp_path)
    (diagnostic,) = caught.value.diagnostics
    printed = str(diagnostic).replace(f"{tmp_path}/", "")
    assert f"```text\n{printed}\n```" in SECTIONS[diagnostic.slug.value]
