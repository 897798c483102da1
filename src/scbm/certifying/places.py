"""Where the values of a JSON text stand. Only asked when something is wrong with them."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Iterable

Path: TypeAlias = tuple[str | int, ...]
"""The keys and indices that lead to a value from the outside."""

_MARK = re.compile(r'"(?:[^"\\]|\\.)*"|[\[\]{}:,]|[^\s\[\]{}:,"]+')
_LINE_END = re.compile(r"\r\n|\r|\n")


def positions(text: str, wanted: Iterable[Path]) -> dict[Path, int]:
    """The position at which the value at each path begins; `text` is JSON, and has these values."""
    left = dict.fromkeys(wanted)
    found: dict[Path, int] = {}
    path: list[str | int | None] = []  # None where a key comes next
    for match in _MARK.finditer(text):
        mark = match[0]
        if mark in ("]", "}"):
            path.pop()
        elif mark == ",":
            path[-1] = path[-1] + 1 if isinstance(path[-1], int) else None
        elif path and path[-1] is None:
            path[-1] = json.loads(mark)
        elif mark != ":":
            here = tuple(part for part in path if part is not None)
            if here in left:
                found.setdefault(here, match.start())
                if len(found) == len(left):
                    break
            if mark in ("[", "{"):
                path.append(0 if mark == "[" else None)
    return found


def line_and_column(text: str, position: int) -> tuple[int, int, str]:
    """The line and the column of a position, both counted from 1, and the text of that line."""
    begin, number = 0, 1
    for match in _LINE_END.finditer(text):
        if match.end() > position:
            return number, position - begin + 1, text[begin : match.start()]
        begin, number = match.end(), number + 1
    return number, position - begin + 1, text[begin:]
