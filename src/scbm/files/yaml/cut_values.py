"""Values that YAML cuts at a comma: in `{…}` and `[…]` a comma ends a value without quotes, also inside `(…)`."""

from __future__ import annotations

import re

_COMMA = re.compile(r"\s*,")
_STOP = re.compile(r"[,\]}\[{\"'#]")
"""What ends a value without quotes, or begins something else."""

_QUANTIFIER = re.compile(r"\b(?:forall|exists|count)\s+\w+ in \w+\Z")
_PARAMETER = re.compile(r"\s*\w+ in \w+\Z")

_MAX_COMMAS = 8
"""Maximum number of commas of a value: the search stays short in a text full of open brackets."""

_FOLD = re.compile(r"\s*[\r\n]\s*")


def may_be_cut(value: str) -> bool:
    """Return whether a comma may have cut a value; `uncut_end` decides it, and takes longer."""
    return "(" in value or " in " in value


def uncut_end(text: str, begin: int, end: int) -> int | None:
    """Return where a value that a comma cuts was meant to end; `None` if none does, or if its bracket stays open.

    Args:
        text: the text of the file.
        begin: where the value without quotes begins.
        end: where it ends for YAML.
    """
    depth, has_quantifier, last, stop = 0, False, begin, end
    for _ in range(_MAX_COMMAS + 1):
        piece = text[last:stop].rstrip()
        depth += piece.count("(") - piece.count(")")
        has_quantifier = (_PARAMETER if has_quantifier else _QUANTIFIER).search(piece) is not None
        if depth <= 0 and not has_quantifier:
            return last + len(piece) if stop > end else None
        comma = _COMMA.match(text, last + len(piece))
        following = _STOP.search(text, comma.end()) if comma is not None else None
        if comma is None or following is None or following[0] in "[{\"'#":
            return None
        last, stop = comma.end(), following.start()
    return None


def folded(text: str) -> str:
    """Return a value of several lines as YAML reads it, in one line."""
    return _FOLD.sub(" ", text)


def quoted(text: str) -> str | None:
    """Return a value in quotes; `None` for a value that would need escapes."""
    return next((f"{quote}{text}{quote}" for quote in "\"'" if not {quote, "\\"} & set(text)), None)
