"""Finds the syntax errors of texts with quantifiers: in the text as it is written, before it is expanded.

An error in a ground text would stand at the quantifier: the text of an instance has no places of its own.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from scbm.files.expansion.lifted_tokens import CONNECTIVES, RELATIONS, tokens_of
from scbm.files.expansion.static_facts import QUANTIFIERS
from scbm.files.language.grammar import keyword_phrases
from scbm.files.language.syntax import SLUGS, SyntaxFault, parse

if TYPE_CHECKING:
    from collections.abc import Container, Sequence

    from scbm.files.expansion.lifted_tokens import LiftedToken
    from scbm.files.language.syntax import Start

_BRACKETS = {"(": 1, ")": -1}
_BEFORE_CONDITIONS = ("(", "!", *CONNECTIVES)
_NO_WORD = re.compile(r"[^A-Za-z0-9_]")


def quantified_fault(text: str, start: Start, tables: Container[str]) -> SyntaxFault | None:
    """Return the syntax error of a text with quantifiers; `None` if it has none, or if a quantifier is malformed.

    The parser of the language underneath reads the text without its quantifiers. What it does not know stands there as
    something that it does, of equal length: an index or a row of a table as a part of a name.

    Args:
        text: the text.
        start: what it is.
        tables: the names of tables.
    """
    tokens = tokens_of(text)
    plain = _without_quantifiers(text, tokens)
    if plain is None:
        return None
    plain = _without_indices(plain, tokens, tables)
    try:
        parse(plain, start)
    except SyntaxFault as fault:
        if fault.slug is not SLUGS[start]:
            return None
        shown, written = plain[fault.begin : fault.end], text[fault.begin : fault.end]
        message = fault.message.replace(f"`{shown}`", f"`{written}`")
        remedy = None if fault.remedy is None else fault.remedy.replace(plain.strip(), text.strip())
        return SyntaxFault(fault.slug, message, fault.begin, fault.end, remedy)
    return None


def _without_quantifiers(text: str, tokens: Sequence[LiftedToken]) -> str | None:
    """Return a text with blanks for its quantifiers; `None` if it has none, or if one is malformed or misplaced."""
    plain = text
    for index, token in enumerate(tokens[:-1]):
        following = tokens[index + 1]
        if token.text not in QUANTIFIERS or not following.is_word or following.text == "in":
            continue
        opening = _after_parameters(tokens, index + 1)
        is_first = not index or tokens[index - 1].text in (*_BEFORE_CONDITIONS, *_words_of_requirements())
        if opening is None or not is_first:
            return None
        plain = _blanked(plain, token.begin, tokens[opening - 1].end)
        if token.text == "count":
            closing = _closing(tokens, opening)
            compared = [] if closing is None else [each.text for each in tokens[closing + 1 : closing + 3]]
            if closing is None or len(compared) < 2 or compared[0] not in RELATIONS or not compared[1].isdecimal():  # noqa: PLR2004 - `<= 1`
                return None
            plain = _blanked(plain, tokens[closing + 1].begin, tokens[closing + 2].end)
    return None if plain == text else plain


def _words_of_requirements() -> list[str]:
    return [word for phrase in keyword_phrases() for word in phrase]


def _after_parameters(tokens: Sequence[LiftedToken], index: int) -> int | None:
    """Return the index of the `(` after the parameters of a quantifier, which begin at `index`; `None` without it."""
    while True:
        words = tokens[index : index + 4]
        if len(words) < 4 or words[1].text not in ("in", ":") or not (words[0].is_word and words[2].is_word):  # noqa: PLR2004 - `r in robot .`
            return None
        index += 4
        if words[3].text != ",":
            break
    return index if words[3].text == "." and index < len(tokens) and tokens[index].text == "(" else None


def _closing(tokens: Sequence[LiftedToken], opening: int) -> int | None:
    depth = 0
    for index in range(opening, len(tokens)):
        depth += _BRACKETS.get(tokens[index].text, 0)
        if not depth:
            return index
    return None


def _without_indices(text: str, tokens: Sequence[LiftedToken], tables: Container[str]) -> str:
    """Return a text with words of equal length for names with an index and rows of tables, and `==` for `in zone`."""
    plain = text
    for index, token in enumerate(tokens[:-1]):
        following = tokens[index + 1]
        if token.text == "in" and following.is_name and plain[token.begin : token.end] == "in":
            plain = f"{plain[: token.begin]}=={plain[token.end :]}"
        closer = _CLOSERS.get(following.text) if token.is_name else None
        is_row = token.text in tables or (following.begin == token.end and token.text not in _NO_TABLES)
        if closer is None or (closer == ")" and not is_row):
            continue
        closing = next((each for each in tokens[index + 1 :] if each.text in (closer, *_ENDS)), None)
        if closing is not None and closing.text == closer:
            rest = _NO_WORD.sub("_", plain[token.end : closing.end])
            plain = f"{plain[: token.end]}{rest}{plain[closing.end :]}"
    return plain


_CLOSERS = {"[": "]", "(": ")"}
_NO_TABLES = ("in", "min", "max", *QUANTIFIERS)
_ENDS = (*CONNECTIVES, *RELATIONS)
"""What neither an index nor the row of a table contains."""


def _blanked(text: str, begin: int, end: int) -> str:
    return f"{text[:begin]}{' ' * (end - begin)}{text[end:]}"
