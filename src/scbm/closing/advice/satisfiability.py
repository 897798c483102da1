"""Whether any state at all satisfies a predicate: backtracking over its normal form."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import Packing, StateSpace
from scbm.model.normal_form import AllOf, AnyOf, FieldPair, OneOf

if TYPE_CHECKING:
    from scbm.model import Predicate
    from scbm.model.bit_fields import Field
    from scbm.model.normal_form import Node

_MAX_STEPS = 100_000


class _SearchLimitError(Exception):
    pass


def is_satisfiable(predicate: Predicate, space: StateSpace) -> bool | None:
    """Whether a state of the space satisfies the predicate; `None` if that was not found out within the limit."""
    try:
        return _SatisfyingSearch().satisfy([Packing(space).normal_form(predicate)], {})
    except (_SearchLimitError, RecursionError):
        return None


class _SatisfyingSearch:
    """Satisfies one node after the other under what the earlier ones allow each field to be."""

    def __init__(self) -> None:
        self._steps = 0

    def satisfy(self, nodes: list[Node], allowed: dict[str, int]) -> bool:
        """Whether all nodes can hold at once; `allowed` has the values left to each variable, as bits."""
        self._steps += 1
        if self._steps > _MAX_STEPS:
            raise _SearchLimitError
        if not nodes:
            return True
        node, rest = nodes[0], nodes[1:]
        match node:
            case bool():
                return node and self.satisfy(rest, allowed)
            case OneOf():
                return self._narrowed(node.field, node.allowed, rest, allowed)
            case AllOf(parts):
                return self.satisfy([*parts, *rest], allowed)
            case AnyOf(parts):
                return any(self.satisfy([part, *rest], allowed) for part in parts)
            case FieldPair(left, right):
                return any(
                    self.satisfy([OneOf(left, 1 << index), OneOf(right, node.row(value)), *rest], allowed)
                    for index, value in enumerate(left.variable.domain.values)
                    if allowed.get(left.variable.name, -1) >> index & 1
                )

    def _narrowed(self, field: Field, values: int, rest: list[Node], allowed: dict[str, int]) -> bool:
        name = field.variable.name
        left = allowed.get(name, values) & values
        return bool(left) and self.satisfy(rest, {**allowed, name: left})
