"""States as integers, and predicates and actions as functions on them.

Each variable of a space gets a field of bits that holds the index of its value in its domain. A conjunction of
equalities then becomes one AND and one comparison, the assignments of a transition one AND and one OR. Exact:
a packed function gives what the predicate or the actions give on the named state (held by property tests).
"""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, TypeAlias

from scbm.model.bit_fields import Field, lay_out
from scbm.model.normal_form import AllOf, AnyOf, FieldPair, Node, OneOf, normal_form
from scbm.model.operations import Action, Add, Assign
from scbm.model.predicates import Constant, Predicate
from scbm.model.state import State

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from scbm.model.values import Value
    from scbm.model.variables import StateSpace

    Test: TypeAlias = Callable[[int], bool]
    Update: TypeAlias = Callable[[int], int | None]


class Packing:
    """The fields of a space. Immutable; everything it returns is a pure function."""

    def __init__(self, space: StateSpace) -> None:
        self.space = space
        self.fields = lay_out(space)
        # The same as the fields, unpacked: these are read for every record of every run.
        readers = [(f.variable.name, f.variable.domain.values, f.mask, f.shift) for f in self.fields]
        self._readers = tuple(readers)
        self._by_bit = [r for f, r in zip(self.fields, readers, strict=True) for _ in range(f.width)]
        self._writers = tuple((f.variable.name, {v: f.bits(v) for v in f.variable.domain.values}) for f in self.fields)

    def __getitem__(self, name: str) -> Field:
        return self.fields[self.space.position(name)]

    def pack(self, state: Mapping[str, Value]) -> int:
        """The state as an integer. `state` may have more variables than the space."""
        packed = 0
        for name, bits in self._writers:
            packed |= bits[state[name]]
        return packed

    def value(self, packed: int, name: str) -> Value:
        """What the variable is in the packed state."""
        field = self[name]
        return field.variable.domain.values[field.index(packed)]

    def values(self, packed: int) -> dict[str, Value]:
        """All variables of the packed state by name, in order."""
        return {name: values[(packed & mask) >> shift] for name, values, mask, shift in self._readers}

    def unpack(self, packed: int) -> State:
        """The packed state, with names."""
        return State(self.space, self.values(packed))

    def changes(self, before: int, after: int) -> tuple[tuple[str, Value], ...]:
        """The variables that differ, in order, with what they are in `after`."""
        changes = []
        difference = before ^ after
        while difference:
            name, values, mask, shift = self._by_bit[(difference & -difference).bit_length() - 1]
            changes.append((name, values[(after & mask) >> shift]))
            difference &= ~mask
        return tuple(changes)

    def assignment(self, values: Mapping[str, Value]) -> tuple[int, int]:
        """`(keep, bits)`, so that `packed & keep | bits` has these values and all others as before."""
        mask = bits = 0
        for name, value in values.items():
            mask |= self[name].mask
            bits |= self[name].bits(value)
        return ~mask, bits

    def normal_form(self, predicate: Predicate) -> Node:
        """The predicate as sets of values of fields."""
        return normal_form(predicate, True, self)

    def test(self, predicate: Predicate) -> Test:
        """The predicate as a function of packed states."""
        return _emit(self.normal_form(predicate))

    def cube(self, predicate: Predicate) -> tuple[int, int]:
        """`(mask, bits)`, so that `packed & mask == bits` wherever the predicate holds: a first look without a call."""
        node = self.normal_form(predicate)
        return _cube(node.parts if isinstance(node, AllOf) else (node,))

    def update(self, actions: Iterable[Action]) -> Update:
        """The actions, at once, as a function of packed states; it gives `None` if a domain would be left."""
        fixed: dict[str, Value] = {}
        moves: list[Update] = []
        mask = 0
        for action in actions:
            if isinstance(action, Assign) and isinstance(action.source, Constant):
                fixed[action.target] = action.source.constant
            else:
                mask |= self[action.target].mask
                moves.append(self._move(action))
        keep, bits = self.assignment(fixed)
        if not moves:
            return lambda packed: packed & keep | bits
        return _combined(keep & ~mask, bits, tuple(moves))

    def _move(self, action: Action) -> Update:
        """The new bits of the target, from a table over the source's values; `None` outside the domain."""
        target = self[action.target]
        source = self[action.reads()[0]]
        domain = target.variable.domain
        table: list[int | None] = []
        for value in source.variable.domain.values:
            moved = int(value) + action.amount if isinstance(action, Add) else value
            table.append(target.bits(moved) if moved in domain else None)
        shift, mask = source.shift, source.mask
        return lambda packed: table[(packed & mask) >> shift]


def _combined(keep: int, bits: int, moves: tuple[Update, ...]) -> Update:
    def update(packed: int) -> int | None:
        result = packed & keep | bits
        for move in moves:
            moved = move(packed)
            if moved is None:
                return None
            result |= moved
        return result

    return update


def _emit(node: Node) -> Test:
    match node:
        case bool():
            return lambda _: node
        case OneOf():
            return _emit_one_of(node)
        case FieldPair():
            return _emit_pair(node)
        case AnyOf(parts):
            return _any_of([_emit(part) for part in parts])
        case AllOf(parts):
            return _emit_all(parts)


def _emit_one_of(node: OneOf) -> Test:
    mask, shift, allowed = node.field.mask, node.field.shift, node.allowed
    if allowed.bit_count() == 1:
        bits = (allowed.bit_length() - 1) << shift
        return lambda packed: packed & mask == bits
    refused = node.all_values & ~allowed
    if refused.bit_count() == 1:
        bits = (refused.bit_length() - 1) << shift
        return lambda packed: packed & mask != bits
    return lambda packed: bool(allowed >> ((packed & mask) >> shift) & 1)


def _emit_pair(pair: FieldPair) -> Test:
    left_mask, left_shift, left_values = pair.left.mask, pair.left.shift, pair.left.variable.domain.values
    right_mask, right_shift, right_values = pair.right.mask, pair.right.shift, pair.right.variable.domain.values
    compare, wanted = pair.comparison.compare, pair.wanted
    return lambda packed: (
        compare(left_values[(packed & left_mask) >> left_shift], right_values[(packed & right_mask) >> right_shift])
        is wanted
    )


def _emit_all(parts: tuple[Node, ...]) -> Test:
    """All single values as one cube (mask and bits), the rest one after the other behind it."""
    mask, bits = _cube(parts)
    rest = [_emit(part) for part in parts if not _is_single(part)]
    if not mask:
        return _all_of(rest)
    if not rest:
        return lambda packed: packed & mask == bits
    others = _all_of(rest)
    return lambda packed: packed & mask == bits and others(packed)


def _cube(parts: tuple[Node, ...]) -> tuple[int, int]:
    """The mask and bits of those parts that allow a field only one value."""
    mask = bits = 0
    for part in parts:
        if isinstance(part, OneOf) and _is_single(part):
            mask |= part.field.mask
            bits |= (part.allowed.bit_length() - 1) << part.field.shift
    return mask, bits


def _is_single(part: Node) -> bool:
    return isinstance(part, OneOf) and part.allowed.bit_count() == 1


_MAX_NESTED = 4
"""Up to so many tests are called one inside the other, which is fastest; more of them in a loop."""


def _all_of(tests: list[Test]) -> Test:
    if len(tests) > _MAX_NESTED:
        return lambda packed: all(test(packed) for test in tests)
    return reduce(lambda first, second: lambda packed: first(packed) and second(packed), tests)


def _any_of(tests: list[Test]) -> Test:
    if len(tests) > _MAX_NESTED:
        return lambda packed: any(test(packed) for test in tests)
    return reduce(lambda first, second: lambda packed: first(packed) or second(packed), tests)
