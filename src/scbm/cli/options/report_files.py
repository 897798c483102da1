"""The options and the files of `scbm report`, one for each entry of `FORMATS`."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from scbm.cli.options.registry_options import OptionPerEntry
from scbm.files import FileWriter
from scbm.model import InputError
from scbm.reports.formats import FORMATS
from scbm.store import Replays, Written

if TYPE_CHECKING:
    from collections.abc import Mapping

    from typer.models import OptionInfo

    from scbm.model import Diagnostic
    from scbm.reports.formats import ReportFormat
    from scbm.store import History, StoredCase
    from scbm.testing import Execution

_SLOW = 200
"""From so many cases on, progress is shown while they are run again."""


def _format_options() -> dict[str, tuple[Any, OptionInfo]]:
    return {
        name: (Path | None, typer.Option(f"--{name}", metavar="FILE", help=form.help)) for name, form in FORMATS.items()
    }


FORMAT_OPTIONS = OptionPerEntry(_format_options)
"""Marks the parameter of a verb that gets the files by the names of their formats."""


@dataclass(frozen=True)
class ReportFiles:
    """The files that are asked for, by the names of their formats."""

    files: Mapping[str, Path | None]

    @property
    def given(self) -> dict[str, Path]:
        """Those that are."""
        return {option: path for option, path in self.files.items() if path is not None}

    def writer(self, store: Path, history: History) -> FileWriter:
        """Return what writes these files, and refuses to replace the store, the model or a case file.

        Raises:
            InputError: two formats are one file, or one of them is such an input.
        """
        cases = (case.recipe.path for case in history.cases if isinstance(case.recipe, Written))
        others = [(store, "the store"), (Path(history.source.path), "the model")]
        writer = FileWriter(chain(others, ((Path(path), "a case file") for path in dict.fromkeys(cases))))
        writer.refuse_clashes({f"--{name}": path for name, path in self.given.items()})
        return writer


def write_formats(wanted: ReportFiles, history: History, writer: FileWriter) -> list[str]:
    """Write the files that are asked for, and return their names.

    Raises `InputError` with all files that cannot be written.
    """
    wrong: list[Diagnostic] = []
    for name, path in wanted.given.items():
        try:
            writer.write(f"--{name}", path, _text(FORMATS[name], history).encode())
        except InputError as error:
            wrong += error.diagnostics
    if wrong:
        raise InputError(wrong)
    return [str(path) for path in wanted.given.values()]


def _text(form: ReportFormat, history: History) -> str:
    """Return the report, with a progress bar on a terminal while many cases are run again for it."""
    replays = Replays(history)
    if not form.runs_cases or len(history.cases) < _SLOW or not sys.stderr.isatty():
        return form.text(history, replays.execute)
    from rich.console import Console  # noqa: PLC0415 - only where there is something to show
    from rich.progress import Progress  # noqa: PLC0415

    with Progress(console=Console(file=sys.stderr), transient=True) as progress:
        task = progress.add_task("running the cases again", total=len(history.cases))

        def run_again(case: StoredCase) -> Execution | None:
            progress.advance(task)
            return replays.execute(case)

        return form.text(history, run_again)
