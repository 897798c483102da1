"""Predicates over objects and parameters, which one choice of objects makes true or false: tables, equality, sets."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping, Sequence

    from scbm.files.language.syntax import SyntaxTree

Choice: TypeAlias = "Mapping[str, str]"
"""An object for each parameter."""


class GroundTree(NamedTuple):
    """A ground predicate: its syntax tree, and about how many characters it has when it is written out."""

    tree: SyntaxTree
    characters: int


class Formula(ABC):
    """A predicate with parameters.

    Attributes:
        parameters: the parameters that it reads.
        is_static: whether it reads no variable, so that each choice makes it true or false.
        least: how many characters each ground text has at least; 0 if a choice may make it true or false.
    """

    parameters: frozenset[str]
    is_static: bool
    least = 0

    @abstractmethod
    def ground(self, choice: Choice) -> GroundTree | bool:
        """Return the predicate for a choice of objects. Raises `SyntaxFault`."""

    def conjuncts(self) -> tuple[Formula, ...]:
        """Return the operands of a conjunction, and the formula itself otherwise."""
        return (self,)

    def candidates(self, name: str, choice: Choice) -> Collection[str] | None:  # noqa: ARG002 - others use both
        """Return the objects that a parameter can have, given objects of some others; `None` if that is not known."""
        return None


class ConstantFormula(Formula):
    """`true` or `false`."""

    parameters = frozenset()
    is_static = True

    def __init__(self, truth: bool) -> None:  # noqa: FBT001 - it is what the formula is
        self._truth = truth

    def ground(self, choice: Choice) -> bool:  # noqa: ARG002 - the same for all choices
        """Return the constant."""
        return self._truth


class ObjectTerm(Struct, frozen=True):
    """An object, or a parameter that stands for one.

    Attributes:
        name: the name of the object or of the parameter.
        is_parameter: whether it is a parameter.
        added: what is added to the integer that the parameter stands for, as in `i + 1`.
    """

    name: str
    is_parameter: bool
    added: int = 0

    def object_in(self, choice: Choice) -> str:
        """Return the object for a choice."""
        if self.added:
            return str(int(choice[self.name]) + self.added)
        return choice[self.name] if self.is_parameter else self.name


def parameters_of(terms: Iterable[ObjectTerm]) -> frozenset[str]:
    """Return the names of the parameters among terms."""
    return frozenset(term.name for term in terms if term.is_parameter)


class TableFormula(Formula):
    """A row of a table, two equal objects, or an object of a set: some terms are one of known tuples of objects."""

    is_static = True

    def __init__(self, terms: Sequence[ObjectTerm], rows: Mapping[tuple[str, ...], None]) -> None:
        """Take the terms, and the rows as keys: their order, unlike that of a set, is the same in each process."""
        self.parameters = parameters_of(terms)
        self._terms = tuple(terms)
        self._rows = rows
        self._joins: dict[tuple[int, ...], dict[tuple[str, ...], dict[str, None]]] = {}

    def ground(self, choice: Choice) -> bool:
        """Return whether there is such a row."""
        return tuple([choice[t.name] if t.is_parameter else t.name for t in self._terms]) in self._rows

    def candidates(self, name: str, choice: Choice) -> Collection[str] | None:
        """Return the objects of a column in the rows with the objects of a choice, as far as there are some."""
        known = [i for i, t in enumerate(self._terms) if not t.is_parameter or (t.name != name and t.name in choice)]
        column = next(i for i, t in enumerate(self._terms) if t.is_parameter and t.name == name)
        columns = (column, *known)
        if columns not in self._joins:
            self._joins[columns] = self._join(columns)
        return self._joins[columns].get(tuple([self._terms[i].object_in(choice) for i in known]), ())

    def _join(self, columns: tuple[int, ...]) -> dict[tuple[str, ...], dict[str, None]]:
        """Return the objects of the first of some columns by those of the others."""
        found: dict[tuple[str, ...], dict[str, None]] = {}
        for row in self._rows:
            first, *others = [row[column] for column in columns]
            found.setdefault(tuple(others), {})[first] = None
        return found


class EqualityFormula(Formula):
    """`p == q` or `p != q` of objects."""

    is_static = True

    def __init__(self, left: ObjectTerm, right: ObjectTerm, *, equal: bool) -> None:
        self.parameters = parameters_of((left, right))
        self._left = left
        self._right = right
        self._equal = equal

    def ground(self, choice: Choice) -> bool:
        """Return whether the objects are equal, or whether they differ."""
        return (self._left.object_in(choice) == self._right.object_in(choice)) is self._equal

    def candidates(self, name: str, choice: Choice) -> Collection[str] | None:
        """Return the other object of an equality."""
        own = ObjectTerm(name, is_parameter=True)
        other = self._right if self._left == own else self._left
        is_known = self._equal and (not other.is_parameter or other.name in choice)
        return (other.object_in(choice),) if is_known else None
