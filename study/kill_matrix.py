"""Which cases find which mutants of one model, by each oracle: what all statistics of the study are made of."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass
from hashlib import sha256
from itertools import groupby, pairwise
from random import Random
from typing import TYPE_CHECKING

from scbm.cases.coverage import Aspect
from scbm.cases.trace import OperationStepped, RunStarted
from scbm.closing import Closer
from scbm.files import write_model
from scbm.model import InputError, OperationState
from scbm.mutation import MutationRuns, mutants_of
from scbm.mutation.equivalence.equivalences import Equivalences
from scbm.mutation.equivalence.mutant_decisions import EquivalentMutant
from scbm.testing import RandomCases, Tester
from scbm.testing.recorded_results import goals_to_record
from scbm.testing.verdicts import FailureKind

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Iterator, Sequence

    from scbm.cases import Case, RecordedGoal
    from scbm.cases.trace import Record
    from scbm.model import BehaviorModel, Value
    from scbm.mutation import Mutant, MutantUnderTest
    from scbm.testing.tester import Execution

ORACLES = ("each difference", "requirements", "built-ins", "recorded")
"""The oracles, from which all see what the model prescribes; `recorded` sees what `built-ins` sees, and more."""

FEWEST = 10
"""A model with fewer mutants that are not equivalent leaves the study."""

ASPECTS = ("disabled", "executing", "timedout", "failed", "completed")


@dataclass(frozen=True, slots=True)
class Counts:
    """How much of a model is studied.

    Attributes:
        cases: the number of random cases of the pool.
        mutants: the maximum number of mutants.
        slowest_s: a model whose random case takes more CPU than so many seconds leaves the study.
    """

    cases: int = 200
    mutants: int = 150
    slowest_s: float = 2.0


@dataclass(frozen=True, slots=True)
class CaseFacts:
    """What predictors and sizes of suites need of a case; sets are the bits of whole numbers.

    Attributes:
        requests: the number of its requests.
        visited: the obligations.
        completed: the operations that completed.
        event_pairs: pairs of records that follow each other in its trace, each with its kind and its changes, numbered
            over all cases of the model.
        state_pairs: pairs of different states that follow each other in its trace, numbered likewise.
    """

    requests: int
    visited: int
    completed: int
    event_pairs: int
    state_pairs: int


@dataclass(frozen=True, slots=True)
class MutantRow:
    """A mutant, and the cases that find it.

    Attributes:
        name: its name.
        operator: its operator.
        found: for each of `ORACLES` the cases that find it, as bits: those of the pool, then those of closing.
    """

    name: str
    operator: str
    found: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class KillMatrix:
    """The results for one model.

    Attributes:
        name: the model in the study.
        group: its group.
        digest: the SHA-256 of the model as it is written.
        obligations: the names of its obligations, in the order of their bits.
        operations: the number of its operations.
        cases: the facts of the cases of the pool that pass.
        closed: the facts of the cases of closing that pass.
        mutants: the mutants that are not proved equivalent.
        equivalent: the number of those that are.
        all_mutants: how many mutants the model has.
        cpu_s: the CPU time of all this.
        left: why the model leaves the study; empty if it stays.
    """

    name: str
    group: str
    digest: str
    obligations: tuple[str, ...] = ()
    operations: int = 0
    cases: tuple[CaseFacts, ...] = ()
    closed: tuple[CaseFacts, ...] = ()
    mutants: tuple[MutantRow, ...] = ()
    equivalent: int = 0
    all_mutants: int = 0
    cpu_s: float = 0.0
    left: str = ""


def kill_matrix(name: str, group: str, model: BehaviorModel, counts: Counts) -> KillMatrix:
    """Return the results for one model."""
    began = time.process_time()
    digest = digest_of(model)
    tester = Tester(model)
    pool = list(RandomCases(model).first(counts.cases, seed=1))
    timed = time.process_time()
    tester.execute(pool[0])
    if time.process_time() - timed > counts.slowest_s:
        return KillMatrix(name, group, digest, left=f"a random case takes more than {counts.slowest_s:g} s")
    closed = [made.case for made in Closer(model).close().cases]
    runs = MutationRuns(tester, [*pool, *closed])
    passed = {case.name for case in runs.cases}
    from_pool = sum(case.name in passed for case in pool)
    originals = OriginalRuns(runs.cases, tester)
    facts = _facts(originals, tester)
    known = tuple(mutants_of(model))
    drawn = sample(known, counts.mutants)
    rows = [(mutant, mutant_row(runs, mutant, originals)) for mutant in drawn]
    equivalent = _equivalent([mutant for mutant, row in rows if not row.found[0]], model)
    kept = tuple(row for mutant, row in rows if mutant.name not in equivalent)
    return KillMatrix(
        name,
        group,
        digest,
        tuple(map(str, tester.obligations)),
        len(model.operations),
        facts[:from_pool],
        facts[from_pool:],
        kept,
        len(equivalent),
        len(known),
        round(time.process_time() - began, 2),
        f"it has only {len(kept)} mutants that are not equivalent" if len(kept) < FEWEST else "",
    )


def digest_of(model: BehaviorModel) -> str:
    """Return the SHA-256 of a model as `scbm` writes it."""
    return sha256(write_model(model).encode()).hexdigest()


def _equivalent(mutants: Sequence[Mutant], model: BehaviorModel) -> frozenset[str]:
    """Return the names of the mutants that are proved equivalent; no case shows a difference for any of `mutants`."""
    if not mutants:
        return frozenset()
    equivalences = Equivalences(model)
    decided = ((mutant.name, equivalences.decide(mutant.model)) for mutant in mutants)
    return frozenset(name for name, decision in decided if isinstance(decision, EquivalentMutant))


def sample(mutants: Sequence[Mutant], most: int) -> tuple[Mutant, ...]:
    """Return at most `most` mutants, the same number of each operator as far as it has so many, drawn with seed 1."""
    if len(mutants) <= most:
        return tuple(mutants)
    random = Random(1)
    left: dict[str, list[Mutant]] = {}
    for mutant in mutants:
        left.setdefault(mutant.operator, []).append(mutant)
    for group in left.values():
        random.shuffle(group)
    drawn: list[Mutant] = []
    while len(drawn) < most:
        for group in left.values():
            if group and len(drawn) < most:
                drawn.append(group.pop())
    kept = {mutant.name for mutant in drawn}
    return tuple(mutant for mutant in mutants if mutant.name in kept)


def operator_weights(model: BehaviorModel, most: int, matrix: KillMatrix | None = None) -> dict[str, float] | None:
    """Return for each operator how many mutants of a model there are for each one in its sample of at most `most`.

    Returns `None` if the model has not as many mutants as its kill `matrix` says, or not as many of an operator: then
    it is another model. The text that `scbm` writes for a model may change without that.
    """
    known = tuple(mutants_of(model))
    drawn = Counter(mutant.operator for mutant in sample(known, most))
    if matrix is not None:
        kept = Counter(row.operator for row in matrix.mutants)
        if matrix.all_mutants != len(known) or any(drawn[name] < count for name, count in kept.items()):
            return None
    return {name: count / drawn[name] for name, count in Counter(mutant.operator for mutant in known).items()}


class OriginalRuns:
    """The runs of cases on the original, each run once, with which those on mutants are compared.

    Attributes:
        executions: the run of each case, in the order of the cases.
    """

    def __init__(self, cases: Iterable[Case], tester: Tester) -> None:
        """Run the cases; `tester` is that of the original."""
        self._tester = tester
        self.executions = tuple(map(tester.execute, cases))
        self._recorded = tuple(map(self.recorded, self.executions))

    def recorded(self, run: Execution) -> tuple[RecordedGoal, ...]:
        """Return what a recorded result would keep of a run, on the original or on a mutant."""
        return goals_to_record(run.trace.records, self._tester.model, self._tester.obligations)

    def differs(self, number: int, run: Execution) -> bool:
        """Return whether the trace of a run differs from that of the case with this number on the original."""
        return run.trace.records != self.executions[number].trace.records

    def is_recorded_otherwise(self, number: int, run: Execution) -> bool:
        """Return whether a recorded result of the case with this number on the original would differ from a run."""
        return self.recorded(run) != self._recorded[number]


def _facts(originals: OriginalRuns, tester: Tester) -> tuple[CaseFacts, ...]:
    operations = {operation.name: 1 << index for index, operation in enumerate(tester.model.operations)}
    measured = sum(tester.obligations.bit(each) for each in tester.obligations if each.aspect is not Aspect.QUEUED)
    events, states = _Pairs(), _Pairs()
    found = []
    for run in originals.executions:
        completed = 0
        for record in run.trace.records:
            if isinstance(record, OperationStepped) and record.target is OperationState.COMPLETED:
                completed |= operations[record.operation]
        of_events = events.bits((type(r).__name__, r.changes) for r in run.trace.records)
        of_states = states.bits(key for key, _ in groupby(_states(run.trace.records)))
        found.append(CaseFacts(len(run.reactions), run.visited & measured, completed, of_events, of_states))
    return tuple(found)


class _Pairs:
    """Numbers for pairs of things that follow each other, in the order in which the pairs are first seen."""

    def __init__(self) -> None:
        self._numbers: dict[tuple[Hashable, Hashable], int] = {}

    def bits(self, things: Iterable[Hashable]) -> int:
        """Return the numbers of the pairs of a sequence, as bits."""
        seen = 0
        for pair in pairwise(things):
            seen |= 1 << self._numbers.setdefault(pair, len(self._numbers))
        return seen


def _states(records: Iterable[Record]) -> Iterator[tuple[Value, ...]]:
    """Yield the values of all variables after each record."""
    state: dict[str, Value] = {}
    for record in records:
        if isinstance(record, RunStarted):
            state.update(record.state)
        if state:  # the state at the start of a run has all earlier changes
            state.update(record.changes)
        yield tuple(state.values())


def mutant_row(runs: MutationRuns, mutant: Mutant, originals: OriginalRuns) -> MutantRow:
    """Return which of the cases of `runs` find a mutant; `originals` are the runs of the same cases."""
    under_test = runs.under_test(mutant)
    found = [0] * len(ORACLES)
    for number, case in enumerate(runs.cases):
        if under_test.may_differ(number, case):
            for index, finds in enumerate(_oracles(under_test, number, case, originals)):
                found[index] |= finds << number
    return MutantRow(mutant.name, mutant.operator, tuple(found))


def _oracles(under_test: MutantUnderTest, number: int, case: Case, originals: OriginalRuns) -> tuple[bool, ...]:
    """Return which oracles find the mutant by the case with a number."""
    if under_test.missing(case) is not None:
        return (True,) * len(ORACLES)
    try:
        run = under_test.execute(case)
    except InputError:
        return (True,) * len(ORACLES)
    kinds = [failure.kind for failure in run.verdict.failures]
    required = any(kind is not FailureKind.BUILT_IN for kind in kinds)
    differs = originals.differs(number, run)
    recorded = bool(kinds) or (differs and originals.is_recorded_otherwise(number, run))
    return differs, required, bool(kinds), recorded
