"""Keys that stages share, and whether a file has parts or objects: the stages are not loaded for most files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

from scbm.files.expansion.expanded_nodes import entries_of
from scbm.files.spelling import nearest

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
"""The sections whose entries can have parameters, or get a prefix in parts, in the order of the reference."""

SHARED_SECTIONS = ("types", "tables")
"""The sections of a part that get no prefix: what they declare is known everywhere."""

REQUIREMENT_KEYS = ("requirement", "where")
"""The keys of a requirement that is written as a mapping, for parameters with a condition."""

NodeKind: TypeAlias = Literal[
    "predicate", "requirement", "actions", "names", "assignments", "term", "text", "simulation", "copy",
    "binding", "call", "choice", "calls", "fields", "argument", "readings",
]  # fmt: skip
"""The kind of text under a key, which says how it is parsed; `copy` for values and words, the last line for `ros`."""

KINDS_BELOW: dict[NodeKind | None, dict[str, NodeKind]] = {
    "names": {"*": "copy"},
    "assignments": {"*": "term"},
    "text": {"*": "text"},
    "simulation": {"measured": "names", "failed": "names", "*": "copy"},
    "binding": {"service": "call", "services": "choice", "measured": "readings", "*": "text"},
    "call": {"request": "fields", "measured": "readings", "*": "text"},
    "choice": {"*": "calls"},
    "calls": {"*": "call"},
    "fields": {"*": "argument"},
    "argument": {"variable": "argument", "*": "text"},
    "readings": {"*": "text"},
}
"""The kind of text under each key of a mapping of a kind; `*` for all other keys."""

BY_VARIABLE = ("names", "assignments", "choice", "readings")
"""The kinds of mappings whose keys are variables; an argument of a request may be one, too."""


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


def shared_section(key: str) -> str | None:
    """Return the section of types or of tables that a key of a model names or probably means; `None` for others."""
    meant = nearest(key, (*SHARED_SECTIONS, *LIFTED_SECTIONS))
    return meant if meant in SHARED_SECTIONS else None


def has_parts(document: YamlNode) -> bool:
    """Return whether the tree of a model includes other files or uses parts."""
    return any(key in document.items for key in PART_KEYS_OF_MODELS)


def has_objects(document: YamlNode) -> bool:
    """Return whether the tree of a model has types, tables, or names with parameters; or a file may have them."""
    if document.incomplete or "types" in document.items or "tables" in document.items:
        return True
    for section in LIFTED_SECTIONS:
        for entry in entries_of(document.items[section]) if section in document.items else ():
            if "[" in entry.key or "where" in entry.node.items:
                return True
    return False
