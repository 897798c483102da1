"""Texts of files and peers as readers see them: control characters and bidirectional marks are shown as escapes."""

from __future__ import annotations

import re
from shlex import quote
from typing import Any

ACTING = re.compile(
    r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]|\r(?!\n)"
)
"""Characters that act on what shows them, and those that XML forbids. Tabs and line ends are none."""

ACTING_IN_A_LINE = re.compile(rf"{ACTING.pattern}|[\r\n]")
"""The same within one line: line ends too."""


def escaped(text: str) -> str:
    """Return the text with control characters and bidirectional marks shown as hexadecimal escapes."""
    return ACTING.sub(escape_of, text)


def in_one_line(text: str) -> str:
    """Return the text as one line: control characters, bidirectional marks and line ends are escaped."""
    return ACTING_IN_A_LINE.sub(escape_of, text)


def printable(text: str) -> str:
    """Return the text as one line with escapes for all that cannot be seen, such as a zero-width space."""
    return text if text.isprintable() else "".join(c if c.isprintable() else _escape(c) for c in text)


def shell_word(text: str) -> str:
    r"""Return a text as one word of a command for Bash, to be copied: `$'a\x1bb'` if it has what cannot be seen."""
    if text.isprintable():
        return quote(text)
    return f"$'{''.join(map(_in_shell, text))}'"


def shown_path(path: str) -> str:
    """Return a path as a word of a shell that no command takes for an option."""
    return shell_word(f"./{path}" if path.startswith("-") else path)


def counted(count: int, singular: str, plural: str | None = None) -> str:
    """Return a number with its noun: `1 error`, `2 errors`."""
    return f"{count} {singular if count == 1 else plural or singular + 's'}"


def _in_shell(character: str) -> str:
    if character.isprintable():
        return f"\\{character}" if character in "\\'" else character
    is_byte = "\udc80" <= character <= "\udcff"  # a byte of a file name that is not UTF-8
    encoded = character.encode(errors="surrogateescape" if is_byte else "surrogatepass")
    return "".join(f"\\x{byte:02x}" for byte in encoded)


def escaped_data(data: Any) -> Any:  # noqa: ANN401 - any value that JSON can represent
    """Return data for JSON with all texts in it escaped."""
    if isinstance(data, str):
        return escaped(data)
    if isinstance(data, dict):
        return {escaped_data(key): escaped_data(value) for key, value in data.items()}
    return [escaped_data(value) for value in data] if isinstance(data, list | tuple) else data


def escape_of(match: re.Match[str]) -> str:
    r"""Return the escape that stands for one character, such as `\x1b`."""
    return _escape(match[0])


def _escape(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")
