"""The objects of a model file, and the digest of its lifted model: of all that does not name them (semantics 8.7)."""

from __future__ import annotations

import json
import re
from hashlib import sha256
from typing import TYPE_CHECKING

from scbm.model import ObjectLists

if TYPE_CHECKING:
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


def read_object_lists(document: YamlNode) -> ObjectLists | None:
    """Return the objects of a model file, and the digest of its lifted model; `None` for a file without types.

    Args:
        document: the tree of the file with its parts, before its objects are expanded; without errors.
    """
    types = document.get("types")
    if types is None:
        return None
    listed = {name: _objects(node) for name, node in types.items.items()}
    tables = document.get("tables")
    columns = {name: node.items["of"].plain for name, node in tables.items.items()} if tables is not None else {}
    rows = {name: node.items["rows"].plain for name, node in tables.items.items()} if tables is not None else {}
    name = document.get("behavior_model")
    declared: list[object] = [
        None if name is None else name.text,
        {name: node.items["of"].plain if "of" in node.items else None for name, node in types.items.items()},
        columns,
    ]
    for section, others in _SECTIONS.items():
        node = document.get(section)
        entries = node.items.items() if node is not None else ()
        declared.append([[_close(key), _without(entry.plain, others)] for key, entry in entries])
    return ObjectLists(
        _digest(declared), _digest(rows), tuple((name, names) for name, names in listed.items() if names)
    )


def _objects(node: YamlNode) -> tuple[str, ...]:
    """Return the objects that a type lists itself."""
    listed = node.items.get("objects", node)
    return tuple(element.text or "" for element in listed.elements)


def _without(plain: object, keys: tuple[str, ...]) -> object:
    return {key: each for key, each in plain.items() if key not in keys} if isinstance(plain, dict) else plain


def _digest(plain: object) -> str:
    return sha256(json.dumps(_closed(plain), sort_keys=True, ensure_ascii=False, default=str).encode()).hexdigest()


def _closed(plain: object) -> object:
    """Return data with all blanks of its texts removed that separate no words."""
    if isinstance(plain, dict):
        return {_close(str(key)): _closed(each) for key, each in plain.items()}
    if isinstance(plain, list):
        return [_closed(each) for each in plain]
    return _close(plain) if isinstance(plain, str) else plain


def _close(text: str) -> str:
    return _BLANKS.sub(lambda match: match[1] or " ", text.strip())
