"""From the text of a predicate, an action or a requirement to its tree, or to one located syntax error."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Literal, TypeAlias, cast

from lark import Lark, Token, Tree
from lark.exceptions import UnexpectedCharacters, UnexpectedInput, UnexpectedToken

from scbm.errors import Slug
from scbm.notation.grammar import GRAMMAR

Start: TypeAlias = Literal["predicate", "action", "requirement"]
SyntaxTree: TypeAlias = Tree[Token]

MOST_CHARACTERS = 20_000
MOST_DEPTH = 60
"""How deep a predicate may nest; generous to people, and less than Python's own recursion allows."""

SLUGS = {
    "predicate": Slug.PREDICATE_SYNTAX,
    "action": Slug.ACTION_SYNTAX,
    "requirement": Slug.REQUIREMENT_SYNTAX,
}


@dataclass(slots=True)
class SyntaxFault(Exception):  # noqa: N818 - it never leaves this room; outside it is a diagnostic
    """Why a text has no tree: what, from which character to which, and what to write instead."""

    slug: Slug
    message: str
    begin: int
    end: int
    remedy: str | None = None


@cache
def _parser() -> Lark:
    return Lark(
        GRAMMAR,
        parser="lalr",
        start=["predicate", "action", "requirement"],
        propagate_positions=True,
        maybe_placeholders=False,
    )


def parse(text: str, start: Start) -> SyntaxTree:
    """The tree of a text. Raises `SyntaxFault`."""
    if len(text) > MOST_CHARACTERS:
        raise SyntaxFault(Slug.TOO_DEEP, f"longer than {MOST_CHARACTERS} characters", 0, 1)
    if not text.strip():
        raise SyntaxFault(SLUGS[start], f"an empty {start}", 0, 1, _EXAMPLES[start])
    try:
        tree = _parser().parse(text, start=start)
    except UnexpectedInput as error:
        raise _fault(error, text, start) from None
    _refuse_depth(tree)
    return tree


def _refuse_depth(tree: SyntaxTree) -> None:
    level: list[SyntaxTree] = [tree]
    for _ in range(MOST_DEPTH):
        level = [child for parent in level for child in parent.children if isinstance(child, Tree)]
        if not level:
            return
    begin, end = extent(level[0])
    raise SyntaxFault(Slug.TOO_DEEP, f"nested more than {MOST_DEPTH} levels deep", begin, end)


def extent(part: SyntaxTree | Token) -> tuple[int, int]:
    """The characters that a part of a tree was made from."""
    if isinstance(part, Token):
        return part.start_pos or 0, part.end_pos or 0
    return getattr(part.meta, "start_pos", 0), getattr(part.meta, "end_pos", 1)


_EXAMPLES = {
    "predicate": "write for example `robot_at == home && box_is_scanned == false`, or `true`",
    "action": "write for example `box_is_scanned <- true`, or `count += 1`",
    "requirement": "write `always p`, `never p`, `p leads to q within 10 s`, `p before q` or "
    "`after p always q until r`",
}

_WORDS = {
    "and": "&&",
    "or": "||",
    "not": "!",
    "is": "==",
    "eq": "==",
    "implies": "->",
}
_CHARACTERS = {
    "&": "write `&&`",
    "|": "write `||`",
    "=": "write `==` to compare",
    "∧": "write `&&`",
    "\N{LOGICAL OR}": "write `||`",
    "¬": "write `!`",
    "~": "write `!`",
    "→": "write `->`",
    "≠": "write `!=`",
    "≤": "write `<=`",
    "≥": "write `>=`",
    '"': "values are written without quotes",
    "'": "values are written without quotes",
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
    "IN": "`in`",
    "ALWAYS": "`always`",
    "NEVER": "`never`",
    "AFTER": "`after`",
    "UNTIL": "`until`",
    "BEFORE": "`before`",
    "LEADS": "`leads to`",
    "TO": "`to`",
    "WITHIN": "`within`",
    "_AND": "`&&`",
    "_OR": "`||`",
    "_IMPLIES": "`->`",
    "_GETS": "`<-`",
    "_INCREASES": "`+=`",
    "_DECREASES": "`-=`",
    "$END": "the end",
}


def _fault(error: UnexpectedInput, text: str, start: Start) -> SyntaxFault:
    slug = SLUGS[start]
    if isinstance(error, UnexpectedToken) and error.token.type != "$END":
        begin, end = extent(error.token)
        return SyntaxFault(
            slug, f"`{error.token}` cannot stand here", begin, end, _remedy(text, begin, end, start, error)
        )
    if isinstance(error, UnexpectedCharacters):
        begin = cast("int", error.pos_in_stream)  # Lark declares it without a type
        message = f"`{text[begin]}` cannot stand here"
        return SyntaxFault(slug, message, begin, begin + 1, _remedy(text, begin, begin + 1, start, error))
    open_bracket = _unclosed(text)
    if open_bracket is not None:
        message = f"this `{text[open_bracket]}` is not closed"
        return SyntaxFault(slug, message, open_bracket, open_bracket + 1, _expected(error))
    end = len(text.rstrip())
    return SyntaxFault(slug, f"the {start} ends too early", max(0, end - 1), end, _expected(error))


def _remedy(text: str, begin: int, end: int, start: Start, error: UnexpectedInput) -> str | None:
    written = text[begin:end]
    around = text[max(0, begin - 1) : begin + 2]
    if start == "action" and (written in ("=", "==") or ":=" in around or around.startswith("==")):
        return "write `<-` to assign"
    if start != "action" and "<-" in around:
        return "`<-` assigns and belongs into actions; write `==` to compare"
    if written.lower() in _WORDS:
        return f"write `{_WORDS[written.lower()]}`"
    if written in _CHARACTERS:
        return _CHARACTERS[written]
    if written == ")" and _unclosed(text[:begin]) is None:
        return "there is no `(` for it"
    return _expected(error)


def _expected(error: UnexpectedInput) -> str | None:
    allowed: set[str] = set(getattr(error, "accepts", None) or getattr(error, "allowed", None) or ())
    names = [name for terminal, name in _TERMINALS.items() if terminal in allowed]
    if not names:
        return None
    return f"expected {names[0]}" if len(names) == 1 else f"expected {', '.join(names[:-1])} or {names[-1]}"


def _unclosed(text: str) -> int | None:
    """Where the last bracket that nothing closes was opened."""
    opened: list[int] = []
    for index, character in enumerate(text):
        if character in "({":
            opened.append(index)
        elif character in ")}" and opened:
            opened.pop()
    return opened[-1] if opened else None
