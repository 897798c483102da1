"""The statuses of lifted obligations: the statuses of all instances of an entry with parameters (semantics 8.6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.cases.coverage.obligations import Aspect, Figure, Obligation
from scbm.cases.coverage.statuses import Decision, count_statuses, coverable_figure

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from scbm.cases.coverage.obligations import Obligations
    from scbm.cases.coverage.statuses import Statuses
    from scbm.model import BehaviorModel

_ORDER = (Decision.UNDECIDED, Decision.FORCED, Decision.WAIVED, Decision.EXCLUDED, Decision.UNCOVERABLE)
"""The statuses of instances that are not covered; the first that any instance has is that of the lifted obligation."""


def folded_decision(decisions: Iterable[Decision]) -> Decision:
    """Return the status of a lifted obligation, whose instances have these statuses."""
    found = dict.fromkeys(decisions)
    return Decision.COVERED if Decision.COVERED in found else first_missed(found)


def first_missed(decisions: Iterable[Decision]) -> Decision:
    """Return the first status that any instance has, covered ones left out; `COVERED` if all are."""
    found = dict.fromkeys(decisions)
    return next((decision for decision in _ORDER if decision in found), Decision.COVERED)


@dataclass(frozen=True, slots=True)
class LiftedStatus:
    """The status of one lifted obligation.

    Attributes:
        obligation: the obligation; its subject is the name of the lifted entry.
        is_lifted: whether the entry has parameters; other entries are listed with their one instance.
        decisions: the statuses of the instances, in the order of the model.
    """

    obligation: Obligation
    is_lifted: bool
    decisions: tuple[Decision, ...]

    @property
    def decision(self) -> Decision:
        """The status: covered if any instance is, uncoverable if all are."""
        return folded_decision(self.decisions)

    @property
    def missed(self) -> int:
        """The number of instances that are not covered."""
        return sum(decision is not Decision.COVERED for decision in self.decisions)


@dataclass(frozen=True, slots=True)
class LiftedStatuses:
    """The statuses of the lifted obligations of a model, *queued* included, in the order of the model."""

    entries: tuple[LiftedStatus, ...]

    @staticmethod
    def of(model: BehaviorModel, statuses: Statuses) -> LiftedStatuses | None:
        """Return the statuses of a model with parameters; `None` for a model without."""
        if not any(origin.section != "goals" for origin in model.origins):
            return None
        origins = {(origin.section, origin.name): origin.lifted for origin in model.origins}
        decisions: dict[tuple[Obligation, bool], list[Decision]] = {}
        for entry in statuses.entries:
            key = lifted_obligation(entry.obligation, origins)
            decisions.setdefault(key, []).append(entry.decision)
        return LiftedStatuses(tuple(LiftedStatus(*key, tuple(found)) for key, found in decisions.items()))

    @property
    def figure(self) -> Figure:
        """The lifted figure: visited of all lifted obligations, without *queued*."""
        counted = [entry.decision for entry in self.entries if entry.obligation.counts]
        visited = sum(decision in (Decision.COVERED, Decision.FORCED) for decision in counted)
        return Figure(visited, len(counted))

    @property
    def counts(self) -> dict[Decision, int]:
        """The number of lifted obligations of each status, without *queued*."""
        return count_statuses(entry.decision for entry in self.entries if entry.obligation.counts)

    @property
    def coverable(self) -> Figure:
        """The figure of what can be covered, of lifted obligations."""
        return coverable_figure(self.counts)


def instances_of(text: str, model: BehaviorModel, obligations: Obligations) -> Iterator[Obligation]:
    """Yield the obligations of all instances of an entry with parameters; of one aspect, if the name has it."""
    origins = {(origin.section, origin.name): origin.lifted for origin in model.origins}
    for obligation in obligations:
        lifted, is_lifted = lifted_obligation(obligation, origins)
        if is_lifted and text in (str(lifted), lifted.subject):
            yield obligation


def lifted_obligation(obligation: Obligation, origins: Mapping[tuple[str, str], str]) -> tuple[Obligation, bool]:
    """Return the lifted obligation of a ground one, and whether its entry has parameters.

    Args:
        obligation: the obligation.
        origins: the lifted name of each ground entry, by its section and its name.
    """
    section = "automatic_transitions" if obligation.aspect is Aspect.TAKEN else "operations"
    lifted = origins.get((section, obligation.subject))
    return (obligation, False) if lifted is None else (Obligation(lifted, obligation.aspect), True)
