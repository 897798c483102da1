"""Mutants, which differ from a model in one small way, and the base class of the mutation operators that make them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, ClassVar, TypeVar

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import Action, BehaviorModel, Predicate, Transition
    from scbm.testing.mutants.model_parts import ModelPart


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


@dataclass(frozen=True, slots=True)
class Mutant:
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


T = TypeVar("T", "Predicate", "tuple[Action, ...]")


class Mutation(ABC):
    """A mutation operator: makes mutants of models. Each subclass is one entry of `MUTATIONS`.

    Attributes:
        name: the key in `MUTATIONS`.
        group: the group that `--operators` can name instead of the operators in it.
        summary: what the operator changes, for help and documentation.
    """

    name: ClassVar[str]
    group: ClassVar[str]
    summary: ClassVar[str]

    @abstractmethod
    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield the mutants of a model in the order of the file.

        The loader accepts each of them without its bindings. Some may equal the model or each other.
        """

    def of_part(self, part: ModelPart[T], edit: str, value: T, change: str = "") -> Mutant:
        """Return the mutant with another value of one part.

        Args:
            part: the part.
            edit: what changes, for the name of the mutant, such as `drop:robot_at == box_a`.
            value: the other value.
            change: what changes in a few words; by default `edit` with a blank for its colon.
        """
        return Mutant(
            name=f"{owner_of(part)}/{part.part}/{edit}",
            operator=self.name,
            kind=part.kind,
            subject=part.subject,
            parts=(part.part,),
            path=part.path,
            before=line_of(part, part.value),
            after=line_of(part, value),
            change=change or edit.replace(":", " ", 1),
            model=part.put(value),
        )


def owner_of(part: ModelPart[T]) -> str:
    """Return the beginning of the names of mutants of a part."""
    return part.subject if part.kind == "operation" else f"{part.kind}/{part.subject}"


def line_of(part: ModelPart[T], value: T) -> str:
    """Return a value of a part in one line, with the name of the part."""
    return f"{part.part}: {written(value)}"


def written(value: Predicate | tuple[Action, ...]) -> str:
    """Return a guard or a list of actions as it is written in a model file."""
    return f"[{', '.join(map(str, value))}]" if isinstance(value, tuple) else str(value)


def body_of(transition: Transition) -> str:
    """Return the guards and actions of a transition in one line."""
    return " / ".join(map(written, (transition.g, transition.gr, transition.a, transition.ar)))
