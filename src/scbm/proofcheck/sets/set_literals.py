"""The sets of a certificate as literals: whether a situation, before or after a step, is in a set."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.proofcheck.sets.clauses import TRUE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.proofcheck.certificate import SetsArgument
    from scbm.proofcheck.sets.clauses import Clauses
    from scbm.proofcheck.sets.set_views import ValueLiterals


class SetLiterals:
    """Whether one situation, given by the literals of its variables, is in sets. These literals are never negated."""

    def __init__(self, argument: SetsArgument, literals: Mapping[str, ValueLiterals], clauses: Clauses) -> None:
        self._argument = argument
        self._literals = literals
        self._clauses = clauses
        self._known = {sign: {0: -sign * TRUE, 1: sign * TRUE} for sign in (1, -1)}

    def inside(self, number: int) -> int:
        """Return the assumption that the situation is in a set."""
        return self._implied(number, 1)

    def outside(self, number: int) -> int:
        """Return the assumption that the situation is not in a set."""
        return self._implied(number, -1)

    def _implied(self, number: int, sign: int) -> int:
        """Return a literal that holds only where the situation is in a set, or with sign -1 only where it is not."""
        found, used, todo = self._known[sign], dict[int, None](), [number]
        while todo:
            each = todo.pop()
            if each not in found and each not in used:
                used[each] = None
                todo += self._argument.nodes[each - 2][1:]
        for each in sorted(used):
            level, *following = self._argument.nodes[each - 2]
            found[each] = self._clauses.new()
            values = self._literals[self._argument.variables[level]].values()
            for value, after in zip(values, following, strict=True):
                self._clauses.add(-found[each], -value, found[after])
        return found[number]
