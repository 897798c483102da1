"""Whether a model file has parts or objects: most files have neither, and their stages are not loaded for them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from scbm.files.expansion.expanded_nodes import entries_of

if TYPE_CHECKING:
    from scbm.files.yaml.document import YamlNode

PART_KEYS_OF_MODELS = ("include", "parts")

LIFTED_SECTIONS = (
    "variables",
    "resources",
    "operations",
    "automatic_transitions",
    "environment",
    "goals",
    "requirements",
)
"""The sections whose entries can have parameters."""


class PartKeyNames(NamedTuple):
    """The keys of parts and of their uses. The codec declares them, and imports the expansion.

    Attributes:
        part: the keys of a file with a part.
        parameter: the keys of a parameter of a part.
        use: the keys of a use of a part.
    """

    part: tuple[str, ...]
    parameter: tuple[str, ...]
    use: tuple[str, ...]


def has_parts(document: YamlNode) -> bool:
    """Return whether the tree of a model includes other files or uses parts."""
    return any(key in document.items for key in PART_KEYS_OF_MODELS)


def has_objects(document: YamlNode) -> bool:
    """Return whether the tree of a model has types, tables, or names with parameters."""
    if "types" in document.items or "tables" in document.items:
        return True
    for section in LIFTED_SECTIONS:
        for entry in entries_of(document.items[section]) if section in document.items else ():
            if "[" in entry.key or "where" in entry.node.items:
                return True
    return False
