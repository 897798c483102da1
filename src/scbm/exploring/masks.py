"""Conditions as sets of states, of which each is one large integer: bit i stands for the state with code i."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.exploring.conditions import AllOf, Among, AnyOf, Condition, Related

if TYPE_CHECKING:
    from scbm.exploring.layout import Layout


class Masks:
    """Makes the masks of a dense layout; all share its width."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self.everything = (1 << layout.size) - 1

    def of(self, condition: Condition) -> int:
        """The states in which the condition holds."""
        match condition:
            case bool():
                return self.everything if condition else 0
            case Among(variable, allowed, _):
                return self.among(variable, allowed)
            case Related():
                return self._related(condition)
            case AllOf(parts):
                return self._all_of(parts)
            case AnyOf(parts):
                return self._any_of(parts)

    def among(self, variable: int, allowed: int) -> int:
        """The states in which a variable has one of some values: a pattern as long as its values, again and again."""
        stride, count = self._layout.strides[variable], self._layout.counts[variable]
        run = (1 << stride) - 1
        pattern = 0
        for value in range(count):
            if allowed >> value & 1:
                pattern |= run << (value * stride)
        return _repeated(pattern, count * stride, self._layout.size // (count * stride))

    def _related(self, related: Related) -> int:
        mask = 0
        for left in range(len(related.left_values)):
            if row := related.row(left):
                mask |= self.among(related.left, 1 << left) & self.among(related.right, row)
        return mask

    def _all_of(self, parts: tuple[Condition, ...]) -> int:
        mask = self.everything
        for part in parts:
            mask &= self.of(part)
        return mask

    def _any_of(self, parts: tuple[Condition, ...]) -> int:
        mask = 0
        for part in parts:
            mask |= self.of(part)
        return mask


def _repeated(pattern: int, width: int, times: int) -> int:
    """The pattern so many times, side by side, by doubling."""
    if times <= 1:
        return pattern * times
    half = _repeated(pattern, width, times // 2)
    doubled = half | half << (width * (times // 2))
    return doubled << width | pattern if times % 2 else doubled
