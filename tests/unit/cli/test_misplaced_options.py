"""The error for an option of another verb says which verb has it, and what to write."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from conftest import Ran
from scbm.reports.formats import FORMATS

CELL = "examples/dual_cnc/cell.yaml"


def _words(ran: Ran) -> str:
    assert ran.code == 2
    return " ".join(ran.err.split())


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("verb", ["test", "close"])
def test_a_format_of_report_leads_to_report_through_a_store(verb: str, name: str, scbm: Callable[..., Ran]) -> None:
    error = _words(scbm(verb, CELL, f"--{name}", "r.out"))
    assert f"`--{name}` is an option of `scbm report`" in error
    assert "--store results.db" in error
    assert f"`scbm report results.db --{name} r.out`" in error
    assert "Possible options" not in error


def test_the_store_of_the_command_line_is_named(scbm: Callable[..., Ran]) -> None:
    error = _words(scbm("test", CELL, "--store", "mine.db", "--html=r.html"))
    assert "`scbm report mine.db --html r.html`" in error
    assert "results.db" not in error


def test_an_option_of_other_verbs_names_them(scbm: Callable[..., Ran]) -> None:
    error = _words(scbm("check", CELL, "--store", "st.db"))
    assert "`--store` is an option of `scbm " in error
    assert "`scbm test`" in error
    assert "`scbm mutate`" in error
    assert "Possible options" not in error


def test_an_option_of_no_verb_is_compared_with_those_of_its_verb(scbm: Callable[..., Ran]) -> None:
    error = _words(scbm("check", CELL, "--stric"))
    assert "No such option: --stric" in error
    assert "--strict" in error
