"""Conditions: what a predicate asks of the values that variables had before some actions.

A variable is a position in a space; a value is an index. Behind actions each variable is a function of one variable
as it was before (an `Image`), so that every predicate on what they leave is a condition on what they find.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

from scbm.model.normal_form import AllOf as AllNodes
from scbm.model.normal_form import AnyOf as AnyNodes
from scbm.model.normal_form import FieldPair, Node, OneOf
from scbm.model.predicates import Order

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.model import Value


@dataclass(frozen=True, slots=True)
class Image:
    """What a variable is behind some actions.

    Attributes:
        source: the variable before the actions that it depends on.
        table: for each value of the source an index in the domain of the variable; `None` outside of the domain.
    """

    source: int
    table: tuple[int | None, ...]


@dataclass(frozen=True, slots=True)
class Among:
    """A variable has one of some values; bit i of `allowed` stands for value i of `count`."""

    variable: int
    allowed: int
    count: int


@dataclass(frozen=True, slots=True)
class Related:
    """Two different variables have values that stand in a relation.

    Attributes:
        left_values: what is compared, for each value of the left variable; `None` is never so related.
        right_values: the same of the right variable.
        compare: the comparison of two values.
        wanted: what the comparison has to say.
        ordered: whether it compares integers by their order; otherwise it asks whether values are the same.
    """

    left: int
    left_values: tuple[Value | None, ...]
    right: int
    right_values: tuple[Value | None, ...]
    compare: Callable[[Value, Value], bool]
    wanted: bool
    ordered: bool

    def holds(self, left: Value | None, right: Value | None) -> bool:
        """Whether these two go together."""
        return left is not None and right is not None and self.compare(left, right) is self.wanted

    def row(self, left: int) -> int:
        """The indices of right values that go with a left one, as bits."""
        value = self.left_values[left]
        return bits_of(index for index, right in enumerate(self.right_values) if self.holds(value, right))


@dataclass(frozen=True, slots=True)
class Conjunction:
    """All parts hold. Of each variable there is one `Among` at most."""

    parts: tuple[Condition, ...]


@dataclass(frozen=True, slots=True)
class Disjunction:
    """One part holds."""

    parts: tuple[Condition, ...]


Condition: TypeAlias = bool | Among | Related | Conjunction | Disjunction


def bits_of(indices: Iterable[int]) -> int:
    """A set of small numbers as bits."""
    bits = 0
    for index in indices:
        bits |= 1 << index
    return bits


def indices_of(bits: int) -> tuple[int, ...]:
    """The numbers of a set of bits, in order."""
    found = []
    while bits:
        lowest = bits & -bits
        found.append(lowest.bit_length() - 1)
        bits ^= lowest
    return tuple(found)


def among(variable: int, allowed: int, count: int) -> Condition:
    """The variable has one of the values; plain `True` or `False` where that is known."""
    if allowed in (0, (1 << count) - 1):
        return bool(allowed)
    return Among(variable, allowed, count)


def all_of(parts: Iterable[Condition]) -> Condition:
    """All of the parts, in their simplest form."""
    sets: dict[int, Among] = {}
    others: list[Condition] = []
    for part in _flat(parts, Conjunction):
        if part is False:
            return False
        if isinstance(part, Among):
            known = sets.get(part.variable, part)
            if not known.allowed & part.allowed:
                return False
            sets[part.variable] = Among(part.variable, known.allowed & part.allowed, part.count)
        elif part is not True:
            others.append(part)
    return _group(Conjunction, (*sets.values(), *others), empty=True)


def any_of(parts: Iterable[Condition]) -> Condition:
    """One of the parts, in its simplest form."""
    sets: dict[int, Among] = {}
    others: list[Condition] = []
    for part in _flat(parts, Disjunction):
        if part is True:
            return True
        if isinstance(part, Among):
            known = sets.get(part.variable, part)
            if among(part.variable, known.allowed | part.allowed, part.count) is True:
                return True
            sets[part.variable] = Among(part.variable, known.allowed | part.allowed, part.count)
        elif part is not False:
            others.append(part)
    return _group(Disjunction, (*sets.values(), *others), empty=False)


def _flat(parts: Iterable[Condition], group: type[Conjunction | Disjunction]) -> Iterable[Condition]:
    for part in parts:
        if isinstance(part, group):
            yield from part.parts
        else:
            yield part


def _group(group: type[Conjunction | Disjunction], parts: tuple[Condition, ...], *, empty: bool) -> Condition:
    if not parts:
        return empty
    return parts[0] if len(parts) == 1 else group(parts)


def through(node: Node, images: Mapping[str, Image]) -> Condition:
    """What a predicate on the state behind some actions asks of the state before them."""
    match node:
        case bool():
            return node
        case OneOf(field, allowed):
            return _source_among(images[field.variable.name], lambda index: bool(allowed >> index & 1))
        case FieldPair():
            return _related(node, images[node.left.variable.name], images[node.right.variable.name])
        case AllNodes(parts):
            return all_of(through(part, images) for part in parts)
        case AnyNodes(parts):
            return any_of(through(part, images) for part in parts)


def fits(image: Image) -> Condition:
    """That the variable is inside its domain."""
    return _source_among(image, lambda _: True)


def _source_among(image: Image, allows: Callable[[int], bool]) -> Condition:
    allowed = bits_of(i for i, index in enumerate(image.table) if index is not None and allows(index))
    return among(image.source, allowed, len(image.table))


def _related(pair: FieldPair, left: Image, right: Image) -> Condition:
    left_values = _values(left, pair.left.variable.domain.values)
    right_values = _values(right, pair.right.variable.domain.values)
    compare, ordered = pair.comparison.compare, isinstance(pair.comparison, Order)
    related = Related(left.source, left_values, right.source, right_values, compare, pair.wanted, ordered)
    if left.source != right.source:
        return related
    both = enumerate(zip(left_values, right_values, strict=True))
    return among(left.source, bits_of(i for i, (one, other) in both if related.holds(one, other)), len(left_values))


def _values(image: Image, domain: Sequence[Value]) -> tuple[Value | None, ...]:
    return tuple(None if index is None else domain[index] for index in image.table)


def allowed(condition: Condition, variable: int) -> int:
    """The values of the variable, as bits, outside of which the condition surely does not hold; -1 for all."""
    if isinstance(condition, Conjunction):
        return next((allowed(part, variable) for part in condition.parts if _is_about(part, variable)), -1)
    return condition.allowed if isinstance(condition, Among) and condition.variable == variable else -1


def _is_about(condition: Condition, variable: int) -> bool:
    return isinstance(condition, Among) and condition.variable == variable


def satisfiable(condition: Condition, values: Sequence[int]) -> bool:
    """Whether the condition can hold if each variable has one of some values (bits), whatever the others have.

    `False` is sure. `True` is not: parts of a conjunction are looked at one by one.
    """
    match condition:
        case bool():
            return condition
        case Among():
            return bool(condition.allowed & values[condition.variable])
        case Related():
            return _may_relate(condition, values)
        case Conjunction(parts):
            return all(satisfiable(part, values) for part in parts)
        case Disjunction(parts):
            return any(satisfiable(part, values) for part in parts)


def _may_relate(related: Related, values: Sequence[int]) -> bool:
    """Orders are decided by the extremes of both sides; sameness by whether the sides meet."""
    left = [v for i in indices_of(values[related.left]) if (v := related.left_values[i]) is not None]
    right = [v for i in indices_of(values[related.right]) if (v := related.right_values[i]) is not None]
    if not left or not right:
        return False
    if related.ordered:
        ends = (min(map(int, right)), max(map(int, right)))
        return any(related.holds(one, other) for one in (min(map(int, left)), max(map(int, left))) for other in ends)
    if related.holds(left[0], left[0]):
        return not frozenset(left).isdisjoint(right)
    return any(value != left[0] for value in (*left, *right))


def restricted(condition: Condition, values: Sequence[tuple[int, ...]]) -> Condition:
    """The same condition where each variable has only some of its values, which are numbered anew."""
    match condition:
        case bool():
            return condition
        case Among(variable, bits, _):
            kept = values[variable]
            return among(variable, bits_of(i for i, old in enumerate(kept) if bits >> old & 1), len(kept))
        case Related():
            return _restricted_relation(condition, values)
        case Conjunction(parts):
            return all_of(restricted(part, values) for part in parts)
        case Disjunction(parts):
            return any_of(restricted(part, values) for part in parts)


def _restricted_relation(related: Related, values: Sequence[tuple[int, ...]]) -> Condition:
    left = tuple(related.left_values[old] for old in values[related.left])
    right = tuple(related.right_values[old] for old in values[related.right])
    if len(left) == 1:
        row = bits_of(i for i, value in enumerate(right) if related.holds(left[0], value))
        return among(related.right, row, len(right))
    if len(right) == 1:
        row = bits_of(i for i, value in enumerate(left) if related.holds(value, right[0]))
        return among(related.left, row, len(left))
    return replace(related, left_values=left, right_values=right)
