"""The files that `scbm report` writes, one for each format."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from importlib import import_module
from os.path import realpath
from pathlib import Path
from typing import TYPE_CHECKING

from scbm.errors import Diagnostic, InputError, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from scbm.storing import History, StoredCase
    from scbm.testing import Execution

_MAKERS = {
    "--junit": ("junit", "junit_xml"),
    "--cobertura": ("cobertura", "cobertura_xml"),
    "--lcov": ("lcov", "lcov_info"),
    "--sarif": ("sarif", "sarif_log"),
    "--markdown": ("markdown", "markdown"),
    "--badge": ("badge", "badge"),
}
"""The module of `reports` and its function from a history to a text, loaded where it is asked for."""

_SLOW = 200
"""From so many cases on, progress is shown while they are run again."""


@dataclass(frozen=True)
class Wanted:
    """The files that are asked for, by their options."""

    files: Mapping[str, Path | None]

    @property
    def given(self) -> dict[str, Path]:
        """Those that are."""
        return {option: path for option, path in self.files.items() if path is not None}

    def refuse_clashes(self, store: Path) -> None:
        """Raises `InputError` if two formats would be one file, or one of them would replace the store."""
        wrong = []
        taken = {Path(realpath(store)): "the store"}  # `resolve` of Python 3.11 fails for links in a circle
        for option, path in self.given.items():
            other = taken.setdefault(Path(realpath(path)), option)
            if other != option and not path.is_char_device():
                message = f"{path} is also {'that of ' if other != 'the store' else ''}{other}"
                wrong.append(Diagnostic(Slug.BAD_OPTION, message, Place(option), "write it to another file"))
        if wrong:
            raise InputError(wrong)


def write_formats(wanted: Wanted, history: History) -> list[str]:
    """Writes all files that are asked for; gives their names. Raises `InputError` with all that cannot be written."""
    wrong = []
    for option, path in wanted.given.items():
        text = _html(history) if option == "--html" else _made(option, history)
        try:
            path.write_text(text, encoding="utf-8", newline="\n")
        except OSError as error:
            message = f"cannot write {path}: {(error.strerror or str(error)).lower()}"
            wrong.append(Diagnostic(Slug.BAD_OPTION, message, Place(option)))
    if wrong:
        raise InputError(wrong)
    return [str(path) for path in wanted.given.values()]


def _made(option: str, history: History) -> str:
    module, name = _MAKERS[option]
    make: Callable[[History], str] = getattr(import_module(f"scbm.reports.{module}"), name)
    return make(history)


def _html(history: History) -> str:
    from scbm.reports.html import html_report  # noqa: PLC0415 - templates, which few reports need
    from scbm.storing import Replays  # noqa: PLC0415

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
