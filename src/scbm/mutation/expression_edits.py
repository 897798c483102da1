"""Small changes of predicates, sums, `min` and `max`: another conjunct, value, variable or sign; and of any tuples."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeVar, assert_never

from msgspec.structs import replace

from scbm.model import (
    And,
    Constant,
    Equal,
    Extreme,
    ExtremeKind,
    Implies,
    Member,
    Not,
    NotEqual,
    Or,
    Order,
    Predicate,
    Reference,
    Sum,
    Term,
    Truth,
    ValueKind,
)
from scbm.model.predicates import TRUE, bounds, calculates

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from scbm.model import StateSpace, Value, Variable

    TermEdit = Callable[[Term], Iterable[Term]]

    Leaf = Equal | NotEqual | Order | Member
    LeafEdit = Callable[[Leaf], Iterable[Leaf]]


T = TypeVar("T")


class ChangedPredicate(NamedTuple):
    """A predicate in which one comparison was changed.

    Attributes:
        old: the comparison before.
        new: the one in its place.
        whole: the whole predicate afterwards.
    """

    old: Predicate
    new: Predicate
    whole: Predicate

    def within(self, whole: Predicate) -> ChangedPredicate:
        """Return the change of the same comparison in a larger predicate."""
        return self._replace(whole=whole)


def conjuncts_of(predicate: Predicate) -> tuple[Predicate, ...]:
    """Return the conjuncts of a predicate, nested ones too; none of `true`."""
    if isinstance(predicate, And):
        return tuple(part for operand in predicate.operands for part in conjuncts_of(operand))
    return () if predicate == TRUE else (predicate,)


def comparisons_of(predicate: Predicate) -> Iterator[Leaf]:
    """Yield all comparisons in a predicate."""
    match predicate:
        case Truth():
            return
        case Equal() | NotEqual() | Order() | Member():
            yield predicate
        case Not(operand):
            yield from comparisons_of(operand)
        case And(operands) | Or(operands):
            yield from (leaf for operand in operands for leaf in comparisons_of(operand))
        case Implies(condition, consequence):
            yield from comparisons_of(condition)
            yield from comparisons_of(consequence)
        case _:
            assert_never(predicate)


def with_other_leaf(predicate: Predicate, edit: LeafEdit) -> Iterator[ChangedPredicate]:
    """Yield the predicate with one comparison changed, for each comparison and each change of it by `edit`."""
    match predicate:
        case Truth():
            return
        case Equal() | NotEqual() | Order() | Member():
            yield from (ChangedPredicate(predicate, leaf, leaf) for leaf in edit(predicate))
        case Not(operand):
            yield from (each.within(Not(each.whole)) for each in with_other_leaf(operand, edit))
        case And(operands) | Or(operands):
            for index, operand in enumerate(operands):
                for each in with_other_leaf(operand, edit):
                    yield each.within(type(predicate)(replaced(operands, index, each.whole)))
        case Implies(condition, consequence):
            yield from (e.within(Implies(e.whole, consequence)) for e in with_other_leaf(condition, edit))
            yield from (e.within(Implies(condition, e.whole)) for e in with_other_leaf(consequence, edit))
        case _:
            assert_never(predicate)


def other_values(leaf: Leaf, space: StateSpace) -> Iterator[Leaf]:
    """Yield a comparison for equality with the next value of the domain instead of each of its values."""
    if isinstance(leaf, Member):
        listed = [member.constant for member in leaf.members]
        for index, member in enumerate(leaf.members):
            for value in _next_value(member, space[leaf.variable.name].domain.values, listed):
                yield Member(leaf.variable, replaced(leaf.members, index, value))
    elif not isinstance(leaf, Order):
        for variable, constant, side in _constants(leaf, space):
            for value in _next_value(constant, variable.domain.values):
                yield _with_constant(leaf, side, value)


def _constants(leaf: Equal | NotEqual | Order, space: StateSpace) -> Iterator[tuple[Variable, Constant, str]]:
    """Yield the variable and the constant of a comparison of these two, and the side of the constant."""
    match leaf.left, leaf.right:
        case Reference(name), Constant() as constant:
            yield space[name], constant, "right"
        case Constant() as constant, Reference(name):
            yield space[name], constant, "left"
        case _:
            return


def _with_constant(leaf: Equal | NotEqual | Order, side: str, value: Constant) -> Leaf:
    return replace(leaf, left=value) if side == "left" else replace(leaf, right=value)


def _next_value(constant: Constant, values: Sequence[Value], excluded: Sequence[Value] = ()) -> Iterator[Constant]:
    for value in after(constant.constant, values):
        if value not in excluded:
            yield Constant(value)
            return


def after(item: T, items: Sequence[T]) -> Iterator[T]:
    """Yield the items after the given one, then those before it."""
    index = items.index(item)
    yield from items[index + 1 :]
    yield from items[:index]


def other_variables(leaf: Leaf, space: StateSpace) -> Iterator[Leaf]:
    """Yield a comparison of the next variable with the same domain and role instead of each of its variables."""
    if isinstance(leaf, Member):
        yield from (replace(leaf, variable=other) for other in _alike(leaf.variable, leaf.variable, space))
    else:
        yield from (replace(leaf, left=other) for other in _next_variable(leaf.left, leaf.right, space))
        yield from (replace(leaf, right=other) for other in _next_variable(leaf.right, leaf.left, space))


def _next_variable(term: Term, opposite: Term, space: StateSpace) -> Iterator[Term]:
    """Yield `term` with the next variable in place of each of its variables; nothing where no variable can be there."""
    yield from with_other_part(term, lambda part: _alike(part, opposite, space))


def _alike(term: Term, opposite: Term, space: StateSpace) -> Iterator[Reference]:
    """Yield the next variable that can take the place of `term`; none if `term` is a value, or no variable can."""
    if isinstance(term, Reference):
        variable = space[term.name]
        for other in after(variable, space.variables):
            if _are_alike(variable, other) and Reference(other.name) != opposite:
                yield Reference(other.name)
                return


def _are_alike(variable: Variable, other: Variable) -> bool:
    return variable.role is other.role and variable.domain == other.domain


def other_thresholds(leaf: Leaf, space: StateSpace) -> Iterator[Leaf]:
    """Yield a comparison of a variable with an integer one less and one greater, as far as the domain goes."""
    if isinstance(leaf, Member):
        return
    for variable, constant, side in _constants(leaf, space):
        yield from (_with_constant(leaf, side, value) for value in _neighbours(constant, variable))
    if calculates(leaf.left) or calculates(leaf.right):
        yield from (replace(leaf, left=o) for o in other_constants(leaf.left) if can_meet(o, leaf.right, space))
        yield from (replace(leaf, right=o) for o in other_constants(leaf.right) if can_meet(leaf.left, o, space))


def _neighbours(constant: Constant, variable: Variable) -> Iterator[Constant]:
    if variable.domain.kind is ValueKind.INTEGER:
        changed = (int(constant.constant) + step for step in (-1, 1))
        yield from (Constant(value) for value in changed if value in variable.domain)


def replaced(items: tuple[T, ...], index: int, *others: T) -> tuple[T, ...]:
    """Return the items with `others` in place of the one at `index`; without that one if there are no others."""
    return (*items[:index], *others, *items[index + 1 :])


def with_other_part(term: Term, edit: TermEdit) -> Iterator[Term]:
    """Yield the term with one variable or constant in it changed, for each of them and each change of it by `edit`."""
    match term:
        case Reference() | Constant():
            yield from edit(term)
        case Sum(parts):
            for index, (sign, part) in enumerate(parts):
                for other in with_other_part(part, edit):
                    yield Sum(replaced(parts, index, (sign, other)))
        case Extreme(kind, terms):
            for index, part in enumerate(terms):
                for other in with_other_part(part, edit):
                    yield Extreme(kind, replaced(terms, index, other))
        case _:
            assert_never(term)


def other_constants(term: Term) -> Iterator[Term]:
    """Yield the term with each constant in it one less and one greater."""
    yield from with_other_part(term, _changed_constant)


def _changed_constant(term: Term) -> Iterator[Term]:
    if isinstance(term, Constant):
        yield from (Constant(int(term.constant) + step) for step in (-1, 1))


def other_calculations(term: Term) -> Iterator[Term]:
    """Yield the term with the other sign of each part, and with `max` in place of `min`; only on its outside."""
    match term:
        case Sum(parts):
            for index, (sign, part) in enumerate(parts):
                if index:
                    yield Sum.of(replaced(parts, index, (-sign, part)))
        case Extreme(kind, terms):
            other = ExtremeKind.GREATEST if kind is ExtremeKind.LEAST else ExtremeKind.LEAST
            yield Extreme(other, terms)
        case Reference() | Constant():
            return
        case _:
            assert_never(term)


def can_meet(left: Term, right: Term, space: StateSpace) -> bool:
    """Return whether two integer terms may have a common value, which a model file asks for (semantics 2.2)."""
    domains = {name: space[name].domain for name in (*left.reads(), *right.reads())}
    (low, high), (least, most) = bounds(left, domains), bounds(right, domains)
    return max(low, least) <= min(high, most)
