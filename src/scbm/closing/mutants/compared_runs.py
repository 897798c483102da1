"""One case run on a model and on a mutant: whether the traces differ."""

from __future__ import annotations

from dataclasses import replace
from itertools import zip_longest
from typing import TYPE_CHECKING

from msgspec import structs

from scbm.cases.trace import RequestSent, RunStarted, assignments, sentence_of
from scbm.closing.scripts.case_search import bounded
from scbm.files import read_case, write_case
from scbm.model import State, format_moment

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.cases import Case
    from scbm.cases.trace import Record
    from scbm.closing.mutants.mutant_decisions import DifferentMutant
    from scbm.model import BehaviorModel
    from scbm.testing import Execution, Tester


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
