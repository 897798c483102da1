"""Predicates in a normal form over the fields of packed states.

Negations are pushed down to the leaves, and every leaf over one variable becomes the set of values that satisfy it.
Sets of one variable meet in conjunctions and join in disjunctions. `true` and `false` are Python's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, TypeAlias

from scbm.model.predicates import And, Equal, Implies, Member, Not, NotEqual, Or, Order, Predicate, Truth

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.model.bit_fields import Field
    from scbm.model.values import Value


class BitFields(Protocol):
    """Where each variable lies."""

    def __getitem__(self, name: str) -> Field: ...


@dataclass(frozen=True, slots=True)
class OneOf:
    """One field has one of some values; bit i of `allowed` stands for value i of its domain."""

    field: Field
    allowed: int

    @property
    def all_values(self) -> int:
        """The bits of the whole domain."""
        return (1 << len(self.field.variable.domain)) - 1


@dataclass(frozen=True, slots=True)
class FieldPair:
    """Two fields have values for which a comparison is as wanted. No table: the domains may be large."""

    left: Field
    right: Field
    comparison: Equal | NotEqual | Order
    wanted: bool

    def holds(self, left: Value, right: Value) -> bool:
        """Whether these two values go together."""
        values = {self.left.variable.name: left, self.right.variable.name: right}
        return self.comparison.holds(values) is self.wanted

    def row(self, left: Value) -> int:
        """The right values that go with a left one, as bits."""
        known = {self.left.variable.name: left}
        return _satisfying(self.comparison, known, self.right, wanted=self.wanted)


@dataclass(frozen=True, slots=True)
class AllOf:
    """All parts hold."""

    parts: tuple[Node, ...]


@dataclass(frozen=True, slots=True)
class AnyOf:
    """One part holds."""

    parts: tuple[Node, ...]


Node: TypeAlias = bool | OneOf | FieldPair | AllOf | AnyOf


def normal_form(predicate: Predicate, wanted: bool, fields: BitFields) -> Node:  # noqa: FBT001 - polarity
    """The normal form of a predicate, or of its negation if it is not `wanted`."""
    match predicate:
        case Truth(truth):
            return truth is wanted
        case Not(operand):
            return normal_form(operand, not wanted, fields)
        case And(operands):
            parts = [normal_form(operand, wanted, fields) for operand in operands]
            return _meet(parts) if wanted else _join(parts)
        case Or(operands):
            parts = [normal_form(operand, wanted, fields) for operand in operands]
            return _join(parts) if wanted else _meet(parts)
        case Implies(condition, consequence):
            parts = [normal_form(condition, not wanted, fields), normal_form(consequence, wanted, fields)]
            return _join(parts) if wanted else _meet(parts)
        case Equal() | NotEqual() | Order() | Member():
            return _leaf(predicate, wanted, fields)


def _leaf(leaf: Equal | NotEqual | Order | Member, wanted: bool, fields: BitFields) -> Node:  # noqa: FBT001
    """A leaf reads at most two variables, so its truth is a table over their values."""
    read = [fields[name] for name in leaf.reads()]
    if not read:
        return leaf.holds({}) is wanted
    left = read[0]
    if len(read) == 1:
        return _one_of(left, _satisfying(leaf, {}, left, wanted=wanted))
    assert not isinstance(leaf, Member)  # noqa: S101 - that reads one variable
    return FieldPair(left, read[1], leaf, wanted)


def _satisfying(leaf: Equal | NotEqual | Order | Member, known: dict[str, Value], field: Field, *, wanted: bool) -> int:
    """The values of the field, as bits, for which the leaf is as wanted."""
    allowed = 0
    for index, value in enumerate(field.variable.domain.values):
        if leaf.holds({**known, field.variable.name: value}) is wanted:
            allowed |= 1 << index
    return allowed


def _one_of(field: Field, allowed: int) -> Node:
    node = OneOf(field, allowed)
    if allowed in (0, node.all_values):
        return bool(allowed)
    return node


def _meet(parts: Iterable[Node]) -> Node:
    """The conjunction, with one set of values for each variable."""
    sets: dict[str, OneOf] = {}
    others: list[Node] = []
    for part in _flattened(parts, AllOf):
        if part is False:
            return False
        if isinstance(part, OneOf):
            known = sets.get(part.field.variable.name, OneOf(part.field, part.all_values))
            merged = _one_of(part.field, known.allowed & part.allowed)
            if isinstance(merged, bool):
                return False  # two different sets of one variable meet in nothing
            sets[part.field.variable.name] = OneOf(part.field, known.allowed & part.allowed)
        elif part is not True:
            others.append(part)
    return _grouped(AllOf, [*sets.values(), *others], empty=True)


def _join(parts: Iterable[Node]) -> Node:
    """The disjunction, with one set of values for each variable."""
    sets: dict[str, OneOf] = {}
    others: list[Node] = []
    for part in _flattened(parts, AnyOf):
        if part is True:
            return True
        if isinstance(part, OneOf):
            known = sets.get(part.field.variable.name, OneOf(part.field, 0))
            if known.allowed | part.allowed == part.all_values:
                return True
            sets[part.field.variable.name] = OneOf(part.field, known.allowed | part.allowed)
        elif part is not False:
            others.append(part)
    return _grouped(AnyOf, [*sets.values(), *others], empty=False)


def _flattened(parts: Iterable[Node], group: type[AllOf | AnyOf]) -> Iterable[Node]:
    for part in parts:
        if isinstance(part, group):
            yield from part.parts
        else:
            yield part


def _grouped(group: type[AllOf | AnyOf], parts: list[Node], *, empty: bool) -> Node:
    if not parts:
        return empty
    return parts[0] if len(parts) == 1 else group(tuple(parts))
