"""`scbm report --since`: the last run of a store against an earlier one, in all formats that show it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import pytest
from msgspec.structs import replace

from scbm.cases.trace import End
from scbm.testing import Failure, FailureKind, Verdict
from support.stores import a_run, cell, results, store
from support.wording import Wording, diagnostic_heads

FIRST = a_run(1, cell()).id


class Ran(Protocol):
    code: int
    out: str
    err: str


Scbm = Callable[..., Ran]


@pytest.fixture
def filled(tmp_path: Path) -> Path:
    """A store with three runs; in the last one a case fails, and the failing case of the first one passes."""
    failed = Verdict(End.REACHED, (Failure(FailureKind.REQUIREMENT, "safe", "safe | is violated"),))
    pairs = results(1, 5)
    first, last = ([(r, replace(each, verdict=failed)) for r, each in pairs[place : place + 1]] for place in (0, 1))
    path = store(tmp_path / "c.db", 1, [*first, *pairs[1:5]])
    store(path, 2, pairs[:1])
    return store(path, 3, [pairs[0], *last, pairs[2]])


def test_each_format_shows_the_changes(scbm: Scbm, filled: Path, tmp_path: Path, wording: Wording) -> None:
    ran = scbm("report", filled, "--since", FIRST, "--markdown", tmp_path / "m.md", "--html", tmp_path / "r.html")
    assert ran.code == 0
    text = (tmp_path / "m.md").read_text(encoding="utf-8")
    wording("\n".join(line for line in ran.out.splitlines() if "ince" in line or "newly" in line or "mended" in line))
    wording(text[text.index("### Since") : text.index("### Missing")])
    assert 'id="/since"' in (tmp_path / "r.html").read_text(encoding="utf-8")


def test_json_has_all_cases(scbm: Scbm, filled: Path) -> None:
    found = json.loads(scbm("report", filled, "--since", FIRST, "--json").out)["since"]
    assert found["then"] == FIRST
    assert found["percent_then"] >= found["percent_now"]
    assert [row["change"] for row in found["changes"]] == [*["newly failing"], *["mended"]]


def test_the_last_run_is_the_one_before(scbm: Scbm, filled: Path) -> None:
    found = json.loads(scbm("report", filled, "--since", "last", "--json").out)["since"]
    assert found["then"] == a_run(2, cell()).id


def test_without_an_earlier_run_a_sentence_is_shown(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    path = store(tmp_path / "c.db", 1, results(1, 1))
    ran = scbm("report", path, "--since", "last", "--markdown", tmp_path / "m.md", "--html", tmp_path / "r.html")
    assert ran.code == 0
    text = (tmp_path / "m.md").read_text(encoding="utf-8")
    wording(text[text.index("### Since") : text.index("### Missing")])
    assert 'data-notice="no-earlier-run"' in (tmp_path / "r.html").read_text(encoding="utf-8")
    assert json.loads(scbm("report", path, "--since", "last", "--json").out)["since"] == {"then": None}


@pytest.mark.parametrize("run", ["", "0", "nightly", a_run(3, cell()).id, "\u202e<b>"])
def test_a_run_that_cannot_be_compared_is_an_error_that_lists_the_others(
    scbm: Scbm, filled: Path, run: str, wording: Wording
) -> None:
    ran = scbm("report", filled, "--since", run)
    assert ran.code == 2
    assert [head.split(":")[0] for head in diagnostic_heads(ran.err)] == ["--since"]
    wording(ran.err)
