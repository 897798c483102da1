"""The causes of failed cases in a store: similar failures are grouped into one cause with all of its cases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.testing import FailureKind

if TYPE_CHECKING:
    from scbm.store import History, Recipe, StoredCase
    from scbm.testing import Failure


@dataclass(frozen=True, slots=True)
class Cause:
    """A cause of failures.

    Attributes:
        failure: the failure of the first case.
        case: the first case.
        messages: the labels of all cases with this cause, in the order of the store, each with its message.
    """

    failure: Failure
    case: StoredCase
    messages: tuple[tuple[str, str], ...]

    @property
    def labels(self) -> tuple[str, ...]:
        """The labels of all cases with this cause."""
        return tuple(label for label, _ in self.messages)


def causes_of(history: History) -> tuple[Cause, ...]:
    """Return all causes, in the order of their first cases.

    Failures have the same cause if their kind and subject are equal. For goals that were not reached the goals must be
    equal too, and for requirements of a command line their sentences. Each unmet expectation is a cause of its own.
    """
    found: dict[tuple[str, ...], tuple[Failure, StoredCase, dict[str, str]]] = {}
    for label, case in zip(history.labels, history.cases, strict=True):
        for failure in case.verdict.failures:
            key = (failure.kind.value, failure.subject, _scope(failure, case, label))
            found.setdefault(key, (failure, case, {}))[2].setdefault(label, failure.message)
    return tuple(Cause(failure, case, tuple(messages.items())) for failure, case, messages in found.values())


def asked_for(failure: Failure, recipe: Recipe) -> str:
    """Return the sentence of a violated requirement of the command line; its name, `required_1`, says nothing."""
    return dict(recipe.requirements).get(failure.subject, "")


def _scope(failure: Failure, case: StoredCase, label: str) -> str:
    """Return what must be equal besides kind and subject."""
    if failure.kind is FailureKind.EXPECTATION:
        return label
    if failure.kind is FailureKind.REQUIREMENT:
        return asked_for(failure, case.recipe)
    return case.goal if failure.kind is FailureKind.NOT_REACHED else ""
