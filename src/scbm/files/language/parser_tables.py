"""The parser of a grammar, from stored tables where they are those of the grammar.

Lark builds the tables from the grammar in a tenth of the time of a short command. So they are stored beside this
module, with the version of Lark and the grammar that they belong to. A new form of requirements changes the grammar,
and another version of Lark may have other tables: then they are built.
"""

from __future__ import annotations

import json
import pickle
from io import BytesIO
from pathlib import Path
from typing import Any

import lark
from lark import Lark

from scbm.model.json_reader import read_json

TABLES = Path(__file__).with_name("parser_tables.json")
"""The file of the tables. After a change of the grammar, `pytest tests/unit/files --update-golden` writes it."""

LIFTED_TABLES = TABLES.with_name("lifted_parser_tables.json")
"""The same for texts with quantifiers and indices, which most models do not have."""

_MAX_CHARACTERS = 1_000_000


def parser_of(grammar: str, tables: Path) -> Lark:
    """Return the parser of a grammar with the start symbols `predicate`, `action` and `requirement`."""
    return stored_parser(grammar, tables) or built_parser(grammar)


def stored_parser(grammar: str, tables: Path) -> Lark | None:
    """Return the parser of the stored tables; `None` if they are not those of this grammar and this version of Lark."""
    try:
        stored: Any = read_json(tables.read_text(encoding="utf-8"), _MAX_CHARACTERS)
    except (OSError, ValueError):  # the file is missing or damaged
        return None
    if not isinstance(stored, dict) or (stored.get("lark"), stored.get("grammar")) != (lark.__version__, grammar):
        return None
    pickled = pickle.dumps(_with_numbers(stored["tables"]))  # `Lark.load` reads no other format
    return Lark.load(BytesIO(pickled))


def built_parser(grammar: str) -> Lark:
    """Return the parser of a grammar, whose tables are built."""
    return Lark(
        grammar,
        parser="lalr",
        start=["predicate", "action", "requirement"],
        propagate_positions=True,
        maybe_placeholders=True,  # the values of a requirement keep their positions if an optional part is left out
    )


def tables_text(grammar: str) -> str:
    """Return the content of the file for a grammar; numbers of states in it depend on the hash seed."""
    saved = BytesIO()
    built_parser(grammar).save(saved)
    tables = pickle.loads(saved.getvalue())  # noqa: S301 - written by the line above
    return json.dumps({"lark": lark.__version__, "grammar": grammar, "tables": tables}) + "\n"


def _with_numbers(value: Any) -> Any:  # noqa: ANN401 - whatever Lark saves
    """Return tables whose keys are numbers again: JSON has them as texts. No symbol is a number."""
    if isinstance(value, dict):
        return {int(key) if key.isdecimal() else key: _with_numbers(each) for key, each in value.items()}
    return [_with_numbers(each) for each in value] if isinstance(value, list) else value
