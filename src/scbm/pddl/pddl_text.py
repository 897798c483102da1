"""Places of names in a text of PDDL, for errors: `unified-planning` gives none for what it has read."""

from __future__ import annotations

import re
from bisect import bisect_right
from fractions import Fraction
from typing import TYPE_CHECKING, NamedTuple

from msgspec.structs import replace

from scbm.model import Diagnostic, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

NUMBER = re.compile(r"-?\d{1,18}(\.\d{1,18})?")
"""A number, with at most as many digits as a model can have."""

_ACTIONS = (":action", ":durative-action")
_TOKEN = re.compile(r";[^\n]*|[()]|[^\s();][^\s();?]*")
"""A comment, a bracket or a word; a variable begins a word of its own: `joined?a` is `joined ?a`."""


_MAX_PLACES = 8
"""Maximum number of further places that an error names: a message has 400 characters at most."""


class _Token(NamedTuple):
    word: str
    begin: int


class PddlText:
    """One file of PDDL with the places of its sections, actions and names."""

    def __init__(self, file: str, text: str) -> None:
        self.file = file
        self.text = text
        self._lines = text.split("\n")
        self._starts = [0, *(match.end() for match in re.finditer("\n", text))]
        self._tokens = [
            _Token(match.group().lower(), match.start()) for match in _TOKEN.finditer(text) if match.group()[0] != ";"
        ]

    @property
    def words(self) -> list[str]:
        """The words and brackets of the text in lower case, without comments."""
        return [token.word for token in self._tokens]

    def action(self, name: str) -> Place:
        """Return the place of the name of an action; that of the whole text if it is not found."""
        index = self._action_index(name)
        return Place(self.file) if index is None else self.place(index)

    def inside_action(self, action: str, name: str) -> Place:
        """Return the place of the first use of `name` in an action; that of the action if there is none."""
        begin = self._action_index(action)
        index = self._next_in_action(begin, name)
        return self.action(action) if index is None else self.place(index)

    def inside_effect(self, action: str, *fact: str) -> Place:
        """Return the place of the name of a fact in the effect of an action; else as `inside_action`.

        `fact` is the name, and the arguments as far as they are known: `at`, `?r`, `?z`.
        """
        effect = self._next_in_action(self._action_index(action), ":effect")
        index = self._next_in_action(effect, *fact)
        return self.inside_action(action, fact[0]) if index is None else self.place(index)

    def _action_index(self, name: str) -> int | None:
        words = [token.word for token in self._tokens]
        return next(
            (i + 1 for i, word in enumerate(words[:-1]) if word in _ACTIONS and words[i + 1] == name.lower()), None
        )

    def _next_in_action(self, begin: int | None, *words: str) -> int | None:
        """Return the index of the next use of words in a row, before another action begins."""
        wanted = [word.lower() for word in words]
        for index in range(len(self._tokens) if begin is None else begin + 1, len(self._tokens)):
            found = [token.word for token in self._tokens[index : index + len(wanted)]]
            if found[0] in _ACTIONS:
                break
            if len(found) == len(wanted) and all(map(_are_alike, found, wanted)):
                return index
        return None

    def first(self, *words: str) -> Place:
        """Return the place of the first of these words that the text has; that of the whole text if it has none."""
        for word in words:
            for index, token in enumerate(self._tokens):
                if _are_alike(token.word, word.lower()):
                    return self.place(index)
        return Place(self.file)

    def declared(self, name: str) -> Place:
        """Return the place where a predicate or a function is declared; that of its first use if it is not found."""
        for section in (":predicates", ":functions"):
            for begin, end in self._expressions(section):
                for index in range(begin + 1, end):
                    if self._tokens[index].word == "(" and self._tokens[index + 1].word == name.lower():
                        return self.place(index + 1)
        return self.first(name)

    def in_section(self, section: str, name: str, objects: Sequence[str] | None = None) -> Place:
        """Return the place of a fact in a section; without objects, of any with its name; else of its first use."""
        words = ["(", name.lower(), *([] if objects is None else [*(each.lower() for each in objects), ")"])]
        for begin, end in self._expressions(section):
            for index in range(begin, end):
                if [token.word for token in self._tokens[index : index + len(words)]] == words:
                    return self.place(index + 1)
        return self.first(name)

    def initial_value(self, name: str, objects: Sequence[str]) -> Place:
        """Return the place of the value of a function in the initial state; that of the fact if it is not found."""
        words = ["(", "=", "(", name.lower(), *(each.lower() for each in objects), ")"]
        for index in range(len(self._tokens) - len(words)):
            if [token.word for token in self._tokens[index : index + len(words)]] == words:
                return self.place(index + len(words))
        return self.in_section(":init", name, objects)

    def _expressions(self, word: str) -> Iterator[tuple[int, int]]:
        """Yield the indices of the brackets around each expression that begins with a word."""
        for begin in range(len(self._tokens) - 1):
            if self._tokens[begin].word == "(" and self._tokens[begin + 1].word == word:
                depth = 0
                for end in range(begin, len(self._tokens)):
                    depth += {"(": 1, ")": -1}.get(self._tokens[end].word, 0)
                    if not depth:
                        yield begin, end
                        break

    def at(self, line: int, column: int) -> Place:
        """Return the place of a line and a column, each from 1, within the text."""
        line = max(1, min(line, len(self._lines)))
        return Place(self.file, line, max(1, min(column, len(self._lines[line - 1]) + 1)))

    def error(self, message: str, place: Place, remedy: str | None = None, slug: Slug | None = None) -> Diagnostic:
        """Return an error with the line that its place is in."""
        shown = self._lines[place.line - 1].rstrip("\r") if place.line else None
        return Diagnostic(slug or Slug.PDDL_NOT_EXPRESSIBLE, message, place, remedy, shown)

    def place(self, index: int) -> Place:
        """Return the place of a word by its index."""
        word, begin = self._tokens[index]
        line = bisect_right(self._starts, begin)
        return Place(self.file, line, begin - self._starts[line - 1] + 1, len(word))


def _are_alike(word: str, other: str) -> bool:
    """Return whether two words are equal, or numbers of one value: `1.5` and `1.50`."""
    are_numbers = NUMBER.fullmatch(word) and NUMBER.fullmatch(other)
    return word == other or (are_numbers is not None and Fraction(word) == Fraction(other))


def merged_errors(errors: Iterable[Diagnostic]) -> list[Diagnostic]:
    """Return errors of which each is told once: the first one of equal ones names the other places."""
    by_text: dict[tuple[str, str, str | None], dict[Diagnostic, None]] = {}
    for each in errors:
        by_text.setdefault((each.place.file, each.message, each.remedy), {})[each] = None
    return [_with_places(*several) for several in by_text.values()]


def _with_places(first: Diagnostic, *others: Diagnostic) -> Diagnostic:
    shown = [f"{each.place.line}:{each.place.column}" for each in others]
    if len(shown) > _MAX_PLACES:
        shown = [*shown[:_MAX_PLACES], f"{len(shown) - _MAX_PLACES} more places"]
    return replace(first, message=f"{first.message}, also at {', '.join(shown)}") if shown else first
