"""The objects of a model file, and the digest of its lifted model: of all that does not name them (semantics 8.7)."""

from __future__ import annotations

import json
import re
from hashlib import sha256
from typing import TYPE_CHECKING

from scbm.model import ObjectLists

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.expansion.static_facts import StaticFacts
    from scbm.files.yaml.document import YamlNode

_SECTIONS: dict[str, tuple[str, ...]] = {
    "variables": ("initial", "random"),
    "resources": ("ros",),
    "operations": (),
    "automatic_transitions": (),
    "environment": (),
    "requirements": (),
    "requirements_off": (),
}
"""The sections that a lifted model consists of, and the keys of their entries that are no part of it."""

_BLANKS = re.compile(r"\s*([^\w\s])\s*|\s+")


def read_object_lists(document: YamlNode, facts: StaticFacts | None) -> ObjectLists | None:
    """Return the objects of a model file, and the digest of its lifted model; `None` for a file without types.

    Args:
        document: the tree of the file with its parts, before its objects are expanded; without errors.
        facts: its types and tables; `None` for a file without objects.
    """
    if facts is None or "types" not in document.items:
        return None
    parents = tuple(facts.parents.items())
    tables = tuple((name, table.types, tuple(table.rows)) for name, table in facts.tables.items())
    name = document.get("behavior_model")
    declared: list[object] = [
        None if name is None else name.text,
        sorted(facts.own),
        sorted(parents),
        sorted((name, columns) for name, columns, _ in tables),
    ]
    for section, others in _SECTIONS.items():
        node = document.get(section)
        entries = node.items.items() if node is not None else ()
        declared.append([[_close(key), _without(entry.plain, others)] for key, entry in entries])
    return ObjectLists(_digest(declared), tuple(facts.own.items()), parents, tables, tuple(_entries(document)))


def _entries(document: YamlNode) -> Iterator[tuple[str, str]]:
    """Yield the section and the name of each operation and automatic transition with parameters."""
    for section in ("operations", "automatic_transitions"):
        node = document.get(section)
        for key in node.items if node is not None else ():
            name, bracket, _ = key.partition("[")
            if bracket:
                yield section, name.rstrip()


def _without(plain: object, keys: tuple[str, ...]) -> object:
    return {key: each for key, each in plain.items() if key not in keys} if isinstance(plain, dict) else plain


def _digest(plain: object) -> str:
    return sha256(json.dumps(_closed(plain), sort_keys=True, ensure_ascii=False, default=str).encode()).hexdigest()


def _closed(plain: object) -> object:
    """Return data with all blanks of its texts removed that separate no words."""
    if isinstance(plain, dict):
        return {_close(str(key)): _closed(each) for key, each in plain.items()}
    if isinstance(plain, list | tuple):
        return [_closed(each) for each in plain]
    return _close(plain) if isinstance(plain, str) else plain


def _close(text: str) -> str:
    return _BLANKS.sub(lambda match: match[1] or " ", text.strip())
