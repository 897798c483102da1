"""A suite and the mutants that it is run against, on one core or on several; results do not depend on the cores."""

from __future__ import annotations

import pickle
from contextlib import closing
from functools import cached_property
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.mutation.distinct_mutants import mutants_of
from scbm.mutation.mutant_results import MutantResult
from scbm.mutation.mutation_runs import MutationRuns
from scbm.testing.batches.all_cores import on_cores
from scbm.testing.batches.worker_processes import WorkerPool
from scbm.testing.tester import Tester

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator

    from scbm.mutation.mutants import Mutant, SubjectKind
    from scbm.store import StoredMutant
    from scbm.testing.batches.campaign_work import CampaignWork

_CHUNK = 8
"""Number of mutants of one request to a worker: some tens of milliseconds."""


class MutationWork(Struct, frozen=True, dict=True):
    """A suite and some mutants of its model; it can be sent to other processes as it is.

    Attributes:
        campaign: the suite, with the model.
        operators: the names of the mutation operators; `None` for all.
        entries: the entries of the model whose mutants are made; `None` for all.
        records: whether cases without a recorded result are compared with what they did on the original.
        finds_visitors: whether a killed mutant is run further, until a case kills it that visits its obligation.
        left_out: the names of mutants that are not run.
    """

    campaign: CampaignWork
    operators: tuple[str, ...] | None = None
    entries: tuple[tuple[SubjectKind, str], ...] | None = None
    records: bool = False
    finds_visitors: bool = False
    left_out: frozenset[str] = frozenset()

    @cached_property
    def mutants(self) -> tuple[Mutant, ...]:
        """The mutants, in the order of reports."""
        entries = None if self.entries is None else frozenset(self.entries)
        made = (m for m in mutants_of(self.campaign.model, self.operators) if m.name not in self.left_out)
        return tuple(m for m in made if entries is None or (m.kind, m.subject) in entries)

    def runs(self) -> MutationRuns:
        """Run the suite on the original. Raise `InputError` if a case cannot be drawn, or does not fit the model."""
        original, cases = Tester(self.campaign.model), self.campaign.cases()
        return MutationRuns(original, cases, records=self.records, finds_visitors=self.finds_visitors)

    def results(self, runs: MutationRuns, jobs: int | None = None) -> Generator[MutantResult, None, None]:
        """Yield the result of each mutant, in their order.

        Args:
            runs: the suite as it ran on the original.
            jobs: the number of worker processes. `None` for none at first, and for all cores once that takes long.

        Raises:
            InputError: a worker process was lost.
        """
        return on_cores(map(runs.result, self.mutants), len(self.mutants), jobs, self._in_processes)

    def _in_processes(self, first: int, count: int) -> Iterator[MutantResult]:
        workers = WorkerPool(_take_mutants, pickle.dumps(self), count)
        begins = range(first, len(self.mutants), _CHUNK)
        with closing(workers.results(_run_in_worker, begins, "ran mutants", "run")) as results:
            for begin, of_chunk in zip(begins, results, strict=True):
                for mutant, stored in zip(self.mutants[begin : begin + _CHUNK], of_chunk, strict=True):
                    yield MutantResult.of_stored(stored, mutant, self.campaign.model)


# in a worker

_taken: list[tuple[MutationWork, MutationRuns]] = []
"""The mutants of this worker process, with the suite as it ran on the original."""


def _take_mutants(sent: bytes) -> None:
    work: MutationWork = pickle.loads(sent)  # noqa: S301 - from our own parent
    _taken[:] = [(work, work.runs())]


def _run_in_worker(begin: int) -> list[StoredMutant]:
    ((work, runs),) = _taken
    results = map(runs.result, work.mutants[begin : begin + _CHUNK])
    return [each.stored(work.campaign.model) for each in results]
