"""Proofs by a set of all situations: what no step in the set visits, no run visits.

One set is about any plans, whichever are chosen. Another one is about canonical plans.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from scbm.cases.coverage import Aspect, Obligations
from scbm.closing.proofs.blame import blame
from scbm.closing.symbolic.reached_sets import DEFAULT_LIMITS, SetSearch
from scbm.closing.symbolic.set_certificates import sets_argument
from scbm.model import OperationState, PlanSet, conjunction
from scbm.running.compiled_steps import OperationPart
from scbm.running.lifecycle import guard_and_actions, is_current_in, states_trying

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.cases.coverage import Obligation
    from scbm.closing.symbolic.reached_sets import ReachedSet, SetLimits
    from scbm.closing.symbolic.run_moves import RunMove
    from scbm.model import BehaviorModel, Predicate
    from scbm.proofcheck import SetsArgument


class SetProofs:
    """What the set of one model proves.

    Attributes:
        visited: the obligations that steps in the set visit, as bits; they may be more than runs visit.
        surely: those of them that runs visit, but for runs that a livelock ends; these prove nothing.
        plans: the plans of the runs that they are about.
    """

    def __init__(self, model: BehaviorModel, found: ReachedSet, search: SetSearch) -> None:
        """Look at what the set of a model visits, which a search has found."""
        self._model = model
        self._search = search
        self.plans = PlanSet.ANY if found.plans is None else PlanSet.CANONICAL
        self._found = found
        self._obligations = Obligations.of(model)
        self.visited, self.surely = found.visited, found.surely
        self._reasons: dict[Obligation, str] = {}

    @staticmethod
    def of(
        model: BehaviorModel, missing: int, progress: Callable[[str], None], limits: SetLimits = DEFAULT_LIMITS
    ) -> SetProofs:
        """Return the proofs for a model. Raises `NoSetError` beyond the limits, or where no engine is installed.

        Args:
            model: the model.
            missing: the obligations that proofs are looked for, as bits.
            progress: called with counts.
            limits: the limits of the set.
        """
        search = SetSearch(model, limits, progress, visits_in(Obligations.of(model)))
        return SetProofs(model, search.find(missing), search)

    def canonical(self, missing: int) -> SetProofs:
        """Return the proofs for canonical plans about what is missing. Raises `NoSetError` beyond the limits."""
        return SetProofs(self._model, self._search.find_canonical(self._found, missing), self._search)

    @cached_property
    def never(self) -> int:
        """The obligations that no run visits, as bits."""
        return self._obligations.mask(*Aspect) & ~self.visited if self._found.is_complete else 0

    def proves(self, obligation: Obligation) -> bool:
        """Return whether no run visits an obligation."""
        return bool(self.never & self._obligations.bit(obligation))

    @property
    def argument(self) -> SetsArgument:
        """The set, for a certificate."""
        return sets_argument(self._found, self._model.runs.goals)

    def reason(self, obligation: Obligation) -> str:
        """Return why no run visits an obligation, as a sentence."""
        if obligation not in self._reasons:
            self._reasons[obligation] = self._reason(obligation)
        return self._reasons[obligation]

    def _reason(self, obligation: Obligation) -> str:
        name, aspect = obligation.subject, obligation.aspect
        if aspect is Aspect.TAKEN:
            return self._reason_not_taken(obligation)
        if not self._visits(name, Aspect.QUEUED):
            count = len(self._model.goals)
            return f"{name} is in no plan to {'the only goal' if count == 1 else f'any of the {count} goals'}"
        if not self._can_hold(is_current_in(name, OperationState)):
            return f"{name} is planned, but every such run ends before the operation becomes current"
        if aspect is Aspect.DISABLED:
            why = "its precondition holds whenever it is checked"
            which = " in any plan" if self.plans is PlanSet.ANY else ""
            return f"{name} is never disabled{which}, unless a case forces it: {why}"
        return self._reason_of_current(obligation)

    def _reason_of_current(self, obligation: Obligation) -> str:
        """Return the sentence about an operation that becomes current, and then does not do something."""
        name = obligation.subject
        if not self._visits(name, Aspect.EXECUTING):
            why = self._needs(name, OperationPart.PRE, "its precondition", "when it is current")
            return f"{name} never executes{why}"
        if obligation.aspect is Aspect.COMPLETED:
            why = self._needs(name, OperationPart.POST, "its postcondition", "while it executes")
            return f"{name} executes, but it never completes{why}"
        if obligation.aspect is Aspect.FAILED:
            why = self._needs(name, OperationPart.FAILED, "its `failed`", "while it executes")
            return f"{name} executes, but it never fails{why}"
        return f"{name} executes, but it never times out: nothing can happen before it ends"

    def _visits(self, subject: str, aspect: Aspect) -> bool:
        return bool(self.visited & self._obligations.bit_of(subject, aspect))

    def _can_hold(self, predicate: Predicate) -> bool:
        return self._found.moves.can_hold(predicate, self._found.reached)

    def _needs(self, name: str, part: OperationPart, what: str, when: str) -> str:
        """Return the rest of a sentence: the conjuncts of a guard that never hold together where it is evaluated."""
        found = guard_and_actions(self._model.operation(name), part)
        if found is None:
            return ""
        where = is_current_in(name, states_trying(part))
        needed = blame((found[0],), lambda each: self._can_hold(conjunction((where, each))))
        return f": {what} needs {conjunction(needed)}, which never holds {when}" if needed else ""

    def _reason_not_taken(self, obligation: Obligation) -> str:
        transition = next(t for t in self._model.automatic_transitions if t.name == obligation.subject)
        needed = blame((transition.running_guard,), self._can_hold)
        if needed:
            return f"no run takes {obligation}: it needs {conjunction(needed)}, which never holds"
        return f"no run takes {obligation}: where its guard holds, an earlier one is taken, or it would change nothing"


def visits_in(obligations: Obligations) -> Callable[[RunMove], int]:
    """Return the function that says which obligations a move visits, as bits."""

    def visits(move: RunMove) -> int:
        return sum(dict.fromkeys(obligations.bit_of(subject, aspect) for subject, aspect in move.visits))

    return visits
