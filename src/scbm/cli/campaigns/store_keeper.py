"""`--store`: results that are added to a coverage store as they come."""

from __future__ import annotations

import sys
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rich.text import Text

from scbm.cases.trace import End
from scbm.cli.output.terminal import errors
from scbm.files import read_file
from scbm.model import InputError
from scbm.reports import counted
from scbm.reports.terminal.combined_report import in_all, since_last_run
from scbm.store import begin_run, drawn_recipe, network_words, sayable, write_store, written_recipe

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    from scbm.cases import Network
    from scbm.cases.coverage import Coverage, Figure
    from scbm.model import BehaviorModel
    from scbm.store import Recipe, StoreWriter
    from scbm.testing import CaseResult, Execution, WrittenCase


@contextmanager
def keeping(path: Path, model: BehaviorModel, model_file: Path, where: str | None = None) -> Iterator[Keeper]:
    """A store to add the results of this command to. Raises `InputError` if it is none that can be added to.

    Args:
        path: the store.
        model: what is tested.
        model_file: its file.
        where: where the cases run, in words; `None` for simulation.
    """
    run = begin_run(["scbm", *sys.argv[1:]], str(model_file), read_file(model_file), where)
    with ExitStack() as store:
        keeper = Keeper(store.enter_context(write_store(path, model, run)), path, model)
        yield keeper
        keeper.finish(store)


class Keeper:
    """Adds results to a store.

    Attributes:
        is_whole: whether everything was added; a full disk is told, and the campaign goes on without the store.
        is_unfinished: whether the store has cases of a run that is not finished there, for all that is known.
    """

    def __init__(self, writer: StoreWriter, path: Path, model: BehaviorModel) -> None:
        self.is_whole = True
        self.is_unfinished = False
        self._writer = writer
        self._path = path
        self._model = model
        self._totals: tuple[int, Figure] | None = None

    def kept(
        self, executions: Iterable[Execution], written: Mapping[str, WrittenCase], network: Network | None
    ) -> Iterator[CaseResult]:
        """The results, each after it was added.

        Args:
            executions: what comes of cases.
            written: by their names, those that are from files, as the files say them; all others are drawn.
            network: what these are drawn with; `None` if another was drawn for each.
        """
        words = network_words(network)
        for position, execution in enumerate(executions, start=1):
            if self.is_whole:
                self._add(position, self._recipe(execution, written, words), execution)
            yield execution.result

    def _recipe(self, execution: Execution, written: Mapping[str, WrittenCase], words: str) -> Recipe:
        """What decides a case. One that was lost has no log, and is not added."""
        case, real = execution.case, None if execution.log is None else execution.log.real
        if case.name not in written:
            return drawn_recipe(case, words, real)
        from_file = written[case.name]
        return written_recipe(from_file.case, self._model, sayable(str(from_file.path)), case, real)

    def _add(self, position: int, recipe: Recipe, execution: Execution) -> None:
        with self._store_errors():
            self._writer.add(position, recipe, execution.result, self._log(execution))
            self.is_unfinished = self.is_unfinished or execution.verdict.end is not End.LOST

    @contextmanager
    def _store_errors(self) -> Iterator[None]:
        """Tells an error of the store, instead of raising it: the cases are not to blame."""
        try:
            yield
        except InputError as error:
            errors().diagnostics(error.diagnostics)
            self.is_whole = False

    def _log(self, execution: Execution) -> str | None:
        """The text of the log of a run over nodes."""
        if execution.log is None:
            return None
        from scbm.nodes.log.event_log import write_event_log  # noqa: PLC0415 - it takes long to load; few runs need it

        return write_event_log(execution.log, self._model)

    def finish(self, store: ExitStack) -> None:
        """Close the store after the last case, so that its run is finished; show an error."""
        self.is_unfinished = False  # who interrupts this cannot know
        with self._store_errors(), store:
            self._totals = self._writer.totals() if self.is_whole else None

    def since(self, coverage: Coverage) -> Since:
        """What this run visits more and less than the last one, and what the whole store visits, once it is closed."""
        before = self._writer.before
        line = since_last_run(coverage.obligations, before, coverage.visited)
        if not self.is_whole or self._totals is None:
            return Since((Text(), line), {"file": str(self._path), "is_whole": False}, is_whole=False)
        cases, figure = self._totals
        lost = self._writer.lost
        unfinished = [Text(f"{counted(lost, 'lost case')}: not in {self._path}", style="yellow")] if lost else []
        lines = (Text(), line, in_all(cases, figure, str(self._path)), *unfinished)
        visited = 0 if before is None else before.visited
        names = coverage.obligations.names
        data = {
            "file": str(self._path),
            "is_whole": True,
            "cases": cases,
            "visited": figure.visited,
            "percent": figure.percent,
            "is_first_run": before is None,
            "gained": list(names(coverage.visited & ~visited)),
            "lost": list(names(visited & ~coverage.visited)),
        }
        return Since(lines, data, is_whole=True)


@dataclass(frozen=True, slots=True)
class Since:
    """What a store says when a run has been added to it, for people and for machines.

    Attributes:
        is_whole: whether all of the run was added.
    """

    lines: tuple[Text, ...]
    as_json: dict[str, Any]
    is_whole: bool
