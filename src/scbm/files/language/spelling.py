"""The name that was probably meant."""

from __future__ import annotations

from difflib import get_close_matches
from itertools import islice
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable

_SHOWN = 8
"""So many names are listed at most when none is near."""

_ALIKE = 0.65
"""The least ratio of `difflib` that counts as alike: `avg` is like `agv`, and `normal` is not like `uniform`."""

_MAX_COMPARED = 2_000
"""So many names are looked at: a model with thousands of them gets its errors in seconds, if with fewer hints."""


def nearest(name: str, known: Iterable[str]) -> str | None:
    """The known name most like `name`, or `None` if none is like it. Upper and lower case count as alike."""
    by_folded = {candidate.casefold(): candidate for candidate in islice(known, _MAX_COMPARED)}
    found = get_close_matches(name.casefold(), by_folded, n=1, cutoff=_ALIKE)
    return by_folded[found[0]] if found else None


def suggestion(name: str, known: Iterable[str], what: str) -> str | None:
    """A remedy for an unknown name: the nearest one, else the list of what there is if it is short."""
    names = list(known)
    near = nearest(name, names)
    if near is not None:
        return f"did you mean `{near}`?"
    if not names:
        return None
    listed = ", ".join(names[:_SHOWN]) + (", …" if len(names) > _SHOWN else "")
    return f"{what}: {listed}"
