"""The logs of a campaign as files: what happened for real cannot be had again, so none replaces another."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING

from scbm.cli.output.terminal import errors
from scbm.files import FileWriter
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.nodes.log.event_log import write_event_log
from scbm.reports import counted

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.cli.options.node_options import NodeOptions
    from scbm.nodes.log.event_log import EventLog
    from scbm.testing import Execution


@dataclass
class SavedLogs:
    """Saves logs, each under the name of its case or the next free one.

    Attributes:
        files: by the name of its case, where each log was saved.
        is_whole: whether all of them could be.
    """

    _asked: NodeOptions
    files: dict[str, Path] = field(default_factory=dict)
    is_whole: bool = True

    def refuse_unwritable(self) -> None:
        """Raises `InputError` if every log is wanted, and none can be saved."""
        directory = self._asked.logs
        if directory is None:
            return
        try:
            directory.mkdir(parents=True, exist_ok=True)
            with TemporaryFile(dir=directory):
                pass
        except OSError as error:
            raise InputError([_unwritable(error, directory, "--logs")]) from None

    def keep(self, execution: Execution) -> None:
        """Save the log of a case if an option asks for it; show the first error, and go on with the cases."""
        asked, log = self._asked, execution.log
        directory = asked.logs if asked.logs is not None or execution.verdict.passed else asked.failures
        if log is not None and directory is not None and self.is_whole:
            self._save(log, execution.case.name, directory)

    @property
    def words(self) -> str | None:
        """How many there are, and where; `None` if there are none."""
        directory = self._asked.failures if self._asked.logs is None else self._asked.logs
        return f"{counted(len(self.files), 'log')} in {directory}" if self.files else None

    def _save(self, log: EventLog, name: str, directory: Path) -> None:
        content = replace(log, model_file=Path(os.path.relpath(self._asked.file, directory)).as_posix())
        try:
            directory.mkdir(parents=True, exist_ok=True)
            path = _free(directory, name)
        except OSError as error:
            self._tell([_unwritable(error, directory, "--failures" if self._asked.logs is None else "--logs")])
            return
        try:
            FileWriter().write(str(path), path, write_event_log(content, self._asked.model).encode())
        except InputError as error:
            path.unlink(missing_ok=True)
            self._tell(error.diagnostics)
        else:
            self.files[name] = path

    def _tell(self, diagnostics: Sequence[Diagnostic]) -> None:
        errors().diagnostics(diagnostics)
        self.is_whole = False


def _free(directory: Path, name: str) -> Path:
    """An empty file that was not there before."""
    path, number = directory / f"{name}.log", 1
    while True:
        try:
            path.touch(exist_ok=False)
        except FileExistsError:
            number += 1
            path = directory / f"{name}-{number}.log"
        else:
            return path


def _unwritable(error: OSError, directory: Path, option: str) -> Diagnostic:
    reason = (error.strerror or str(error)).lower()
    return Diagnostic(Slug.BAD_OPTION, f"cannot save logs in {directory}: {reason}", Place(option))
