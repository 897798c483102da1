"""States as one integer, their code: a sum over the variables of number times stride.

The first variable has the least stride, and no two states have one code. So all layouts of a box order its states
alike: by the last variable, then by the one before it, and so on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.exploring.box import Coordinates


@dataclass(frozen=True, slots=True)
class Layout:
    """Where each variable lies in a code.

    Attributes:
        counts: how many values each variable has.
        strides: what one more of each adds to the code.
        size: all codes are less.
    """

    counts: tuple[int, ...]
    strides: tuple[int, ...]
    size: int

    @staticmethod
    def dense(counts: tuple[int, ...]) -> Layout:
        """Without gaps (mixed radix): `size` is the number of states."""
        strides, size = [], 1
        for count in counts:
            strides.append(size)
            size *= count
        return Layout(counts, tuple(strides), size)

    @staticmethod
    def fields(counts: tuple[int, ...]) -> Layout:
        """A field of whole bits for each variable: `size` is a power of two."""
        strides, bits = [], 0
        for count in counts:
            strides.append(1 << bits)
            bits += max(count - 1, 0).bit_length()
        return Layout(counts, tuple(strides), 1 << bits)

    def code(self, coordinates: Coordinates) -> int:
        """The code of a state."""
        return sum(number * stride for number, stride in zip(coordinates, self.strides, strict=True))

    def coordinates(self, code: int) -> Coordinates:
        """The state of a code."""
        ends = (*self.strides[1:], self.size)
        return tuple(code % end // stride for stride, end in zip(self.strides, ends, strict=False))
