"""The stored tables of the parser: they are those of the grammar, and their parser is the one that is built."""

from __future__ import annotations

import json
from pathlib import Path

import lark
import pytest
from lark import Lark
from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from scbm.files.language.grammar import grammar, lifted_grammar
from scbm.files.language.parser_tables import (
    LIFTED_TABLES,
    TABLES,
    built_parser,
    parser_of,
    stored_parser,
    tables_text,
)

GRAMMARS = {TABLES: grammar(), LIFTED_TABLES: lifted_grammar()}

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
LIFTED = [
    ("predicate", "forall r in robot, z: zone. (at[r] == z -> near(r, z) && r in zone)"),
    ("predicate", "count r in robot. (at.r == dock) <= 1 || arm[r]_req_state == initial"),
    ("predicate", "count r in robot. (at.r == dock) + 1 <= sum r in robot. (load[r])"),
    ("predicate", "count r in robot. at.r == dock"),
    ("action", "forall r in robot. (at[r] <- dock)"),
    ("requirement", "always exists r in robot. (move[r].state == executing)"),
]


@pytest.fixture(scope="module")
def stored(request: pytest.FixtureRequest) -> dict[Path, Lark]:
    parsers = {path: stored_parser(text, path) for path, text in GRAMMARS.items()}
    for path in (path for path, parser in parsers.items() if parser is None):
        if request.config.getoption("--update-golden"):
            path.write_text(tables_text(GRAMMARS[path]), encoding="utf-8")
            parsers[path] = stored_parser(GRAMMARS[path], path)
        elif json.loads(path.read_text(encoding="utf-8"))["lark"] != lark.__version__:
            pytest.skip("the tables are those of another version of Lark")
    found = {path: parser for path, parser in parsers.items() if parser is not None}
    assert found.keys() == GRAMMARS.keys(), "the grammar has changed: run this test with --update-golden"
    return found


@pytest.fixture(scope="module")
def built() -> dict[Path, Lark]:
    return {path: built_parser(text) for path, text in GRAMMARS.items()}


def parsed(parser: Lark, text: str, start: str) -> object:
    """Return the tree of a text, or where the parser stops and what it accepts there."""
    try:
        return parser.parse(text, start=start)
    except UnexpectedToken as error:
        return type(error), error.pos_in_stream, error.token, sorted(error.accepts)
    except UnexpectedCharacters as error:
        return type(error), error.pos_in_stream, error.char, sorted(error.allowed)


@pytest.mark.parametrize(("start", "text"), [*TEXTS, *LIFTED])
@pytest.mark.parametrize("path", GRAMMARS, ids=lambda path: path.stem)
def test_the_stored_parser_is_the_one_that_is_built(
    start: str, text: str, path: Path, stored: dict[Path, Lark], built: dict[Path, Lark]
) -> None:
    assert parsed(stored[path], text, start) == parsed(built[path], text, start)


def test_some_texts_are_right_and_some_are_wrong(built: dict[Path, Lark]) -> None:
    for path, parser in built.items():
        texts = TEXTS if path == TABLES else LIFTED
        wrong = 0
        for start, text in texts:
            try:
                parser.parse(text, start=start)
            except UnexpectedInput:
                wrong += 1
        assert 0 < wrong < len(texts)


@pytest.mark.parametrize(("start", "text"), TEXTS)
def test_a_text_without_objects_has_one_tree(start: str, text: str, built: dict[Path, Lark]) -> None:
    try:
        tree = built[TABLES].parse(text, start=start)
    except UnexpectedInput:
        return
    assert built[LIFTED_TABLES].parse(text, start=start) == tree


def test_another_grammar_is_built() -> None:
    other = grammar().replace('_AND: "&&"', '_AND: "and"')
    assert stored_parser(other, TABLES) is None
    assert parser_of(other, TABLES).parse("a == b and c == d", start="predicate").data == "predicate"


def test_the_tables_of_another_version_of_lark_are_not_used(
    stored: dict[Path, Lark], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lark, "__version__", "0.1")
    tree = stored[TABLES].parse("a == b", start="predicate")
    assert stored_parser(grammar(), TABLES) is None
    assert parser_of(grammar(), TABLES).parse("a == b", start="predicate") == tree


@pytest.mark.parametrize("content", [None, "", "{", "[]", "{}", "\x00"])
def test_without_tables_that_can_be_read_they_are_built(content: str | None, tmp_path: Path) -> None:
    path = tmp_path / "tables.json"
    if content is not None:
        path.write_text(content, encoding="utf-8")
    assert stored_parser(grammar(), path) is None
