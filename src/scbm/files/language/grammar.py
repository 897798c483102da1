"""The grammar of predicates, actions and requirements (semantics 2 and 7.3), for Lark's LALR parser.

The rules of requirements and their keywords come from the patterns in `model.FORMS`.
"""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from scbm.model import FORMS
from scbm.model.requirements import DURATION, PREDICATES, pattern_words

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

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

requirement: <forms>

RELATION: "==" | "!=" | "<=" | "<" | ">=" | ">"
_IMPLIES: "->"
_OR: "||"
_AND: "&&"
_GETS: "<-"
_INCREASES: "+="
_DECREASES: "-="
_IN.2: /in(?![\w.])/
<keywords>
TRUE: "true"
FALSE: "false"
NAME: /[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*/
INTEGER: /-?[0-9]+/
DURATION: /[0-9]+(\.[0-9]+)?\s*[A-Za-zµ]+/
%ignore /[ \t\r\n\f]+/
"""

_WORDS = ("true", "false", "in")
"""The keywords of predicates."""


def grammar() -> str:
    """Return the grammar with the forms of requirements that there are now."""
    forms = "\n           | ".join(f"{_rule(form.pattern)} -> {name}" for name, form in FORMS.items())
    terminals = (f"{_terminal(word)}.2: /{word}(?![\\w.])/" for word in _requirement_words())
    return _GRAMMAR.replace("<forms>", forms).replace("<keywords>", "\n".join(terminals))


def keywords() -> tuple[str, ...]:
    """Return the words that cannot be names.

    In a requirement, the second word of a phrase may be a name, such as `to` of `leads to`: its position identifies it.
    """
    return (*_WORDS, *dict.fromkeys(phrase[0] for phrase in _phrases()))


def requirement_phrases() -> dict[str, str]:
    """Return the terminals of requirements with what they stand for: `_LEADS` with `leads to`, and `_TO` with `to`."""
    phrases: dict[str, str] = {}
    for phrase in _phrases():
        for number, word in enumerate(phrase):
            phrases.setdefault(_terminal(word), " ".join(phrase[number:]))
    return phrases


def _phrases() -> Iterator[list[str]]:
    """The keywords of requirements; those that follow each other directly, such as `leads to`, together."""
    for form in FORMS.values():
        for is_value, words in groupby(_flat(form.pattern), _is_value):
            if not is_value:
                yield list(words)


def opening_words() -> tuple[str, ...]:
    """Return the keywords that requirements begin with."""
    first = (pattern_words(form.pattern)[0] for form in FORMS.values())
    return tuple(dict.fromkeys(word for word in first if not _is_value(word)))


def _rule(pattern: str) -> str:
    words = pattern_words(pattern)
    return " ".join(f"[{_rule(word[1:-1])}]" if word.startswith("[") else _symbol(word) for word in words)


def _symbol(word: str) -> str:
    if word in PREDICATES:
        return "implication"
    return "DURATION" if word == DURATION else _terminal(word)


def _terminal(word: str) -> str:
    return f"_{word.upper()}"


def _requirement_words() -> Iterable[str]:
    return dict.fromkeys(word for form in FORMS.values() for word in _flat(form.pattern) if not _is_value(word))


def _flat(pattern: str) -> list[str]:
    """The words of a pattern, those of its optional parts among them."""
    return pattern.replace("[", "").replace("]", "").split()


def _is_value(word: str) -> bool:
    return word in PREDICATES or word == DURATION
