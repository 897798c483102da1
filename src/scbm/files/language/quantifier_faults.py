"""Explains the syntax error of a text with a malformed or misplaced quantifier: it stands at the quantifier's word."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from scbm.files.language.grammar import AGGREGATES, QUANTIFIERS, keyword_phrases
from scbm.files.language.syntax import SyntaxFault
from scbm.files.spelling import nearest
from scbm.model import Slug

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.language.syntax import Start

_WORD = r"[^\W\d]\w*(?:\.[^\W\d]\w*)*"
_IN = r"(?:in(?![\w.])|:)"
_PARAMETER = re.compile(rf"\s*({_WORD})\s*{_IN}\s*(?!in\b)({_WORD})")
_BEGINS = re.compile(rf"\s+(?!in\b){_WORD}")
_LIKE_PARAMETER = rf"{_WORD}\s*{_IN}\s*[^\s,]+?\s*"
_LIKE_PARAMETERS = re.compile(rf"\s+{_LIKE_PARAMETER}(?:,\s*{_LIKE_PARAMETER})*\.(?!\w)")
_IN_BRACKETS = re.compile(rf"\s*\(\s*\S+\s*{_IN}")
_NO_PARAMETER = re.compile(rf"\s*{_IN}\s*\S+\s*\.(?!\w)")
_NO_PARAMETERS = re.compile(r"\s*\(")
_EXAMPLE = "write for example `{} r in robot. (robot_at[r] == dock)`"
EXAMPLE_OF_COUNT = "write for example `count r in robot. (robot_at[r] == dock) <= 1`"
_EXAMPLE_OF_TERM = "write for example `{} r in robot. (load[r]) <= 5`"
_EXAMPLES = {"count": EXAMPLE_OF_COUNT, **dict.fromkeys(AGGREGATES, _EXAMPLE_OF_TERM)}
_NO_BRACKETS = "the predicate of a quantifier stands in brackets"
_TERMS = ("count", *AGGREGATES)


def quantifier_fault(text: str, start: Start) -> SyntaxFault | None:
    """Return the error of the first quantifier of a text that is malformed or misplaced; `None` without one."""
    words = re.finditer(rf"(?<![\w.]){_WORD}", text)
    if start == "action":
        words = (word for word in words if not text[: word.start()].strip())
    return next((fault for word in words for fault in _faults(word, text, start)), None)


def _faults(word: re.Match[str], text: str, start: Start) -> Iterator[SyntaxFault]:
    """Yield what is wrong with the quantifier that a word begins or should begin."""
    shown, at = word[0], word.end()
    example = _EXAMPLES.get(shown, _EXAMPLE).format(shown)
    if shown not in (*QUANTIFIERS, *AGGREGATES):
        if _LIKE_PARAMETERS.match(text, at) and not _is_of_requirements(shown):
            near = nearest(shown, (*QUANTIFIERS, *AGGREGATES))
            remedy = f"write {', '.join(f'`{each}`' for each in _TERMS)}, `forall` or `exists`"
            remedy = remedy if near is None else f"did you mean `{near}`?"
            yield _fault(word, f"there is no quantifier `{shown}`", remedy)
    elif _IN_BRACKETS.match(text, at):
        yield _fault(word, f"the parameters of this `{shown}` stand in brackets", example)
    elif _NO_PARAMETER.match(text, at) or (shown in QUANTIFIERS and _NO_PARAMETERS.match(text, at)):
        yield _fault(word, f"a parameter is missing after this `{shown}`", example)
    elif shown not in _TERMS and _LIKE_PARAMETERS.match(text, at) and not _stands_first(text[: word.start()]):
        yield _fault(word, f"`{shown}` stands first in its condition", example)
    elif _BEGINS.match(text, at):  # otherwise the word is a name
        message = _malformed(text, at, shown, start)
        if message is not None:
            yield _fault(word, message, example)


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
        return f"what this `{word}` is about stands in brackets" if word in AGGREGATES else _NO_BRACKETS
    return None


def _fault(word: re.Match[str], message: str, remedy: str) -> SyntaxFault:
    return SyntaxFault(Slug.PREDICATE_SYNTAX, message, *word.span(), remedy)


def _is_of_requirements(word: str) -> bool:
    return any(word in phrase for phrase in keyword_phrases())


def _stands_first(before: str) -> bool:
    """Return whether a condition can begin behind a text."""
    last = re.search(r"(\w+|&&|\|\||->|\S)\s*$", before)
    return last is None or last[1] in ("(", "!", "&&", "||", "->", ",") or _is_of_requirements(last[1])
