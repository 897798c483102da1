"""Why cases of a store failed: failures that are alike are one cause, with all of its cases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.testing import FailureKind

if TYPE_CHECKING:
    from scbm.store import History, Recipe, StoredCase
    from scbm.testing import Failure


@dataclass(frozen=True, slots=True)
class Cause:
    """A reason to fail.

    Attributes:
        failure: the reason, as the first case has it.
        case: that case.
        told: the labels of all cases that fail for it, in the order of the store, each with what it says.
    """

    failure: Failure
    case: StoredCase
    told: tuple[tuple[str, str], ...]

    @property
    def labels(self) -> tuple[str, ...]:
        """The labels alone."""
        return tuple(label for label, _ in self.told)


def causes_of(history: History) -> tuple[Cause, ...]:
    """All causes, those first that came first.

    Failures are alike if kind and subject are; that a goal was not reached, also if the goal is; that a requirement of
    a command line was broken, also if its sentence is. What a case expects is its own, and so is each expectation that
    was not met.
    """
    found: dict[tuple[str, ...], tuple[Failure, StoredCase, dict[str, str]]] = {}
    for label, case in zip(history.labels, history.cases, strict=True):
        for failure in case.verdict.failures:
            key = (failure.kind.value, failure.subject, _scope(failure, case, label))
            found.setdefault(key, (failure, case, {}))[2].setdefault(label, failure.message)
    return tuple(Cause(failure, case, tuple(told.items())) for failure, case, told in found.values())


def asked_for(failure: Failure, recipe: Recipe) -> str:
    """The sentence of a broken requirement of the command line: `required_1` is another one in each command."""
    return dict(recipe.requirements).get(failure.subject, "")


def _scope(failure: Failure, case: StoredCase, label: str) -> str:
    """What besides kind and subject must be the same."""
    if failure.kind is FailureKind.EXPECTATION:
        return label
    if failure.kind is FailureKind.REQUIREMENT:
        return asked_for(failure, case.recipe)
    return case.goal if failure.kind is FailureKind.NOT_REACHED else ""
