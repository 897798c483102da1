"""Campaigns of `scbm mutate`: run the suite against the mutants, decide about those that no case killed, and report."""

from __future__ import annotations

from contextlib import AbstractContextManager, closing, nullcontext
from os.path import lexists
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases.coverage import MutantStatus
from scbm.cli.exit_codes import INTERRUPTED
from scbm.cli.options.campaign_options import read_percentages
from scbm.cli.options.option_errors import option_error
from scbm.cli.options.verb_options import FAIL_UNDER
from scbm.cli.output.terminal import activity_display, errors, report_columns, results, write_json
from scbm.closing.interruption import Interruption
from scbm.files import load_located, read_file, suggestion
from scbm.files.file_writer import has_text
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.model.visible_text import counted, shown_path
from scbm.mutation.equivalence.equivalences import Survivors
from scbm.mutation.mutation_operators import MUTATIONS
from scbm.mutation.report.mutation_json import mutation_json
from scbm.mutation.report.mutation_page import mutation_page
from scbm.mutation.report.mutation_report import mutation_report
from scbm.mutation.report.mutation_sarif import mutation_sarif
from scbm.mutation.report.mutation_summary import MutationSummary
from scbm.testing import case_texts

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from scbm.closing import CloseLimits
    from scbm.mutation.mutant_keeper import MutantKeeper
    from scbm.mutation.mutant_results import MutantCounts, MutantResult
    from scbm.mutation.mutation_runs import MutationRuns
    from scbm.mutation.mutation_work import MutationWork
    from scbm.testing.suite import Suite


_MUTANTS = "mutants"


class MutationOptions(Struct, frozen=True):
    """How mutants run, beside the suite and the mutants themselves.

    Attributes:
        jobs: the number of worker processes; `None` for all cores as soon as it takes long.
        limits: the limits for deciding about mutants that no case killed; `None` does not decide about them.
        store: the store that has results of mutants and gets those that it lacks; `None` for none.
    """

    jobs: int | None = None
    limits: CloseLimits | None = None
    store: Path | None = None


class MutationOutput(Struct, frozen=True):
    """The options for the output.

    Attributes:
        thresholds: the least scores, in per cent.
        witnesses: the directory for witnesses that would kill mutants; `None` for none.
        html: the file for the page; `None` for none.
        sarif: the file for the mutants that no case killed; `None` for none.
        json: whether the report is JSON.
    """

    thresholds: Sequence[float] = ()
    witnesses: Path | None = None
    html: Path | None = None
    sarif: Path | None = None
    json: bool = False

    @property
    def files(self) -> dict[str, Path]:
        """The files to write, by their options."""
        asked = {"--html": self.html, "--sarif": self.sarif}
        return {option: path for option, path in asked.items() if path is not None}


def read_score(texts: Sequence[str]) -> tuple[float, ...]:
    """Return thresholds such as `mutants=90` in per cent. Raise `InputError` with all errors."""
    remedy = "write `mutants=90`; `scbm test` and `scbm report` have the thresholds of coverage"
    return tuple(percent for _, percent in read_percentages(texts, [_MUTANTS], lambda _: remedy))


def read_oracle(text: str | None) -> bool:
    """Return whether `--oracle` asks for recorded results. Raise `InputError` for any other text."""
    if text not in (None, "recorded"):
        message = f"there is no oracle `{text}`"
        raise option_error("--oracle", message, "write `--oracle recorded`")
    return text is not None


def read_operators(texts: Sequence[str]) -> tuple[str, ...] | None:
    """Return the names of mutation operators that the command line names, alone or by their groups; `None` for all.

    Raises `InputError` with all unknown names.
    """
    if not texts:
        return None
    groups = dict.fromkeys(mutation.group for mutation in MUTATIONS.values())
    names = [name.strip() for text in texts for name in text.split(",")]
    unknown = dict.fromkeys(name for name in names if name not in MUTATIONS and name not in groups)
    if unknown:
        raise InputError([_unknown(name, list(dict.fromkeys((*groups, *MUTATIONS)))) for name in unknown])
    return tuple(name for name, mutation in MUTATIONS.items() if name in names or mutation.group in names)


def _unknown(name: str, known: Sequence[str]) -> Diagnostic:
    remedy = suggestion(name, known, "the groups and operators are")
    place = Place("--operators", 1, 1, max(1, len(name)))
    return Diagnostic(Slug.BAD_OPTION, f"there is no mutation operator `{name}`", place, remedy, name)


def carry_out_mutants(suite: Suite, work: MutationWork, options: MutationOptions, output: MutationOutput) -> int:
    """Run the suite against the mutants, print the report, write the files, and return the exit code.

    Args:
        suite: the cases, with the model.
        work: the mutants, with the cases.
        options: how they run.
        output: the options for the output.

    Raises:
        InputError: there is no case that passes on the model, so none can kill a mutant; or a file cannot be written.
    """
    witnesses = [] if output.witnesses is None else [output.witnesses]
    suite.writer.refuse_outputs(output.files, {"--witnesses": witnesses}, {"--store": options.store})
    loop = MutationLoop(suite, options, work)
    with loop.interruption.handled():
        return _reported(_summary(suite, loop), suite, output, loop)


def _reported(summary: MutationSummary, suite: Suite, output: MutationOutput, loop: MutationLoop) -> int:
    """Print the report, write the files, and return the exit code."""
    if output.json:
        write_json(mutation_json(summary))
    else:
        results().lines(mutation_report(summary, report_columns()))
    if output.witnesses is not None:
        _save_witnesses(summary, suite, output.witnesses)
    for option, path in output.files.items():
        text = mutation_sarif(summary) if option == "--sarif" else mutation_page(summary, read_file(suite.file))
        suite.writer.write(option, path, text.encode())
    if loop.kept:
        errors().line(loop.kept)
    if output.files:
        errors().line(f"Written: {', '.join(map(str, output.files.values()))}")
    if summary.ended_early:
        return INTERRUPTED
    if loop.work.entries is not None and not summary.results:
        return 0  # nothing that changed can have mutants, so no threshold is about it
    return 0 if _is_met(summary.counts, output.thresholds) else 1


def _summary(suite: Suite, loop: MutationLoop) -> MutationSummary:
    """Run the suite against the mutants, and show the progress."""
    _, places = load_located(suite.file)
    with activity_display(suite.activity) as show:
        try:
            with loop.interruption.stage():
                loop.interruption.check()
                runs = loop.work.runs()
        except KeyboardInterrupt:
            errors().prose(f"scbm: {BEFORE_FIRST}: the cases were running on the model itself")
            raise
        if not runs.cases:
            raise InputError([_no_case(suite, runs.failing)])
        done = loop.carry_out(runs, loop.interruption.checked(show))
    command = f"scbm mutate {shown_path(str(suite.file))}{suite.test_options}"
    failing, file = tuple(runs.failing), str(suite.file)
    return MutationSummary(
        suite.model, file, places, suite.words, len(runs.cases), failing, tuple(done), command, loop.ended_early
    )


def _save_witnesses(summary: MutationSummary, suite: Suite, directory: Path) -> None:
    """Write the witnesses that would kill mutants, and those that only show them. Raise `InputError`."""
    texts = case_texts(summary.witnesses, directory, suite.model, suite.file)
    edited = [path for path, text in texts.items() if lexists(path) and not has_text(path, text)]
    suite.writer.write_all({path: text for path, text in texts.items() if path not in edited}, overwrite=False)
    written = counted(len(texts) - len(edited), "witness", "witnesses")
    left = f"; left as they are, with other content: {', '.join(path.name for path in edited)}" if edited else ""
    errors().line(f"Written: {written} in {directory}{left}")


def _no_case(suite: Suite, failing: Sequence[str]) -> Diagnostic:
    message = "no case passes on the model, so none can kill a mutant" if failing else "there are no cases to run"
    test = f"scbm test {shown_path(str(suite.file))}{suite.test_options}"
    remedy = f"`{test}` reports why" if failing else "add `--cases 20`"
    return Diagnostic(Slug.NO_CASES, message, Place("CASES"), remedy)


def _is_met(counts: MutantCounts, thresholds: Sequence[float]) -> bool:
    """Return whether all thresholds are met; print a sentence for each that is not."""
    missed = [percent for percent in thresholds if counts.score.percent is None or counts.score.percent < percent]
    for percent in missed:
        found = f"{counts.score} of the mutants are killed, under {percent:g} %."
        none = f"There are no mutants to kill, so {FAIL_UNDER} {_MUTANTS}={percent:g} cannot be met."
        errors().prose(found if counts.score.of else none)
    return not missed


BEFORE_FIRST = "interrupted before the first mutant had a result"
"""The words for the work of an interrupted command that has no results yet."""


_NOT_COMPARED = "it is not compared yet: the command was interrupted"
"""The reason why nothing more is known of a mutant."""


class MutationLoop:
    """The mutants of one command, with the results so far.

    Attributes:
        work: the suite and the mutants.
        kept: at the end, how many results the store did not have, in words; empty without a store.
        interruption: the handling of Ctrl-C.
        ended_early: at the end, how far the command was when it was interrupted; empty if it was not.
    """

    def __init__(self, suite: Suite, options: MutationOptions, work: MutationWork) -> None:
        self._suite = suite
        self._options = options
        self.work = work
        self._results: list[MutantResult] = []
        self.kept = ""
        self.interruption = Interruption()
        self.ended_early = ""

    def carry_out(self, runs: MutationRuns, show: Callable[[str], None]) -> list[MutantResult]:
        """Return the results of all mutants, in their order; after an interruption, those so far.

        Args:
            runs: the suite as it ran on the original.
            show: shows the progress.

        Raises:
            InputError: the store cannot be used, or a worker process was lost.
            KeyboardInterrupt: the user ended the command before the first mutant had a result; a line says so.
        """
        with self._store() as keeper:
            try:
                with self.interruption.stage():
                    self._run(runs, keeper, show)
                    if self._options.limits is not None and any(map(_is_open, self._results)):
                        self._decide(keeper, show)
            except KeyboardInterrupt:
                errors().prose(f"scbm: {self._interrupted(keeper)}")
                if not self._results:
                    raise
                self.ended_early = f"interrupted: {self._done}"
                self._results = [replace(r, reason=_NOT_COMPARED) if _is_open(r) else r for r in self._results]
            except InputError:
                if keeper is not None and keeper.added:
                    kept = f"{self._options.store} has {counted(len(keeper.added), 'result')} of this command"
                    errors().prose(f"scbm: {kept}; once it can be written again, the same command goes on")
                raise
        if keeper is not None and not self.ended_early:
            self.kept = f"{self._options.store}: {self._kept(keeper)}"
        return self._results

    def _store(self) -> AbstractContextManager[MutantKeeper | None]:
        """Return the store of the command line, if it names one."""
        if self._options.store is None:
            return nullcontext()
        from scbm.mutation.mutant_keeper import keeping_mutants  # noqa: PLC0415 - a database, which few runs need

        options = self._options
        return keeping_mutants(self._options.store, self._suite, options.limits, records=self.work.records)

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
                    survivors = survivors or Survivors(self._suite.model, limits, show, self._suite.requirements)
                    decided = survivors.decided(result)
                    if keeper is not None:
                        keeper.add(decided, is_decided=True)
                self._results[place] = decided

    def _interrupted(self, keeper: MutantKeeper | None) -> str:
        """Return how many results there were before an interruption, as a sentence."""
        if not self._results:
            has = "" if keeper is None else f"; {self._options.store} has {keeper.known_in_words}"
            return f"{BEFORE_FIRST}{has}"
        if keeper is None:
            return f"interrupted: {self._done}; with `--store FILE`, the same command would go on"
        return f"interrupted: {self._done}; {self._options.store} has these results, and the same command goes on"

    @property
    def _done(self) -> str:
        done, count = len(self._results), len(self.work.mutants)
        if done < count:
            return f"ran the cases on {done} of {counted(count, 'mutant')}"
        open_ones = sum(map(_is_open, self._results))
        return f"ran the cases on {counted(count, 'mutant')}, and {open_ones} of them are not compared yet"

    def _kept(self, keeper: MutantKeeper) -> str:
        """Return how many results are new in the store, as a sentence."""
        new = len(keeper.added) or "none"
        return f"results of {counted(len(self._results), 'mutant')}, {new} of them new"


def _is_open(result: MutantResult) -> bool:
    """Return whether no case killed a mutant and nothing else is known of it."""
    return result.status is MutantStatus.UNDECIDED and not result.reason
