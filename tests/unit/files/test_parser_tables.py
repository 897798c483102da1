"""The stored tables of the parser: they are those of the grammar, and their parser is the one that is built."""

from __future__ import annotations

import json
from pathlib import Path

import lark
import pytest
from lark import Lark
from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from scbm.files.language.grammar import grammar
from scbm.files.language.parser_tables import TABLES, built_parser, parser_of, stored_parser, tables_text

TEXTS = [
    ("predicate", "a == b && !(c || d.e in {x, 1}) -> f"),
    ("predicate", "(a + 2 - b) <= min(c, 3) && (d)"),
    ("predicate", "a = b"),
    ("predicate", "a == b &&"),
    ("predicate", "(a == b"),
    ("predicate", "a == b) c"),
    ("action", "a <- b + 1"),
    ("action", "a += 1"),
    ("action", "a == 1"),
    ("requirement", "always (a -> b)"),
    ("requirement", "a leads to b within 10 s"),
    ("requirement", "a leads b"),
    ("requirement", "never a within"),
]


@pytest.fixture(scope="module")
def stored(request: pytest.FixtureRequest) -> Lark:
    if request.config.getoption("--update-golden") and stored_parser(grammar()) is None:
        TABLES.write_text(tables_text(grammar()), encoding="utf-8")
    parser = stored_parser(grammar())
    if parser is None and json.loads(TABLES.read_text(encoding="utf-8"))["lark"] != lark.__version__:
        pytest.skip("the tables are those of another version of Lark")
    assert parser is not None, "the grammar has changed: run this test with --update-golden"
    return parser


@pytest.fixture(scope="module")
def built() -> Lark:
    return built_parser(grammar())


def parsed(parser: Lark, text: str, start: str) -> object:
    """Return the tree of a text, or where the parser stops and what it accepts there."""
    try:
        return parser.parse(text, start=start)
    except UnexpectedToken as error:
        return type(error), error.pos_in_stream, error.token, sorted(error.accepts)
    except UnexpectedCharacters as error:
        return type(error), error.pos_in_stream, error.char, sorted(error.allowed)


@pytest.mark.parametrize(("start", "text"), TEXTS)
def test_the_stored_parser_is_the_one_that_is_built(start: str, text: str, stored: Lark, built: Lark) -> None:
    assert parsed(stored, text, start) == parsed(built, text, start)


def test_some_texts_are_right_and_some_are_wrong(built: Lark) -> None:
    wrong = 0
    for start, text in TEXTS:
        try:
            built.parse(text, start=start)
        except UnexpectedInput:
            wrong += 1
    assert 0 < wrong < len(TEXTS)


def test_another_grammar_is_built() -> None:
    other = grammar().replace('_AND: "&&"', '_AND: "and"')
    assert stored_parser(other) is None
    assert parser_of(other).parse("a == b and c == d", start="predicate").data == "predicate"


def test_the_tables_of_another_version_of_lark_are_not_used(stored: Lark, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lark, "__version__", "0.1")
    assert stored_parser(grammar()) is None
    assert parser_of(grammar()).parse("a == b", start="predicate") == stored.parse("a == b", start="predicate")


@pytest.mark.parametrize("content", [None, "", "{", "[]", "{}", "\x00"])
def test_without_tables_that_can_be_read_they_are_built(
    content: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "tables.json"
    monkeypatch.setattr("scbm.files.language.parser_tables.TABLES", path)
    if content is not None:
        path.write_text(content, encoding="utf-8")
    assert stored_parser(grammar()) is None
