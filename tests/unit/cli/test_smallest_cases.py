"""Stores keep the smallest cases of failures, and the formats for CI give them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scbm.cases import Case
from scbm.files import read_case
from scbm.reports.html import html_report
from scbm.store import Replays, SmallestCase, read_history
from scbm.testing import FailureKind
from unit.cli.test_store import Scbm

MODEL = "tests/models/fails_at_run/requirement.yaml"


@pytest.fixture
def store(tmp_path: Path) -> Path:
    return tmp_path / "cov.db"


def _run(scbm: Scbm, store: Path, *options: str) -> None:
    scbm("test", MODEL, "--cases", 3, "--seed", 1, "--store", store, "--failures", store.parent / "small", *options)


def _kept(store: Path) -> list[SmallestCase]:
    return [small for case in read_history(store).cases for small in case.smallest]


def test_the_first_case_of_a_failure_has_the_smallest_one(scbm: Scbm, store: Path) -> None:
    _run(scbm, store)
    (small,) = _kept(store)
    assert read_history(store).cases[0].smallest == (small,)
    assert (small.kind, small.subject) == (FailureKind.REQUIREMENT, "open_while_pumping")
    assert small.operations <= small.operations_before
    assert Path(small.path).is_file()
    assert small.text.startswith("case: ")
    assert scbm("replay", small.path).code == 1


def test_a_run_that_does_not_seek_it_leaves_none(scbm: Scbm, store: Path) -> None:
    _run(scbm, store)
    _run(scbm, store, "--no-shrink")
    assert _kept(store) == []


def test_combined_stores_have_it(scbm: Scbm, store: Path, tmp_path: Path) -> None:
    _run(scbm, store)
    assert scbm("combine", store, "-o", tmp_path / "all.db").code == 0
    assert _kept(tmp_path / "all.db") == _kept(store)


def test_formats_for_ci_give_its_file_its_size_and_what_matters(scbm: Scbm, store: Path, tmp_path: Path) -> None:
    _run(scbm, store)
    (small,) = _kept(store)
    files = {name: tmp_path / f"report.{name}" for name in ("junit", "sarif", "markdown", "html")}
    options = [part for name, path in files.items() for part in (f"--{name}", path)]
    assert scbm("report", store, *options).code == 0
    texts = {name: path.read_text(encoding="utf-8") for name, path in files.items()}
    for name in ("junit", "sarif", "markdown"):
        assert small.path in texts[name].replace("\\\\", "\\").replace("\\_", "_"), name
        assert small.sizes in texts[name], name
        assert all(words in texts[name].replace("\\", "") for words in small.what_matters), name
    (result,) = json.loads(texts["sarif"])["runs"][0]["results"]
    found = result["properties"]["smallestCase"]
    assert (found["file"], found["operations"]) == (small.path, small.operations)


def test_a_damaged_column_is_reported(scbm: Scbm, store: Path) -> None:
    import sqlite3  # noqa: PLC0415 - for this test alone

    _run(scbm, store)
    with sqlite3.connect(store) as connection:
        connection.execute("UPDATE test_case SET smallest = '[{}]' WHERE smallest IS NOT NULL")
    connection.close()
    assert scbm("report", store).code == 2


def test_a_requirement_of_the_command_line_is_violated_once(scbm: Scbm, store: Path) -> None:
    """The smallest case has the requirement in its text, so a report must not add it again."""
    _run(scbm, store, "--require", "never valve == open")
    history = read_history(store)
    (small,) = [each for each in _kept(store) if each.subject == "required_1"]
    shown: list[Case] = []
    html_report(history, lambda stored: shown.append(Replays(history).case(stored)))
    (case,) = [each for each in shown if each.name == read_case(small.text, history.model).name]
    assert [each.name for each in case.requirements].count("required_1") == 1
