"""Element trees as XML files: deterministic, indented, and without characters that XML forbids.

Also paths in a form that tools on other machines can read.
"""

from __future__ import annotations

import posixpath
import re
from xml.etree.ElementTree import Element, indent, tostring

_DRIVE = re.compile(r"[A-Za-z]:/")


def portable(path: str) -> str:
    """Return a normalized path with forward slashes: `./cells/../cell.yaml` is `cell.yaml`."""
    return posixpath.normpath(path.replace("\\", "/"))


def is_absolute(path: str) -> bool:
    """Return whether a portable path begins at the root of a file system, or with a drive letter."""
    return path.startswith("/") or _DRIVE.match(path) is not None


_FORBIDDEN = re.compile(r"[^\t\n\r\x20-\uD7FF\uE000-\uFFFD\U00010000-\U0010FFFF]")
"""Characters that XML 1.0 cannot represent, not even escaped (its production `Char`)."""

_PICTURES = 0x2400
"""First code point of the Unicode pictures of control characters, which are in the same order."""


def xml_text(root: Element) -> str:
    """Return the text of an XML file; replace forbidden characters in the tree by visible ones."""
    for element in root.iter():
        element.text = None if element.text is None else visible(element.text)
        for name, value in element.items():
            element.set(name, visible(value))
    indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{tostring(root, encoding="unicode")}\n'


def visible(text: str) -> str:
    """Return a text with pictures for control characters, and U+FFFD for other characters that XML forbids."""
    return _FORBIDDEN.sub(_picture, text)


def _picture(match: re.Match[str]) -> str:
    code = ord(match[0])
    return chr(_PICTURES + code) if code < ord(" ") else "\ufffd"
