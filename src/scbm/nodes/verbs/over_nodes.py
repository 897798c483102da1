"""Campaigns over nodes: the cell, remedies while it is incomplete, the progress, and the saved event logs.

`scbm test --transport` and `scbm node tester` run them. Remedies are the sentences and commands that errors suggest to
users. A saved log never replaces another one: a real run cannot be repeated.
"""

from __future__ import annotations

import os
import sys
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec import Struct, field
from msgspec.structs import replace

from scbm.cli.campaigns.campaign_loop import carry_out, finished_executions
from scbm.cli.campaigns.test_campaign import remember_failed, report_campaign, result_of
from scbm.cli.options.node_options import ALONE, Via, transport_option
from scbm.cli.output.terminal import errors
from scbm.files import FileWriter, digest_of
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.model.visible_text import counted, in_one_line, shell_word, shown_path
from scbm.nodes import Bus, BusError, Children, Lack, LoopbackCell, NotReadyError, RemoteCell, Session
from scbm.nodes.cases_over_nodes import NodeTester
from scbm.nodes.limited_warnings import LimitedWarnings
from scbm.nodes.verbs.node_setup import bus_error, refuse_beyond_reach, warn
from scbm.testing import Answers, Tester, find_causes
from scbm.testing.event_logs.event_log import write_event_log
from scbm.testing.random_streams import draw_plans
from scbm.testing.real_drivers import GoalFate, with_excluded
from scbm.testing.transports import DEFAULT_TRANSPORT, LOOPBACK, TRANSPORTS

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Iterable, Iterator, Sequence

    from scbm.cases import Case
    from scbm.cli.campaigns.campaign_loop import Finished
    from scbm.cli.options.campaign_options import CampaignOutput
    from scbm.cli.options.node_options import NodeOptions
    from scbm.nodes import Reason
    from scbm.nodes.buses.bus import Join
    from scbm.nodes.roles.session import Cell
    from scbm.testing import Execution
    from scbm.testing.event_logs.event_log import EventLog
    from scbm.testing.real_drivers import ExcludedVariable
    from scbm.testing.suite import Suite


def run_over_nodes(suite: Suite, output: CampaignOutput, asked: NodeOptions, command: str) -> int:
    """Run the cases over nodes, print the report, and return the exit code.

    Args:
        suite: the cases.
        output: the options for output and storage.
        asked: where they run.
        command: what runs them all again.
    """
    refuse_beyond_reach(suite, asked.real, "--real")
    tester = Tester(suite.model)
    with over_nodes(asked, tester) as nodes:
        if not asked.starts:  # the controller reports which resources are real
            refuse_beyond_reach(suite, nodes.real, "--network")

        def run(begin: Callable[[str], None]) -> Generator[Finished, None, None]:
            return finished_executions(suite, nodes.executions(suite.work.cases(), begin))

        done = carry_out(suite, output, run, asked.words)
    is_kept = nodes.logs.is_whole and remember_failed(suite, done.campaign, output.failures)
    findings = find_causes(tester, done.campaign, 0)  # what fails over nodes need not fail in simulation
    logs = (nodes.logs.files.get(finding.names[0]) for finding in findings)
    commands = tuple(command if log is None else f"scbm replay {shown_path(str(log))}" for log in logs)
    result = result_of(done, suite, output, findings, commands)
    excluded = tuple(nodes.excluded.values())
    result = replace(result, answers=nodes.answers, excluded=excluded)
    result = replace(result, where=asked.words, verb=asked.verb, node_options=asked.options)
    code = report_campaign(done, result, output)
    if nodes.logs.words is not None and not output.json:
        errors().prose(f"scbm: {nodes.logs.words}")
    for complaint in nodes.complaints:
        errors().prose(f"scbm: {complaint}")
    if any(answers.is_silent for answers in nodes.answers):
        code = max(code, 1)
    return code if is_kept else max(2, code)


class SavedLogs(Struct):
    """Saves logs, each under the name of its case or the next free one.

    Attributes:
        files: the file of each saved log, by the name of its case.
        is_whole: whether all logs were saved.
    """

    _asked: NodeOptions
    files: dict[str, Path] = field(default_factory=dict)
    is_whole: bool = True

    def keep(self, execution: Execution) -> None:
        """Save the log of a case if an option asks for it; show the first error, and go on with the cases."""
        asked, log = self._asked, execution.log
        directory = asked.logs if asked.logs is not None or execution.verdict.passed else asked.failures
        if log is not None and directory is not None and self.is_whole:
            self._save(log, execution.case.name, directory)

    @property
    def words(self) -> str | None:
        """The number of logs and their directory in words; `None` without logs."""
        directory = self._asked.failures if self._asked.logs is None else self._asked.logs
        return f"{counted(len(self.files), 'log')} in {directory}" if self.files else None

    def _save(self, log: EventLog, name: str, directory: Path) -> None:
        content = replace(log, model_file=Path(os.path.relpath(self._asked.file, directory)).as_posix())
        try:
            directory.mkdir(parents=True, exist_ok=True)
            path = _free(directory, name)
        except OSError as error:
            self._print_errors([_unwritable(error, directory, "--failures" if self._asked.logs is None else "--logs")])
            return
        try:
            FileWriter().write(str(path), path, write_event_log(content, self._asked.model).encode())
        except InputError as error:
            path.unlink(missing_ok=True)
            self._print_errors(error.diagnostics)
        else:
            self.files[name] = path

    def _print_errors(self, diagnostics: Sequence[Diagnostic]) -> None:
        errors().diagnostics(diagnostics)
        self.is_whole = False


def _free(directory: Path, name: str) -> Path:
    """Create an empty file with a name that is not in use, and return its path."""
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


_PLAIN = {
    Lack.RIVAL: "wait for it, or stop it",
    Lack.VERSION: "stop that process, and start it again with this version of scbm",
    Lack.MODEL: "stop that process, and start it again",
    Lack.TIME_SCALE: "leave `--time-scale` out",
    Lack.CHILD: "see its output above",
    Lack.UNREADABLE: "stop that process: all nodes of a cell are of one version of scbm",
    Lack.DRIVER: "start one driver of it in this domain, or correct its binding",
    Lack.BINDING: "correct its binding, or start the driver that it means",
    Lack.VENDOR: "use `--via rclpy`",
    Lack.SERVERS: "stop all of them but one",
    Lack.GOAL: (
        "wait until that goal is over, or have the program that sent it cancel it; scbm cancels no goal of others"
    ),
}
_ON_LOOPBACK = (
    "nodes look on loopback only: a driver that uses Cyclone DDS needs `ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST`, or "
    "this command `--interface all`"
)
_OF_CHILDREN = {
    Lack.MODEL: "the model file was changed meanwhile: run this again",
    Lack.CONTROLLER: "read the output of the nodes above, or wait longer: `--wait`",
    Lack.RESOURCES: "read the output of the nodes above, or wait longer: `--wait`",
}


def cell_error(error: NotReadyError, asked: NodeOptions) -> InputError:
    """Return the error for a cell that is incomplete or wrong, with a remedy for each reason."""
    place = Place(asked.where)
    reasons = error.reasons
    return InputError(
        [Diagnostic(Slug.CELL_INCOMPLETE, in_one_line(r.message), place, _remedy(r, asked)) for r in reasons]
    )


def _remedy(reason: Reason, asked: NodeOptions) -> str | None:
    if asked.starts and reason.lack in _OF_CHILDREN:
        return _OF_CHILDREN[reason.lack]
    if reason.lack is Lack.DRIVER and asked.interface == LOOPBACK and asked.via is Via.DDS:
        return f"{_PLAIN[Lack.DRIVER]}; {_ON_LOOPBACK}"
    if reason.lack in _PLAIN:
        return _PLAIN[reason.lack]
    if reason.lack is Lack.FOREIGN:
        return f"stop it, choose another `--domain`, or test with the running nodes: {_node('tester', asked)}"
    commands = [_node("controller", asked)] if reason.lack is Lack.CONTROLLER else []
    if reason.resources:
        commands.append(_node("resources", asked, reason.resources))
    return f"start {' and '.join(commands)}"


def _node(role: str, asked: NodeOptions, resources: Sequence[str] = ()) -> str:
    """Return the command that starts a node in the domain of the tester."""
    is_all = len(resources) == len(asked.model.resources)
    names = "" if is_all else "".join(f" {name}" for name in resources)
    is_default = asked.domain == 0 and not os.environ.get("ROS_DOMAIN_ID")
    domain = "" if is_default else f" --domain {asked.domain}"
    options = f"{transport_option(asked.transport)}{domain}{asked.interface_option}"
    return f"`scbm node {role} {shell_word(str(asked.file))}{names}{options}`"


def silent_driver(answers: Answers, asked: NodeOptions) -> str:
    """Return a warning about a real resource that carried out none of its requests, and where to look."""
    sent = counted(answers.sent, "request")
    return f"`{answers.resource}` is real, and of {sent} none succeeded: {_outcomes(answers)}; {_look(answers, asked)}"


def _outcomes(answers: Answers) -> str:
    """Return how the requests to a resource ended if none of them succeeded."""
    if answers.failed == answers.sent:
        return "each was refused or failed"
    if answers.timed_out == answers.sent:
        return "no reply came in time"
    parts = [
        (answers.failed, "failed"),
        (answers.timed_out, "got no reply in time"),
        (answers.given_up, f"{'was' if answers.given_up == 1 else 'were'} given up"),
    ]
    return ", ".join(f"{count} {words}" for count, words in parts if count)


def _look(answers: Answers, asked: NodeOptions) -> str:
    if not answers.timed_out:
        return "see the output of its driver"
    where = f"the binding of `{answers.resource}`" + ("" if asked.bindings is None else f" in {asked.bindings}")
    return f"check the output of its driver, {where}, and its deadlines"


class Waiting(Struct):
    """Reports what a cell waits for; nodes that this command starts itself are left out."""

    _asked: NodeOptions
    _print: Callable[[str], None]
    _last: str = ""

    def __call__(self, reasons: Sequence[Reason]) -> None:
        """Print the reasons for waiting unless they repeat the previous ones."""
        shown = [r.message for r in reasons if not self._asked.starts or r.lack not in _OF_CHILDREN]
        words = "; ".join(shown)
        if words and words != self._last:
            self._print(f"waiting for {self._asked.wait_s:g} s at most: {words}")
        self._last = words


@contextmanager
def over_nodes(asked: NodeOptions, tester: Tester) -> Iterator[OverNodes]:
    """Open a session that runs cases over nodes.

    Raises `InputError` if the cell is incomplete.
    """
    logs, limited = SavedLogs(asked), LimitedWarnings(warn)
    with _node_errors(asked):
        cell = _cell(asked, limited)
    session = Session(cell, asked.model, digest_of(asked.model), asked.time_scale, asked.wait_s)
    session.warn = limited
    session.alone = ALONE if asked.interface == LOOPBACK and TRANSPORTS[asked.transport].joins_processes else None
    session.waiting = Waiting(asked, warn)
    with closing(limited), _node_errors(asked), session:
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


def _cell(asked: NodeOptions, warn: Callable[[str], None]) -> Cell:
    transport = TRANSPORTS[asked.transport]
    join: Join = transport.connect(asked.domain, warn, asked.interface)
    if not transport.joins_processes:
        return LoopbackCell(digest_of(asked.model), join, draw_plans)

    async def open_bus() -> Bus:
        return join("tester")

    return RemoteCell(open_bus, Children(_commands(asked)) if asked.starts else None)


def _commands(asked: NodeOptions) -> dict[str, list[str]]:
    """Return the commands that start the other nodes of the cell, by their description."""
    scbm = [sys.executable, "-m", "scbm", "node"]
    transport = [] if asked.transport == DEFAULT_TRANSPORT else ["--transport", asked.transport]
    interface = [] if asked.interface is None else ["--interface", asked.interface]
    common = [str(asked.file), *transport, "--domain", str(asked.domain), *interface, "--while-stdin"]
    bindings = [] if asked.bindings is None else ["--bindings", str(asked.bindings)]
    real = [word for name in asked.real for word in ("--real", name)]
    via = ["--via", asked.via.value] if asked.real else []
    simulated = [resource.name for resource in asked.model.resources if resource.name not in asked.real]
    commands = {"the controller": [*scbm, "controller", *common, *bindings, *real, *via, *asked.planner]}
    if simulated:
        file, *options = common
        commands["the node of resources"] = [*scbm, "resources", file, *simulated, *options]
    return commands


class OverNodes(Struct):
    """Runs cases one by one, and saves their event logs.

    Attributes:
        logs: the files of the saved logs.
        excluded: the variables of which drivers sent values that the model excludes, by their names.
    """

    _asked: NodeOptions
    logs: SavedLogs
    _session: Session
    _tester: NodeTester
    _answers: dict[str, Answers] = field(default_factory=dict)
    excluded: dict[str, ExcludedVariable] = field(default_factory=dict)

    @property
    def real(self) -> tuple[str, ...]:
        """Return the resources that real drivers carry out."""
        return self._session.real

    @property
    def answers(self) -> tuple[Answers, ...]:
        """Return the counts of replies of the real resources so far, in the order of the model."""
        names = [resource.name for resource in self._asked.model.resources]
        return tuple(replace(self._answers[name], goals=self._goals(name)) for name in names if name in self._answers)

    def _goals(self, resource: str) -> dict[str, int]:
        """Return the number of goals by what became of them; it is complete once the session has ended."""
        counts = self._session.goals
        return {fate.value: counts[resource, fate] for fate in GoalFate if counts[resource, fate]}

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
            self.excluded = with_excluded(self.excluded, execution)
            yield execution

    def _count(self, execution: Execution) -> None:
        """Count the replies of a case, those of a lost case up to the loss; one that had not begun has no log."""
        for name in () if execution.log is None else execution.log.real:
            self._answers[name] = self._answers.get(name, Answers(name)).after(execution.trace.records)

    @property
    def complaints(self) -> Iterator[str]:
        """Return warnings about real resources that carried out no request."""
        return (silent_driver(answers, self._asked) for answers in self.answers if answers.is_silent)
