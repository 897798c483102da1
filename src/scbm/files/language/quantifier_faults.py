"""Explains the syntax error of a text with a malformed or misplaced quantifier: it stands at the quantifier's word."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from scbm.files.language.grammar import QUANTIFIERS, keyword_phrases
from scbm.files.language.syntax import SyntaxFault
from scbm.model import Slug

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.language.syntax import Start

_WORD = r"[^\W\d]\w*(?:\.[^\W\d]\w*)*"
_IN = r"(?:in(?![\w.])|:)"
_PARAMETER = re.compile(rf"\s*({_WORD})\s*{_IN}\s*(?!in\b)({_WORD})")
_BEGINS = re.compile(rf"\s+(?!in\b){_WORD}")
_LIKE_PARAMETERS = re.compile(rf"\s+({_WORD})\s*{_IN}\s*\S+?\s*\.(?!\w)")
_IN_BRACKETS = re.compile(rf"\s*\(\s*\S+\s*{_IN}")
_NO_PARAMETER = re.compile(rf"\s*{_IN}\s*\S+\s*\.(?!\w)")
_COMPARED = re.compile(r"\s*(?:==|!=|<=|>=|<|>)\s*\d+\s*(?:$|\)|&&|\|\||->|(?=[A-Za-z]))")
_EXAMPLE = "write for example `{} r in robot. (robot_at[r] == dock)`"
EXAMPLE_OF_COUNT = "write for example `count r in robot. (robot_at[r] == dock) <= 1`"


def quantifier_fault(text: str, start: Start) -> SyntaxFault | None:
    """Return the error of the first quantifier of a text that is malformed or misplaced; `None` without one."""
    words = re.finditer(rf"(?<![\w.]){_WORD}", text)
    if start == "action":
        words = (word for word in words if not text[: word.start()].strip())
    return next((fault for word in words for fault in _faults(word, text, start)), None)


def _faults(word: re.Match[str], text: str, start: Start) -> Iterator[SyntaxFault]:
    """Yield what is wrong with the quantifier that a word begins or should begin."""
    shown, at = word[0], word.end()
    example = _EXAMPLE.format(shown)
    if shown not in QUANTIFIERS:
        if _LIKE_PARAMETERS.match(text, at) and not _is_of_requirements(shown):
            remedy = "write `forall`, `exists` or `count`; name each object in a sum: `n.r1 + n.r2 <= 3`"
            yield _fault(word, f"there is no quantifier `{shown}`", remedy)
    elif _IN_BRACKETS.match(text, at):
        yield _fault(word, f"the parameters of this `{shown}` stand in brackets", example)
    elif _NO_PARAMETER.match(text, at):
        yield _fault(word, f"a parameter is missing after this `{shown}`", example)
    elif _LIKE_PARAMETERS.match(text, at) and not _stands_first(text[: word.start()]):
        example = EXAMPLE_OF_COUNT if shown == "count" else example
        yield _fault(word, f"`{shown}` stands first in its condition", example)
    elif _BEGINS.match(text, at):  # otherwise the word is a name
        message = _malformed(text, at, shown, start)
        if message is not None:
            yield _fault(word, message, EXAMPLE_OF_COUNT if "compared" in message else example)


def _malformed(text: str, at: int, word: str, start: Start) -> str | None:
    """Return what is wrong behind a quantifier; `None` if its parameters have types, and what follows can follow."""
    parameter = _PARAMETER.match(text, at)
    while parameter is not None and text[parameter.end() :].lstrip().startswith(","):
        parameter = _PARAMETER.match(text, text.index(",", parameter.end()) + 1)
    if parameter is None:
        return f"a parameter of this `{word}` has no type"
    rest = text[parameter.end() :].lstrip()
    if not rest.startswith("."):
        return f"a `.` is missing after the parameters of this `{word}`"
    if start == "action":
        return None
    if not rest[1:].lstrip().startswith("("):
        return "the predicate of a quantifier stands in brackets"
    is_right = word != "count" or _is_compared(text, text.index("(", parameter.end()))
    return None if is_right else "a count is compared with a number"


def _fault(word: re.Match[str], message: str, remedy: str) -> SyntaxFault:
    return SyntaxFault(Slug.PREDICATE_SYNTAX, message, *word.span(), remedy)


def _is_of_requirements(word: str) -> bool:
    return any(word in phrase for phrase in keyword_phrases())


def _stands_first(before: str) -> bool:
    """Return whether a condition can begin behind a text."""
    last = re.search(r"(\w+|&&|\|\||->|\S)\s*$", before)
    return last is None or last[1] in ("(", "!", "&&", "||", "->", ",") or _is_of_requirements(last[1])


def _is_compared(text: str, opening: int) -> bool:
    """Return whether a number is compared behind the bracket that opens at an index; also true if it is not closed."""
    depth = 0
    for index in range(opening, len(text)):
        depth += {"(": 1, ")": -1}.get(text[index], 0)
        if not depth:
            return _COMPARED.match(text, index + 1) is not None
    return True
