"""A tester and its cell for callers without an event loop, which run cases one by one."""

from __future__ import annotations

import asyncio
import signal
from collections import Counter
from threading import current_thread, main_thread
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeVar

from msgspec import structs
from msgspec.structs import replace

from scbm.nodes.buses.loopback import LoopbackHub
from scbm.nodes.roles.cell_topics import NodeContext, new_status
from scbm.nodes.roles.controller import ControllerNode
from scbm.nodes.roles.node_process import AbsenceWatch
from scbm.nodes.roles.readiness import Lack, NotReadyError, Reason
from scbm.nodes.roles.resources_node import ResourcesNode
from scbm.nodes.roles.tester_node import LostError, NotBegunError, TesterNode
from scbm.running.simulation import PlainReactions

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Coroutine
    from fractions import Fraction
    from types import TracebackType

    from scbm.cases import Case
    from scbm.model import BehaviorModel
    from scbm.nodes.buses.bus import Bus, Join
    from scbm.nodes.node_messages import Status
    from scbm.nodes.roles.controller import DrawPlans
    from scbm.nodes.roles.node_process import Children
    from scbm.nodes.roles.tester_node import NodeRun
    from scbm.running import RunnerOptions
    from scbm.running.simulation import Choices

T = TypeVar("T")

_MOST_CONTROLLERS = 10
"""A case that so many controllers leave before its run begins is lost: it may be the case that ends them."""


class Cell(Protocol):
    """The nodes around a tester: how it joins them, and restarts those that it owns."""

    async def open(self, model: BehaviorModel, warn: Callable[[str], None]) -> Bus:
        """Join the cell."""
        ...

    @property
    def is_own(self) -> bool:
        """Whether this process starts all other nodes."""
        ...

    async def mend(self) -> Bus | None:
        """Restart lost nodes, as far as this process can. Raises `NotReadyError` if it never can.

        Returns:
            The bus from now on, if it had to join again.
        """
        ...

    async def keep(self) -> None:
        """Restart lost nodes until this is cancelled."""
        ...

    async def close(self) -> None:
        """Leave the cell, and end the nodes that were started."""
        ...


class LoopbackCell:
    """Controller and resources in this process."""

    def __init__(self, digest: str, join: Join | None = None, draw_plans: DrawPlans | None = None) -> None:
        """Prepare the cell of a model.

        Args:
            digest: of the model.
            join: opens the buses of the nodes; by default those of a `LoopbackHub`.
            draw_plans: what `ControllerNode` draws plans with.
        """
        self._digest = digest
        self._draw_plans = draw_plans
        self._join = join or LoopbackHub().join
        self._nodes: list[ControllerNode | ResourcesNode] = []
        self._buses: list[Bus] = []

    async def open(self, model: BehaviorModel, warn: Callable[[str], None]) -> Bus:
        """Start controller and resources in this process."""
        names = [resource.name for resource in model.resources]
        contexts = []
        for role, resources in (("controller", []), ("resources", names)):
            bus = self._join(role)
            self._buses.append(bus)
            contexts.append(NodeContext(bus, model, new_status(role, model, self._digest, resources), warn))
        controller = ControllerNode(contexts[0], draw_plans=self._draw_plans)
        self._nodes = [controller, ResourcesNode(contexts[1], PlainReactions())]
        own = self._join("tester")
        self._buses.append(own)
        return own

    @property
    def is_own(self) -> bool:
        """Always true."""
        return True

    async def mend(self) -> None:
        """Do nothing: nodes of this process are never lost."""

    async def keep(self) -> None:
        """Do nothing: nodes of this process are never lost."""
        await asyncio.Event().wait()

    async def close(self) -> None:
        """End controller and resources."""
        for node in self._nodes:
            await node.close()
        for bus in self._buses:
            await bus.close()


class RemoteCell:
    """Controller and resources in other processes: `children`, or nodes that run already."""

    def __init__(self, open_bus: Callable[[], Awaitable[Bus]], children: Children | None = None) -> None:
        self._open_bus = open_bus
        self._children = children
        self._bus: Bus | None = None
        self._watch: AbsenceWatch | None = None
        self._warn: Callable[[str], None] = lambda _: None

    async def open(self, model: BehaviorModel, warn: Callable[[str], None]) -> Bus:  # noqa: ARG002 - as all cells
        """Join before the children start, so that an error that all nodes would meet is reported once."""
        self._warn = warn
        bus = await self._join()
        await self._start_children()
        return bus

    @property
    def is_own(self) -> bool:
        """Whether the other nodes are children."""
        return self._children is not None

    async def mend(self) -> Bus | None:
        """Start missing children. Raises `NotReadyError` if one of them cannot work.

        Joins again, as a new participant, if this process was stopped for so long that its peers may have lost it.
        """
        is_missed = self._watch is not None and self._watch.has_noticed
        joined = await self._join_again() if is_missed else None
        await self._start_children()
        return joined

    async def _join(self) -> Bus:
        self._bus = bus = await self._open_bus()
        self._watch = AbsenceWatch(
            asyncio.get_running_loop(), bus.lease_ns, lambda: None
        )  # it is asked before each case
        return bus

    async def _join_again(self) -> Bus:
        self._warn("the tester was stopped for a while, and rejoins the cell")
        await self._leave()
        return await self._join()

    async def _leave(self) -> None:
        if self._watch is not None:
            self._watch.close()
        if self._bus is not None:
            await self._bus.close()

    async def _start_children(self) -> None:
        if self._children is None:
            return
        if self._children.broken is not None:
            raise NotReadyError([Reason(Lack.CHILD, self._children.broken)])
        for ended in await self._children.start():
            self._warn(f"{ended}, and was restarted")

    async def keep(self) -> None:
        """Restart children whenever they end."""
        while self._children is not None:
            await self._children.one_ends()
            await self._start_children()
        await asyncio.Event().wait()

    async def close(self) -> None:
        """End the children."""
        if self._children is not None:
            await self._children.end()
        await self._leave()


def _interrupt(*_: object) -> None:
    """Handle SIGTERM like SIGINT, also where SIGINT is ignored, as in a background job of a script."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.raise_signal(signal.SIGINT)


class Session:
    """Runs cases over nodes. SIGINT ends it by `KeyboardInterrupt`, with the run given up.

    Attributes:
        warn: called with a sentence for each fault that the session repairs.
        alone: the warning if no other node is found; `None` for none.
        waiting: called with a description of the missing nodes, once a case has waited for long.
        goals: the numbers of goals at real drivers, by resource and `GoalFate`; complete once the session has ended.
    """

    def __init__(self, cell: Cell, model: BehaviorModel, digest: str, time_scale: Fraction, wait_s: float) -> None:
        """Prepare a session, which starts with `with`.

        Args:
            cell: where the nodes are.
            model: what is tested.
            digest: its identity.
            time_scale: how many seconds of a run pass in one of the wall.
            wait_s: so long nodes may take to come.
        """
        self._cell = cell
        self._model = model
        self._digest = digest
        self._time_scale = time_scale
        self._wait_s = wait_s
        self._runner = asyncio.Runner()
        self._tester: TesterNode | None = None
        self._was_lost = False
        self._work: asyncio.Task[Any] | None = None
        self._before: Any = None
        self.warn: Callable[[str], None] = lambda _: None
        self.alone: str | None = None
        self.goals: Counter[tuple[str, str]] = Counter()
        self.waiting: Callable[[tuple[Reason, ...]], None] = lambda _: None

    def __enter__(self) -> Self:
        """Join the cell, and wait for all nodes. Raises `BusError`, `NotReadyError`."""
        if current_thread() is main_thread():  # others cannot be interrupted
            self._before = signal.signal(signal.SIGTERM, _interrupt)
        try:
            self._runner.run(self._noted(self._open()))
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._close()

    @property
    def real(self) -> tuple[str, ...]:
        """The resources that are reached at real drivers."""
        assert self._tester is not None  # noqa: S101 - `with` has opened it
        return self._tester.real

    def run(self, case: Case, choices: Choices, options: RunnerOptions) -> NodeRun:
        """Run a case. Raises `LostError` if it is not finished."""
        return self._runner.run(self._noted(self._run(case, choices, options)))

    async def _noted(self, work: Coroutine[Any, Any, T]) -> T:
        self._work = asyncio.current_task()
        return await work

    async def _open(self) -> None:
        status = new_status("tester", self._model, self._digest)  # before others begin here: it is older than they
        bus = await self._cell.open(self._model, self.warn)
        tester = self._make_tester(bus, status)
        await _beside(self._cell.keep(), tester.wait_for_cell(self._wait_s, self.waiting))

    def _make_tester(self, bus: Bus, status: Status) -> TesterNode:
        self._close_tester()
        context = NodeContext(bus, self._model, status, self.warn)
        self._tester = TesterNode(context, self._time_scale, is_first=self._cell.is_own)
        self._tester.goals = self.goals
        self._tester.membership.report_if_alone(self.alone, self.warn)
        return self._tester

    async def _run(self, case: Case, choices: Choices, options: RunnerOptions) -> NodeRun:
        """Run a case; begin again if the controller leaves before the run has sent a request."""
        tester = await self._whole_cell()
        for _ in range(_MOST_CONTROLLERS - 1):
            try:
                return await self._run_once(tester, case, choices, options)
            except NotBegunError as error:
                tester = await self._whole_cell_after(error)
        return await self._run_once(tester, case, choices, options)

    async def _run_once(self, tester: TesterNode, case: Case, choices: Choices, options: RunnerOptions) -> NodeRun:
        awaits = any(name in tester.real for name in self._measuring())
        run = tester.run(case, choices, replace(options, awaits_measurements=awaits))
        return await _beside(self._cell.keep(), run)

    async def _whole_cell_after(self, left: NotBegunError) -> TesterNode:
        """Wait for all nodes once more. Raises `LostError` with both reasons."""
        self.warn(f"{left}; the case begins again when all nodes are there")
        try:
            return await self._whole_cell()
        except LostError as error:
            raise LostError(f"{left}, and the case could not begin again: {error}") from None

    async def _whole_cell(self) -> TesterNode:
        """Return the tester once all nodes are there. Raises `LostError` after the timeout."""
        assert self._tester is not None  # noqa: S101 - `with` has opened it
        tester = self._tester
        bus = await self._cell.mend()
        if bus is not None:
            tester = self._make_tester(bus, self._status_again(tester.membership.own))
            self._was_lost = False
        try:
            wait_s = 0.0 if self._was_lost else self._wait_s
            await _beside(self._cell.keep(), tester.wait_for_cell(wait_s, self.waiting))
        except NotReadyError as error:
            if tester.membership.rival() is not None or any(reason.lack is Lack.GOAL for reason in error.reasons):
                raise
            self._was_lost = True  # the next case does not wait as long again
            raise LostError(str(error)) from None
        self._was_lost = False
        return tester

    def _status_again(self, before: Status) -> Status:
        """Return the status of a tester that rejoins. It keeps its age only among nodes that it started.

        Elsewhere another one may have taken its place.
        """
        status = new_status("tester", self._model, self._digest)
        return structs.replace(status, since_ns=before.since_ns) if self._cell.is_own else status

    def _measuring(self) -> list[str]:
        """Return the resources that may publish values."""
        return [resource.name for resource in self._model.resources if resource.measures]

    def _close(self) -> None:
        self._runner.run(self._leave())
        self._runner.close()
        if self._before is not None:
            signal.signal(signal.SIGTERM, self._before)

    async def _leave(self) -> None:
        """Cancel the open run first, as long as there is a bus to report it, and leave the cell."""
        if self._work is not None and not self._work.done():
            self._work.cancel()
            await asyncio.wait([self._work])
        self._close_tester()
        await self._cell.close()

    def _close_tester(self) -> None:
        if self._tester is not None:
            self._tester.membership.close()


async def _beside(help_: Coroutine[Any, Any, None], work: Coroutine[Any, Any, T]) -> T:
    """Return the result of `work`, with `help_` running beside it. Raises what either of them raises."""
    tasks = helping, working = asyncio.ensure_future(help_), asyncio.ensure_future(work)
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        if helping.done():
            helping.result()
        return working.result()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
