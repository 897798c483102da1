"""Large integers as sets of numbers, and as numbers of many states at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

_BITS_OF_BYTE = tuple(tuple(bit for bit in range(8) if byte >> bit & 1) for byte in range(256))


def holds_bit(members: bytes, number: int) -> bool:
    """Whether the number is in the set, given as bytes, the least first. An integer would be shifted as a whole."""
    return bool(members[number >> 3] >> (number & 7) & 1)


def codes_of(members: bytes) -> Iterator[int]:
    """The numbers in the set, in order."""
    for place, byte in enumerate(members):
        for bit in _BITS_OF_BYTE[byte]:
            yield 8 * place + bit


class BitPlanes:
    """A number for each of many states, 0 at first. Plane k is the set of states whose number has bit k.

    Numbers are added to whole sets of states, to each state at most once. After the first look no more are added.
    """

    def __init__(self, size: int) -> None:
        self._bytes_of_plane = size // 8 + 1
        self._planes: list[int] = []
        self._looked_at: list[bytes] = []

    def add(self, states: int, number: int) -> None:
        """All these states have this number."""
        self._planes.extend([0] * (number.bit_length() - len(self._planes)))
        for k in range(number.bit_length()):
            if number >> k & 1:
                self._planes[k] |= states

    def __getitem__(self, code: int) -> int:
        if len(self._looked_at) < len(self._planes):
            self._looked_at = [plane.to_bytes(self._bytes_of_plane, "little") for plane in self._planes]
        return sum(1 << k for k, plane in enumerate(self._looked_at) if holds_bit(plane, code))
