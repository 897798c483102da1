"""Values that YAML cuts at a comma: where they were meant to end."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from ruamel.yaml import YAML

from scbm.files.yaml.cut_values import folded, may_be_cut, quoted, uncut_end

TEXTS = st.text(" ,()[]{}\"'#:ab\n", max_size=40)


def meant(text: str) -> str | None:
    """Return what the first element of a list was meant to be; `None` if no comma cuts it."""
    event = next(event for event in YAML(typ="safe", pure=True).parse(text) if getattr(event, "value", None))
    end = uncut_end(text, event.start_mark.index, event.end_mark.index)
    assert end is None or may_be_cut(event.value)
    return None if end is None else text[event.start_mark.index : end]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("[a(b, c)]", "a(b, c)"),
        ("[a(b, c) && d, e]", "a(b, c) && d"),
        ("[a(b , (c, d), e) , f]", "a(b , (c, d), e)"),
        ("[a(b,\n  c), d]", "a(b,\n  c)"),
        ("[min(a, b) == max(c, d), e]", "min(a, b) == max(c, d)"),
        ("[forall r in robot, z in zone. (p), q]", "forall r in robot, z in zone. (p)"),
        (
            "[a && count r in robot, z in zone, w in x. (c(r, z)) <= 1]",
            "a && count r in robot, z in zone, w in x. (c(r, z)) <= 1",
        ),
    ],
)
def test_a_value_goes_on_until_its_brackets_are_closed(text: str, value: str) -> None:
    assert meant(text) == value


@pytest.mark.parametrize(
    "text",
    [
        "[a, b]",
        "[a(b), c]",
        "[a), (b, c]",
        "[a(b, c]",
        "[a(b, 'c)']",
        "[a(b, {c: d})]",
        "[a(b, # comment\n c)]",
        "[r in robot, z in zone]",
        "[a(1, 2, 3, 4, 5, 6, 7, 8, 9, 10)]",
    ],
)
def test_other_values_end_where_yaml_ends_them(text: str) -> None:
    assert meant(text) is None


@given(TEXTS, st.integers(0, 40), st.integers(0, 40))
def test_an_end_is_behind_that_of_yaml_and_closes_all_brackets(text: str, begin: int, length: int) -> None:
    end = uncut_end(text, begin, begin + length)
    if end is not None:
        value = text[begin:end]
        assert begin + length < end <= len(text)
        assert value.count("(") <= value.count(")")
        assert "," in value
        assert may_be_cut(text[begin : begin + length])


def test_a_value_of_several_lines_is_read_in_one() -> None:
    assert folded("min(a,  \r\n   b)") == "min(a, b)"


@pytest.mark.parametrize(
    ("text", "shown"), [("a, b", '"a, b"'), ('a "b", c', "'a \"b\", c'"), ("a, 'b\"", None), ("a, \\b", None)]
)
def test_a_value_is_quoted_without_escapes(text: str, shown: str | None) -> None:
    assert quoted(text) == shown
