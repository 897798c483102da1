"""Places of names in a text of PDDL, for errors: `unified-planning` gives none for what it has read."""

from __future__ import annotations

import re
from typing import NamedTuple

from scbm.model import Diagnostic, Place, Slug

_TOKEN = re.compile(r";[^\n]*|[()]|[^\s();]+")


class _Token(NamedTuple):
    word: str
    begin: int


class PddlText:
    """One file of PDDL with the places of its sections, actions and names."""

    def __init__(self, file: str, text: str) -> None:
        self.file = file
        self.text = text
        self._lines = text.split("\n")
        self._tokens = [
            _Token(match.group().lower(), match.start()) for match in _TOKEN.finditer(text) if match.group()[0] != ";"
        ]

    def action(self, name: str) -> Place:
        """Return the place of the name of an action; that of the whole text if it is not found."""
        sections = (":action", ":durative-action")
        for index, token in enumerate(self._tokens[:-1]):
            if token.word in sections and self._tokens[index + 1].word == name.lower():
                return self._place(index + 1)
        return Place(self.file)

    def inside_action(self, action: str, name: str) -> Place:
        """Return the place of the first use of `name` in an action; that of the action if there is none."""
        found = self.action(action)
        inside = [i for i, token in enumerate(self._tokens) if self._position(token.begin) > (found.line, found.column)]
        for index in inside if found.line else ():
            word = self._tokens[index].word
            if word in {":action", ":durative-action"}:
                break
            if word == name.lower():
                return self._place(index)
        return found

    def first(self, *words: str) -> Place:
        """Return the place of the first of these words that the text has; that of the whole text if it has none."""
        for word in words:
            for index, token in enumerate(self._tokens):
                if token.word == word.lower():
                    return self._place(index)
        return Place(self.file)

    def at(self, line: int, column: int) -> Place:
        """Return the place of a line and a column, each from 1, within the text."""
        line = max(1, min(line, len(self._lines)))
        return Place(self.file, line, max(1, min(column, len(self._lines[line - 1]) + 1)))

    def error(self, message: str, place: Place, remedy: str | None = None, slug: Slug | None = None) -> Diagnostic:
        """Return an error with the line that its place is in."""
        shown = self._lines[place.line - 1].rstrip("\r") if place.line else None
        return Diagnostic(slug or Slug.PDDL_NOT_EXPRESSIBLE, message, place, remedy, shown)

    def _place(self, index: int) -> Place:
        word, begin = self._tokens[index]
        line, column = self._position(begin)
        return Place(self.file, line, column, len(word))

    def _position(self, begin: int) -> tuple[int, int]:
        return self.text.count("\n", 0, begin) + 1, begin - self.text.rfind("\n", 0, begin)
