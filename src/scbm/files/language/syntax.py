"""Parses predicates, actions and requirements: from a text to its syntax tree, or to one located syntax error.

Syntax errors are explained to people who write predicates, actions and requirements.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, cast

from lark import Token, Tree
from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from scbm.files.language.grammar import (
    grammar,
    keyword_phrases,
    keywords,
    lifted_grammar,
    opening_words,
    requirement_phrases,
    words_after_predicates,
)
from scbm.files.language.parser_tables import LIFTED_TABLES, TABLES, parser_of
from scbm.files.spelling import nearest
from scbm.model import FORMS, RequirementForm, Slug

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from lark import Lark


Start: TypeAlias = Literal["predicate", "action", "requirement"]

SLUGS = {
    "predicate": Slug.PREDICATE_SYNTAX,
    "action": Slug.ACTION_SYNTAX,
    "requirement": Slug.REQUIREMENT_SYNTAX,
}

_EXAMPLES = {
    "predicate": "`robot_at == home && box_is_scanned == false`, or `true`",
    "action": "`box_is_scanned <- true`, or `count += 1`",
}


def example(start: Start) -> str:
    """Return the remedy for an empty text: what to write instead."""
    if start == "requirement":
        return f"write {_alternatives([f'`{form.pattern}`' for form in FORMS.values()])}"
    return f"write for example {_EXAMPLES[start]}"


@dataclass(slots=True)
class SyntaxFault(Exception):  # noqa: N818 - it never leaves this package; outside it is a diagnostic
    """A syntax error: the message, its characters in the text, and a remedy."""

    slug: Slug
    message: str
    begin: int
    end: int
    remedy: str | None = None


def syntax_fault(error: UnexpectedInput, text: str, start: Start) -> SyntaxFault:
    """Return the syntax error for an error of the parser."""
    accepted = _accepted(error)
    if isinstance(error, UnexpectedCharacters):
        begin = cast("int", error.pos_in_stream)  # Lark declares it without a type
        return _misplaced(text, begin, begin + 1, start, accepted)
    if isinstance(error, UnexpectedToken) and error.token.type != "$END":
        begin = error.token.start_pos or 0
        return _misplaced(text, begin, error.token.end_pos or begin + 1, start, accepted)
    return _early_end(text, start, accepted)


def _accepted(error: UnexpectedInput) -> Collection[str]:
    """Return the terminals that the parser could have accepted."""
    parser: Any = getattr(error, "interactive_parser", None)  # set by the parser, and declared nowhere
    return () if parser is None else parser.accepts()


def _early_end(text: str, start: Start, accepted: Collection[str]) -> SyntaxFault:
    opened = _unclosed(text)
    if opened is not None:
        message = f"this `{text[opened]}` is not closed"
        return SyntaxFault(SLUGS[start], message, opened, opened + 1, _expected(accepted))
    end = len(text.rstrip())
    expected = _expected(accepted)
    if start == "requirement" and all(word in accepted for word in words_after_predicates()):  # it is a predicate
        expected = f"{expected}; write `always {text.strip()}` for what must hold all the time"
    return SyntaxFault(SLUGS[start], f"the {start} ends too early", max(0, end - 1), end, expected)


def _misplaced(text: str, begin: int, end: int, start: Start, accepted: Collection[str]) -> SyntaxFault:
    """Return the error for a misplaced word; the word before it is blamed if it belongs to another language."""
    misspelt = misspelt_opening(text) if start == "requirement" else None
    if misspelt is not None:
        return misspelt
    opening = _LAST_WORD.search(text, 0, begin)
    if opening is not None:
        remedy = _opening_remedy(opening[1], start)
        if remedy is not None:
            begin, end = opening.span(1)
            return SyntaxFault(SLUGS[start], f"`{opening[1]}` cannot stand here", begin, end, remedy)
    message = f"`{text[begin:end]}` cannot stand here"
    remedy = _remedy(text, begin, end, start, accepted) or _expected(accepted)
    return SyntaxFault(SLUGS[start], message, begin, end, remedy)


def operands_in(text: str) -> Iterator[tuple[int, int]]:
    """Yield where the operands of the connectives of a text begin and end, but for connectives in brackets."""
    depth = begin = 0
    for match in _CONNECTIVE_OR_BRACKET.finditer(text):
        depth += (match[0] in "([{") - (match[0] in ")]}")
        if match["connective"] and depth == 0:
            yield begin, match.start()
            begin = match.end()
    if begin:
        yield begin, len(text)


_CONNECTIVE_OR_BRACKET = re.compile(r"(?P<connective>&&|\|\||->)|[()\[\]{}]")


def misspelt_opening(text: str) -> SyntaxFault | None:
    """Return the error of a requirement whose first word is close to `always` and its like; `None` for others."""
    match = _FIRST_WORD.match(text)
    following = [word for phrase in keyword_phrases() for word in phrase]
    if match is None or match[2] in (*following, *_WORDS, "in"):
        return None
    word = match[1]
    near = nearest(word, opening_words())
    if near is None or word.lower() in (*following, *keywords(), *_OPENING_WORDS, *_WORDS):
        return None
    message = f"`{word}` cannot stand here"
    return SyntaxFault(Slug.REQUIREMENT_SYNTAX, message, *match.span(1), f"did you mean `{near}`?")


_FIRST_WORD = re.compile(r"\s*([A-Za-z_]+)\s+(?=([A-Za-z_]\w*|[(!](?!=)))")
_LAST_WORD = re.compile(r"(?<![\w.])([A-Za-z]+)\s*$")


def _opening_remedy(word: str, start: Start) -> str | None:
    """Return the remedy for a word that does not begin a sentence of this language."""
    lower = word.lower()
    if lower in keywords() and start == "requirement" and lower != word:
        return f"write `{lower}`"
    if lower in opening_words() and start != "requirement":
        return f"`{lower}` belongs into requirements"
    return None if lower in keywords() else _OPENING_WORDS.get(lower)


_OPENING_WORDS = {
    "not": "write `!`",
    "if": "write `p -> q` for `if p then q`",
    "when": "write `p leads to q`, or `always p -> q`",
    "whenever": "write `p leads to q`, or `always p -> q`",
    "eventually": "write `true leads to p`",
    "set": "write `v <- value`",
}


def _remedy(text: str, begin: int, end: int, start: Start, accepted: Collection[str]) -> str | None:
    written = text[begin:end]
    if written.lower() in _WORDS:
        return f"write `{_WORDS[written.lower()]}`"
    if written == ")" and _unclosed(text[:begin]) is None:
        return "there is no `(` for it"
    calculating = _calculation_remedy(text, begin, end, accepted)
    if calculating is not None:
        return calculating
    if start == "action":
        return _action_remedy(written, text[end:].lstrip(), accepted)
    for pattern, remedy in _OPERATORS:
        match = pattern.search(text, max(0, begin - 2), end + 2)
        if match is not None and match.start() <= begin < match.end():
            return remedy
    return _CHARACTERS.get(written)


def _calculation_remedy(text: str, begin: int, end: int, accepted: Collection[str]) -> str | None:
    """Return the remedy for what sums do not have, and for what looks like a sum."""
    written = text[begin:end]
    if _HYPHEN.search(text, max(0, begin - 1), begin + 2):
        return NO_HYPHENS
    if written in ("*", "/", "%"):
        return "sums have no products; write `a + a` for twice `a`"
    if any(match.start() <= begin < match.end() for match in _CLOCK.finditer(text)):
        return NO_CLOCKS
    if written == "in" and "SIGN" in accepted and "RELATION" in accepted:
        return "`in` takes a variable; compare a sum with `==`, joined with `||`"
    if _NEGATION.match(text, begin) and "INTEGER" in accepted and text[begin - 1 : begin] != "<":
        return "write `0 - a` for the negative of `a`"
    return None


def _action_remedy(written: str, rest: str, accepted: Collection[str]) -> str | None:
    if written in ("+", "-") and not rest[:1].isalpha():
        return "to count, write `v += 1` or `v -= 1`"
    if "_GETS" in accepted and not written[0].isalnum():
        return "write `<-` to assign"
    return _CHARACTERS[written] if written in ("'", '"') else None


NO_HYPHENS = "names are letters, digits, `_` and `.`, so write `_` for `-`"
NO_CLOCKS = "predicates read no clocks: give an operation a `deadline`, or an environment transition `after: 5 s`"

_HYPHEN = re.compile(r"\w-\w")
_NEGATION = re.compile(r"-\s*[A-Za-z_(]")
_CLOCK = re.compile(
    r"(==|!=|<=?|>=?)\s*{0}|{0}\s*(==|!=|<=?|>=?)".format(r"(?<![\w.])\d+(\.\d+)?\s*(ns|us|µs|ms|s|min|h)\b")
)
"""A duration beside an operator that compares: the time since something happened is meant."""

_WORDS = {
    "and": "&&",
    "or": "||",
    "not": "!",
    "is": "==",
    "equals": "==",
    "eq": "==",
    "implies": "->",
    "then": "->",
}
_OPERATORS = (
    (re.compile("<-"), "`<-` assigns and belongs into actions; write `==` to compare"),
    (re.compile("=>"), "write `->` to imply, or `>=` to compare"),
    (re.compile("=<"), "write `<=`"),
    (re.compile("<>"), "write `!=`"),
    (re.compile(r"\d\.\d"), "numbers are whole"),
    (re.compile(r"\d\.\."), "list the numbers, or compare with `<=`"),
)
"""Operators of other languages, wherever in them the parser stopped."""

_CHARACTERS = {
    "&": "write `&&`",
    "|": "write `||`",
    "=": "write `==` to compare",
    "∧": "write `&&`",
    "\u2228": "write `||`",
    "¬": "write `!`",
    "~": "write `!`",
    "→": "write `->`",
    "≠": "write `!=`",
    "≤": "write `<=`",
    "≥": "write `>=`",
    '"': "names and values are written without quotes",
    "'": "names and values are written without quotes",
    "←": "write `<-`",
}

_TERMINALS = {
    "NAME": "a name",
    "INTEGER": "a number",
    "TRUE": "`true`",
    "FALSE": "`false`",
    "RELATION": "a comparison such as `==`",
    "DURATION": "a duration such as `10 s`",
    "LPAR": "`(`",
    "RPAR": "`)`",
    "LBRACE": "`{`",
    "RBRACE": "`}`",
    "COMMA": "`,`",
    "BANG": "`!`",
    "_IN": "`in`",
    "_AND": "`&&`",
    "_OR": "`||`",
    "_IMPLIES": "`->`",
    "_GETS": "`<-`",
    "_INCREASES": "`+=`",
    "_DECREASES": "`-=`",
    "$END": "the end",
}


def _expected(accepted: Collection[str]) -> str | None:
    phrases = {terminal: f"`{phrase}`" for terminal, phrase in requirement_phrases().items()}
    is_name = "_IN" in accepted  # after it, `(` begins a row of a table, which few mean
    known = (_TERMINALS | phrases).items()
    names = [name for terminal, name in known if terminal in accepted and not (is_name and terminal == "LPAR")]
    if not names and "SIGN" in accepted:
        names = ["`+`", "`-`"]
    return f"expected {_alternatives(names)}" if names else None


def _alternatives(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} or {names[-1]}"


def _unclosed(text: str) -> int | None:
    """Return the position of the last bracket that is not closed; `None` if all are closed."""
    opened: list[int] = []
    for index, character in enumerate(text):
        if character in "({":
            opened.append(index)
        elif character in ")}" and opened:
            opened.pop()
    return opened[-1] if opened else None


SyntaxTree: TypeAlias = Tree[Token]

MAX_CHARACTERS = 20_000
MAX_DEPTH = 60
"""The maximum nesting of a predicate: more than people write, and less than Python's recursion limit allows."""


@cache
def _parser(_: tuple[type[RequirementForm], ...], *, is_lifted: bool) -> Lark:
    """Return the parser for the forms of requirements that there are now."""
    return parser_of(lifted_grammar(), LIFTED_TABLES) if is_lifted else parser_of(grammar(), TABLES)


def parse(text: str, start: Start, *, is_lifted: bool = False) -> SyntaxTree:
    """Return the syntax tree of a text; of a lifted one also with quantifiers and indices. Raises `SyntaxFault`."""
    if len(text) > MAX_CHARACTERS:
        message = f"this text has {len(text):,} characters; at most {MAX_CHARACTERS:,} fit"
        raise SyntaxFault(Slug.TEXT_TOO_LONG, message, 0, 1, "divide it: a list of predicates is their conjunction")
    if not text.strip():
        raise SyntaxFault(SLUGS[start], f"an empty {start}", 0, 1, example(start))
    try:
        tree = _parsed(text, start, tuple(FORMS.values()), is_lifted=is_lifted)
    except UnexpectedInput as error:
        raise syntax_fault(error, text, start) from None
    refuse_depth(tree)
    return tree


@lru_cache(maxsize=2_000)
def _parsed(text: str, start: Start, forms: tuple[type[RequirementForm], ...], *, is_lifted: bool) -> SyntaxTree:
    """Return the tree of a text, which nothing changes: hundreds of operations of a model have the same actions."""
    return _parser(forms, is_lifted=is_lifted).parse(text, start=start)


def refuse_depth(tree: SyntaxTree) -> None:
    """Raise `SyntaxFault` for a tree that is too deep."""
    level: list[SyntaxTree] = [tree]
    for _ in range(MAX_DEPTH):
        level = [child for parent in level for child in parent.children if isinstance(child, Tree)]
        if not level:
            return
    begin, end = extent(level[0])
    raise SyntaxFault(Slug.TOO_DEEP, f"nested more than {MAX_DEPTH} levels deep", begin, end)


def extent(part: SyntaxTree | Token) -> tuple[int, int]:
    """Return the first and the last position of a part of a tree in its text."""
    if isinstance(part, Token):
        return part.start_pos or 0, part.end_pos or 0
    return getattr(part.meta, "start_pos", 0), getattr(part.meta, "end_pos", 1)
