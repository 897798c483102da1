"""Cases that are run over nodes: the cell, the progress, and the logs of what happened."""

from __future__ import annotations

import os
import shlex
import sys
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from scbm.cli.files import write_whole
from scbm.cli.nodes import bus_error, cell_error, complain, open_dds
from scbm.cli.output import errors
from scbm.errors import Diagnostic, InputError, Place, Slug
from scbm.notation import digest_of
from scbm.realtime import BusError, Children, LoopbackCell, NotReadyError, RemoteCell, Session
from scbm.realtime.event_log import write_event_log
from scbm.testing.on_nodes import NodeTester

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from scbm.cases import Case
    from scbm.cli.node_options import Asked
    from scbm.realtime.event_log import EventLog
    from scbm.realtime.session import Cell
    from scbm.testing import CaseResult, Execution, Tester


@contextmanager
def over_nodes(asked: Asked, tester: Tester) -> Iterator[OverNodes]:
    """Runs cases over nodes as long as this lasts. Raises `InputError` if there is no whole cell."""
    session = Session(_cell(asked), asked.model, digest_of(asked.model), asked.time_scale, asked.wait_s)
    session.complain = complain
    try:
        with session:
            yield OverNodes(asked, NodeTester(tester, session))
    except BusError as error:
        raise bus_error(error) from None
    except NotReadyError as error:
        raise cell_error(error.reasons, asked.where, _remedy(asked)) from None


def _cell(asked: Asked) -> Cell:
    if asked.transport == "loopback":
        return LoopbackCell(digest_of(asked.model))
    children = Children(_commands(asked)) if asked.starts else None
    return RemoteCell(lambda: open_dds("tester", asked.domain), children)


def _commands(asked: Asked) -> dict[str, list[str]]:
    """How the other nodes of the cell are started."""
    scbm = [sys.executable, "-m", "scbm", "node"]
    common = [str(asked.file), "--domain", str(asked.domain), "--while-stdin"]
    bindings = [] if asked.bindings is None else ["--bindings", str(asked.bindings)]
    real = [word for name in asked.real for word in ("--real", name)]
    via = ["--via", asked.via.value] if asked.real else []
    simulated = [resource.name for resource in asked.model.resources if resource.name not in asked.real]
    commands = {"the controller": [*scbm, "controller", *common, *bindings, *real, *via]}
    if simulated:
        file, *options = common
        commands["the node of resources"] = [*scbm, "resources", file, *simulated, *options]
    return commands


def _remedy(asked: Asked) -> str:
    if asked.starts:
        return "see above what the nodes say; drivers have to be in this domain"
    model = shlex.quote(str(asked.file))
    return f"start `scbm node controller {model}` and `scbm node resources {model}` in this domain"


@dataclass
class OverNodes:
    """Runs cases one by one, and saves what cannot be had again.

    Attributes:
        log_files: by the name of its case, where each log was saved.
        is_saved: whether all of them could be.
    """

    _asked: Asked
    _tester: NodeTester
    log_files: dict[str, Path] = field(default_factory=dict)
    is_saved: bool = True

    def results(self, cases: Iterable[Case], said: Callable[[str], None]) -> Iterator[CaseResult]:
        """What comes of each; `said` gets the name of the one that runs."""
        for case in cases:
            said(case.name)
            execution = self._tester.execute(case)
            self._keep(execution)
            yield execution.result

    def _keep(self, execution: Execution) -> None:
        asked, log = self._asked, execution.log
        directory = asked.logs if asked.logs is not None or execution.verdict.passed else asked.failures
        if log is not None and directory is not None and self.is_saved:
            self._save(log, execution.case.name, directory)

    def _save(self, log: EventLog, name: str, directory: Path) -> None:
        path = directory / f"{name}.log"
        shown = Path(os.path.relpath(self._asked.file, directory)).as_posix()
        try:
            directory.mkdir(parents=True, exist_ok=True)
            write_whole(str(path), path, write_event_log(replace(log, model_file=shown), self._asked.model).encode())
        except OSError as error:
            told = f"cannot save logs here: {(error.strerror or str(error)).lower()}"
            self._tell([Diagnostic(Slug.BAD_OPTION, told, Place(str(error.filename or directory)))])
        except InputError as error:
            self._tell(error.diagnostics)
        else:
            self.log_files[name] = path

    def _tell(self, diagnostics: Sequence[Diagnostic]) -> None:
        errors().diagnostics(diagnostics)
        self.is_saved = False
