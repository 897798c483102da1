"""Proofs of requirements of the user by a set of all situations: no state in it violates them (semantics 7.3).

The states of a run are those of the set, and those in which a run that ends has cancelled some of its requests.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from scbm.cases.coverage import Obligations
from scbm.closing.symbolic.reached_sets import DEFAULT_LIMITS, NoSetError, SetSearch
from scbm.closing.symbolic.run_moves import RunMove
from scbm.closing.symbolic.run_space import TooManyValuesError
from scbm.closing.symbolic.set_certificates import sets_argument
from scbm.closing.symbolic.set_proofs import visits_in
from scbm.model import Not, PlanSet
from scbm.model.requirements import AfterAlways, Always, Before, Never
from scbm.proofcheck import PHASE, SetPhase

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scbm.closing.symbolic.decision_diagrams import Diagram
    from scbm.closing.symbolic.reached_sets import ReachedSet, SetLimits
    from scbm.model import BehaviorModel, Predicate, Requirement
    from scbm.model.requirements import RequirementForm
    from scbm.proofcheck import SetsArgument


class _Watch(NamedTuple):
    """Which states violate a sentence: from a state with `begin` on, until one with `stop`, those with `bad`.

    Attributes:
        bad: the predicate that violates it, unless `stop` holds.
        stop: the predicate after which none does; `None` if there is no such predicate.
        begin: the predicate from which on one does; `None` from the beginning of runs on.
    """

    bad: Predicate
    stop: Predicate | None = None
    begin: Predicate | None = None


def _watch(sentence: RequirementForm) -> _Watch | None:
    match sentence:
        case Always(predicate):
            return _Watch(Not(predicate))
        case Never(predicate):
            return _Watch(predicate)
        case Before(first, second):
            return _Watch(second, stop=first)
        case AfterAlways(start, predicate, stop):
            return _Watch(Not(predicate), stop, start)
        case _:
            return None


class RequirementSets:
    """What the set of one model proves about requirements.

    Attributes:
        found: the set.
        plans: the plans of the runs that it is about.
    """

    def __init__(self, model: BehaviorModel, found: ReachedSet, search: SetSearch) -> None:
        """Look at the set of a model, which a search has found."""
        self._model = model
        self.found = found
        self._search = search
        self.plans = PlanSet.ANY if found.plans is None else PlanSet.CANONICAL
        self._known: dict[str, Diagram | None] = {}

    @staticmethod
    def of(
        model: BehaviorModel,
        requirements: Sequence[Requirement],
        progress: Callable[[str], None],
        limits: SetLimits = DEFAULT_LIMITS,
    ) -> RequirementSets:
        """Return the proofs for requirements under any plans.

        Raises `NoSetError` beyond the limits, or where no engine is installed.
        """
        also = tuple(dict.fromkeys(name for each in requirements for name in each.sentence.reads()))
        search = SetSearch(model, limits, progress, visits_in(Obligations.of(model)), also)
        return RequirementSets(model, search.find(-1), search)

    def canonical(self) -> RequirementSets:
        """Return the proofs for canonical plans. Raises `NoSetError` beyond the limits."""
        return RequirementSets(self._model, self._search.find_canonical(self.found, -1), self._search)

    def proves(self, requirement: Requirement) -> bool:
        """Return whether no run violates a requirement, as far as the limits let the set say so."""
        if requirement.name not in self._known:
            try:
                self._known[requirement.name] = self._watched(requirement.sentence)
            except (NoSetError, TooManyValuesError):
                self._known[requirement.name] = None
        return self._known[requirement.name] is not None

    def argument(self, names: Sequence[str]) -> SetsArgument:
        """Return the set, for a certificate of requirements that it proves."""
        watched = [diagram for name in names if (diagram := self._known[name]) is not None]
        return sets_argument(self.found, self._model.runs.goals, watched)

    def _watched(self, sentence: RequirementForm) -> Diagram | None:
        """Return situations among which are all that could violate a sentence; `None` if one of them does.

        Raises `NoSetError` beyond the limits, `TooManyValuesError`.
        """
        watch, found = _watch(sentence), self.found
        if watch is None:
            return None
        moves, nothing = found.moves, found.space.manager.false
        stop = nothing if watch.stop is None else moves.where(watch.stop)
        bad = moves.where(watch.bad) & ~stop
        if not self._is_any(bad, found.reached):
            return found.reached
        if watch.stop is None:
            return None
        first = moves.start() if watch.begin is None else self._first(moves.where(watch.begin) & ~stop, bad)
        if first is None or self._is_any(bad, first):
            return None
        beyond = stop | found.space.has(PHASE, SetPhase.PLANNED)
        watched = self._search.following(found, first, beyond)
        return None if self._is_any(bad, watched) else watched

    def _is_any(self, bad: Diagram, situations: Diagram) -> bool:
        """Return whether a state of runs is bad, in some situations or while a run ends in one of them."""
        space = self.found.space
        if situations & bad != space.manager.false:
            return True
        ending = situations & space.any_of(move.where for move in self._ends)
        return self.found.moves.cancelled(ending) & bad != space.manager.false

    def _first(self, begin: Diagram, bad: Diagram) -> Diagram | None:
        """Return the situations of the set in which a sentence becomes active, and those after an end in which it does.

        `None` if one of the states until the end is bad.
        """
        moves, everything = self.found.moves, self.found.space.manager.true
        first = self.found.reached & begin
        for move in self._ends:
            active = moves.cancelled(self.found.reached & move.where) & begin
            if moves.cancelled(active) & bad != ~everything:
                return None
            first |= moves.image(RunMove(everything, move.stages), active)
        return first

    @cached_property
    def _ends(self) -> tuple[RunMove, ...]:
        """The moves that end a run."""
        return tuple(move for move in self.found.moves.moves() if move.ends_run)
