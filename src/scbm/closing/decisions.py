"""What closing comes to: for every obligation a decision, and the cases, certificates and suggestions behind it."""

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
    """How an obligation ends (semantics 8.5)."""

    COVERED = "covered"
    UNCOVERABLE = "uncoverable"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Decided:
    """The decision of one obligation.

    Attributes:
        case: the name of the first case that covers it, if it is covered.
        certificate: the name of the certificate, if it is uncoverable; a key of `Closing.certificates`.
        reason: one sentence: how the case covers it, why nothing does, or what stopped the search.
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
        case: with its expectations (verdict, visits), and nothing recorded.
        execution: its run.
        adds: the obligations that no case before it visits, those beside the figure (queued) among them.
    """

    case: Case
    execution: Execution
    adds: tuple[Obligation, ...]


class SuggestionKind(StrEnum):
    """What a suggestion would change."""

    GOAL = "goal"
    GUARD = "guard"
    SHADOWED = "shadowed"
    DEADLINE = "deadline"
    FAILURE = "failure"


@dataclass(frozen=True, slots=True)
class Suggestion:
    """What would make uncoverable obligations coverable, or why they are not.

    Attributes:
        obligations: what it is about.
        kind: what it would change.
        text: one sentence.
        name: for a goal, the name that it would have in the model.
        goal: for a goal, the goal; it was found by search and verified by a run.
        blamed: for a guard, the conjuncts that never hold together; for a shadowed transition, the ones before it.
    """

    obligations: tuple[Obligation, ...]
    kind: SuggestionKind
    text: str
    name: str | None = None
    goal: Predicate | None = None
    blamed: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Closing:
    """Everything that closing a model came to.

    Attributes:
        before: what the given suite visits.
        after: what the suite and the new cases visit.
        decided: one for each obligation of the model in the order of `Obligations`, *queued* among them.
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
