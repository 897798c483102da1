"""JSON from a file or a peer: what is accepted comes back as it is, and everything else is refused with a reason."""

from __future__ import annotations

import json
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import Meta

from scbm.model.json_reader import (
    JsonError,
    convert_json,
    line_and_column,
    read_json,
    read_json_object,
    value_positions,
)
from support.strings import CHARACTERS
from support.wording import Wording

MAX = 1_000
TEXTS = st.text(CHARACTERS)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | TEXTS,
    lambda inner: st.lists(inner) | st.dictionaries(TEXTS, inner),
    max_leaves=8,
)


class Word(StrEnum):
    SUCCEED = "succeed"


@dataclass(frozen=True)
class Pair:
    name: str
    counts: tuple[Annotated[int, Meta(ge=0)], ...]


@given(JSON)
def test_json_comes_back_as_it_was(value: object) -> None:
    text = json.dumps(value, ensure_ascii=False)
    assert read_json(text, len(text)) == value


@pytest.mark.parametrize(
    ("text", "position"),
    [
        ("", 0),
        ('{"a": 1,}', 8),
        ('{"a": 1, "a": 2}', 9),
        ('[{"b": {"c": 1, "c": 1}}]', 16),
        ("[1, NaN]", 4),
        ("[-Infinity]", 1),
        ("1" * 5_000, 0),
        ('["\\ud83d\\ude00", "\\ud800"]', 18),
        ('{"\\udfff": 1}', 2),
    ],
)
def test_text_that_is_not_acceptable_is_refused_at_its_place(text: str, position: int, wording: Wording) -> None:
    with pytest.raises(JsonError) as raised:
        read_json(text, MAX)
    wording(raised.value.message.partition(": ")[0])  # Python words the rest
    assert raised.value.position == position


@pytest.mark.parametrize(
    "text",
    [
        "1" * 5_000,
        "[" * 500_000,
    ],
)
def test_numbers_and_nesting_beyond_the_limits_of_python_are_refused(text: str, wording: Wording) -> None:
    with wording.raises(JsonError):
        read_json(text, len(text))


@pytest.mark.parametrize("text", ["[]", "1", "null", '"x"'])
def test_another_value_is_not_an_object(text: str, wording: Wording) -> None:
    with wording.raises(JsonError):
        read_json_object(text, MAX)


def test_plain_data_becomes_typed_values() -> None:
    assert convert_json({"name": "a", "counts": [0, 3]}, Pair) == Pair("a", (0, 3))
    assert convert_json("succeed", Word) is Word.SUCCEED
    assert convert_json({"x": True, "y": 2, "z": "on"}, dict[str, bool | int | str]) == {"x": True, "y": 2, "z": "on"}


@pytest.mark.parametrize(
    ("value", "type_"),
    [
        (1.0, int),
        (True, int),
        ("1", int),
        ("any", Word),
        ({"name": "a", "counts": [0, -1]}, Pair),
        ({"name": "a"}, Pair),
    ],
)
def test_a_value_of_another_type_is_refused_with_its_place(value: object, type_: Any, wording: Wording) -> None:  # noqa: ANN401
    with wording.raises(JsonError):
        convert_json(value, type_)


def test_positions_are_those_of_the_values() -> None:
    text = '{"a": [1, {"b": "x,y"}],\n "c": {}}'
    found = value_positions(text, [(), ("a", 1, "b"), ("c",), ("missing",)])
    assert {path: line_and_column(text, position)[:2] for path, position in found.items()} == {
        (): (1, 1),
        ("a", 1, "b"): (1, 17),
        ("c",): (2, 7),
    }
