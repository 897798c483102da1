"""Sets as integers: position i is in the set if bit i is one."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator


def bits_of(visited: int) -> Iterator[int]:
    """The positions of the ones of a set, ascending."""
    while visited:
        lowest = visited & -visited
        yield lowest.bit_length() - 1
        visited ^= lowest
