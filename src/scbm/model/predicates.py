"""Predicates: the paper's equality logic, and the notation that expands to it (paper, Section II; semantics 2).

The grammar of the paper is `F: F && F | F || F | !F | atom`, `atom: term == term | true | false`,
`term: variable | value`. `!=`, `->`, `in {…}` and the order on integers can be expressed in it; they are kept as
written, so that a predicate prints back to its source. Precedence, tightest first: sums, comparison, `!`, `&&`, `||`,
`->` (to the right).

Other terms calculate with integers of any size: only comparisons and assignments look at domains (decision 51).
"""

from __future__ import annotations

import operator
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, TypeAlias, assert_never

from msgspec import Struct

from scbm.model.values import Value, format_value, kind_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.model.values import Domain

    Valuation: TypeAlias = Mapping[str, Value]


# terms


class Reference(Struct, frozen=True):
    """A term that reads a variable."""

    name: str

    def value(self, state: Valuation) -> Value:
        """Return the value of the variable in `state`."""
        return state[self.name]

    def reads(self) -> tuple[str, ...]:
        """Return the name of the variable."""
        return (self.name,)

    def __str__(self) -> str:
        return self.name


@dataclass(frozen=True, slots=True, eq=False)
class Constant:
    """A term that is a value."""

    constant: Value

    def value(self, _: Valuation) -> Value:
        """Return the constant."""
        return self.constant

    def reads(self) -> tuple[str, ...]:
        """Return no names."""
        return ()

    def __eq__(self, other: object) -> bool:
        # True == 1 to Python; to this language they are different values.
        return (
            isinstance(other, Constant)
            and kind_of(self.constant) is kind_of(other.constant)
            and self.constant == other.constant
        )

    def __hash__(self) -> int:
        return hash((kind_of(self.constant), self.constant))

    def __str__(self) -> str:
        return format_value(self.constant)


class Sum(Struct, frozen=True):
    """`a + b - c`: integers that are added and subtracted.

    Attributes:
        parts: each term with its sign, 1 or -1; two or more, the first with 1.
    """

    parts: tuple[tuple[int, Term], ...]

    @staticmethod
    def of(parts: Iterable[tuple[int, Term]]) -> Sum:
        """Return a sum with brackets only where a sum is subtracted, as files are read."""
        flat: list[tuple[int, Term]] = []
        for sign, term in parts:
            flat += term.parts if sign > 0 and isinstance(term, Sum) else [(sign, term)]
        return Sum(tuple(flat))

    def value(self, state: Valuation) -> int:
        """Return the sum; it may be outside every domain."""
        return sum(sign * int(term.value(state)) for sign, term in self.parts)

    def reads(self) -> tuple[str, ...]:
        """Return the variables of the parts."""
        return names_of(term for _, term in self.parts)

    def __str__(self) -> str:
        (_, first), *others = self.parts
        return " ".join([_operand(first), *(f"{'+' if sign > 0 else '-'} {_operand(term)}" for sign, term in others)])


class ExtremeKind(StrEnum):
    """Whether an `Extreme` is the least or the greatest of its integers."""

    LEAST = "min"
    GREATEST = "max"


class Extreme(Struct, frozen=True):
    """`min(a, b, …)` or `max(a, b, …)`: the least or the greatest of two terms or more."""

    kind: ExtremeKind
    terms: tuple[Term, ...]

    def value(self, state: Valuation) -> int:
        """Return the least or the greatest value of the terms."""
        return _chooser(self.kind)(int(term.value(state)) for term in self.terms)

    def reads(self) -> tuple[str, ...]:
        """Return the variables of the terms."""
        return names_of(self.terms)

    def __str__(self) -> str:
        return f"{self.kind}({', '.join(map(str, self.terms))})"


Term: TypeAlias = Reference | Constant | Sum | Extreme
"""What a comparison compares."""


def names_of(terms: Iterable[Term]) -> tuple[str, ...]:
    """Return the names that the terms read, each once, in order of first occurrence."""
    return tuple(dict.fromkeys(name for term in terms for name in term.reads()))


def _operand(term: Term) -> str:
    return f"({term})" if isinstance(term, Sum) else str(term)


def _chooser(kind: ExtremeKind) -> Callable[[Iterable[int]], int]:
    return min if kind is ExtremeKind.LEAST else max


def calculates(term: Term) -> bool:
    """Return whether a term is more than a variable or a value."""
    return isinstance(term, Sum | Extreme)


def bounds(term: Term, domains: Mapping[str, Domain]) -> tuple[int, int]:
    """Return a lower and an upper bound of an integer term; a variable that occurs once gives exact ones."""
    match term:
        case Constant(constant):
            return int(constant), int(constant)
        case Reference(name):
            values = domains[name].values
            return int(values[0]), int(values[-1])
        case Sum(parts):
            found = [bounds(part, domains) if sign > 0 else _negated(bounds(part, domains)) for sign, part in parts]
            return sum(low for low, _ in found), sum(high for _, high in found)
        case Extreme(kind, terms):
            choose, ends = _chooser(kind), [bounds(part, domains) for part in terms]
            return choose(low for low, _ in ends), choose(high for _, high in ends)
        case _:
            assert_never(term)


def _negated(ends: tuple[int, int]) -> tuple[int, int]:
    return -ends[1], -ends[0]


def substituted(term: Term, values: Mapping[str, Value]) -> Term:
    """Return the term with the values of some variables in their place; a constant if no variable is left."""
    if all(name in values for name in term.reads()):
        return Constant(term.value(values))
    match term:
        case Sum(parts):
            return Sum(tuple((sign, substituted(part, values)) for sign, part in parts))
        case Extreme(kind, terms):
            return Extreme(kind, tuple(substituted(part, values) for part in terms))
        case Reference() | Constant():
            return term
        case _:
            assert_never(term)


Atom: TypeAlias = Reference | Extreme
"""A term that is not a sum and not a constant."""


class LinearForm(Struct, frozen=True):
    """A sum without brackets: each atom once, with how often it is added, and what is added besides.

    Attributes:
        factors: the atoms with their factors, none of which is 0, in order of first occurrence.
        constant: the sum of all constants.
    """

    factors: tuple[tuple[Atom, int], ...]
    constant: int

    @staticmethod
    def difference(left: Term, right: Term) -> LinearForm:
        """Return `left - right`, both integers."""
        factors: dict[Atom, int] = {}
        constant, pending = 0, [(-1, right), (1, left)]
        while pending:
            sign, term = pending.pop()
            match term:
                case Constant(value):
                    constant += sign * int(value)
                case Sum(parts):
                    pending += [(sign * factor, part) for factor, part in reversed(parts)]
                case Reference() | Extreme():
                    factors[term] = factors.get(term, 0) + sign
                case _:
                    assert_never(term)
        return LinearForm(tuple((atom, factor) for atom, factor in factors.items() if factor), constant)

    def reads(self) -> tuple[str, ...]:
        """Return the variables of the atoms."""
        return names_of(atom for atom, _ in self.factors)

    def value(self, values: Mapping[str, Value], known: Sequence[str], name: str | None = None) -> int:
        """Return the sum of the atoms that read `known` variables only, and `name` among them, if it is given."""
        return sum(
            factor * int(atom.value(values))
            for atom, factor in self.factors
            if all(each in known for each in atom.reads()) and (name is None or name in atom.reads())
        )


# predicates


class Truth(Struct, frozen=True):
    """`true` or `false`."""

    truth: bool

    def holds(self, _: Valuation) -> bool:
        """Return the truth value."""
        return self.truth

    def reads(self) -> tuple[str, ...]:
        """Return no names."""
        return ()

    def __str__(self) -> str:
        return format_value(self.truth)


class Equal(Struct, frozen=True):
    """`left == right`."""

    left: Term
    right: Term

    @property
    def compare(self) -> Callable[[Value, Value], bool]:
        """The comparison of two values."""
        return operator.eq

    def holds(self, state: Valuation) -> bool:
        """Return whether both terms have the same value."""
        return self.left.value(state) == self.right.value(state)

    def reads(self) -> tuple[str, ...]:
        """Return the variables on both sides."""
        return _merge((self.left, self.right))

    def __str__(self) -> str:
        return f"{self.left} == {self.right}"


class NotEqual(Struct, frozen=True):
    """`left != right`, short for `!(left == right)`."""

    left: Term
    right: Term

    @property
    def compare(self) -> Callable[[Value, Value], bool]:
        """The comparison of two values."""
        return operator.ne

    def holds(self, state: Valuation) -> bool:
        """Return whether the terms have different values."""
        return self.left.value(state) != self.right.value(state)

    def reads(self) -> tuple[str, ...]:
        """Return the variables on both sides."""
        return _merge((self.left, self.right))

    def __str__(self) -> str:
        return f"{self.left} != {self.right}"


class Relation(StrEnum):
    """An order on integers."""

    LESS = "<"
    AT_MOST = "<="
    GREATER = ">"
    AT_LEAST = ">="

    @property
    def function(self) -> Callable[[Value, Value], bool]:
        """The relation as a function of two integers."""
        return _RELATIONS[self]


_OPPOSITES = {
    Relation.LESS: Relation.AT_LEAST,
    Relation.AT_LEAST: Relation.LESS,
    Relation.GREATER: Relation.AT_MOST,
    Relation.AT_MOST: Relation.GREATER,
}

_RELATIONS: dict[Relation, Callable[[Value, Value], bool]] = {
    Relation.LESS: operator.lt,
    Relation.AT_MOST: operator.le,
    Relation.GREATER: operator.gt,
    Relation.AT_LEAST: operator.ge,
}


class Order(Struct, frozen=True):
    """`left < right`, `<=`, `>` or `>=`: short for the disjunction of the pairs of integers that satisfy it."""

    left: Term
    relation: Relation
    right: Term

    @property
    def compare(self) -> Callable[[Value, Value], bool]:
        """The comparison of two values."""
        return self.relation.function

    def holds(self, state: Valuation) -> bool:
        """Return whether the relation holds."""
        return self.relation.function(self.left.value(state), self.right.value(state))

    def reads(self) -> tuple[str, ...]:
        """Return the variables on both sides."""
        return _merge((self.left, self.right))

    def __str__(self) -> str:
        return f"{self.left} {self.relation} {self.right}"


class Member(Struct, frozen=True):
    """`variable in {a, b}`, short for `variable == a || variable == b`."""

    variable: Reference
    members: tuple[Constant, ...]

    def holds(self, state: Valuation) -> bool:
        """Return whether the variable has one of the values."""
        value = self.variable.value(state)
        return any(value == member.constant for member in self.members)

    def reads(self) -> tuple[str, ...]:
        """Return the name of the variable."""
        return self.variable.reads()

    def __str__(self) -> str:
        return f"{self.variable} in {{{', '.join(map(str, self.members))}}}"


class Not(Struct, frozen=True):
    """`!operand`."""

    operand: Predicate

    def holds(self, state: Valuation) -> bool:
        """Return whether the operand does not hold."""
        return not self.operand.holds(state)

    def reads(self) -> tuple[str, ...]:
        """Return the variables of the operand."""
        return self.operand.reads()

    def __str__(self) -> str:
        if isinstance(self.operand, (Truth, Not)):
            return f"!{self.operand}"
        return f"!({self.operand})"


class And(Struct, frozen=True):
    """`a && b && …`; two operands or more."""

    operands: tuple[Predicate, ...]

    def holds(self, state: Valuation) -> bool:
        """Return whether all operands hold."""
        return all(operand.holds(state) for operand in self.operands)

    def reads(self) -> tuple[str, ...]:
        """Return the variables of the operands."""
        return _merge(self.operands)

    def __str__(self) -> str:
        return " && ".join(_bracket(operand, (And, Or, Implies)) for operand in self.operands)


class Or(Struct, frozen=True):
    """`a || b || …`; two operands or more."""

    operands: tuple[Predicate, ...]

    def holds(self, state: Valuation) -> bool:
        """Return whether an operand holds."""
        return any(operand.holds(state) for operand in self.operands)

    def reads(self) -> tuple[str, ...]:
        """Return the variables of the operands."""
        return _merge(self.operands)

    def __str__(self) -> str:
        return " || ".join(_bracket(operand, (Or, Implies)) for operand in self.operands)


class Implies(Struct, frozen=True):
    """`condition -> consequence`, short for `!condition || consequence`."""

    condition: Predicate
    consequence: Predicate

    def holds(self, state: Valuation) -> bool:
        """Return whether the condition does not hold or the consequence does."""
        return not self.condition.holds(state) or self.consequence.holds(state)

    def reads(self) -> tuple[str, ...]:
        """Return the variables of both sides."""
        return _merge((self.condition, self.consequence))

    def __str__(self) -> str:
        return f"{_bracket(self.condition, (Implies,))} -> {self.consequence}"


Predicate: TypeAlias = Truth | Equal | NotEqual | Order | Member | Not | And | Or | Implies
"""A condition on states."""

TRUE = Truth(True)
FALSE = Truth(False)


def conjuncts(predicate: Predicate) -> tuple[Predicate, ...]:
    """Return the conjuncts of a predicate, those of nested conjunctions included."""
    if not isinstance(predicate, And):
        return (predicate,)
    return tuple(part for operand in predicate.operands for part in conjuncts(operand))


def negated(predicate: Predicate) -> Predicate:
    """Return the negation, written as briefly as the notation allows."""
    match predicate:
        case Truth(truth):
            return Truth(not truth)
        case Equal(left, right):
            return NotEqual(left, right)
        case NotEqual(left, right):
            return Equal(left, right)
        case Order(left, relation, right):
            return Order(left, _OPPOSITES[relation], right)
        case Not(operand):
            return operand
        case _:
            return Not(predicate)


def all_needed(predicate: Predicate) -> tuple[Predicate, ...]:
    """Return the predicates that hold together where `predicate` holds: `a != b` and `!c` for `!(a == b || c)`."""
    match predicate:
        case And(operands):
            parts = operands
        case Not(Not(operand)):
            parts = (operand,)
        case Not(Or(operands)):
            parts = tuple(map(negated, operands))
        case Not(Implies(condition, consequence)):
            parts = (condition, negated(consequence))
        case _:
            return (predicate,)
    return tuple(each for part in parts for each in all_needed(part))


def alternatives(predicate: Predicate) -> tuple[Predicate, ...]:
    """Return the predicates of which one holds where `predicate` holds: `a != b` and `c` for `a == b -> c`."""
    return tuple(map(negated, all_needed(negated(predicate))))


def conjunction(predicates: Iterable[Predicate]) -> Predicate:
    """Return the conjunction of the predicates: `true` for none, the predicate itself for one."""
    operands = tuple(predicates)
    if not operands:
        return TRUE
    return operands[0] if len(operands) == 1 else And(operands)


def flat_conjunction(predicates: Iterable[Predicate]) -> Predicate:
    """Return the conjunction of the predicates, in which no operand is a conjunction itself, or `true`."""
    operands: list[Predicate] = []
    for predicate in predicates:
        operands += predicate.operands if isinstance(predicate, And) else [predicate]
    return conjunction(operand for operand in operands if operand != TRUE)


def _bracket(operand: Predicate, looser: tuple[type, ...]) -> str:
    return f"({operand})" if isinstance(operand, looser) else str(operand)


def _merge(parts: Iterable[Predicate | Term]) -> tuple[str, ...]:
    """Return the names that the parts read, each once, in order of first occurrence."""
    return tuple(dict.fromkeys(name for part in parts for name in part.reads()))
