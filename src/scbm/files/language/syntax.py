"""Parses predicates, actions and requirements: from a text to its syntax tree, or to one located syntax error."""

from __future__ import annotations

from functools import cache
from typing import TypeAlias

from lark import Lark, Token, Tree
from lark.exceptions import UnexpectedInput

from scbm.files.language.syntax_faults import EXAMPLES, SLUGS, Start, SyntaxFault, syntax_fault
from scbm.model import Slug

_GRAMMAR = r"""
predicate: implication
?implication: disjunction | disjunction _IMPLIES implication
?disjunction: conjunction | conjunction (_OR conjunction)+
?conjunction: negation | negation (_AND negation)+
?negation: "!" negation -> no | atom
?atom: "(" implication ")" -> group
     | term RELATION term -> comparison
     | NAME _IN "{" [term ("," term)*] "}" -> member
     | truth
     | NAME -> bare
truth: TRUE | FALSE
term: NAME | INTEGER | TRUE | FALSE

action: NAME _GETS term -> assign
      | NAME _INCREASES INTEGER -> add
      | NAME _DECREASES INTEGER -> subtract

requirement: _ALWAYS implication -> always
           | _NEVER implication -> never
           | implication _LEADS _TO implication [_WITHIN DURATION] -> leads_to
           | implication _BEFORE implication -> before
           | _AFTER implication _ALWAYS implication _UNTIL implication -> after_always

RELATION: "==" | "!=" | "<=" | "<" | ">=" | ">"
_IMPLIES: "->"
_OR: "||"
_AND: "&&"
_GETS: "<-"
_INCREASES: "+="
_DECREASES: "-="
_IN.2: /in(?![\w.])/
_ALWAYS.2: /always(?![\w.])/
_NEVER.2: /never(?![\w.])/
_LEADS.2: /leads(?![\w.])/
_TO.2: /to(?![\w.])/
_WITHIN.2: /within(?![\w.])/
_BEFORE.2: /before(?![\w.])/
_AFTER.2: /after(?![\w.])/
_UNTIL.2: /until(?![\w.])/
TRUE: "true"
FALSE: "false"
NAME: /[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*/
INTEGER: /-?[0-9]+/
DURATION: /[0-9]+(\.[0-9]+)?\s*[A-Za-zµ]+/
%ignore /[ \t\r\n\f]+/
"""
"""The grammar (semantics 2 and 7.3), for Lark's LALR parser."""

SyntaxTree: TypeAlias = Tree[Token]

MAX_CHARACTERS = 20_000
MAX_DEPTH = 60
"""The maximum nesting of a predicate: more than people write, and less than Python's recursion limit allows."""


@cache
def _parser() -> Lark:
    return Lark(
        _GRAMMAR,
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
        raise SyntaxFault(SLUGS[start], f"an empty {start}", 0, 1, EXAMPLES[start])
    try:
        tree = _parser().parse(text, start=start)
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
