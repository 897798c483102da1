"""The expressions of a file of PDDL as a tree, and errors about brackets that do not match."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.model import Diagnostic, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.pddl.pddl_text import PddlText

MAX_DEPTH = 32
"""The maximum number of open brackets: `unified-planning` recurses at each, and fails at about 50."""


class PddlNode(Struct, frozen=True):
    """A word, or a list in brackets.

    Attributes:
        word: the word in lower case; empty for a list.
        parts: the parts of a list.
        place: the word, or the opening bracket of a list.
    """

    word: str
    parts: tuple[PddlNode, ...]
    place: Place

    @property
    def is_list(self) -> bool:
        """Whether this is a list in brackets."""
        return not self.word

    @property
    def head(self) -> str:
        """The first word of a list; empty without one."""
        return self.parts[0].word if self.parts else ""

    @property
    def spot(self) -> Place:
        """The place that errors about the whole expression show: its first word."""
        return self.parts[0].place if self.head else self.place

    def with_head(self, word: str) -> PddlNode:
        """Return a list with another first word at the same place."""
        return replace(self, parts=(replace(self.parts[0], word=word), *self.parts[1:]))

    def lists(self) -> Iterator[PddlNode]:
        """Yield an expression, and all expressions in it, that are lists."""
        if self.is_list:
            yield self
        for part in self.parts:
            yield from part.lists()

    def words(self) -> Iterator[PddlNode]:
        """Yield all words of an expression."""
        if not self.is_list:
            yield self
        for part in self.parts:
            yield from part.words()

    def __str__(self) -> str:
        return f"({' '.join(map(str, self.parts))})" if self.is_list else self.word


class _OpenList:
    def __init__(self, index: int) -> None:
        self.index = index
        self.parts: list[PddlNode] = []


def read_nodes(text: PddlText) -> tuple[PddlNode | None, list[Diagnostic]]:
    """Return the expression of a file, and errors about its brackets; `None` where there are errors."""
    reader = _NodeReader(text)
    root = reader.root()
    return (None if reader.errors else root), reader.errors


class _NodeReader:
    def __init__(self, text: PddlText) -> None:
        self._text = text
        self._words = text.words
        self._open: list[_OpenList] = []
        self.errors: list[Diagnostic] = []

    def root(self) -> PddlNode | None:
        if self._words[:1] != ["("]:
            message = "the file begins with no `(`" if self._words else "the file has no PDDL in it"
            self._wrong(0, message, "write `(define (domain NAME) …)` or `(define (problem NAME) …)`")
            return None
        for index, word in enumerate(self._words):
            if word == "(":
                self._close_section_before(index)
                self._open.append(_OpenList(index))
                if len(self._open) > MAX_DEPTH:
                    self._wrong(index, f"more than {MAX_DEPTH} brackets are open here", "write less nested expressions")
                    return None
            elif word == ")":
                rest = self._words[index + 1 :]
                if len(self._open) == 1 and not rest:
                    return self._closed()
                if len(self._open) > 1:
                    self._closed()
                elif set(rest) == {")"}:
                    self._wrong(index + 1, "this `)` closes nothing", "remove it")
                    return None
                else:
                    self._wrong(index, "this `)` closes `(define`, and more follows", "remove it, or a `)` before it")
            else:
                self._open[-1].parts.append(PddlNode(word, (), self._text.place(index)))
        if not self.errors:
            opening = self._open[-1].index
            message = f"this `(` is never closed: the file ends {len(self._open)} `)` too early"
            self._wrong(opening, message, "write the missing `)`")
        return None

    def _close_section_before(self, index: int) -> None:
        """Close what is open where a section begins inside another one, and note an error."""
        if len(self._open) < 2 or not self._word(index + 1).startswith(":"):  # noqa: PLR2004 - `(define` and a section
            return
        opening, missing = self._open[1].index, len(self._open) - 1
        line = self._text.place(index).line
        named = " ".join(self._words[opening + 1 : opening + 1 + (2 if "action" in self._word(opening + 1) else 1)])
        section = f"`({named}`" if "(" not in named else "this bracket"
        message = f"{section} is not closed where `({self._word(index + 1)}` begins in line {line}"
        self._wrong(opening, message, f"write {missing} more `)` before line {line}")
        while len(self._open) > 1:
            self._closed()

    def _closed(self) -> PddlNode:
        closed = self._open.pop()
        node = PddlNode("", tuple(closed.parts), self._text.place(closed.index))
        if self._open:
            self._open[-1].parts.append(node)
        return node

    def _word(self, index: int) -> str:
        return self._words[index] if index < len(self._words) else ""

    def _wrong(self, index: int, message: str, remedy: str) -> None:
        place = self._text.place(index) if index < len(self._words) else self._text.at(1, 1)
        self.errors.append(self._text.error(message, place, remedy, Slug.BAD_PDDL))


class FileFaults:
    """The errors of one file of PDDL: each is reported once."""

    def __init__(self, text: PddlText) -> None:
        self.text = text
        self.found: dict[Diagnostic, None] = {}

    def wrong(self, node: PddlNode | Place, message: str, remedy: str | None = None) -> None:
        """Note that something is no right PDDL."""
        self._note(node, message, remedy, Slug.BAD_PDDL)

    def refuse(self, node: PddlNode | Place, message: str, remedy: str | None = None) -> None:
        """Note that a model cannot express something."""
        self._note(node, message, remedy, Slug.PDDL_NOT_EXPRESSIBLE)

    def _note(self, node: PddlNode | Place, message: str, remedy: str | None, slug: Slug) -> None:
        place = node.spot if isinstance(node, PddlNode) else node
        self.found[self.text.error(message, place, remedy, slug)] = None

    @property
    def are_of_pddl(self) -> bool:
        """Whether the file is no right PDDL, whatever a model could express."""
        return any(each.slug == Slug.BAD_PDDL for each in self.found)
