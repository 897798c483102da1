"""Mutants, which differ from a model in one small way each."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.model import BehaviorModel, EnvironmentTransition, Operation, Resource, Transition, Variable

    ModelEntry: TypeAlias = Operation | Transition | EnvironmentTransition | Resource | Variable


class SubjectKind(StrEnum):
    """The kind of entry of a model file that a mutant changes."""

    OPERATION = "operation"
    AUTOMATIC = "automatic"
    ENVIRONMENT = "environment"
    VARIABLE = "variable"
    RESOURCE = "resource"


class MutatedPart(StrEnum):
    """A part of an entry that a mutant changes. Each value is the text of the part in the names of mutants."""

    PRE_G = "pre.g"
    PRE_GR = "pre.gr"
    PRE_A = "pre.a"
    PRE_AR = "pre.ar"
    POST_G = "post.g"
    POST_GR = "post.gr"
    POST_A = "post.a"
    POST_AR = "post.ar"
    FAILED = "failed"
    """The whole `failed` transition, which the mutant does not have."""
    FAILED_G = "failed.g"
    FAILED_GR = "failed.gr"
    FAILED_A = "failed.a"
    FAILED_AR = "failed.ar"
    TIMEDOUT = "timedout"
    DEADLINE = "deadline"
    DISABLED_DEADLINE = "disabled_deadline"
    OPERATIONS = "operations"
    """The list of operations, or their order."""
    AUTOMATIC_G = "g"
    AUTOMATIC_GR = "gr"
    AUTOMATIC_A = "a"
    AUTOMATIC_AR = "ar"
    AUTOMATIC_TRANSITIONS = "automatic_transitions"
    """The list of automatic transitions, or their order."""
    INITIAL = "initial"
    REQUEST = "request"
    ENVIRONMENT_GUARD = "guard"
    ENVIRONMENT_ACTIONS = "actions"
    ENVIRONMENT = "environment"
    """The list of environment transitions."""


WHOLE_ENTRIES = (MutatedPart.OPERATIONS, MutatedPart.AUTOMATIC_TRANSITIONS, MutatedPart.ENVIRONMENT)
"""The parts that are whole entries: the name of the entry says enough."""


class Mutant(Struct, frozen=True):
    """A model that differs from the original model in one small way.

    Attributes:
        name: unique among the mutants of the original, such as `scan/pre.g/drop:robot_at == box_a`.
        operator: the name of the mutation operator in `MUTATIONS` that made it.
        kind: the kind of the changed entry.
        subject: the name of the changed entry; of two that change places, the first.
        parts: the changed parts of the entry, at least one; `pre.g` and `pre.gr` for a conjunct that moves.
        path: the keys that lead to the changed part in the model file, for `Places.find`.
        before: the changed part of the original in one line, as it is written in a model file.
        after: the same part of the mutant; empty if the mutant does not have it.
        change: the difference of both in a few words, such as `drop robot_at == box_a`.
        model: the changed model.
    """

    name: str
    operator: str
    kind: SubjectKind
    subject: str
    parts: tuple[MutatedPart, ...]
    path: tuple[str, ...]
    before: str
    after: str
    change: str
    model: BehaviorModel

    @property
    def owner(self) -> str:
        """The changed entry in the words of reports: the name of an operation, or `automatic/` and a name."""
        return self.subject if self.kind is SubjectKind.OPERATION else f"{self.kind}/{self.subject}"


def entries_of(model: BehaviorModel) -> dict[SubjectKind, Sequence[ModelEntry]]:
    """Return the entries of a model that mutants change, by their kinds."""
    return {
        SubjectKind.VARIABLE: model.variables,
        SubjectKind.RESOURCE: model.resources,
        SubjectKind.OPERATION: model.operations,
        SubjectKind.AUTOMATIC: model.automatic_transitions,
        SubjectKind.ENVIRONMENT: model.environment,
    }
