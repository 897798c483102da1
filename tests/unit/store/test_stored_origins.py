"""A store keeps the entries that the parts of a model were expanded from, so that reports of it can fold."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from scbm.files import read_model
from scbm.model import InputError
from scbm.store import combine_stores, drawn_recipe, read_history
from scbm.testing import RandomCases, Tester
from support.stores import store as add_run

MODEL = read_model(
    """behavior_model: doors
types: {door: [d1, d2]}
variables:
  open[door]: {domain: bool, initial: false}
operations:
  open_it[d in door]: {pre: {g: open.d == false}, post: {g: true, a: [open.d <- true]}}
goals:
  entered: open.d1 == true
"""
)


def _add(path: Path, number: int) -> Path:
    """Add a run with one random case to a store."""
    case = next(iter(RandomCases(MODEL).first(1, number)))
    return add_run(path, number, [(drawn_recipe(case, ""), Tester(MODEL).execute(case).result)], MODEL)


@pytest.fixture
def store(tmp_path: Path) -> Path:
    """Return a store with one run of the model."""
    return _add(tmp_path / "cov.db", 1)


def test_a_store_has_the_origins_of_its_model(store: Path, tmp_path: Path) -> None:
    assert read_history(store).model.origins == MODEL.origins
    combine_stores([store], tmp_path / "all.db")
    lifted = read_history(tmp_path / "all.db").lifted
    assert lifted is not None
    assert lifted.figure.of == 5


def _set_lifted(store: Path, text: str | None) -> None:
    connection = sqlite3.connect(store)
    with connection:
        connection.execute("UPDATE model SET lifted = ?", (text,))
    connection.close()


def test_a_store_without_origins_is_read_and_gets_them_with_the_next_run(store: Path) -> None:
    _set_lifted(store, None)
    assert read_history(store).lifted is None
    _add(store, 2)
    assert read_history(store).model.origins == MODEL.origins


@pytest.mark.parametrize("text", ["{", "[[1, 2, 3]]", '[["operations"]]'])
def test_damaged_origins_are_an_error(store: Path, text: str) -> None:
    _set_lifted(store, text)
    with pytest.raises(InputError):
        read_history(store)
