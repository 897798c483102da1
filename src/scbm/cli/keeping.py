"""`--store`: results that are added to a coverage store as they come."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from rich.text import Text

from scbm.cli.output import errors
from scbm.errors import InputError
from scbm.notation import read_file
from scbm.reports import counted
from scbm.reports.since import in_all, since_last_run
from scbm.storing import begin_run, drawn_recipe, network_words, sayable, write_store, written_recipe

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path

    from scbm.cases import Case, Network
    from scbm.coverage import Coverage
    from scbm.model import BehaviorModel
    from scbm.storing import Recipe, StoreWriter
    from scbm.testing import CaseResult, WrittenCase


@contextmanager
def keeping(path: Path, model: BehaviorModel, model_file: Path) -> Iterator[Keeper]:
    """A store to add the results of this command to. Raises `InputError` if it is none that can be added to."""
    run = begin_run(["scbm", *sys.argv[1:]], str(model_file), read_file(model_file))
    with write_store(path, model, run) as writer:
        yield Keeper(writer, path, model)


class Keeper:
    """Adds results to a store.

    Attributes:
        is_whole: whether everything was added; a full disk is told, and the campaign goes on without the store.
    """

    def __init__(self, writer: StoreWriter, path: Path, model: BehaviorModel) -> None:
        self.is_whole = True
        self._writer = writer
        self._path = path
        self._model = model

    def kept(
        self, results: Iterable[CaseResult], written: Mapping[str, WrittenCase], network: Network | None
    ) -> Iterator[CaseResult]:
        """The results, each after it was added.

        Args:
            results: what comes of cases.
            written: by their names, those that are from files, as the files say them; all others are drawn.
            network: what these are drawn with; `None` if another was drawn for each.
        """
        words = network_words(network)
        for position, result in enumerate(results, start=1):
            if self.is_whole:
                self._add(position, self._recipe(result.case, written, words), result)
            yield result

    def _recipe(self, case: Case, written: Mapping[str, WrittenCase], words: str) -> Recipe:
        if case.name not in written:
            return drawn_recipe(case, words)
        from_file = written[case.name]
        return written_recipe(from_file.case, self._model, sayable(str(from_file.path)), case)

    def _add(self, position: int, recipe: Recipe, result: CaseResult) -> None:
        try:
            self._writer.add(position, recipe, result)
        except InputError as error:
            errors().diagnostics(error.diagnostics)
            self.is_whole = False

    def since(self, coverage: Coverage) -> Since:
        """What this run visits more and less than the last one, and what the whole store visits."""
        before = self._writer.before
        line = since_last_run(coverage.obligations, before, coverage.visited)
        if not self.is_whole:
            return Since((Text(), line), {"file": str(self._path), "is_whole": False}, is_whole=False)
        cases, figure = self._writer.totals()
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
