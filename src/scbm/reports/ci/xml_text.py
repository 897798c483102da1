"""Trees of elements as XML files: deterministic, laid out, and without characters that XML forbids.

Paths as tools on other machines read them.
"""

from __future__ import annotations

import posixpath
import re
from xml.etree.ElementTree import Element, indent, tostring

_DRIVE = re.compile(r"[A-Za-z]:/")


def portable(path: str) -> str:
    """A path with forward slashes and without detours: `./cells/../cell.yaml` is `cell.yaml`."""
    return posixpath.normpath(path.replace("\\", "/"))


def is_absolute(path: str) -> bool:
    """Whether a portable path begins at the root of a file system, or with the letter of a drive."""
    return path.startswith("/") or _DRIVE.match(path) is not None


_FORBIDDEN = re.compile(r"[^\t\n\r\x20-\uD7FF\uE000-\uFFFD\U00010000-\U0010FFFF]")
"""What XML 1.0 has no way to say, not even escaped (its production `Char`)."""

_PICTURES = 0x2400
"""Where Unicode has a picture for each control character, in their order."""


def xml_text(root: Element) -> str:
    """The text of an XML file. What XML cannot say is replaced by what can be seen; the tree is changed so."""
    for element in root.iter():
        element.text = None if element.text is None else visible(element.text)
        for name, value in element.items():
            element.set(name, visible(value))
    indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{tostring(root, encoding="unicode")}\n'


def visible(text: str) -> str:
    """A text with pictures instead of control characters, and U+FFFD instead of all else that XML forbids."""
    return _FORBIDDEN.sub(_picture, text)


def _picture(match: re.Match[str]) -> str:
    code = ord(match[0])
    return chr(_PICTURES + code) if code < ord(" ") else "\N{REPLACEMENT CHARACTER}"
