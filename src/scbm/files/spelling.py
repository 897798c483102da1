"""Finds the known name that a misspelt one probably means."""

from __future__ import annotations

from difflib import get_close_matches
from functools import lru_cache
from itertools import islice
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

_SHOWN = 10
"""The maximum number of names listed if none is similar."""

_ALIKE = 0.65
"""The minimum ratio of `difflib` for similar names: `avg` is similar to `agv`, and `normal` is not to `uniform`."""

_MAX_COMPARED = 2_000
"""The maximum number of names compared, so that errors in a model with thousands of names take seconds."""


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name most similar to `name`, ignoring case; `None` if none is similar.

    A name with the same words in another order comes first: `cnc_req_state.m` for `cnc.m_req_state`.
    """
    return _nearest(name, tuple(islice(known, _MAX_COMPARED)))


@lru_cache(maxsize=32)
def _nearest(name: str, known: tuple[str, ...]) -> str | None:
    """Return the most similar name; an error of many instances asks for the same again and again."""
    by_folded = {candidate.casefold(): candidate for candidate in known}
    words = _words(name)
    moved = next((other for folded, other in by_folded.items() if _words(folded) == words), None) if words[1:] else None
    if moved is not None and name.casefold() not in by_folded:
        return moved
    found = get_close_matches(name.casefold(), by_folded, n=1, cutoff=_ALIKE)
    return by_folded[found[0]] if found else None


def _words(name: str) -> list[str]:
    """Return the words between the dots and underscores of a name, sorted."""
    return sorted(name.casefold().replace(".", "_").split("_"))


def suggestion(name: str, known: Iterable[str], what: str) -> str | None:
    """Return a remedy for an unknown name: the most similar one, else the list of known names."""
    names = list(known)
    near = nearest(name, names)
    if near is not None:
        return f"did you mean `{near}`?"
    if not names:
        return None
    listed = ", ".join(names[:_SHOWN]) + (", …" if len(names) > _SHOWN else "")
    return f"{what}: {listed}"
