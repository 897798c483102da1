"""Campaigns over nodes: the cell, the progress, and the saved event logs."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from scbm.cli.campaigns.node_setup import bus_error, warn
from scbm.cli.campaigns.remedies import Waiting, cell_error, silent_driver
from scbm.cli.output.saved_logs import SavedLogs
from scbm.files import digest_of
from scbm.nodes import Bus, BusError, Children, LoopbackCell, NotReadyError, RemoteCell, Session
from scbm.nodes.buses.transports import DEFAULT_TRANSPORT, TRANSPORTS
from scbm.testing import Answers
from scbm.testing.node_runs import NodeTester

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from scbm.cases import Case
    from scbm.cli.options.node_options import NodeOptions
    from scbm.nodes.roles.session import Cell
    from scbm.testing import Execution, Tester


@contextmanager
def over_nodes(asked: NodeOptions, tester: Tester) -> Iterator[OverNodes]:
    """Open a session that runs cases over nodes.

    Raises `InputError` if the cell is incomplete, or logs cannot be saved.
    """
    logs = SavedLogs(asked)
    logs.refuse_unwritable()
    session = Session(_cell(asked), asked.model, digest_of(asked.model), asked.time_scale, asked.wait_s)
    session.warn = warn
    session.waiting = Waiting(asked, warn)
    with _node_errors(asked), session:
        yield OverNodes(asked, logs, session, NodeTester(tester, session))


@contextmanager
def _node_errors(asked: NodeOptions) -> Iterator[None]:
    """Turn errors of a bus or a cell into `InputError`."""
    try:
        yield
    except BusError as error:
        raise bus_error(error) from None
    except NotReadyError as error:
        raise cell_error(error, asked) from None


def _cell(asked: NodeOptions) -> Cell:
    transport = TRANSPORTS[asked.transport]
    join = transport.connect(asked.domain, warn)
    if not transport.joins_processes:
        return LoopbackCell(digest_of(asked.model), join)

    async def open_bus() -> Bus:
        return join("tester")

    return RemoteCell(open_bus, Children(_commands(asked)) if asked.starts else None)


def _commands(asked: NodeOptions) -> dict[str, list[str]]:
    """Return the commands that start the other nodes of the cell, by their description."""
    scbm = [sys.executable, "-m", "scbm", "node"]
    transport = [] if asked.transport == DEFAULT_TRANSPORT else ["--transport", asked.transport]
    common = [str(asked.file), *transport, "--domain", str(asked.domain), "--while-stdin"]
    bindings = [] if asked.bindings is None else ["--bindings", str(asked.bindings)]
    real = [word for name in asked.real for word in ("--real", name)]
    via = ["--via", asked.via.value] if asked.real else []
    simulated = [resource.name for resource in asked.model.resources if resource.name not in asked.real]
    commands = {"the controller": [*scbm, "controller", *common, *bindings, *real, *via]}
    if simulated:
        file, *options = common
        commands["the node of resources"] = [*scbm, "resources", file, *simulated, *options]
    return commands


@dataclass
class OverNodes:
    """Runs cases one by one, and saves their event logs.

    Attributes:
        logs: the files of the saved logs.
    """

    _asked: NodeOptions
    logs: SavedLogs
    _session: Session
    _tester: NodeTester
    _answers: dict[str, Answers] = field(default_factory=dict)

    @property
    def real(self) -> tuple[str, ...]:
        """Return the resources that real drivers carry out."""
        return self._session.real

    @property
    def answers(self) -> tuple[Answers, ...]:
        """Return the counts of replies of the real resources so far, in the order of the model."""
        names = [resource.name for resource in self._asked.model.resources]
        return tuple(self._answers[name] for name in names if name in self._answers)

    def executions(self, cases: Iterable[Case], started: Callable[[str], None]) -> Iterator[Execution]:
        """Yield the execution of each case; call `started` with its name before it runs.

        Raises `InputError` if the cell cannot recover, or the bus cannot be used.
        """
        self._answers = {name: Answers(name) for name in self.real}
        for case in cases:
            started(case.name)
            with _node_errors(self._asked):
                execution = self._tester.execute(case)
            self.logs.keep(execution)
            self._count(execution)
            yield execution

    def _count(self, execution: Execution) -> None:
        """Count the replies of a case; a lost case has no log, so its replies are unknown."""
        for name in () if execution.log is None else execution.log.real:
            self._answers[name] = self._answers.get(name, Answers(name)).after(execution.trace.records)

    @property
    def complaints(self) -> Iterator[str]:
        """Return warnings about real resources that carried out no request."""
        return (silent_driver(answers, self._asked) for answers in self.answers if answers.is_silent)
