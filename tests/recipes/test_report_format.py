"""A report format, added as docs/how-to/recipes.md says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from scbm.reports.formats import FORMATS
from support.histories import EXAMPLE, history_of
from support.recipe_page import followed


def test_a_new_format_has_an_option_and_writes_its_file(scbm: Callable[..., Any], tmp_path: Path) -> None:
    with followed("A report format", tmp_path) as recipe:
        fill, write = (recipe.in_directory(command, tmp_path) for command in recipe.commands)
        assert scbm(*fill, "--failures", tmp_path / "failures").code == 0
        assert scbm(*write).code == 0
        lines = (tmp_path / "cases.txt").read_text(encoding="utf-8").splitlines()
        assert len(lines) == 5
        assert {line.split()[0] for line in lines} <= {"passed", "failed"}
        assert "--case-list FILE" in scbm("report", "--help").out
        clash = scbm("report", tmp_path / "cases.db", "--case-list", tmp_path / "cases.db")
        assert (clash.code, "--case-list" in clash.err) == (2, True)


def test_a_new_format_shows_what_proofs_assume(tmp_path: Path) -> None:
    history = history_of(EXAMPLE / "before.yaml", 5)
    proved = replace(history, decided=replace(history.statuses, assumptions=("no driver lies",)))
    with followed("A report format", tmp_path):
        text = FORMATS["case-list"].text(proved, lambda _: None)
    assert text.splitlines()[0] == "assumed: no driver lies"
