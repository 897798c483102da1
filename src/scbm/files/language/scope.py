"""The names that a predicate or an action can use, and where it stands (semantics 1.3)."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING

from scbm.model.values import Value, format_value

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from scbm.model.behavior import BehaviorModel
    from scbm.model.resources import Resource
    from scbm.model.variables import Variable


class Where(Enum):
    """Where an expression stands; it decides which of the runner's variables it may use."""

    GUARD = "a guard"
    WORLD = "a predicate over the world"  # goals, initial states: the runner's variables mean nothing there
    REQUIREMENT = "a requirement"
    PLANNED = "an action that the planner sees"
    RUNNING = "an action of an operation that only the runner sees"
    AUTOMATIC = "an action of an automatic transition"


@dataclass(frozen=True)
class Scope:
    """All names of a model.

    Attributes:
        variables: by name, in order; `None` for a name whose declaration is wrong, of which no more is said.
        incomplete: whether a part of the model that declares names is wrong, so that an unknown one may be meant there.
        operations: the names of the operations, in order; only of a model that is already built.
        resources: by name, in order; only of a model that is already built.
    """

    variables: Mapping[str, Variable | None]
    incomplete: bool = False
    operations: tuple[str, ...] = ()
    resources: Mapping[str, Resource] = field(default_factory=dict)

    @staticmethod
    def of(model: BehaviorModel) -> Scope:
        """The names of a model that is already built."""
        return Scope(
            {variable.name: variable for variable in model.running_space},
            operations=tuple(operation.name for operation in model.operations),
            resources={resource.name: resource for resource in model.resources},
        )

    @staticmethod
    def over(variables: Iterable[Variable]) -> Scope:
        """The names of some variables."""
        return Scope({variable.name: variable for variable in variables})

    @cached_property
    def symbols(self) -> dict[str, str]:
        """Each value of each domain, as it is written, with the first variable that has it."""
        found: dict[str, str] = {}
        for name, variable in self.variables.items():
            for value in variable.domain.values if variable is not None else ():
                found.setdefault(format_value(value), name)
        return found

    def has(self, value: Value) -> bool:
        """Whether any variable can have this value."""
        return format_value(value) in self.symbols
