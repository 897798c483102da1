"""Predicates: the paper's equality logic, and the notation that expands to it (paper, Section II; semantics 2).

The grammar of the paper is `F: F && F | F || F | !F | atom`, `atom: term == term | true | false`,
`term: variable | value`. `!=`, `->`, `in {…}` and the order on integers can be expressed in it; they are kept as
written, so that a predicate prints back to its source. Precedence, tightest first: comparison, `!`, `&&`, `||`, `->`
(to the right).
"""

from __future__ import annotations

import operator
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, TypeAlias

from scbm.model.values import Value, format_value, kind_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    Valuation: TypeAlias = Mapping[str, Value]


@dataclass(frozen=True, slots=True)
class Reference:
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


Term: TypeAlias = Reference | Constant


@dataclass(frozen=True, slots=True)
class Truth:
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


@dataclass(frozen=True, slots=True)
class Equal:
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


@dataclass(frozen=True, slots=True)
class NotEqual:
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


_RELATIONS: dict[Relation, Callable[[Value, Value], bool]] = {
    Relation.LESS: operator.lt,
    Relation.AT_MOST: operator.le,
    Relation.GREATER: operator.gt,
    Relation.AT_LEAST: operator.ge,
}


@dataclass(frozen=True, slots=True)
class Order:
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


@dataclass(frozen=True, slots=True)
class Member:
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


@dataclass(frozen=True, slots=True)
class Not:
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


@dataclass(frozen=True, slots=True)
class And:
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


@dataclass(frozen=True, slots=True)
class Or:
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


@dataclass(frozen=True, slots=True)
class Implies:
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

TRUE = Truth(True)
FALSE = Truth(False)


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
