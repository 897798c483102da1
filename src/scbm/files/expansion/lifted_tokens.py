"""The tokens of lifted predicates, actions and requirements, and the pieces of the ground texts that they become."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from scbm.files.language.grammar import keyword_phrases

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.model import RequirementForm

RELATIONS = ("==", "!=", "<", "<=", ">", ">=")
CONNECTIVES = ("&&", "||", "->")

_TOKEN = re.compile(
    r"(?P<name>[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*)(?!(?u:\w))"
    r"|(?P<word>(?u:[^\W\d]\w*))"
    r"|(?P<number>\d+(?:\.\d+)?)"
    r"|(?P<sign><-|\+=|-=|->|==|!=|<=|>=|&&|\|\||\S)",
    re.ASCII,
)
"""A word with letters that no name has is one token, so that errors name all of it."""

Piece: TypeAlias = tuple[str, int, int]
"""A part of a ground text, and the characters `begin..end` of the lifted text that it stands for."""

Pieces: TypeAlias = list[Piece]


class LiftedToken(NamedTuple):
    """A token of a lifted text.

    Attributes:
        text: its characters.
        begin: where it begins in the lifted text.
        end: where it ends.
        is_name: whether it is a name or a keyword, with or without dots.
    """

    text: str
    begin: int
    end: int
    is_name: bool

    @property
    def is_word(self) -> bool:
        """Whether it is a name, or would be one with other letters."""
        return self.is_name or self.text.isidentifier()


def tokens_of(text: str) -> list[LiftedToken]:
    """Return the tokens of a text; a character that no expression has is a token of its own."""
    return [LiftedToken(m[0], *m.span(), m.lastgroup == "name") for m in _TOKEN.finditer(text)]


def text_of(pieces: Sequence[Piece]) -> str:
    """Return the ground text that pieces make."""
    return "".join(text for text, _, _ in pieces)


def phrase_at(tokens: Sequence[LiftedToken], index: int, forms: tuple[type[RequirementForm], ...]) -> int:
    """Return the number of tokens of the phrase of requirements that begins at an index, such as `leads to`; or 0."""
    for phrase in _phrases(forms):
        if tuple(token.text for token in tokens[index : index + len(phrase)]) == phrase:
            return len(phrase)
    return 0


@cache
def _phrases(_: tuple[type[RequirementForm], ...]) -> tuple[tuple[str, ...], ...]:
    """Return the phrases of the forms of requirements that there are now, long ones first."""
    return tuple(sorted(map(tuple, keyword_phrases()), key=len, reverse=True))
