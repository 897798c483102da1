"""The result of closing: a decision for each obligation, with its cases, certificates and suggestions."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.cases import Case
    from scbm.cases.coverage import Coverage, Obligation
    from scbm.model import BehaviorModel, Predicate
    from scbm.proofcheck import Certificate
    from scbm.testing import Execution


class Decision(StrEnum):
    """The decision about an obligation (semantics 8.5)."""

    COVERED = "covered"
    UNCOVERABLE = "uncoverable"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Decided:
    """The decision about one obligation.

    Attributes:
        case: the name of the first case that covers it, if it is covered.
        certificate: the name of the certificate, if it is uncoverable; a key of `Closing.certificates`.
        reason: one sentence: how the case covers it, why nothing does, or what ended the search.
    """

    obligation: Obligation
    decision: Decision
    reason: str
    case: str | None = None
    certificate: str | None = None


@dataclass(frozen=True, slots=True)
class ClosingCase:
    """A case that closing made.

    Attributes:
        case: the case with its expectations (verdict, visits), without recorded choices.
        execution: its run.
        adds: the obligations that no case before it visits, *queued* included.
    """

    case: Case
    execution: Execution
    adds: tuple[Obligation, ...]


class SuggestionKind(StrEnum):
    """The part of the model that a suggestion would change."""

    GOAL = "goal"
    GUARD = "guard"
    SHADOWED = "shadowed"
    DEADLINE = "deadline"
    FAILURE = "failure"


@dataclass(frozen=True, slots=True)
class Suggestion:
    """A change that would make uncoverable obligations coverable, or the reason why they are not.

    Attributes:
        obligations: the obligations that it is about.
        kind: the part of the model that it would change.
        text: one sentence.
        name: for a goal, the name that it would have in the model.
        goal: for a goal, the goal; it was found by search and verified by a run.
        blamed: for a guard, the conjuncts that never hold together; for a shadowed transition, the transitions that
            shadow it.
    """

    obligations: tuple[Obligation, ...]
    kind: SuggestionKind
    text: str
    name: str | None = None
    goal: Predicate | None = None
    blamed: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Closing:
    """The result of closing a model.

    Attributes:
        before: the coverage of the given suite.
        after: the coverage of the suite and the new cases.
        decided: one decision for each obligation of the model, in the order of `Obligations`, *queued* included.
        cases: the new cases, in order; each adds something.
        certificates: by name: `structure`, `values`, `runs`.
        suggestions: in the order of the obligations that they are about.
    """

    model: BehaviorModel
    before: Coverage
    after: Coverage
    decided: tuple[Decided, ...]
    cases: tuple[ClosingCase, ...]
    certificates: tuple[tuple[str, Certificate], ...]
    suggestions: tuple[Suggestion, ...]
