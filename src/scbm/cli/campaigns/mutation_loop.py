"""The loop of `scbm mutate`: runs the suite against mutants, decides about those that no case killed, keeps results."""

from __future__ import annotations

from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.cli.output.terminal import errors
from scbm.closing.mutants.survivors import Survivors
from scbm.model import InputError
from scbm.reports import counted
from scbm.testing.mutants import MutantResult, MutantStatus

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.cli.campaigns.mutant_keeper import MutantKeeper
    from scbm.cli.campaigns.mutation_campaign import MutationOptions
    from scbm.cli.campaigns.suite import Suite
    from scbm.testing.batches.mutation_work import MutationWork
    from scbm.testing.mutants import MutationRuns


BEFORE_FIRST = "interrupted before the first mutant had a result"
"""The words for the work of an interrupted command that has no results yet."""


class MutationLoop:
    """The mutants of one command, with the results so far.

    Attributes:
        work: the suite and the mutants.
        kept: at the end, how many results the store did not have, in words; empty without a store.
    """

    def __init__(self, suite: Suite, options: MutationOptions, work: MutationWork) -> None:
        self._suite = suite
        self._options = options
        self.work = work
        self._results: list[MutantResult] = []
        self._decided = 0
        self.kept = ""

    def carry_out(self, runs: MutationRuns, show: Callable[[str], None]) -> list[MutantResult]:
        """Return the results of all mutants, in their order.

        Args:
            runs: the suite as it ran on the original.
            show: shows the progress.

        Raises:
            InputError: the store cannot be used, or a worker process was lost.
            KeyboardInterrupt: the user ended the command; a line says what is in the store.
        """
        with self._store() as keeper:
            try:
                self._run(runs, keeper, show)
                if self._options.limits is not None and any(map(_is_open, self._results)):
                    self._decide(keeper, show)
            except KeyboardInterrupt:
                errors().line(f"scbm: {self._interrupted(keeper)}")
                raise
            except InputError:
                if keeper is not None and keeper.added:
                    kept = f"{self._options.store} has {counted(len(keeper.added), 'result')} of this command"
                    errors().line(f"scbm: {kept}; once it can be written again, the same command goes on")
                raise
        if keeper is not None:
            self.kept = f"{self._options.store}: {self._kept(keeper)}"
        return self._results

    def _store(self) -> AbstractContextManager[MutantKeeper | None]:
        """Return the store of the command line, if it names one."""
        if self._options.store is None:
            return nullcontext()
        from scbm.cli.campaigns.mutant_keeper import keeping_mutants  # noqa: PLC0415 - a database, which few runs need

        options = self._options
        return keeping_mutants(self._options.store, self._suite, options.limits, records=options.records)

    def _run(self, runs: MutationRuns, keeper: MutantKeeper | None, show: Callable[[str], None]) -> None:
        """Run the suite against the mutants whose results the store does not have."""
        work = self.work
        known = {} if keeper is None else keeper.ran(work.mutants)
        todo = replace(work, left_out=frozenset(known)) if known else work
        killed = 0
        with closing(todo.results(runs, self._options.jobs)) as fresh:
            for mutant in work.mutants:
                result = known.get(mutant.name) or next(fresh)
                self._results.append(result)
                if keeper is not None and mutant.name not in known:
                    keeper.add(result, is_decided=False)
                killed += result.status is MutantStatus.KILLED
                show(f"{len(self._results)} of {len(work.mutants)} mutants, {killed} killed")

    def _decide(self, keeper: MutantKeeper | None, show: Callable[[str], None]) -> None:
        """Decide about the mutants that no case killed and about which the store does not say enough."""
        survivors: Survivors | None = None
        limits = self._options.limits
        assert limits is not None  # noqa: S101 - the caller has checked it
        count, compared = sum(map(_is_open, self._results)), 0
        for place, result in enumerate(self._results):
            if _is_open(result):
                compared += 1
                show(f"comparing {compared} of {counted(count, 'mutant')} that no case killed: {result.mutant.name}")
                decided = None if keeper is None else keeper.decided(result)
                if decided is None:
                    survivors = survivors or Survivors(self._suite.model, limits, show)
                    decided = survivors.decided(result)
                    if keeper is not None:
                        keeper.add(decided, is_decided=True)
                self._results[place] = decided
            self._decided = place + 1

    def _interrupted(self, keeper: MutantKeeper | None) -> str:
        """Return how many results there were before an interruption, as a sentence."""
        if not self._results:
            has = "" if keeper is None else f"; {self._options.store} has {keeper.known_in_words}"
            return f"{BEFORE_FIRST}{has}"
        done, count = len(self._results), len(self.work.mutants)
        what = f"ran the cases on {done} of {counted(count, 'mutant')}"
        if done == count:
            open_ones = sum(map(_is_open, self._results[self._decided :]))
            what = f"ran the cases on {counted(count, 'mutant')}, and {open_ones} of them are not compared yet"
        if keeper is None:
            return f"interrupted: {what}; these results are lost: `--store FILE` keeps results"
        return f"interrupted: {what}; {self._options.store} has these results, and the same command goes on"

    def _kept(self, keeper: MutantKeeper) -> str:
        """Return how many results are new in the store, as a sentence."""
        new = len(keeper.added) or "none"
        return f"results of {counted(len(self._results), 'mutant')}, {new} of them new"


def _is_open(result: MutantResult) -> bool:
    """Return whether no case killed a mutant and nothing else is known of it."""
    return result.status is MutantStatus.UNDECIDED and not result.reason
