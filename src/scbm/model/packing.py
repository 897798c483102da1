"""States as integers, and predicates and actions as functions on them.

Each variable of a space gets a field of bits that holds the index of its value in its domain. A conjunction of
equalities then becomes one AND and one comparison, the assignments of a transition one AND and one OR. Exact:
a packed function gives what the predicate or the actions give on the named state (held by property tests).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import TYPE_CHECKING, TypeAlias

from scbm.model.actions import Action, Add, Assign
from scbm.model.predicates import (
    And,
    Constant,
    Equal,
    Implies,
    Member,
    Not,
    NotEqual,
    Or,
    Order,
    Predicate,
    Truth,
)
from scbm.model.state import State

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from scbm.model.values import Value
    from scbm.model.variables import StateSpace, Variable

    Test: TypeAlias = Callable[[int], bool]
    Update: TypeAlias = Callable[[int], int | None]


@dataclass(frozen=True, slots=True)
class Field:
    """Where a variable lies in a packed state.

    Attributes:
        variable: what is packed there.
        shift: the lowest bit.
        width: how many bits; 0 for a domain of one value.
        mask: all its bits, in place.
    """

    variable: Variable
    shift: int
    width: int
    mask: int

    def bits(self, value: Value) -> int:
        """The value, in place. Raises `ValueError` if it is outside the domain."""
        return self.variable.domain.values.index(value) << self.shift

    def index(self, packed: int) -> int:
        """Which value of the domain the packed state has here."""
        return (packed & self.mask) >> self.shift


class Packing:
    """The fields of a space. Immutable; everything it returns is a pure function."""

    def __init__(self, space: StateSpace) -> None:
        self.space = space
        self.fields = _lay_out(space)
        self._by_bit = {bit: field for field in self.fields for bit in range(field.shift, field.shift + field.width)}

    def __getitem__(self, name: str) -> Field:
        return self.fields[self.space.position(name)]

    def pack(self, state: Mapping[str, Value]) -> int:
        """The state as an integer. `state` may have more variables than the space."""
        packed = 0
        for field in self.fields:
            packed |= field.bits(state[field.variable.name])
        return packed

    def value(self, packed: int, name: str) -> Value:
        """What the variable is in the packed state."""
        field = self[name]
        return field.variable.domain.values[field.index(packed)]

    def values(self, packed: int) -> dict[str, Value]:
        """All variables of the packed state by name, in order."""
        return {
            field.variable.name: field.variable.domain.values[(packed & field.mask) >> field.shift]
            for field in self.fields
        }

    def unpack(self, packed: int) -> State:
        """The packed state, with names."""
        return State(self.space, self.values(packed))

    def changes(self, before: int, after: int) -> tuple[tuple[str, Value], ...]:
        """The variables that differ, in order, with what they are in `after`."""
        changes = []
        difference = before ^ after
        while difference:
            field = self._by_bit[(difference & -difference).bit_length() - 1]
            variable, mask = field.variable, field.mask
            changes.append((variable.name, variable.domain.values[(after & mask) >> field.shift]))
            difference &= ~mask
        return tuple(changes)

    def assignment(self, values: Mapping[str, Value]) -> tuple[int, int]:
        """`(keep, bits)`, so that `packed & keep | bits` has these values and all others as before."""
        mask = bits = 0
        for name, value in values.items():
            mask |= self[name].mask
            bits |= self[name].bits(value)
        return ~mask, bits

    def test(self, predicate: Predicate) -> Test:
        """The predicate as a function of packed states."""
        return _emit(_normalize(predicate, True, self))

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


def _lay_out(space: StateSpace) -> tuple[Field, ...]:
    fields = []
    shift = 0
    for variable in space:
        width = (len(variable.domain) - 1).bit_length()
        fields.append(Field(variable, shift, width, ((1 << width) - 1) << shift))
        shift += width
    return tuple(fields)


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


# Predicates are first normalized: negations pushed down, and every leaf over one variable turned into the set of
# values that satisfy it. Sets of one variable meet in conjunctions and join in disjunctions.


@dataclass(frozen=True, slots=True)
class _OneOf:
    """One field has one of some values; bit i of `allowed` stands for value i of its domain."""

    field: Field
    allowed: int

    @property
    def all_values(self) -> int:
        return (1 << len(self.field.variable.domain)) - 1


@dataclass(frozen=True, slots=True)
class _Pair:
    """Two fields have values that a relation allows: `table[i]` are the right indices allowed for left index i."""

    left: Field
    right: Field
    table: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class _All:
    parts: tuple[_Node, ...]


@dataclass(frozen=True, slots=True)
class _Any:
    parts: tuple[_Node, ...]


_Node: TypeAlias = bool | _OneOf | _Pair | _All | _Any


def _normalize(predicate: Predicate, wanted: bool, packing: Packing) -> _Node:  # noqa: FBT001 - polarity
    match predicate:
        case Truth(truth):
            return truth is wanted
        case Not(operand):
            return _normalize(operand, not wanted, packing)
        case And(operands):
            parts = [_normalize(operand, wanted, packing) for operand in operands]
            return _meet(parts) if wanted else _join(parts)
        case Or(operands):
            parts = [_normalize(operand, wanted, packing) for operand in operands]
            return _join(parts) if wanted else _meet(parts)
        case Implies(condition, consequence):
            parts = [_normalize(condition, not wanted, packing), _normalize(consequence, wanted, packing)]
            return _join(parts) if wanted else _meet(parts)
        case Equal() | NotEqual() | Order() | Member():
            return _leaf(predicate, wanted, packing)


def _leaf(leaf: Equal | NotEqual | Order | Member, wanted: bool, packing: Packing) -> _Node:  # noqa: FBT001
    """A leaf reads at most two variables, so its truth is a table over their values."""
    fields = [packing[name] for name in leaf.reads()]
    if not fields:
        return leaf.holds({}) is wanted
    left = fields[0]
    if len(fields) == 1:
        return _one_of(left, _satisfying(leaf, {}, left, wanted=wanted))
    right = fields[1]
    rows = [
        _satisfying(leaf, {left.variable.name: value}, right, wanted=wanted) for value in left.variable.domain.values
    ]
    return _Pair(left, right, tuple(rows))


def _satisfying(leaf: Equal | NotEqual | Order | Member, known: dict[str, Value], field: Field, *, wanted: bool) -> int:
    """The values of the field, as bits, for which the leaf is as wanted."""
    allowed = 0
    for index, value in enumerate(field.variable.domain.values):
        if leaf.holds({**known, field.variable.name: value}) is wanted:
            allowed |= 1 << index
    return allowed


def _one_of(field: Field, allowed: int) -> _Node:
    node = _OneOf(field, allowed)
    if allowed in (0, node.all_values):
        return bool(allowed)
    return node


def _meet(parts: Iterable[_Node]) -> _Node:
    """The conjunction, with one set of values for each variable."""
    sets: dict[str, _OneOf] = {}
    others: list[_Node] = []
    for part in _flattened(parts, _All):
        if part is False:
            return False
        if isinstance(part, _OneOf):
            known = sets.get(part.field.variable.name, _OneOf(part.field, part.all_values))
            merged = _one_of(part.field, known.allowed & part.allowed)
            if isinstance(merged, bool):
                return False  # two different sets of one variable meet in nothing
            sets[part.field.variable.name] = _OneOf(part.field, known.allowed & part.allowed)
        elif part is not True:
            others.append(part)
    return _grouped(_All, [*sets.values(), *others], empty=True)


def _join(parts: Iterable[_Node]) -> _Node:
    """The disjunction, with one set of values for each variable."""
    sets: dict[str, _OneOf] = {}
    others: list[_Node] = []
    for part in _flattened(parts, _Any):
        if part is True:
            return True
        if isinstance(part, _OneOf):
            known = sets.get(part.field.variable.name, _OneOf(part.field, 0))
            if known.allowed | part.allowed == part.all_values:
                return True
            sets[part.field.variable.name] = _OneOf(part.field, known.allowed | part.allowed)
        elif part is not False:
            others.append(part)
    return _grouped(_Any, [*sets.values(), *others], empty=False)


def _flattened(parts: Iterable[_Node], group: type[_All | _Any]) -> Iterable[_Node]:
    for part in parts:
        if isinstance(part, group):
            yield from part.parts
        else:
            yield part


def _grouped(group: type[_All | _Any], parts: list[_Node], *, empty: bool) -> _Node:
    if not parts:
        return empty
    return parts[0] if len(parts) == 1 else group(tuple(parts))


def _emit(node: _Node) -> Test:
    match node:
        case bool():
            return lambda _: node
        case _OneOf():
            return _emit_one_of(node)
        case _Pair(left, right, table):
            return _emit_pair(left, right, table)
        case _Any(parts):
            return reduce(_either, [_emit(part) for part in parts])
        case _All(parts):
            return _emit_all(parts)


def _emit_one_of(node: _OneOf) -> Test:
    mask, shift, allowed = node.field.mask, node.field.shift, node.allowed
    if allowed.bit_count() == 1:
        bits = (allowed.bit_length() - 1) << shift
        return lambda packed: packed & mask == bits
    refused = node.all_values & ~allowed
    if refused.bit_count() == 1:
        bits = (refused.bit_length() - 1) << shift
        return lambda packed: packed & mask != bits
    return lambda packed: bool(allowed >> ((packed & mask) >> shift) & 1)


def _emit_pair(left: Field, right: Field, table: tuple[int, ...]) -> Test:
    left_mask, left_shift, right_mask, right_shift = left.mask, left.shift, right.mask, right.shift
    return lambda packed: bool(table[(packed & left_mask) >> left_shift] >> ((packed & right_mask) >> right_shift) & 1)


def _emit_all(parts: tuple[_Node, ...]) -> Test:
    """All single values as one cube (mask and bits), the rest one after the other behind it."""
    mask = bits = 0
    rest: list[Test] = []
    for part in parts:
        if isinstance(part, _OneOf) and part.allowed.bit_count() == 1:
            mask |= part.field.mask
            bits |= (part.allowed.bit_length() - 1) << part.field.shift
        else:
            rest.append(_emit(part))
    if not mask:
        return reduce(_both, rest)
    if not rest:
        return lambda packed: packed & mask == bits
    others = reduce(_both, rest)
    return lambda packed: packed & mask == bits and others(packed)


def _both(first: Test, second: Test) -> Test:
    return lambda packed: first(packed) and second(packed)


def _either(first: Test, second: Test) -> Test:
    return lambda packed: first(packed) or second(packed)
