"""The search for witnesses: cases whose runs on a model and on a mutant differ, compared run by run."""

from __future__ import annotations

from contextlib import suppress
from itertools import count, islice, zip_longest
from typing import TYPE_CHECKING

from msgspec import structs
from msgspec.structs import replace

from scbm.cases import Case, CaseLimits
from scbm.cases.trace import RequestSent, RunStarted, assignments, sentence_of
from scbm.closing.scripts.case_scripts import CaseScripts
from scbm.closing.scripts.case_search import bounded
from scbm.files import read_case, write_case
from scbm.model import InputError, Outcome, State, format_moment
from scbm.mutation.equivalence.mutant_decisions import DifferentMutant
from scbm.mutation.equivalence.shown_states import ShownStates
from scbm.planning import PlanCache
from scbm.testing import RandomCases, Tester

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.cases.trace import Record
    from scbm.model import BehaviorModel, Requirement
    from scbm.mutation.equivalence.observed_runs import ObservedRuns
    from scbm.mutation.equivalence.runner_differences import StateDifference
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

    def __init__(self, observed: ObservedRuns, most_tried: int, requirements: tuple[Requirement, ...] = ()) -> None:
        """Prepare the search.

        Args:
            observed: the runs of the original.
            most_tried: the maximum number of differences, and of random cases, that are tried for a mutant.
            requirements: the requirements of each case beside those of the model.
        """
        self._requirements = requirements
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
            original = self._run(case)
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
        yield from (execution for case in cases if (execution := self._run(case)) is not None)

    def _run(self, case: Case) -> Execution | None:
        return bounded(self._tester, replace(case, requirements=self._requirements))

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


class ComparedRuns:
    """Runs cases on a mutant, and compares their traces with those of the original."""

    def __init__(self, original: Tester, mutant: BehaviorModel) -> None:
        """Prepare runs. They are judged by the requirements of the original, in the world of the original."""
        self._of_original = original
        self._tester = original.of_mutant(mutant, plans_alike=False)
        self._original = original.model
        self._mutant = mutant

    def confirmed(self, found: DifferentMutant) -> DifferentMutant:
        """Return a witness that kills; one whose file does not kill is marked as such."""
        text = write_case(found.recorded(found.case.name), self._original, None)
        saved = read_case(text, self._original)
        on_original = self._of_original.execute(saved)
        on_mutant = self._tester.execute(case_on(self._mutant, saved, self._original))
        fails = on_original.verdict.passed and not on_mutant.verdict.passed
        return found if fails else replace(found, is_lost_in_file=True)

    def differing(self, original: Execution, case: Case) -> Execution | None:
        """Return the run of a case on the mutant if its trace is not that of the run on the original; else `None`."""
        mutated = bounded(self._tester, case_on(self._mutant, case, self._original))
        if mutated is None or _is_same(original.trace.records, mutated.trace.records):
            return None
        return mutated


def case_on(mutant: BehaviorModel, case: Case, original: BehaviorModel) -> Case:
    """Return a case of the original as its file means it for a mutant: a nominal value is that of the mutant."""
    before, after = original.nominal_state, mutant.nominal_state
    changed = {name: after[name] for name, value in case.initial.items() if value == before[name] != after[name]}
    return replace(case, initial=State(mutant.space, {**dict(case.initial), **changed})) if changed else case


def first_difference(original: Execution, mutated: Execution, nominal: State) -> str:
    """Return what happens first in only one of two runs of a case, as a clause.

    Args:
        original: the run on the model.
        mutated: the run on the mutant.
        nominal: the nominal state of the model.
    """
    pairs = zip_longest(original.trace.records, mutated.trace.records)
    one, other = next((pair for pair in pairs if None in pair or not _is_same_record(*pair)), (None, None))
    before, after = _event(one, nominal), _event(other, nominal)
    if one is None or other is None or before != after:
        return f"{before} on the model, and {after} on the mutant"
    known, changed = _changes(one, other, nominal), _changes(other, one, nominal)
    return f"{before}, where the model sets {known or 'nothing else'}, and the mutant {changed or 'nothing else'}"


def differ_only_in_payloads(original: Execution, mutated: Execution) -> bool:
    """Return whether two runs of a case differ only in the values that requests carry."""
    pairs = zip_longest(original.trace.records, mutated.trace.records)
    return all(_without_payload(one) == _without_payload(other) for one, other in pairs)


def _without_payload(record: Record | None) -> Record | None:
    return structs.replace(record, payload=()) if isinstance(record, RequestSent) else record


def _event(record: Record | None, nominal: State) -> str:
    """Return the sentence of a record with its time."""
    if record is None:
        return "nothing more"
    return f'"{sentence_of(record, nominal).numbered_text}" at {format_moment(record.at_ns)}'


def _changes(record: Record, other: Record, nominal: State) -> str:
    """Return what a record changes, or begins with, unlike another record."""
    there = dict(other.changes) | (dict(other.state) if isinstance(other, RunStarted) else {})
    here = dict(record.changes) | (dict(record.state) if isinstance(record, RunStarted) else {})
    names = [name for name in here if name in nominal and there.get(name) != here[name]]
    return assignments(tuple((name, here[name]) for name in names))


def _is_same(one: Sequence[Record], other: Sequence[Record]) -> bool:
    return len(one) == len(other) and all(map(_is_same_record, one, other))


def _is_same_record(one: Record, other: Record) -> bool:
    """Return whether two records are equal, but for the states of operations that only one of the models has."""
    if one == other or not (isinstance(one, RunStarted) and isinstance(other, RunStarted)):
        return one == other
    before, after = dict(one.state), dict(other.state)
    same = all(value == after.get(name, value) for name, value in before.items())
    return same and (one.at_ns, one.goal, one.predicate, one.changes) == (
        other.at_ns,
        other.goal,
        other.predicate,
        other.changes,
    )
