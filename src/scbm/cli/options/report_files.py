"""The files that `scbm report` writes, one for each format."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from importlib import import_module
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from scbm.cli.output.written_files import refuse_clashes, write_whole
from scbm.model import InputError
from scbm.store import Replays, Written

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from scbm.model import Diagnostic
    from scbm.store import History, StoredCase
    from scbm.testing import Execution

_MAKERS = {
    "--junit": ("ci.junit", "junit_xml"),
    "--cobertura": ("ci.cobertura", "cobertura_xml"),
    "--lcov": ("ci.lcov", "lcov_info"),
    "--sarif": ("ci.sarif", "sarif_log"),
    "--markdown": ("ci.markdown", "markdown"),
    "--badge": ("ci.badge", "badge"),
}
"""The module below `reports` and its function from a history to a text, loaded where it is asked for."""

_SLOW = 200
"""From so many cases on, progress is shown while they are run again."""


@dataclass(frozen=True)
class ReportFiles:
    """The files that are asked for, by their options."""

    files: Mapping[str, Path | None]

    @property
    def given(self) -> dict[str, Path]:
        """Those that are."""
        return {option: path for option, path in self.files.items() if path is not None}

    def refuse_clashes(self, store: Path, history: History) -> None:
        """Raises `InputError` if two formats would be one file, or one would replace the store, the model or a case."""
        cases = (case.recipe.path for case in history.cases if isinstance(case.recipe, Written))
        others = [(store, "the store"), (Path(history.source.path), "the model")]
        refuse_clashes(self.given, chain(others, ((Path(path), "a case file") for path in dict.fromkeys(cases))))


def write_formats(wanted: ReportFiles, history: History) -> list[str]:
    """Writes all files that are asked for; gives their names. Raises `InputError` with all that cannot be written."""
    wrong: list[Diagnostic] = []
    for option, path in wanted.given.items():
        text = _html(history) if option == "--html" else _made(option, history)
        try:
            write_whole(option, path, text.encode())
        except InputError as error:
            wrong += error.diagnostics
    if wrong:
        raise InputError(wrong)
    return [str(path) for path in wanted.given.values()]


def _made(option: str, history: History) -> str:
    module, name = _MAKERS[option]
    make: Callable[[History], str] = getattr(import_module(f"scbm.reports.{module}"), name)
    return make(history)


def _html(history: History) -> str:
    from scbm.reports.html import html_report  # noqa: PLC0415 - templates, which few reports need

    replays = Replays(history)
    if len(history.cases) < _SLOW or not sys.stderr.isatty():
        return html_report(history, replays.execute)
    from rich.console import Console  # noqa: PLC0415 - only where there is something to show
    from rich.progress import Progress  # noqa: PLC0415

    with Progress(console=Console(file=sys.stderr), transient=True) as progress:
        task = progress.add_task("running the cases again", total=len(history.cases))

        def execute(case: StoredCase) -> Execution | None:
            progress.advance(task)
            return replays.execute(case)

        return html_report(history, execute)
