"""Conditions and steps as functions of one code, for codes of any width."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from scbm.planning.engines.conditions import Among, Condition, Conjunction, Disjunction, Related

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.planning.engines.joint_moves import JointMove, Write
    from scbm.planning.engines.reduced_system import StateCodes

    Test: TypeAlias = Callable[[int], bool]
    Transfer: TypeAlias = Callable[[int], int]


class Functions:
    """Makes the functions of a layout of fields."""

    def __init__(self, layout: StateCodes) -> None:
        self._shifts = tuple(stride.bit_length() - 1 for stride in layout.strides)
        self._masks = tuple((1 << max(count - 1, 0).bit_length()) - 1 for count in layout.counts)

    def test(self, condition: Condition) -> Test:
        """Whether the condition holds in a state."""
        match condition:
            case bool():
                return lambda _: condition
            case Among(variable, allowed, _):
                shift, mask = self._shifts[variable], self._masks[variable]
                return lambda code: bool(allowed >> (code >> shift & mask) & 1)
            case Related():
                return self._related(condition)
            case Conjunction(parts):
                tests = [self.test(part) for part in parts]
                return lambda code: all(test(code) for test in tests)
            case Disjunction(parts):
                tests = [self.test(part) for part in parts]
                return lambda code: any(test(code) for test in tests)

    def _related(self, related: Related) -> Test:
        left_shift, left_mask = self._shifts[related.left], self._masks[related.left]
        right_shift, right_mask = self._shifts[related.right], self._masks[related.right]
        left, right = related.left_values, related.right_values
        return lambda code: related.holds(left[code >> left_shift & left_mask], right[code >> right_shift & right_mask])

    def transfer(self, step: JointMove) -> Transfer:
        """Where the step leads from a state in which its guard holds."""
        keep = ~sum(self._masks[write.variable] << self._shifts[write.variable] for write in step.writes)
        tables = [self._table(write) for write in step.writes]

        def transfer(code: int) -> int:
            after = code & keep
            for shift, mask, table in tables:
                after |= table[code >> shift & mask]
            return after

        return transfer

    def _table(self, write: Write) -> tuple[int, int, list[int]]:
        """Where the source lies, and the bits of the new value for each of its values."""
        placed = [(after or 0) << self._shifts[write.variable] for after in write.table]
        return self._shifts[write.source], self._masks[write.source], placed
