"""Mutation operators: the base class, and how an operator makes a mutant from one changed part."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar, TypeVar

from scbm.testing.mutants.mutant import Mutant

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import Action, BehaviorModel, Predicate, Transition
    from scbm.testing.mutants.model_parts import ModelPart

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
