"""Parses predicates, actions and requirements: from a text to its syntax tree, or to one located syntax error."""

from __future__ import annotations

from functools import cache
from typing import TypeAlias

from lark import Lark, Token, Tree
from lark.exceptions import UnexpectedInput

from scbm.files.language.grammar import grammar
from scbm.files.language.syntax_faults import SLUGS, Start, SyntaxFault, example, syntax_fault
from scbm.model import FORMS, RequirementForm, Slug

SyntaxTree: TypeAlias = Tree[Token]

MAX_CHARACTERS = 20_000
MAX_DEPTH = 60
"""The maximum nesting of a predicate: more than people write, and less than Python's recursion limit allows."""


@cache
def _parser(_: tuple[type[RequirementForm], ...]) -> Lark:
    """Return the parser for the forms of requirements that there are now."""
    return Lark(
        grammar(),
        parser="lalr",
        start=["predicate", "action", "requirement"],
        propagate_positions=True,
        maybe_placeholders=False,
    )


def parse(text: str, start: Start) -> SyntaxTree:
    """Return the syntax tree of a text. Raises `SyntaxFault`."""
    if len(text) > MAX_CHARACTERS:
        raise SyntaxFault(Slug.TOO_DEEP, f"longer than {MAX_CHARACTERS} characters", 0, 1)
    if not text.strip():
        raise SyntaxFault(SLUGS[start], f"an empty {start}", 0, 1, example(start))
    try:
        tree = _parser(tuple(FORMS.values())).parse(text, start=start)
    except UnexpectedInput as error:
        raise syntax_fault(error, text, start) from None
    _refuse_depth(tree)
    return tree


def _refuse_depth(tree: SyntaxTree) -> None:
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
