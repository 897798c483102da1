"""The delete relaxation: the values that each variable can ever have, as if no value were lost by taking another.

Whatever the moves reach is made of these values, and they lead out of them from no such state, reached or not. So a
variable with one value needs no room, and a predicate that fails under these values holds in no state that is reached.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.planning.engines.conditions import allowed, bits_of, indices_of, satisfiable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.planning.engines.joint_moves import JointMove


def values_ever(steps: Sequence[JointMove], starts: Sequence[int]) -> tuple[tuple[int, ...], ...]:
    """For each variable the indices of the values that it can ever have, in order.

    Args:
        steps: over whole domains.
        starts: the values at the starts, as bits, for each variable.
    """
    relaxed = _Relaxed(steps, starts)
    while relaxed.grow():
        pass
    return tuple(map(indices_of, relaxed.values))


class _Relaxed:
    """The values found so far. Of each table the entries already followed are kept, so that each is followed once."""

    def __init__(self, steps: Sequence[JointMove], starts: Sequence[int]) -> None:
        self.values = list(starts)
        self._steps = steps
        self._followed = [[0 for _ in step.writes] for step in steps]

    def grow(self) -> bool:
        """Takes each step that may be possible once; whether that gave a variable a new value."""
        before = list(self.values)
        for step, followed in zip(self._steps, self._followed, strict=True):
            if satisfiable(step.guard, self.values):
                self._take(step, followed)
        return self.values != before

    def _take(self, step: JointMove, followed: list[int]) -> None:
        for number, write in enumerate(step.writes):
            sources = self.values[write.source] & allowed(step.guard, write.source)
            found = (write.table[i] for i in indices_of(sources & ~followed[number]))
            self.values[write.variable] |= bits_of(index for index in found if index is not None)
            followed[number] |= sources
