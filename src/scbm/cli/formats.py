"""The files that `scbm report` writes, one for each format."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from importlib import import_module
from os.path import lexists, realpath
from pathlib import Path
from typing import TYPE_CHECKING

from scbm.errors import Diagnostic, InputError, Place, Slug
from scbm.storing import Replays, Written

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

    def refuse_clashes(self, store: Path, history: History) -> None:
        """Raises `InputError` if two formats would be one file, or one would replace the store, the model or a case."""
        taken = {_identity(store): "the store", _identity(Path(history.source.path)): "the model"}
        for case in history.cases:
            if isinstance(case.recipe, Written):
                taken.setdefault(_identity(Path(case.recipe.path)), "a case file")
        wrong = []
        for option, path in self.given.items():
            other = taken.setdefault(_identity(path), option)
            if other != option and not path.is_char_device():
                told = f"{path} is also {'that of ' if other.startswith('--') else ''}{other}"
                wrong.append(Diagnostic(Slug.BAD_OPTION, told, Place(option), "write it to another file"))
        if wrong:
            raise InputError(wrong)


def _identity(path: Path) -> object:
    """What tells files apart, by whichever name: links lead to the same."""
    try:
        status = path.stat()
    except OSError:
        return realpath(path)
    return status.st_dev, status.st_ino


def write_formats(wanted: Wanted, history: History) -> list[str]:
    """Writes all files that are asked for; gives their names. Raises `InputError` with all that cannot be written."""
    wrong = []
    for option, path in wanted.given.items():
        text = _html(history) if option == "--html" else _made(option, history)
        try:
            _write(Path(realpath(path)), text)
        except OSError as error:
            message = f"cannot write {path}: {(error.strerror or str(error)).lower()}"
            wrong.append(Diagnostic(Slug.BAD_OPTION, message, Place(option)))
    if wrong:
        raise InputError(wrong)
    return [str(path) for path in wanted.given.values()]


def _write(path: Path, text: str) -> None:
    """All of it or nothing, where that is a file; a pipe or a terminal takes what it gets."""
    if lexists(path) and not path.is_file():
        path.write_text(text, encoding="utf-8", newline="\n")
        return
    part = path.with_name(f"{path.name}.part")
    try:
        part.write_text(text, encoding="utf-8", newline="\n")
        part.replace(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise


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
