"""YAML nodes made of others, with the places of the text that people wrote."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from scbm.files.expansion.rewritten_scalar import PlacedScalar
from scbm.files.yaml.document import YamlNode, plain_value

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.files.yaml.source_text import Scalar
    from scbm.model import Place


class MappingEntry(NamedTuple):
    """An entry of a mapping.

    Attributes:
        key: its key.
        place: where the key is written, or what it is generated from.
        node: its value.
        end: where in the text the value ends; reports on lines show the lines from the key to this end, and the line of
            the key alone for 0.
    """

    key: str
    place: Place
    node: YamlNode
    end: int


def entries_of(node: YamlNode) -> Iterator[MappingEntry]:
    """Yield the entries of a mapping; none for other nodes."""
    for key, child in node.items.items():
        yield MappingEntry(key, node.key_places[key], child, node.value_ends[key])


def with_entries(node: YamlNode, entries: Iterable[MappingEntry]) -> YamlNode:
    """Return a mapping with other entries that stands where `node` stands; the last entry of a key counts."""
    listed = {entry.key: entry for entry in entries}
    return replace(
        node,
        plain={key: entry.node.plain for key, entry in listed.items()},
        items={key: entry.node for key, entry in listed.items()},
        key_places={key: entry.place for key, entry in listed.items()},
        value_ends={key: entry.end for key, entry in listed.items()},
        size=1 + sum(1 + entry.node.size for entry in listed.values()),
    )


def mapping_node(entries: Iterable[MappingEntry], place: Place, end: int, origin: str | None = None) -> YamlNode:
    """Return a new mapping that stands for the text from `place` to the index `end`."""
    return with_entries(YamlNode({}, place, end=end, origin=origin), entries)


def list_node(elements: Iterable[YamlNode], place: Place, end: int) -> YamlNode:
    """Return a new list that stands for the text from `place` to the index `end`."""
    listed = list(elements)
    size = 1 + sum(element.size for element in listed)
    return YamlNode([element.plain for element in listed], place, elements=listed, size=size, end=end)


def scalar_node(scalar: Scalar, place: Place, end: int) -> YamlNode:
    """Return a new node with a scalar that stands for the text from `place` to the index `end`."""
    plain = scalar.text if scalar.style else plain_value(scalar.text)
    return YamlNode(plain, place, scalar, end=end)


def text_node(text: str, place: Place, end: int) -> YamlNode:
    """Return a new node with a generated text; errors in it underline `place`."""
    return scalar_node(PlacedScalar(text, place), place, end)
