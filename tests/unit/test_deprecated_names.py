"""Imports that earlier documentation named keep working, with a warning."""

from __future__ import annotations

import importlib
import warnings

import pytest

import scbm.cases.trace
import scbm.files
import scbm.plugins.hypothesis


@pytest.mark.parametrize(
    ("old", "name", "value"),
    [
        ("scbm.notation", "load_model", scbm.files.load_model),
        ("scbm.notation", "load_bindings", scbm.files.load_bindings),
        ("scbm.strategies", "cases", scbm.plugins.hypothesis.cases),
        ("scbm.trace", "read_trace", scbm.cases.trace.read_trace),
    ],
)
def test_an_old_import_gives_the_same_function_and_warns(old: str, name: str, value: object) -> None:
    with pytest.warns(DeprecationWarning, match=f"{old} is now"):
        assert getattr(importlib.import_module(old), name) is value


@pytest.mark.parametrize("old", ["scbm.notation", "scbm.strategies", "scbm.trace"])
def test_a_name_that_never_was_is_an_attribute_error(old: str) -> None:
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = importlib.import_module(old).nothing


@pytest.mark.parametrize(
    ("old", "names"),
    [
        ("scbm.notation", ["load_model", "read_model"]),
        ("scbm.strategies", ["cases"]),
        ("scbm.trace", ["read_trace"]),
    ],
)
def test_an_import_warns_once_for_each_name_and_for_nothing_else(old: str, names: list[str]) -> None:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        exec(f"from {old} import {', '.join(names)}", {})  # noqa: S102 - the statement is what is tested
    assert [str(each.message).partition(": ")[2] for each in caught] == [f"import {name} from there" for name in names]


def test_a_star_import_warns_once_for_each_name() -> None:
    found: dict[str, object] = {}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        exec("from scbm.strategies import *", found)  # noqa: S102 - the statement is what is tested
    names = scbm.plugins.hypothesis.__all__
    assert [name for name in names if found.get(name) is not getattr(scbm.plugins.hypothesis, name)] == []
    assert len(caught) == len(names)
