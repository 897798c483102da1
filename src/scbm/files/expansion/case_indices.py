"""Writes names with an index in a case file as names of instances: `at.r1` for `at[r1]`, in keys and in values."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.files.expansion.expanded_nodes import MappingEntry, Piece, RewrittenScalar, entries_of, with_entries
from scbm.files.language.dotted_text import INDEXED, DottedText
from scbm.files.yaml.document import plain_value
from scbm.model import Slug

if TYPE_CHECKING:
    from collections.abc import Container, Iterator

    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.error_collector import ErrorCollector

_WITHOUT_NAMES = ("case", "model", "recorded")
"""The keys of a case whose values are no names of its model that people write."""


def ground_case(document: YamlNode, report: ErrorCollector, text: str, variables: Container[str]) -> YamlNode:
    """Return the tree of a case without indices; the same tree if the text has none.

    Args:
        document: the tree of the file. Its keys are not checked yet, so it can have any shape.
        report: where errors go.
        text: the text of the file.
        variables: the names of the variables of its model.
    """
    if INDEXED.search(text) is None:
        return document
    stage = _IndexStage(report, variables)
    entries = (
        entry if entry.key in _WITHOUT_NAMES else entry._replace(node=stage.ground(entry.node))
        for entry in entries_of(document)
    )
    return with_entries(document, entries) if document.items else document


class _IndexStage:
    def __init__(self, report: ErrorCollector, variables: Container[str]) -> None:
        self._report = report
        self._variables = variables

    def ground(self, node: YamlNode, *, is_element: bool = False) -> YamlNode:
        """Return a node without indices; `is_element` is for those of lists, whose `name` is a name of the case."""
        if node.scalar is not None and "[" in node.scalar.text:
            return self._scalar(node)
        if node.items:
            return with_entries(node, self._entries(node, own_key="name" if is_element else None))
        if node.elements:
            elements = [self.ground(element, is_element=True) for element in node.elements]
            return replace(node, plain=[element.plain for element in elements], elements=elements)
        return node

    def _entries(self, node: YamlNode, own_key: str | None) -> Iterator[MappingEntry]:
        """Yield the entries of a mapping without indices; note two keys that are one name."""
        written: dict[str, str] = {}
        for entry in entries_of(node):
            key = DottedText(entry.key, self._variables).text
            if key in written:
                message = f"`{entry.key}` and `{written[key]}` are one name"
                self._report.add(Slug.DUPLICATE_KEY, message, entry.place, "leave out one of them")
            written.setdefault(key, entry.key)
            child = entry.node if key == own_key else self.ground(entry.node)
            yield MappingEntry(key, entry.place, child, entry.end)

    def _scalar(self, node: YamlNode) -> YamlNode:
        source = node.scalar
        ground = DottedText(node.text or "", self._variables)
        if source is None or ground.text == source.text:
            return node
        pieces = [
            Piece.copy(source, each.begin, each.end)
            if each.is_copy
            else Piece.instead(each.text, source, each.begin, each.end)
            for each in ground.pieces
        ]
        scalar = RewrittenScalar(pieces)
        scalar.style = source.style
        plain = scalar.text if source.style else plain_value(scalar.text)
        return replace(node, scalar=scalar, plain=plain)
