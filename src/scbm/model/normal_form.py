"""The normal form of predicates: conjunctions and disjunctions of literals over the variables of a space.

A variable is its position in the space, a value its index in the domain of the variable. Negations are pushed down to
the literals. A literal restricts one variable to a set of values (`OneOf`) or compares two variables (`Pair`); each
conjunction and each disjunction has at most one `OneOf` per variable. `true` and `false` are Python's. A comparison of
sums of more variables is a case distinction over the values of all but two of them (decision 51).

This is the only normal form: tests of packed states, guards of joint moves, satisfiability and the delete relaxation
are all made from it.
"""

from __future__ import annotations

from itertools import combinations
from math import prod
from typing import TYPE_CHECKING, TypeAlias, assert_never

from msgspec import Struct

from scbm.model.predicates import (
    And,
    Constant,
    Equal,
    Implies,
    LinearForm,
    Member,
    Not,
    NotEqual,
    Or,
    Order,
    Predicate,
    Truth,
    calculates,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.model.values import Value
    from scbm.model.variables import StateSpace, Variable


class OneOf(Struct, frozen=True):
    """The literal that one variable has one of some values.

    Attributes:
        variable: the position of the variable.
        allowed: the values as a set of bits; bit i stands for value i.
        count: how many values the variable has.
    """

    variable: int
    allowed: int
    count: int

    @property
    def all_values(self) -> int:
        """The bits of all values of the variable."""
        return (1 << self.count) - 1


class Pair(Struct, frozen=True):
    """The literal that compares two different variables. It holds no table of pairs: the domains may be large.

    Attributes:
        left: the position of the variable on the left.
        left_values: what is compared for each value of that variable; `None` where the comparison never holds.
        right: the position of the variable on the right.
        right_values: the same for the variable on the right.
        compare: the comparison of two values.
        wanted: the result of the comparison for which the literal holds.
        is_order: whether integers are compared by their order; otherwise the comparison is `==` or `!=`.
    """

    left: int
    left_values: tuple[Value | None, ...]
    right: int
    right_values: tuple[Value | None, ...]
    compare: Callable[[Value, Value], bool]
    wanted: bool
    is_order: bool

    def holds(self, left: Value | None, right: Value | None) -> bool:
        """Return whether the literal holds for these two values."""
        return left is not None and right is not None and self.compare(left, right) is self.wanted

    def row(self, left: int) -> int:
        """Return the indices of the right values that go with the left value of index `left`, as bits."""
        value = self.left_values[left]
        return bits_of(index for index, right in enumerate(self.right_values) if self.holds(value, right))


class AllOf(Struct, frozen=True):
    """A conjunction."""

    parts: tuple[NormalForm, ...]


class AnyOf(Struct, frozen=True):
    """A disjunction."""

    parts: tuple[NormalForm, ...]


NormalForm: TypeAlias = bool | OneOf | Pair | AllOf | AnyOf


def normal_form(predicate: Predicate, space: StateSpace, *, wanted: bool = True) -> NormalForm:
    """Return the normal form of a predicate, or of its negation if it is not `wanted`.

    Raises `KeyError` if the predicate reads a variable that the space does not have.
    """
    match predicate:
        case Truth(truth):
            return truth is wanted
        case Not(operand):
            return normal_form(operand, space, wanted=not wanted)
        case And(operands):
            parts = [normal_form(operand, space, wanted=wanted) for operand in operands]
            return all_of(parts) if wanted else any_of(parts)
        case Or(operands):
            parts = [normal_form(operand, space, wanted=wanted) for operand in operands]
            return any_of(parts) if wanted else all_of(parts)
        case Implies(condition, consequence):
            parts = [
                normal_form(condition, space, wanted=not wanted),
                normal_form(consequence, space, wanted=wanted),
            ]
            return any_of(parts) if wanted else all_of(parts)
        case Equal() | NotEqual() | Order() | Member():
            return _literal(predicate, space, wanted=wanted)
        case _:
            assert_never(predicate)


def _literal(leaf: Equal | NotEqual | Order | Member, space: StateSpace, *, wanted: bool) -> NormalForm:
    names = leaf.reads()
    if not names:
        return leaf.holds({}) is wanted
    if not isinstance(leaf, Member) and (calculates(leaf.left) or calculates(leaf.right)):
        return _SumComparison(leaf, space, wanted).by_cases(())
    left = space.position(names[0])
    values = space.variables[left].domain.values
    if len(names) == 1:
        name = names[0]
        if isinstance(leaf, Equal | NotEqual) and isinstance(leaf.right, Constant):
            is_equal = wanted is isinstance(leaf, Equal)
            return _comparison(leaf.right.constant, space.variables[left], left, wanted=is_equal)
        allowed = bits_of(index for index, value in enumerate(values) if leaf.holds({name: value}) is wanted)
        return one_of(left, allowed, len(values))
    assert not isinstance(leaf, Member)  # noqa: S101 - that reads one variable
    right = space.position(names[1])
    right_values = space.variables[right].domain.values
    return Pair(left, values, right, right_values, leaf.compare, wanted, isinstance(leaf, Order))


def _comparison(value: Value, variable: Variable, position: int, *, wanted: bool) -> NormalForm:
    """Return whether a variable has one value, without a look at the others: its domain may be large."""
    count = len(variable.domain)
    try:
        equal = 1 << variable.domain.index(value)
    except KeyError:
        equal = 0
    return one_of(position, equal if wanted else ((1 << count) - 1) & ~equal, count)


# sums


class _SumComparison:
    """A comparison of integers that were calculated: `left - right` is compared with 0."""

    def __init__(self, leaf: Equal | NotEqual | Order, space: StateSpace, wanted: bool) -> None:  # noqa: FBT001 - as in `Pair`
        self._leaf, self._space, self._wanted = leaf, space, wanted
        self._form = LinearForm.difference(leaf.left, leaf.right)
        self._kept, self._others = _divided(self._form, {name: len(space[name].domain) for name in self._form.reads()})

    def by_cases(self, values: Sequence[Value]) -> NormalForm:
        """Return the comparison where the first of the other variables have these values."""
        if len(values) == len(self._others):
            return self._between(dict(zip(self._others, values, strict=True)))
        position = self._space.position(self._others[len(values)])
        domain = self._space.variables[position].domain
        cases: dict[NormalForm, int] = {}
        for index, value in enumerate(domain.values):
            form = self.by_cases((*values, value))
            cases[form] = cases.get(form, 0) | 1 << index
        return any_of(all_of((one_of(position, bits, len(domain)), form)) for form, bits in cases.items())

    def _between(self, values: Mapping[str, Value]) -> NormalForm:
        """Return the comparison where all other variables have values: a literal about one variable or two."""
        constant = self._form.constant + self._form.value(values, self._others)
        columns = [self._column(name, values) for name in self._kept]
        compare, wanted = self._leaf.compare, self._wanted
        if not columns:
            return compare(constant, 0) is wanted
        left = tuple(constant + value for value in columns[0])
        position = self._space.position(self._kept[0])
        if len(columns) == 1:
            return one_of(position, bits_of(i for i, v in enumerate(left) if compare(v, 0) is wanted), len(left))
        right = tuple(-value for value in columns[1])
        is_order = isinstance(self._leaf, Order)
        return Pair(position, left, self._space.position(self._kept[1]), right, compare, wanted, is_order)

    def _column(self, name: str, values: Mapping[str, Value]) -> tuple[int, ...]:
        domain = self._space[name].domain
        return tuple(self._form.value({**values, name: value}, (*self._others, name), name) for value in domain.values)


def _divided(form: LinearForm, sizes: Mapping[str, int]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return at most two variables to compare, no atom having both, and the others, so that there are few cases."""
    largest = sorted(sizes, key=lambda name: -sizes[name])
    pairs = [pair for pair in combinations(largest, 2) if not any(_has(atom.reads(), pair) for atom, _ in form.factors)]
    kept = max(pairs, key=lambda pair: sizes[pair[0]] * sizes[pair[1]], default=tuple(largest[:1]))
    return kept, tuple(name for name in sizes if name not in kept)


def _has(names: Sequence[str], wanted: Iterable[str]) -> bool:
    return all(name in names for name in wanted)


MAX_SUM_VALUES = 200_000
"""Maximum number of cases of one sum: the normal form of so many takes a second at most."""


def count_cases(leaf: Equal | NotEqual | Order, sizes: Mapping[str, int]) -> int:
    """Return how many values the normal form of a comparison of sums looks at; `sizes` are those of the domains."""
    form = LinearForm.difference(leaf.left, leaf.right)
    kept, others = _divided(form, {name: sizes[name] for name in form.reads()})
    return prod(sizes[name] for name in others) * max(1, sum(sizes[name] for name in kept))


# constructors that simplify


def one_of(variable: int, allowed: int, count: int) -> NormalForm:
    """Return the literal that a variable has one of some values; plain `True` or `False` where that is known."""
    if allowed in (0, (1 << count) - 1):
        return bool(allowed)
    return OneOf(variable, allowed, count)


def all_of(parts: Iterable[NormalForm]) -> NormalForm:
    """Return the conjunction, with one set of values per variable."""
    sets: dict[int, OneOf] = {}
    others: list[NormalForm] = []
    for part in _flattened(parts, AllOf):
        if part is False:
            return False
        if isinstance(part, OneOf):
            known = sets.get(part.variable, part)
            if not known.allowed & part.allowed:
                return False
            sets[part.variable] = OneOf(part.variable, known.allowed & part.allowed, part.count)
        elif part is not True:
            others.append(part)
    return _grouped(AllOf, (*sets.values(), *others), empty=True)


def any_of(parts: Iterable[NormalForm]) -> NormalForm:
    """Return the disjunction, with one set of values per variable."""
    sets: dict[int, OneOf] = {}
    others: list[NormalForm] = []
    for part in _flattened(parts, AnyOf):
        if part is True:
            return True
        if isinstance(part, OneOf):
            known = sets.get(part.variable, part)
            if known.allowed | part.allowed == part.all_values:
                return True
            sets[part.variable] = OneOf(part.variable, known.allowed | part.allowed, part.count)
        elif part is not False:
            others.append(part)
    return _grouped(AnyOf, (*sets.values(), *others), empty=False)


def _flattened(parts: Iterable[NormalForm], group: type[AllOf | AnyOf]) -> Iterable[NormalForm]:
    for part in parts:
        if isinstance(part, group):
            yield from part.parts
        else:
            yield part


def _grouped(group: type[AllOf | AnyOf], parts: tuple[NormalForm, ...], *, empty: bool) -> NormalForm:
    if not parts:
        return empty
    return parts[0] if len(parts) == 1 else group(parts)


def is_cube(form: NormalForm) -> bool:
    """Return whether the form is `true`, or asks for single values of some variables and for nothing else."""
    parts = form.parts if isinstance(form, AllOf) else (form,)
    return all(part is True or (isinstance(part, OneOf) and part.allowed.bit_count() == 1) for part in parts)


def variables_of(form: NormalForm) -> tuple[int, ...]:
    """Return the positions of the variables that the form mentions, each once."""
    found: dict[int, None] = {}
    pending = [form]
    while pending:
        part = pending.pop()
        match part:
            case bool():
                pass
            case OneOf():
                found[part.variable] = None
            case Pair():
                found |= {part.left: None, part.right: None}
            case AllOf() | AnyOf():
                pending += part.parts
            case _:
                assert_never(part)
    return tuple(found)


# sets of values as bits


def allowed_values(form: NormalForm, variable: int) -> int:
    """Return a superset of the values (bits) that the variable has where the form holds; -1 for all values."""
    parts = form.parts if isinstance(form, AllOf) else (form,)
    return next((part.allowed for part in parts if isinstance(part, OneOf) and part.variable == variable), -1)


def bits_of(indices: Iterable[int]) -> int:
    """Return a set of small numbers as bits."""
    bits = 0
    for index in indices:
        bits |= 1 << index
    return bits


def indices_of(bits: int) -> tuple[int, ...]:
    """Return the numbers in a set of bits, in ascending order."""
    found = []
    while bits:
        lowest = bits & -bits
        found.append(lowest.bit_length() - 1)
        bits ^= lowest
    return tuple(found)
