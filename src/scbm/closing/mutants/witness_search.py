"""The search for witnesses: cases whose runs on a model and on a mutant differ."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from itertools import count, islice
from typing import TYPE_CHECKING

from scbm.cases import Case, CaseLimits
from scbm.closing.mutants.compared_runs import ComparedRuns
from scbm.closing.mutants.mutant_decisions import DifferentMutant
from scbm.closing.mutants.shown_states import ShownStates
from scbm.closing.scripts.case_scripts import CaseScripts
from scbm.closing.scripts.case_search import bounded
from scbm.model import InputError, Outcome, State
from scbm.planning import PlanCache
from scbm.testing import RandomCases, Tester

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.closing.mutants.observed_runs import ObservedRuns
    from scbm.closing.mutants.runner_differences import StateDifference
    from scbm.model import BehaviorModel
    from scbm.testing import Execution

_WITNESS = "witness"
_MAX_SHOWN = 5
"""The best one of so many witnesses is kept: after so many that break no requirement, a mutant counts as benign."""

_MAX_CHANGED = 20
"""Maximum number of changed replies that are tried for a witness that does not kill."""

_FEW_PLANS = 3
"""Limits of plans up to this one are tried, to show what follows the end of a run."""

_SEED = 1


class WitnessSearch:
    """Searches for witnesses for the mutants of one model."""

    def __init__(self, observed: ObservedRuns, most_tried: int) -> None:
        """Prepare the search.

        Args:
            observed: the runs of the original.
            most_tried: the maximum number of differences, and of random cases, that are tried for a mutant.
        """
        self._observed = observed
        self._most_tried = most_tried
        self._model = observed.model
        self._tester = Tester(self._model)
        self._scripts = CaseScripts(self._model, observed.program, PlanCache(observed.runs.planner))
        self._states = ShownStates(observed)
        self._random = self._draw_random()
        self._drawn: list[Execution] = []

    def from_differences(self, mutant: BehaviorModel, differences: Iterable[StateDifference]) -> DifferentMutant | None:
        """Return a witness that leads to one of the differences, if possible one that breaks a requirement."""
        compared = ComparedRuns(self._tester, mutant)
        few = islice(differences, self._most_tried)
        cases = (case for each in few for case in self._cases(each, mutant))
        found = _best(self._compared(compared, cases), compared)
        return found if found is None or found.kills else self._more_visible(found, compared)

    def from_random(self, mutant: BehaviorModel, *, redraws: bool = False) -> DifferentMutant | None:
        """Return a witness among plain and random cases.

        Args:
            mutant: the mutant.
            redraws: whether changes from outside are drawn anew on the mutant, instead of repeated.
        """
        if self._observed.runs.planner.entry.is_external:
            return None  # each plan would start another program
        compared = ComparedRuns(self._tester, mutant)
        return _best(self._compared_random(compared, redraws=redraws), compared)

    def _cases(self, difference: StateDifference, mutant: BehaviorModel) -> Iterator[Case]:
        """Yield cases that lead to a difference."""
        for path in self._states.paths(difference):
            case = self._scripts.case(path, _WITNESS)
            if difference.at_deadline:
                yield from self._with_late_reply(case, difference.where.state, mutant)
            yield case
            if self._observed.program.current(difference.where.state) is None:
                yield from (replace(case, limits=CaseLimits(plans=plans)) for plans in range(1, _FEW_PLANS + 1))

    def _with_late_reply(self, case: Case, state: int, mutant: BehaviorModel) -> Iterator[Case]:
        """Yield a case in which the last reply that is missing comes between the deadlines of both models."""
        current = self._observed.program.current(state)
        missing = [rule for rule in case.outcomes if rule.outcome is Outcome.TIMEOUT]
        if current is None or not missing:
            return
        deadline_ns, other_ns = current.operation.deadline_ns, mutant.operation(current.operation.name).deadline_ns
        if deadline_ns is None or deadline_ns == other_ns:
            return
        late_ns = (deadline_ns + (3 * deadline_ns if other_ns is None else other_ns)) // 2
        late = replace(missing[-1], outcome=Outcome.SUCCEED, latency_ns=late_ns)
        yield replace(case, outcomes=tuple(late if rule is missing[-1] else rule for rule in case.outcomes))

    def _more_visible(self, found: DifferentMutant, compared: ComparedRuns) -> DifferentMutant:
        """Return a witness that kills, if one reply that fails or is missing makes it one; else `found`."""
        closed = found.original.closed_case
        others = (
            replace(
                closed,
                outcomes=(*closed.outcomes[:number], replace(rule, outcome=outcome), *closed.outcomes[number + 1 :]),
            )
            for number, rule in enumerate(closed.outcomes)
            for outcome in (Outcome.TIMEOUT, Outcome.FAIL)
            if rule.outcome is Outcome.SUCCEED
        )
        changed = self._compared(compared, islice(others, _MAX_CHANGED))
        killing = (compared.confirmed(each) for each in changed if each.kills)
        return next((each for each in killing if each.kills), found)

    def _compared(self, compared: ComparedRuns, cases: Iterable[Case]) -> Iterator[DifferentMutant]:
        for case in cases:
            original = bounded(self._tester, case)
            mutated = None if original is None else compared.differing(original, original.case)
            if original is not None and mutated is not None:
                yield DifferentMutant(original.case, original, mutated)

    def _compared_random(self, compared: ComparedRuns, *, redraws: bool) -> Iterator[DifferentMutant]:
        for number in range(self._most_tried):
            original = self._random_run(number)
            if original is None:
                return
            case = original.case if redraws else original.closed_case
            mutated = compared.differing(original, case)
            if mutated is not None:
                yield DifferentMutant(replace(case, name=_WITNESS), original, mutated)

    def _random_run(self, number: int) -> Execution | None:
        """Return the run of a plain or random case on the original; memoized."""
        while len(self._drawn) <= number:
            drawn = next(self._random, None)
            if drawn is None:
                return None
            self._drawn.append(drawn)
        return self._drawn[number]

    def _draw_random(self) -> Iterator[Execution]:
        cases = self._random_cases()
        yield from (execution for case in cases if (execution := bounded(self._tester, case)) is not None)

    def _random_cases(self) -> Iterator[Case]:
        """Yield a plain case for each goal from the nominal state, then random cases."""
        nominal = self._model.nominal_state
        if self._model.initial_states.holds(nominal):
            yield from (
                Case(name, name, goal, State(self._model.space, dict(nominal))) for name, goal in self._model.goals
            )
        random = RandomCases(self._model)
        with suppress(InputError):  # no combination of random values is allowed
            yield from (random.case(_SEED, number) for number in count(1))


def _best(found: Iterator[DifferentMutant], compared: ComparedRuns) -> DifferentMutant | None:
    """Return the best of a few witnesses: one that kills and breaks a requirement, or kills; `None` without any.

    A witness counts as killing only if the file that it is saved in kills.
    """
    few = list[DifferentMutant]()
    for each in islice(found, _MAX_SHOWN):
        few.append(each)
        if each.kills and not each.is_benign:
            break
    while few:
        place = max(range(len(few)), key=lambda number: _rank(few[number]))
        if not few[place].kills:
            return few[place]
        few[place] = compared.confirmed(few[place])
        if few[place].kills:
            return few[place]
    return None


def _rank(found: DifferentMutant) -> tuple[bool, bool, bool]:
    return found.kills, not found.is_benign, found.original.verdict.passed
