"""Names: what can be the name of an entry, and which names predicates and actions can use where (semantics 1.3)."""

from __future__ import annotations

import re
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct, field

from scbm.files.language.grammar import keywords
from scbm.model import Slug
from scbm.model.values import Domain, Value, ValueKind, format_value
from scbm.model.variables import NO_OPERATION

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from scbm.model.behavior import BehaviorModel
    from scbm.model.resources import Resource
    from scbm.model.variables import Variable


class Where(Enum):
    """The sort of place of an expression; it decides which variables of the runner the expression may use."""

    GUARD = "a guard"
    WORLD = "a predicate over the world"  # goals, initial states: the runner's variables mean nothing there
    REQUIREMENT = "a requirement"
    PLANNED = "an action that the planner sees"
    RUNNING = "an action of an operation that only the runner sees"
    AUTOMATIC = "an action of an automatic transition"
    ENVIRONMENT = "an environment transition"  # what acts outside the controller knows nothing of its runner

    @property
    def has_runner(self) -> bool:
        """Whether an expression at such a place can read variables of the runner."""
        return self not in (Where.WORLD, Where.ENVIRONMENT)


def overlap(left: Domain, right: Domain) -> bool:
    """Return whether two domains have a value in common."""
    if left.kind is not right.kind:
        return False
    if left.kind is ValueKind.INTEGER:
        return max(left.values[0], right.values[0]) <= min(left.values[-1], right.values[-1])  # type: ignore[operator]
    return not set(left.values).isdisjoint(right.values)


class Scope(Struct, frozen=True, dict=True):
    """The names of a model.

    Attributes:
        variables: the variables by name, in order; `None` if the declaration is wrong, for which an error is noted.
        incomplete: whether a part of the model that declares names is wrong, so that an unknown name is no error.
        misses_states: the same for operations, which declare the names of their states.
        operations: the names of the operations, in order; only for a complete model.
        resources: the resources by name, in order; only for a complete model.
        objects: the names of objects: a parameter was written where one stands that is neither a value nor a variable.
    """

    variables: Mapping[str, Variable | None]
    incomplete: bool = False
    misses_states: bool = False
    operations: tuple[str, ...] = ()
    resources: Mapping[str, Resource] = field(default_factory=dict)
    objects: frozenset[str] = frozenset()

    def may_miss(self, name: str) -> bool:
        """Return whether a part of the model that is wrong may declare a name."""
        return self.incomplete or (self.misses_states and name.endswith(".state"))

    @staticmethod
    def of(model: BehaviorModel) -> Scope:
        """Return the names of a complete model."""
        return Scope(
            {variable.name: variable for variable in model.running_space},
            operations=tuple(operation.name for operation in model.operations),
            resources={resource.name: resource for resource in model.resources},
        )

    @staticmethod
    def over(variables: Iterable[Variable]) -> Scope:
        """Return a scope with some variables."""
        return Scope({variable.name: variable for variable in variables})

    @cached_property
    def symbols(self) -> dict[str, str]:
        """Each value of each domain as it is written, with the first variable that has it."""
        found: dict[str, str] = {}
        for name, variable in self.variables.items():
            for value in variable.domain.values if variable is not None else ():
                found.setdefault(format_value(value), name)
        return found

    @cached_property
    def _readable(self) -> dict[tuple[Domain | None, bool], tuple[str, ...]]:
        """The results of `readable`: in a large model, many errors ask for the same."""
        return {}

    def readable(self, domain: Domain | None, *, has_runner: bool) -> tuple[str, ...]:
        """Return the names of variables, in order.

        Args:
            domain: leave out variables that can never equal a value of this domain.
            has_runner: whether the variables of the runner are among them.
        """
        key = (domain, has_runner)
        if key not in self._readable:
            variables = [(n, v) for n, v in self.variables.items() if v is None or has_runner or not v.role.is_runner]
            names = (n for n, v in variables if v is None or domain is None or overlap(v.domain, domain))
            self._readable[key] = tuple(names)
        return self._readable[key]

    def is_object(self, name: str) -> bool:
        """Return whether a name is that of an object, and neither of a variable nor a value of one."""
        return name in self.objects and name not in self.variables and name not in self.symbols

    def has(self, value: Value) -> bool:
        """Return whether any variable can have this value."""
        return format_value(value) in self.symbols


NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z0-9_]+)*", re.ASCII)
"""The syntax of names; dots join the names of parts, entries and objects."""

_NEARLY_NAME = re.compile(r"[\w .-]{1,60}", re.ASCII)
"""A text that is a name once its spaces and signs are replaced."""

_RESERVED_OPERATIONS = (NO_OPERATION, "current", "plan", "automatic")
"""Words that operations cannot have as names: other names begin with them, or they mean "no operation"."""


class NameFault(NamedTuple):
    """The fault of the name of an entry."""

    slug: Slug
    message: str
    remedy: str


def reserved_names(section: str) -> tuple[str, ...]:
    """Return the words that entries of a section of a model cannot have as their names."""
    return (*keywords(), *(_RESERVED_OPERATIONS if section == "operations" else ()))


def name_fault(name: str, section: str = "") -> NameFault | None:
    """Return what is wrong with the name of an entry of a section; `None` if it can have this name."""
    if not NAME.fullmatch(name):
        message = f"`{name}` is not a name" if name else "a name is missing"
        return NameFault(Slug.BAD_NAME, message, _name_remedy(name))
    if name in reserved_names(section):
        return NameFault(Slug.RESERVED_NAME, f"`{name}` is a reserved word", "choose another name")
    return None


def _name_remedy(name: str) -> str:
    fixed = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")
    if not fixed or fixed[0].isdigit() or not _NEARLY_NAME.fullmatch(name):
        return "names are letters from a to z, digits and `_`, and begin with a letter"
    return f"write `{fixed}`"
