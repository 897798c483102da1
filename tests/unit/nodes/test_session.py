"""A cell for those that have no event loop: opened, waited for, mended, closed."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from itertools import count
from pathlib import Path
from threading import Thread
from typing import Any

import pytest
from msgspec import structs

from scbm.cases.trace import End
from scbm.files import digest_of, read_case
from scbm.model import BehaviorModel
from scbm.nodes import (
    Bus,
    BusError,
    ControllerNode,
    Lack,
    LoopbackCell,
    LostError,
    NodeContext,
    NotReadyError,
    Reason,
    ResourcesNode,
    Session,
    TesterNode,
    new_status,
)
from scbm.nodes.buses.bus import Received
from scbm.nodes.buses.loopback import LoopbackBus, LoopbackHub
from scbm.nodes.cases_over_nodes import NodeTester
from scbm.nodes.node_messages import decode
from scbm.nodes.roles.cell_topics import CellTopics, Membership
from scbm.nodes.roles.node_process import Children
from scbm.nodes.roles.session import Cell, RemoteCell
from scbm.running.simulation import PlainReactions
from scbm.testing import Tester
from scbm.testing.verdicts import FailureKind
from support.loops import GUARD_S
from support.models import scan_cell
from support.wording import Wording

MODEL = scan_cell(
    ("measures: [temperature]", "measures: [temperature]\n    simulation: {latency: 1 s}"),
    ("deadline: 10 seconds", "deadline: 10 h"),  # a thousand times faster, ten seconds pass before a busy machine looks
)
DIGEST = digest_of(MODEL)
TESTS = Path(__file__).parents[2]
CASE = read_case("case: scans\ngoal: scanned\n", MODEL)


@pytest.fixture(autouse=True)
def short_periods(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sessions run in wall time, and a node is known after some periods of its status."""
    monkeypatch.setattr("scbm.nodes.roles.cell_topics.STATUS_PERIOD_S", 0.001)


def in_thread(work: Callable[[], None]) -> None:
    """The main thread may have an event loop already, of the browser's."""
    raised: list[BaseException] = []

    def guarded() -> None:
        try:
            work()
        except BaseException as error:  # noqa: BLE001 - it is raised where the test is
            raised.append(error)

    thread = Thread(target=guarded)
    thread.start()
    thread.join()
    if raised:
        raise raised[0]


def session(cell: Cell, wait_s: float = 60.0, digest: str = DIGEST) -> Session:
    return Session(cell, MODEL, digest, Fraction(1_000), wait_s)


def test_cases_run_one_by_one_in_a_cell_of_this_process() -> None:
    def work() -> None:
        with session(LoopbackCell(DIGEST)) as opened:
            tester = Tester(MODEL)
            assert opened.real == ()
            for _ in range(2):
                done = opened.run(CASE, tester.choices_of(CASE), tester.options_of(CASE))
                assert done.run.end is End.REACHED
                assert [record.kind for record in done.run.records] == [
                    record.kind for record in tester.execute(CASE).trace.records
                ]
                assert done.log.options == tester.options_of(CASE)

    in_thread(work)


class Incomplete(LoopbackCell):
    """A cell whose controller leaves before the second case, and what is done with it."""

    def __init__(self, *, loses: bool = False) -> None:
        super().__init__(DIGEST)
        self.loses = loses
        self.mended = 0
        self.is_closed = False

    async def mend(self) -> None:
        self.mended += 1
        if self.loses and self.mended == 2:
            await self._nodes[0].close()
            await self._buses[0].close()

    async def close(self) -> None:
        self.is_closed = True
        buses = self._buses[1:] if self.loses and self.mended >= 2 else self._buses
        for bus in buses:
            await bus.close()


def test_a_cell_that_is_mended_in_vain_loses_the_case_and_the_next_does_not_wait_as_long(
    monkeypatch: pytest.MonkeyPatch,
    wording: Wording,
) -> None:
    waits: list[float] = []
    reports: list[tuple[Any, ...]] = []
    wait_for_cell = TesterNode.wait_for_cell

    async def kept(node: TesterNode, wait_s: float, *more: Any) -> None:  # noqa: ANN401 - what it is given
        waits.append(wait_s)
        reports.append(more)
        await wait_for_cell(node, wait_s, *more)

    monkeypatch.setattr(TesterNode, "wait_for_cell", kept)

    def work() -> None:
        cell = Incomplete(loses=True)
        with session(cell, wait_s=0.1) as opened:
            tester = NodeTester(Tester(MODEL), opened)
            verdicts = [execution.verdict for execution in tester.executions([CASE] * 3)]
        assert [verdict.passed for verdict in verdicts] == [True, False, False]
        assert [verdict.end for verdict in verdicts[1:]] == [End.LOST, End.LOST]
        ((failure,), _) = (verdict.failures for verdict in verdicts[1:])
        assert failure.kind is FailureKind.LOST
        wording(failure.message)
        assert cell.mended == 3
        assert waits == [0.1, 0.1, 0.1, 0.0]
        assert reports == [(opened.waiting,)] * 4  # not the first case alone waits aloud
        assert cell.is_closed

    in_thread(work)


class Leaving(LoopbackCell):
    """A cell whose controllers are asked to leave as soon as they have handled a message of a kind.

    Attributes:
        left: how many have left.
    """

    def __init__(self, kind: str, count: int = 1) -> None:
        self.hub = LoopbackHub()
        super().__init__(DIGEST, self.hub.join)
        self.left = 0
        self._kind = kind
        self._count = count
        self._leaving: list[asyncio.Task[None]] = []

    async def open(self, model: BehaviorModel, warn: Callable[[str], None]) -> Bus:
        own = await super().open(model, warn)
        self._listen()
        return own

    def _listen(self) -> None:
        """Subscribe anew, behind the controller, which so handles each message first."""
        self._buses.append(self.hub.join("listener"))
        self._buses[-1].subscribe(CellTopics.of(MODEL).case, partial(self._hear, self._nodes[0]))

    def _hear(self, controller: ControllerNode | ResourcesNode, received: Received) -> None:
        if (
            self.left < self._count
            and self._nodes[0] is controller
            and decode(received.message.data).kind == self._kind
        ):
            self.left += 1
            self._leaving.append(asyncio.ensure_future(self._leave(controller, self._buses[0])))

    async def _leave(self, controller: ControllerNode | ResourcesNode, bus: Bus) -> None:
        await controller.close()
        await bus.close()

    def replace_controller(self) -> None:
        self._buses[0] = bus = self.hub.join("controller")
        self._nodes[0] = ControllerNode(NodeContext(bus, MODEL, new_status("controller", MODEL, DIGEST), print))
        self._listen()


@pytest.mark.parametrize("kind", ["prepare", "go"])
def test_a_case_whose_controller_leaves_before_it_sends_a_request_runs_with_the_next_one(
    kind: str, wording: Wording
) -> None:
    def work() -> None:
        cell, warnings = Leaving(kind), list[str]()
        opened = session(cell)

        def warn(warning: str) -> None:
            warnings.append(warning)
            cell.replace_controller()

        opened.warn = warn
        with opened:
            tester = Tester(MODEL)
            for _ in range(2):
                done = opened.run(CASE, tester.choices_of(CASE), tester.options_of(CASE))
                assert done.run.end is End.REACHED
        assert cell.left == 1
        wording(warnings)

    in_thread(work)


def test_a_case_that_no_other_controller_takes_is_lost_with_both_reasons(wording: Wording) -> None:
    def work() -> None:
        with session(Leaving("prepare"), wait_s=0.1) as opened:
            tester = Tester(MODEL)
            with wording.raises(LostError):
                opened.run(CASE, tester.choices_of(CASE), tester.options_of(CASE))

    in_thread(work)


def test_a_case_that_every_controller_leaves_is_lost_in_the_end(wording: Wording) -> None:
    def work() -> None:
        cell = Leaving("prepare", count=1_000)
        opened = session(cell)
        opened.warn = lambda _: cell.replace_controller()
        with opened:
            tester = Tester(MODEL)
            with wording.raises(LostError):
                opened.run(CASE, tester.choices_of(CASE), tester.options_of(CASE))
        assert cell.left == 10

    in_thread(work)


def test_a_cell_that_is_not_whole_is_reported_and_left(wording: Wording) -> None:
    def work() -> None:
        hub = LoopbackHub()

        async def open_bus() -> Bus:
            bus = hub.join("controller")
            ControllerNode(NodeContext(bus, MODEL, new_status("controller", MODEL, DIGEST), print))
            return hub.join("tester")

        with wording.raises(NotReadyError) as raised, session(RemoteCell(open_bus), wait_s=0.05):
            pytest.fail("no node simulates its resource")
        assert [(reason.lack, reason.resources) for reason in raised.value.reasons] == [(Lack.RESOURCES, ("scan",))]

    in_thread(work)


@pytest.mark.slow
def test_what_the_first_case_waits_for_is_reported() -> None:
    def work() -> None:
        hub = LoopbackHub()
        reported: list[tuple[Reason, ...]] = []

        async def open_bus() -> Bus:
            return hub.join("tester")

        def come(reasons: tuple[Reason, ...]) -> None:
            """The missing node joins once the session has reported it."""
            reported.append(reasons)
            for role, resources in (("controller", []), ("resources", ["scan"])):
                context = NodeContext(hub.join(role), MODEL, new_status(role, MODEL, DIGEST, resources), print)
                (ControllerNode(context) if role == "controller" else ResourcesNode(context, PlainReactions()))

        opened = session(RemoteCell(open_bus))
        opened.waiting = come
        with opened:
            ((missing,),) = reported
            assert (missing.lack, missing.resources) == (Lack.CONTROLLER, ("scan",))

    in_thread(work)


def test_a_bus_that_cannot_be_opened_is_reported() -> None:
    async def open_bus() -> Bus:
        raise BusError("down", "up")

    def work() -> None:
        with pytest.raises(BusError, match="down"), session(RemoteCell(open_bus)):
            pytest.fail("there is no bus")

    in_thread(work)


def test_another_version_of_the_model_is_reported_at_once(wording: Wording) -> None:
    def work() -> None:
        with pytest.raises(NotReadyError) as raised, session(LoopbackCell("other")):
            pytest.fail("the nodes have another model")
        reasons = raised.value.reasons  # of the nodes that have answered by then
        assert {reason.lack for reason in reasons} == {Lack.MODEL}
        (words,) = {reason.message.partition(" has ")[2] for reason in reasons}
        wording(words)

    in_thread(work)


def test_a_run_that_is_lost_says_why(wording: Wording) -> None:
    class Refusing(LoopbackCell):
        async def open(self, model: BehaviorModel, warn: Callable[[str], None]) -> Bus:
            other = scan_cell(("initial: 5}", "initial: 4}"), ("scanned: box", "renamed: box"))
            assert other.name == model.name
            return await super().open(other, warn)

    def work() -> None:
        with session(Refusing(DIGEST)) as opened:
            tester = Tester(MODEL)
            with wording.raises(LostError):
                opened.run(CASE, tester.choices_of(CASE), tester.options_of(CASE))

    in_thread(work)


class Joined(LoopbackCell):
    """A cell that a tester joins before the second case, who says that it began long ago."""

    def __init__(self) -> None:
        super().__init__(DIGEST)
        self.mended = 0

    async def mend(self) -> None:
        self.mended += 1
        if self.mended == 2:
            bus = self._join("tester")
            self._buses.append(bus)
            status = structs.replace(new_status("tester", MODEL, DIGEST), since_ns=1)
            Membership(bus, CellTopics.of(MODEL), status)


def test_a_tester_that_was_there_before_ends_the_session() -> None:
    def work() -> None:
        with session(Joined()) as opened:
            tester = NodeTester(Tester(MODEL), opened)
            assert tester.execute(CASE).verdict.passed
            with pytest.raises(NotReadyError) as raised:
                all(tester.execute(CASE) for _ in count())  # until the other one is known
            assert [reason.lack for reason in raised.value.reasons] == [Lack.RIVAL]

    in_thread(work)


@dataclass
class Watch:
    """Notices an absence when a test says that there was one."""

    has_noticed: bool = False
    is_over: bool = False

    def close(self) -> None:
        self.is_over = True


@pytest.fixture
def watches(monkeypatch: pytest.MonkeyPatch) -> list[Watch]:
    """Those of all testers, in the order in which they joined."""
    made: list[Watch] = []

    def watch(*_: object) -> Watch:
        made.append(Watch())
        return made[-1]

    monkeypatch.setattr("scbm.nodes.roles.session.AbsenceWatch", watch)
    return made


def test_a_tester_that_was_missed_joins_again_before_the_next_case(watches: list[Watch], wording: Wording) -> None:
    def work() -> None:
        hub, buses = LoopbackHub(), list[LoopbackBus]()
        complaints: list[str] = []

        async def open_bus() -> Bus:
            buses.append(hub.join("tester"))
            if len(buses) == 1:
                for role, names in (("controller", []), ("resources", ["scan"])):
                    context = NodeContext(
                        hub.join(role), MODEL, new_status(role, MODEL, DIGEST, names), complaints.append
                    )
                    (ControllerNode(context) if role == "controller" else ResourcesNode(context, PlainReactions()))
            return buses[-1]

        opened = session(RemoteCell(open_bus))
        opened.warn = complaints.append
        with opened:
            tester = NodeTester(Tester(MODEL), opened)
            assert tester.execute(CASE).verdict.passed
            buses[0].is_open = False  # it is cut off from the others
            watches[0].has_noticed = True
            assert [tester.execute(CASE).verdict.passed for _ in range(2)] == [True, True]
            assert (len(buses), [watch.is_over for watch in watches]) == (2, [True, False])
        (complaint,) = complaints
        wording(complaint)
        assert [watch.is_over for watch in watches] == [True, True]
        assert not buses[1].is_open

    in_thread(work)


class Ending(Children):
    """Nodes on a hub instead of processes. If one ends between cases, only the parent that restarts it learns of that.

    Attributes:
        starts: who had ended at each start, in order; then one of them cannot work any more.
    """

    def __init__(self, hub: LoopbackHub, *starts: tuple[str, ...]) -> None:
        super().__init__({})
        self.starts = list(starts)
        self._hub = hub
        self._nodes: list[ControllerNode | ResourcesNode] = []

    async def start(self) -> tuple[str, ...]:
        if not self._nodes:
            contexts = [
                NodeContext(self._hub.join(role), MODEL, new_status(role, MODEL, DIGEST, names), print)
                for role, names in (("controller", []), ("resources", ["scan"]))
            ]
            self._nodes = [ControllerNode(contexts[0]), ResourcesNode(contexts[1], PlainReactions())]
        return self.starts.pop(0)

    @property
    def broken(self) -> str | None:
        return None if self.starts else "broken"

    async def one_ends(self) -> None:
        await asyncio.Event().wait()

    async def end(self) -> None:
        for node in self._nodes:
            await node.close()


def test_a_child_that_ended_between_cases_is_started_again_before_the_next(wording: Wording) -> None:
    def work() -> None:
        hub = LoopbackHub()
        complaints: list[str] = []

        async def open_bus() -> Bus:
            return hub.join("tester")

        opened = session(RemoteCell(open_bus, Ending(hub, (), (), ("killed",))))
        opened.warn = complaints.append
        reported = []
        with opened:
            tester = NodeTester(Tester(MODEL), opened)
            for _ in range(2):
                assert tester.execute(CASE).verdict.passed
                reported.append(list(complaints))
        before, (complaint,) = reported
        assert (before, complaint.startswith("killed")) == ([], True)
        wording(complaint)

    in_thread(work)


def test_a_child_that_cannot_work_any_more_ends_the_session() -> None:
    def work() -> None:
        hub = LoopbackHub()

        async def open_bus() -> Bus:
            return hub.join("tester")

        with session(RemoteCell(open_bus, Ending(hub, (), ()))) as opened:
            tester = NodeTester(Tester(MODEL), opened)
            assert tester.execute(CASE).verdict.passed
            with pytest.raises(NotReadyError) as raised:
                tester.execute(CASE)
            assert raised.value.reasons == (Reason(Lack.CHILD, "broken"),)

    in_thread(work)


SIGNALS = """
from fractions import Fraction
from signal import SIGTERM, getsignal
from scbm.files import digest_of
from scbm.nodes import LoopbackCell, NotReadyError, Session
from support.models import scan_cell

model, before, seen = scan_cell(), getsignal(SIGTERM), []
for digest in (digest_of(model), "other"):
    try:
        with Session(LoopbackCell(digest), model, digest_of(model), Fraction(1), 60.0):
            seen.append(getsignal(SIGTERM) is before)
    except NotReadyError:
        pass
    seen.append(getsignal(SIGTERM) is before)
print(seen)
"""


@pytest.mark.slow
def test_what_sigterm_does_is_as_it_was_before_once_a_session_is_over_or_could_not_begin() -> None:
    ended = subprocess.run(
        [sys.executable, "-c", SIGNALS], check=False, capture_output=True, text=True, timeout=GUARD_S, cwd=TESTS
    )
    assert (ended.stdout, ended.stderr) == ("[False, True, True]\n", "")


@pytest.mark.parametrize("is_own", [True, False])
def test_a_tester_that_joins_again_is_older_than_nodes_of_its_own_alone(*, is_own: bool, watches: list[Watch]) -> None:
    def work() -> None:
        hub, buses = LoopbackHub(), list[LoopbackBus]()

        async def open_bus() -> Bus:
            buses.append(hub.join("tester"))
            if not is_own and len(buses) == 1:
                await nodes.start()
            if len(buses) == 2:  # another tester has come meanwhile
                Membership(hub.join("another"), CellTopics.of(MODEL), new_status("tester", MODEL, DIGEST))
            return buses[-1]

        nodes = Ending(hub, *[()] * 5)
        with session(RemoteCell(open_bus, nodes if is_own else None)) as opened:
            tester = NodeTester(Tester(MODEL), opened)
            assert tester.execute(CASE).verdict.passed
            buses[0].is_open = False
            watches[0].has_noticed = True
            if is_own:
                assert tester.execute(CASE).verdict.passed
            else:
                with pytest.raises(NotReadyError) as raised:
                    tester.execute(CASE)
                assert [reason.lack for reason in raised.value.reasons] == [Lack.RIVAL]

    in_thread(work)
