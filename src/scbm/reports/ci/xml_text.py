"""Element trees as XML files: deterministic, indented, and without characters that XML forbids.

Also paths in a form that tools on other machines can read.
"""

from __future__ import annotations

import posixpath
import re
from xml.etree.ElementTree import Element, indent, tostring

from scbm.model.visible_text import escaped

_DRIVE = re.compile(r"[A-Za-z]:/")


def portable(path: str) -> str:
    """Return a normalized path with forward slashes: `./cells/../cell.yaml` is `cell.yaml`."""
    return posixpath.normpath(path.replace("\\", "/"))


def is_absolute(path: str) -> bool:
    """Return whether a portable path begins at the root of a file system, or with a drive letter."""
    return path.startswith("/") or _DRIVE.match(path) is not None


def xml_text(root: Element) -> str:
    """Return the text of an XML file; control characters in the tree are escaped."""
    for element in root.iter():
        element.text = None if element.text is None else escaped(element.text)
        for name, value in element.items():
            element.set(name, escaped(value))
    indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{tostring(root, encoding="unicode")}\n'
