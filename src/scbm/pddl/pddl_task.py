"""A problem of PDDL as values: what the reader finds and the writer of models needs, without `unified-planning`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple, TypeAlias

from msgspec import Struct, field

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from fractions import Fraction

    from scbm.model import Diagnostic

PddlNumber: TypeAlias = "int | Fraction"
"""A number of PDDL: a fraction only if it is no whole number."""

FormulaKind: TypeAlias = Literal[
    "and",
    "or",
    "not",
    "forall",
    "exists",
    "fluent",
    "parameter",
    "object",
    "number",
    "equals",
    "<=",
    "<",
    "+",
    "-",
    "*",
    "/",
]


class PddlFormula(Struct, frozen=True):
    """A condition or a term.

    Attributes:
        kind: what it is; `equals` compares two objects or two numbers.
        parts: its operands, or the arguments of a fluent.
        name: of a fluent, a parameter or an object.
        number: of a number; a fraction only where it is no whole number.
        variables: what a quantifier is over: names with their types.
    """

    kind: FormulaKind
    parts: tuple[PddlFormula, ...] = ()
    name: str = ""
    number: PddlNumber = 0
    variables: tuple[tuple[str, str], ...] = ()


TRUE, FALSE = PddlFormula("and"), PddlFormula("or")


class PddlFluent(Struct, frozen=True):
    """A predicate or a numeric function: its name, and its parameters with their types."""

    name: str
    parameters: tuple[tuple[str, str], ...]
    is_numeric: bool = False

    @property
    def types(self) -> tuple[str, ...]:
        """The type of each parameter."""
        return tuple(kind for _, kind in self.parameters)


EffectKind: TypeAlias = Literal["assign", "increase", "decrease"]


class PddlEffect(Struct, frozen=True):
    """An effect of an action: a fluent becomes a value, or more, or less by it.

    Attributes:
        fluent: the fluent with its arguments.
        value: `TRUE`, `FALSE`, or a number.
        kind: whether the value is assigned, added or subtracted.
        condition: where the effect happens.
        variables: the objects that it happens for.
        moment: 0 at the start of an action with a duration, 1 at its end.
    """

    fluent: PddlFormula
    value: PddlFormula
    kind: EffectKind = "assign"
    condition: PddlFormula = TRUE
    variables: tuple[tuple[str, str], ...] = ()
    moment: int = 1


class PddlDuration(Struct, frozen=True):
    """The shortest and the longest duration of an action, as terms over its parameters, in seconds."""

    lowest: PddlFormula
    highest: PddlFormula


class PddlLiftedAction(Struct, frozen=True):
    """An action with parameters, as the domain has it."""

    name: str
    parameters: tuple[tuple[str, str], ...]
    conditions: tuple[PddlFormula, ...]
    effects: tuple[PddlEffect, ...]
    duration: PddlDuration | None = None


Fact: TypeAlias = "tuple[str, ...]"
"""The objects that a fluent is about."""


class InvariantPart(NamedTuple):
    """One fluent of an invariant.

    Attributes:
        fluent: the name of the fluent.
        keys: for each key of the invariant, the index of the parameter of this fluent.
        counted: the index of the parameter that is counted; `None` if there is none.
    """

    fluent: str
    keys: tuple[int, ...]
    counted: int | None


FactInvariant: TypeAlias = tuple[InvariantPart, ...]
"""Fluents of which at most one fact is true in each reachable state, for each choice of objects for the keys.

Each part has another fluent; the parts are in the order of the names.
"""


class PddlTask(Struct, frozen=True):
    """A domain with one problem.

    Attributes:
        name: of the problem.
        types: the types with their parents, parents first.
        objects: the objects with their types, in order.
        fluents: predicates and numeric functions, by name.
        initial: the values of each fluent that the problem gives.
        exclusive: for fluents, the parameter whose values are proved to exclude each other.
        invariants: which facts are proved to exclude each other.
        errors: what a model cannot express; a condition `TRUE` stands for it.
        more_parents: the types above a type, besides the one that `types` has.
    """

    name: str
    types: Mapping[str, str | None]
    objects: Mapping[str, str]
    fluents: Mapping[str, PddlFluent]
    actions: tuple[PddlLiftedAction, ...]
    initial: Mapping[str, Mapping[Fact, PddlNumber]]
    goals: tuple[PddlFormula, ...]
    exclusive: Mapping[str, int] = field(default_factory=dict)
    invariants: tuple[FactInvariant, ...] = ()
    errors: tuple[Diagnostic, ...] = ()
    more_parents: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def objects_of(self, kind: str) -> tuple[str, ...]:
        """Return the objects of a type and of the types below it."""
        own = [name for name, each in self.objects.items() if each == kind]
        below = [each for each, parent in self.types.items() if kind in (parent, *self.more_parents.get(each, ()))]
        return tuple(dict.fromkeys([*own, *(each for child in below for each in self.objects_of(child))]))

    def types_above(self, kind: str) -> Iterator[str]:
        """Yield the types above a type."""
        parent = self.types[kind]
        for each in (*([] if parent is None else [parent]), *self.more_parents.get(kind, ())):
            yield each
            yield from self.types_above(each)
