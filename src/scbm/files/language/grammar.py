"""The grammar of predicates, actions and requirements (semantics 2 and 7.3), for Lark's LALR parser.

A term, a sum, or one of them in brackets is an operand of a comparison. It also parses as a predicate of its own,
`bare`, as one token ahead does not show which: the resolver accepts it if it is `true` or `false`. After `(` and a sum,
the parser takes `)` for the bracket of an operand, by Lark's rule to prefer to shift.

The rules of requirements and their keywords come from the patterns of `FORMS` in `model/requirements.py`.
"""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, assert_never

from scbm.model.requirements import FORMS, PLACEHOLDERS, PlaceholderKind, pattern_parts, spellings

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.model import RequirementForm

_GRAMMAR = r"""
predicate: implication
?implication: disjunction | disjunction _IMPLIES implication
?disjunction: conjunction | conjunction (_OR conjunction)+
?conjunction: negation | negation (_AND negation)+
?negation: "!" negation -> no | atom
?atom: "(" implication ")" -> group
     | sum RELATION sum -> comparison
     | NAME _IN "{" (term ("," term)*)? "}" -> member
     | sum -> bare
?sum: operand | operand (SIGN operand)+ -> sum
?operand: term
        | "(" sum ")"
        | EXTREME "(" sum ("," sum)+ ")" -> extreme
term: NAME | INTEGER | TRUE | FALSE

action: NAME _GETS sum -> assign
      | NAME _INCREASES INTEGER -> add
      | NAME _DECREASES INTEGER -> subtract

requirement: <forms>

RELATION: "==" | "!=" | "<=" | "<" | ">=" | ">"
_IMPLIES: "->"
_OR: "||"
_AND: "&&"
_GETS: "<-"
SIGN: /[+-]/
EXTREME.2: /(min|max)(?=\s*\()/
_INCREASES: "+="
_DECREASES: "-="
_IN.2: /in(?![\w.])/
<keywords>
TRUE: "true"
FALSE: "false"
NAME: /[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z0-9_]+)*/
INTEGER: /-?[0-9]+/
DURATION: /[0-9]+(\.[0-9]+)?\s*[A-Za-zµ]+/
%ignore /[ \t\r\n\f]+/
"""

_LIFTED_ATOMS = r"""
     | QUANTIFIER bound ("," bound)* "." "(" implication ")" -> quantified
     | NAME "(" [implication] ("," [implication])* ")" -> row
     | NAME _IN NAME -> within
"""
_LIFTED_OPERANDS = r"""
        | AGGREGATE bound ("," bound)* "." "(" sum ")" -> aggregate
        | COUNT bound ("," bound)* "." "(" implication ")" -> counted
"""
_LIFTED_ACTION = """
      | FORALL bound ("," bound)* "." "(" action ")" -> all_actions
      | FORALL bound ("," bound)* "." action -> all_actions
"""
_LIFTED_RULES = r"""
bound: BOUND (_IN | ":") BOUND
BOUND: /[^\W\d]\w*(\.[^\W\d]\w*)*/
FORALL.4: /forall(?=\s+(?!in(?![\w.]))[^\W\d])/
QUANTIFIER.3: /(forall|exists)(?=\s+(?!in(?![\w.]))[^\W\d])/
AGGREGATE.3: /(sum|min|max)(?=\s+(?!in(?![\w.]))[^\W\d])/
COUNT.3: /count(?=\s+(?!in(?![\w.]))[^\W\d])/
"""
QUANTIFIERS = ("forall", "exists", "count")
"""The words that begin a quantifier; they are keywords only before a parameter."""

AGGREGATES = ("sum", "min", "max")
"""The words that begin a term over objects; they are keywords only before a parameter, too."""

_NAME = r"/[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z0-9_]+)*/"
_INDEXED_NAME = (
    r"/[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z0-9_]+)*"
    r"(\s*\[[^\[\](){}]*\](_[A-Za-z0-9_]+|(\.[A-Za-z0-9_]+)*))?/"
)

_WORDS = ("true", "false", "in")
"""The keywords of predicates."""


_FORM = "form_"
"""Begins the names of the rules of forms, so that no form has the name of another rule."""


def grammar() -> str:
    """Return the grammar with the forms of requirements that there are now."""
    forms = "\n           | ".join(f"{_rule(form.pattern)} -> {_FORM}{name}" for name, form in FORMS.items())
    terminals = (f"{_terminal(word)}.2: /{word}(?![\\w.])/" for word in _requirement_words())
    return _GRAMMAR.replace("<forms>", forms).replace("<keywords>", "\n".join(terminals))


def lifted_grammar() -> str:
    """Return the grammar of texts with quantifiers, rows of tables, and names with an index."""
    text = grammar().replace("     | sum -> bare\n", f"     | sum -> bare{_LIFTED_ATOMS}")
    text = text.replace("-> extreme\n", f"-> extreme{_LIFTED_OPERANDS}")
    text = text.replace("-> subtract\n", f"-> subtract{_LIFTED_ACTION}")
    return text.replace(_NAME, _INDEXED_NAME) + _LIFTED_RULES


def form_of(rule: str) -> type[RequirementForm]:
    """Return the form of requirements whose rule this is."""
    return FORMS[rule.removeprefix(_FORM)]


def keywords() -> tuple[str, ...]:
    """Return the words that cannot be names.

    In a requirement, the second word of a phrase may be a name, such as `to` of `leads to`: its position identifies it.
    """
    return (*_WORDS, *dict.fromkeys(phrase[0] for phrase in keyword_phrases()))


def requirement_phrases() -> dict[str, str]:
    """Return the terminals of requirements with what they stand for: that of `leads` with `leads to`."""
    phrases: dict[str, str] = {}
    for phrase in keyword_phrases():
        for number, word in enumerate(phrase):
            phrases.setdefault(_terminal(word), " ".join(phrase[number:]))
    return phrases


def keyword_phrases() -> Iterator[list[str]]:
    """Yield the keywords of requirements; those that follow each other directly, such as `leads to`, together."""
    for form in FORMS.values():
        for part in pattern_parts(form.pattern):
            for is_value, words in groupby(part.words, PLACEHOLDERS.__contains__):
                if not is_value:
                    yield list(words)


def opening_words() -> tuple[str, ...]:
    """Return the keywords that requirements begin with."""
    first = (words[0] for words in _spelled())
    return tuple(dict.fromkeys(word for word in first if word not in PLACEHOLDERS))


def words_after_predicates() -> tuple[str, ...]:
    """Return the terminals that follow the predicate in forms that begin with one."""
    begins = ((words[0], words[1]) for words in _spelled() if words[1:])
    return tuple(_terminal(second) for first, second in begins if PLACEHOLDERS.get(first) is PlaceholderKind.PREDICATE)


def _spelled() -> Iterator[list[str]]:
    """Return the words of all ways to write a requirement."""
    return (spelling.split() for form in FORMS.values() for spelling in spellings(form.pattern))


def _rule(pattern: str) -> str:
    parts = ((part.is_optional, " ".join(map(_symbol, part.words))) for part in pattern_parts(pattern))
    return " ".join(f"[{symbols}]" if is_optional else symbols for is_optional, symbols in parts)


def _symbol(word: str) -> str:
    """Return the symbol of the grammar for a word of a pattern."""
    kind = PLACEHOLDERS.get(word)
    match kind:
        case None:
            return _terminal(word)
        case PlaceholderKind.PREDICATE:
            return "implication"
        case PlaceholderKind.DURATION:
            return "DURATION"
        case PlaceholderKind.NUMBER:
            return "INTEGER"
        case _:
            assert_never(kind)


def _terminal(word: str) -> str:
    return f"_WORD_{word.upper()}"


def _requirement_words() -> Iterable[str]:
    words = (word for form in FORMS.values() for part in pattern_parts(form.pattern) for word in part.words)
    return dict.fromkeys(word for word in words if word not in PLACEHOLDERS)
