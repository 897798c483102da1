"""Masks: the states in which a normal form holds, as one large integer with bit i for the state of code i.

Also sets of numbers as large integers, and bit planes for one number per state.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, assert_never

from scbm.model.normal_form import AllOf, AnyOf, NormalForm, OneOf, Pair

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.planning.engines.reduced_system import StateCodes

_BITS_OF_BYTE = tuple(tuple(bit for bit in range(8) if byte >> bit & 1) for byte in range(256))


def holds_bit(members: bytes, number: int) -> bool:
    """Return whether the number is in the set of bytes, little-endian; a large integer would be shifted as a whole."""
    return bool(members[number >> 3] >> (number & 7) & 1)


def codes_of(members: bytes) -> Iterator[int]:
    """Yield the numbers in the set in ascending order."""
    for place, byte in enumerate(members):
        for bit in _BITS_OF_BYTE[byte]:
            yield 8 * place + bit


class BitPlanes:
    """A number for each of many states, 0 at first. Plane k is the set of states whose number has bit k.

    Numbers are added to whole sets of states, to each state at most once. No more are added after the first look-up.
    """

    def __init__(self, size: int) -> None:
        self._bytes_of_plane = size // 8 + 1
        self._planes: list[int] = []
        self._frozen: list[bytes] = []

    def add(self, states: int, number: int) -> None:
        """Give all these states a number."""
        self._planes.extend([0] * (number.bit_length() - len(self._planes)))
        for k in range(number.bit_length()):
            if number >> k & 1:
                self._planes[k] |= states

    def __getitem__(self, code: int) -> int:
        if len(self._frozen) < len(self._planes):
            self._frozen = [plane.to_bytes(self._bytes_of_plane, "little") for plane in self._planes]
        return sum(1 << k for k, plane in enumerate(self._frozen) if holds_bit(plane, code))


class Masks:
    """Makes the masks of one dense layout; all have its width."""

    def __init__(self, layout: StateCodes) -> None:
        self._layout = layout
        self.everything = (1 << layout.size) - 1

    def of(self, condition: NormalForm) -> int:
        """Return the states in which the form holds."""
        match condition:
            case bool():
                return self.everything if condition else 0
            case OneOf(variable, allowed, _):
                return self.among(variable, allowed)
            case Pair():
                return self._pair(condition)
            case AllOf(parts):
                return self._all_of(parts)
            case AnyOf(parts):
                return self._any_of(parts)
            case _:
                assert_never(condition)

    def among(self, variable: int, allowed: int) -> int:
        """Return the states in which a variable has one of some values: a periodic pattern of bits."""
        stride, count = self._layout.strides[variable], self._layout.counts[variable]
        run = (1 << stride) - 1
        pattern = 0
        for value in range(count):
            if allowed >> value & 1:
                pattern |= run << (value * stride)
        return _repeated(pattern, count * stride, self._layout.size // (count * stride))

    def _pair(self, pair: Pair) -> int:
        mask = 0
        for left in range(len(pair.left_values)):
            if row := pair.row(left):
                mask |= self.among(pair.left, 1 << left) & self.among(pair.right, row)
        return mask

    def _all_of(self, parts: tuple[NormalForm, ...]) -> int:
        mask = self.everything
        for part in parts:
            mask &= self.of(part)
        return mask

    def _any_of(self, parts: tuple[NormalForm, ...]) -> int:
        mask = 0
        for part in parts:
            mask |= self.of(part)
        return mask


def _repeated(pattern: int, width: int, times: int) -> int:
    """Return a pattern repeated side by side, by doubling."""
    if times <= 1:
        return pattern * times
    half = _repeated(pattern, width, times // 2)
    doubled = half | half << (width * (times // 2))
    return doubled << width | pattern if times % 2 else doubled
