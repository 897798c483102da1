"""Requirements: sentences over a run (semantics 7.3). This module says what they are; `testing` checks them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from scbm.model.durations import format_duration

if TYPE_CHECKING:
    from scbm.model.predicates import Predicate


@dataclass(frozen=True, slots=True)
class Always:
    """`always p`: p holds in every state."""

    predicate: Predicate

    def __str__(self) -> str:
        return f"always {self.predicate}"


@dataclass(frozen=True, slots=True)
class Never:
    """`never p`: p holds in no state."""

    predicate: Predicate

    def __str__(self) -> str:
        return f"never {self.predicate}"


@dataclass(frozen=True, slots=True)
class LeadsTo:
    """`p leads to q [within d]`: whenever p holds, q holds then or later.

    Within d if that is said, and else before the run ends. A run that ends before d has passed has broken nothing.
    """

    cause: Predicate
    effect: Predicate
    within_ns: int | None = None

    def __str__(self) -> str:
        limit = "" if self.within_ns is None else f" within {format_duration(self.within_ns)}"
        return f"{self.cause} leads to {self.effect}{limit}"


@dataclass(frozen=True, slots=True)
class Before:
    """`p before q`: q does not hold until p has held, then or earlier."""

    first: Predicate
    second: Predicate

    def __str__(self) -> str:
        return f"{self.first} before {self.second}"


@dataclass(frozen=True, slots=True)
class AfterAlways:
    """`after p always q until r`: from each state with p on, q holds until a state with r, which ends it."""

    start: Predicate
    predicate: Predicate
    stop: Predicate

    def __str__(self) -> str:
        return f"after {self.start} always {self.predicate} until {self.stop}"


Sentence: TypeAlias = Always | Never | LeadsTo | Before | AfterAlways


@dataclass(frozen=True, slots=True)
class Requirement:
    """A sentence with a name."""

    name: str
    sentence: Sentence

    def __str__(self) -> str:
        return f"{self.name}: {self.sentence}"
