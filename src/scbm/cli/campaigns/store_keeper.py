"""`--store`: adds each result to a coverage store at once."""

from __future__ import annotations

import sys
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from msgspec import Struct
from rich.text import Text

from scbm.cases.trace import End
from scbm.cli.output.terminal import errors, report_columns
from scbm.closing.certificate_files import MAX_BYTES
from scbm.closing.proved_statuses import claims_of
from scbm.files import read_file
from scbm.model import InputError
from scbm.model.visible_text import counted
from scbm.reports.terminal.store_report import clock_warning, in_all, since_last_run, united_lines
from scbm.store import (
    StoredCertificate,
    begin_run,
    drawn_recipe,
    keep_smallest,
    network_words,
    sayable,
    write_store,
    written_recipe,
)
from scbm.testing.campaign_results_json import lifted_json

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from scbm.cases import Case, Network
    from scbm.cases.coverage import AssertionEvidence, Coverage
    from scbm.closing.certificate_files import CheckedCertificate
    from scbm.closing.proved_statuses import StatusEvidence
    from scbm.model import BehaviorModel
    from scbm.store import Recipe, SmallestCase, StoredRun, StoreFigures, StoreWriter
    from scbm.testing import CaseResult, WrittenCase
    from scbm.testing.decided_requirements import KnownDecision
    from scbm.testing.event_logs.event_log import EventLog
    from scbm.testing.suite import Suite


@contextmanager
def keeping(path: Path, suite: Suite, where: str | None, evidence: StatusEvidence | None) -> Iterator[Keeper]:
    """Return a keeper that adds the results of this command to a store. Raise `InputError` if it cannot.

    Args:
        path: the store.
        suite: the cases of the command.
        where: a description of the nodes that run the cases; `None` for simulation.
        evidence: the certificates and waivers that count; `None` for those of the model alone.
    """
    model = suite.model
    waivers = model.waivers if evidence is None else (*evidence.waivers.counting, *evidence.waivers.expired)
    run = begin_run(["scbm", *sys.argv[1:]], str(suite.file), read_file(suite.file), where, waivers)
    with ExitStack() as store:
        writer = store.enter_context(write_store(path, model, run))
        writer.keep_certificates([] if evidence is None else list(map(_stored, evidence.sound)))
        keeper = Keeper(writer, path, model, run)
        yield keeper
        keeper.finish(store)


def _stored(checked: CheckedCertificate) -> StoredCertificate:
    path = checked.file.path
    return StoredCertificate.of(sayable(str(path)), read_file(path, MAX_BYTES), dict(claims_of(checked)))


def recipe_of(
    case: Case, real: tuple[str, ...] | None, written: Mapping[str, WrittenCase], network: str, model: BehaviorModel
) -> Recipe:
    """Return the recipe of a case that has run or will run.

    Args:
        case: the case with what the command line added to it.
        real: if it runs over nodes, the resources that are real.
        written: by their names, the cases from files, as the files say them; all others are drawn.
        network: the words for the network that these are drawn with.
        model: the model.
    """
    if case.name not in written:
        return drawn_recipe(case, network, real)
    from_file = written[case.name]
    return written_recipe(from_file.case, model, sayable(str(from_file.path)), case, real)


class Keeper:
    """Adds results to a store.

    Attributes:
        is_whole: whether all results were added; after an error the campaign continues without the store.
        is_unfinished: whether the store may have cases of a run that is not marked as finished.
        evidence: at the end, what the store says about asserted obligations; `None` before, and after an error.
        decisions: at the end, the answers of the last closing about requirements.
    """

    def __init__(self, writer: StoreWriter, path: Path, model: BehaviorModel, run: StoredRun) -> None:
        self.is_whole = True
        self.is_unfinished = False
        self.evidence: AssertionEvidence | None = None
        self.decisions: tuple[KnownDecision, ...] = ()
        self._writer = writer
        self._path = path
        self._model = model
        self._run = run
        self._totals: StoreFigures | None = None

    def keep(
        self,
        ran: Iterable[tuple[int, CaseResult, EventLog | None]],
        written: Mapping[str, WrittenCase],
        network: Network | None,
    ) -> None:
        """Add results to the store, until it cannot be written any more.

        Args:
            ran: for each case its position, its result and the log of its run over nodes.
            written: by their names, the cases from files, as the files say them; all others are drawn.
            network: what these are drawn with; `None` if another was drawn for each.
        """
        words = network_words(network)
        for position, result, log in ran:
            if not self.is_whole:
                return
            recipe = recipe_of(result.case, None if log is None else log.real, written, words, self._model)
            with self._store_errors():
                planner = None if log is None else log.planner
                self._writer.add(position, recipe, result, self._log(log), planner)
                self.is_unfinished = self.is_unfinished or result.verdict.end is not End.LOST

    def keep_smallest(self, smallest: Mapping[str, Sequence[SmallestCase]]) -> None:
        """Add the smallest cases that were found after the run, by the names of the cases that failed."""
        if smallest and self.is_whole:
            with self._store_errors():
                keep_smallest(self._path, self._run, smallest)

    @contextmanager
    def _store_errors(self) -> Iterator[None]:
        """Print an error of the store instead of raising it: the results of the cases stay valid."""
        try:
            yield
        except InputError as error:
            errors().diagnostics(error.diagnostics)
            self.is_whole = False

    def _log(self, log: EventLog | None) -> str | None:
        """Return the text of the log of a run over nodes."""
        if log is None:
            return None
        from scbm.testing.event_logs.event_log import write_event_log  # noqa: PLC0415 - it takes long to load; few runs need it

        return write_event_log(log, self._model)

    def finish(self, store: ExitStack) -> None:
        """Close the store after the last case, so that its run is finished; show an error."""
        self.is_unfinished = False  # after an interruption here, it is unknown whether the run is finished
        with self._store_errors(), store:
            if self.is_whole:
                self._totals = self._writer.totals()
                self.evidence = self._writer.evidence()
                self.decisions = self._writer.decisions()

    def since(self, coverage: Coverage) -> Since:
        """Return the changes since the last run, and the figure of the whole store."""
        before = self._writer.before
        lifted = None if self._totals is None else self._totals.lifted
        is_united = lifted is not None and bool(lifted.others)
        line = since_last_run(coverage.obligations, before, coverage.visited, is_united=is_united)
        if not self.is_whole or self._totals is None:
            return Since((Text(), line), {"file": str(self._path), "is_whole": False}, is_whole=False)
        cases, figure = self._totals.cases, self._totals.figure
        lost = self._writer.lost
        unfinished = [Text(f"{counted(lost, 'lost case')}: not in {self._path}", style="yellow")] if lost else []
        later = self._writer.later_start
        clock = [] if later is None else [clock_warning(later, str(self._path))]
        in_store = in_all(cases, figure, str(self._path))
        united = united_lines(lifted, report_columns())
        lines = (Text(), line, in_store, *united, *unfinished, *clock)
        visited = 0 if before is None else before.visited
        names = coverage.obligations.names
        data = {
            "file": str(self._path),
            "is_whole": True,
            "cases": cases,
            "visited": figure.visited,
            "percent": figure.percent,
            "is_first_run": before is None,
            "later_start": later,
            **lifted_json(lifted),
            "gained": list(names(coverage.visited & ~visited)),
            "lost": list(names(visited & ~coverage.visited)),
        }
        return Since(lines, data, is_whole=True, is_united=is_united)


class Since(Struct, frozen=True):
    """The effect of a run on a store, as text and as JSON.

    Attributes:
        is_whole: whether all of the run was added.
        is_united: whether the store has cases of the same lifted model under other objects.
    """

    lines: tuple[Text, ...]
    as_json: dict[str, Any]
    is_whole: bool
    is_united: bool = False
