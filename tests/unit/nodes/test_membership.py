"""Who is in a cell, who cannot be in it beside another, and who cannot be understood."""

from __future__ import annotations

from collections.abc import Awaitable, Callable

import pytest
from msgspec import structs

from scbm.nodes.buses.bus import BusError, UnmatchedKind
from scbm.nodes.buses.loopback import LoopbackBus, LoopbackHub
from scbm.nodes.node_messages import VERSION, Status, Trouble, encode
from scbm.nodes.roles.cell_topics import REPETITIONS, STATUS_PERIOD_S, CellTopics, Membership, new_status
from support.models import scan_cell
from support.nodes import JOINS_NS, repeat_status
from support.virtual_loop import VirtualLoop, run_virtually
from support.wording import Wording

MODEL = scan_cell()
TOPICS = CellTopics.of(MODEL)
PERIOD_NS = int(STATUS_PERIOD_S * 1e9)
TROUBLE = Trouble(UnmatchedKind.MISMATCH, "trouble")


def status(role: str, since_ns: int, *resources: str) -> Status:
    return structs.replace(new_status(role, MODEL, "d" * 64, resources), since_ns=since_ns)


class Cell:
    def __init__(self, loop: VirtualLoop) -> None:
        self.loop = loop
        self.hub = LoopbackHub(loop.now_ns)

    def join(self, own: Status) -> tuple[Membership, LoopbackBus]:
        bus = self.hub.join(own.role)
        return Membership(bus, TOPICS, own), bus

    def says(self, words: str) -> LoopbackBus:
        bus = self.hub.join("outsider")
        bus.publisher(TOPICS.status).publish({"data": words})
        return bus


def play(scene: Callable[[Cell], Awaitable[None]]) -> None:
    async def main(loop: VirtualLoop) -> None:
        await scene(Cell(loop))

    run_virtually(main)


def test_each_hears_all_others_whoever_came_first_and_when_they_leave() -> None:
    async def scene(cell: Cell) -> None:
        one, other = status("controller", 1), status("resources", 2, "scan")
        early, _ = cell.join(one)
        late, bus = cell.join(other)
        changes: list[int] = []
        early.changed = lambda: changes.append(len(early.others))
        await cell.loop.settle(JOINS_NS)
        assert (early.own, early.others, late.others) == (one, (other,), (one,))
        await bus.close()
        await cell.loop.settle(JOINS_NS)
        assert (early.others, changes) == ((), [1, 0])

    play(scene)


def test_of_two_controllers_the_oldest_counts_and_of_two_nodes_of_a_resource_too() -> None:
    async def scene(cell: Cell) -> None:
        tester, _ = cell.join(status("tester", 1))
        assert tester.controller() is None
        assert tester.node_of("scan") is None
        new, old = status("controller", 20), status("controller", 10)
        first, second = status("resources", 30, "scan", "other"), status("resources", 40, "scan", "more")
        for node in (new, old, first, second):
            cell.join(node)
        await cell.loop.settle(JOINS_NS)
        assert tester.controller() == old
        assert tester.node_of("scan") == first
        assert tester.node_of("other") == first
        assert tester.node_of("more") == second
        assert tester.node_of("missing") is None

    play(scene)


@pytest.mark.parametrize(
    ("own", "other", "has_to_leave"),
    [
        (status("controller", 2), status("controller", 1), True),
        (status("controller", 1), status("controller", 2), False),
        (status("tester", 2), status("tester", 1), True),
        (status("tester", 2), status("controller", 1), False),
        (status("resources", 2, "scan"), status("resources", 1, "robot", "scan"), True),
        (status("resources", 2, "scan"), status("resources", 1, "robot"), False),
        (status("resources", 1, "scan"), status("resources", 2, "scan"), False),
        (status("controller", 2, "scan"), status("resources", 1, "scan"), False),
    ],
)
def test_the_younger_of_two_that_cannot_both_be_there_has_to_leave(
    own: Status,
    other: Status,
    has_to_leave: bool,  # noqa: FBT001 - a case
) -> None:
    async def scene(cell: Cell) -> None:
        member, _ = cell.join(own)
        cell.join(other)
        await cell.loop.settle(JOINS_NS)
        assert member.rival() == (other if has_to_leave else None)

    play(scene)


def test_of_two_of_the_same_age_just_one_has_to_leave() -> None:
    async def scene(cell: Cell) -> None:
        one, _ = cell.join(status("controller", 1))
        other, _ = cell.join(status("controller", 1))
        await cell.loop.settle(JOINS_NS)
        assert [one.rival() is None, other.rival() is None].count(True) == 1

    play(scene)


def test_a_rival_that_left_is_none() -> None:
    async def scene(cell: Cell) -> None:
        own, _ = cell.join(status("tester", 2))
        _, bus = cell.join(status("tester", 1))
        await cell.loop.settle(JOINS_NS)
        assert own.rival() is not None
        await bus.close()
        await cell.loop.settle(JOINS_NS)
        assert own.rival() is None

    play(scene)


def test_who_cannot_be_understood_is_unknown_until_it_leaves_or_speaks_clearly(wording: Wording) -> None:
    async def scene(cell: Cell) -> None:
        own, _ = cell.join(status("tester", 1))
        changes: list[int] = []
        own.changed = lambda: changes.append(len(own.unreadable))
        bus = cell.says('{"kind": "status", "role": "controller", "version": 99}')
        await cell.loop.settle()
        counts = [(len(own.others), len(own.unreadable))]
        wording(own.unreadable)
        bus.publisher(TOPICS.status).publish({"data": ""})
        await cell.loop.settle()
        counts.append((len(own.others), len(own.unreadable)))
        await bus.close()
        await cell.loop.settle()
        counts.append((len(own.others), len(own.unreadable)))
        publisher = cell.hub.join("late").publisher(TOPICS.status)
        publisher.publish({"data": "what"})
        late = encode(status("controller", 5))
        for _ in range(REPETITIONS + 1):
            publisher.publish({"data": late})
            await cell.loop.settle(PERIOD_NS)
        counts.append((len(own.others), len(own.unreadable)))
        assert counts == [(0, 1), (0, 2), (0, 0), (1, 0)]
        assert changes == [1, 2, 1, 0, 1, 0]

    play(scene)


@pytest.mark.parametrize("burst", [1, 1_000])
def test_a_status_that_comes_once_takes_no_effect_and_is_reported(burst: int, wording: Wording) -> None:
    async def scene(cell: Cell) -> None:
        own, _ = cell.join(status("tester", 2))
        publisher = cell.hub.join("forger").publisher(TOPICS.status)
        for role in ("tester", "controller"):
            for _ in range(burst):
                publisher.publish({"data": encode(status(role, 1))})
        await cell.loop.settle(PERIOD_NS)
        assert own.unreadable == ()
        await cell.loop.settle(100 * PERIOD_NS)
        assert (own.others, own.rival(), own.controller()) == ((), None, None)
        wording(own.unreadable)

    play(scene)


def test_a_status_takes_effect_after_three_periods_and_repetitions_change_nothing() -> None:
    async def scene(cell: Cell) -> None:
        own, _ = cell.join(status("tester", 1))
        changes: list[int] = []
        own.changed = lambda: changes.append(len(own.others))
        cell.join(status("controller", 1))
        await cell.loop.settle(3 * PERIOD_NS - 1)
        assert changes == []
        await cell.loop.settle(PERIOD_NS // 2)
        assert changes == [1]
        await cell.loop.settle(100 * PERIOD_NS)
        assert changes == [1]

    play(scene)


def test_a_publisher_that_says_once_that_it_is_another_node_stays_the_first() -> None:
    async def scene(cell: Cell) -> None:
        own, _ = cell.join(status("tester", 1))
        statuses = [status("controller", 1)]
        bus = cell.hub.join("controller")
        repeat_status(bus, lambda: statuses[-1])
        await cell.loop.settle(JOINS_NS)
        statuses.append(status("controller", 2))
        await cell.loop.settle(PERIOD_NS)
        statuses.append(statuses[0])
        await cell.loop.settle(100 * PERIOD_NS)
        assert own.others == (statuses[0],)
        statuses.append(statuses[1])
        await cell.loop.settle(JOINS_NS)
        assert own.others == (statuses[1],)

    play(scene)


def test_a_node_that_could_not_repeat_its_status_goes_on_and_one_that_is_closed_does_not() -> None:
    async def scene(cell: Cell) -> None:
        one, bus = cell.join(status("controller", 1))
        bus.is_open = False
        await cell.loop.settle(5 * PERIOD_NS)
        bus.is_open = True
        late, _ = cell.join(status("tester", 2))
        await cell.loop.settle(JOINS_NS)
        assert late.others == (one.own,)
        one.close()
        later, _ = cell.join(status("resources", 3))
        await cell.loop.settle(JOINS_NS)
        assert later.others == (late.own,)

    play(scene)


def test_a_node_that_finds_no_other_reports_it_once() -> None:
    async def scene(cell: Cell) -> None:
        reported: list[str] = []
        first, _ = cell.join(status("controller", 1))
        first.report_if_alone("alone", reported.append)
        await cell.loop.settle(5 * 10**9 - 1)
        assert reported == []
        await cell.loop.settle(100 * 10**9)
        assert reported == ["alone"]
        second, _ = cell.join(status("resources", 2))
        second.report_if_alone("second", reported.append)
        closed, _ = cell.join(status("resources", 3))
        closed.report_if_alone("closed", reported.append)
        closed.close()
        await cell.loop.settle(100 * 10**9)
        assert reported == ["alone"]

    play(scene)


def test_a_message_of_another_kind_is_no_member() -> None:
    async def scene(cell: Cell) -> None:
        own, _ = cell.join(status("tester", 1))
        cell.says('{"kind": "go", "run": "x"}')
        await cell.loop.settle(JOINS_NS)
        assert own.others == ()

    play(scene)


def test_others_learn_what_a_node_lacks_now() -> None:
    async def scene(cell: Cell) -> None:
        own, _ = cell.join(status("tester", 1))
        controller, _ = cell.join(status("controller", 1, "scan"))
        await cell.loop.settle(JOINS_NS)
        controller.publish_troubles((TROUBLE,))
        await cell.loop.settle(JOINS_NS)
        controller_status = own.controller()
        assert controller_status is not None
        assert controller_status.troubles == (TROUBLE,)
        controller.publish_troubles(())
        await cell.loop.settle(JOINS_NS)
        assert own.controller() == structs.replace(controller_status, troubles=())
        late, _ = cell.join(status("resources", 3))
        await cell.loop.settle(JOINS_NS)
        assert controller.own in late.others

    play(scene)


def test_what_could_not_be_reported_is_reported_when_it_is_tried_again() -> None:
    async def scene(cell: Cell) -> None:
        own, _ = cell.join(status("tester", 1))
        controller, bus = cell.join(status("controller", 1, "scan"))
        bus.is_open = False
        with pytest.raises(BusError):
            controller.publish_troubles((TROUBLE,))
        bus.is_open = True
        controller.publish_troubles((TROUBLE,))
        await cell.loop.settle(JOINS_NS)
        controller_status = own.controller()
        assert controller_status is not None
        assert controller_status.troubles == (TROUBLE,)

    play(scene)


def test_a_new_node_says_of_itself_what_nobody_else_does() -> None:
    one, other = (new_status("resources", MODEL, "d" * 64, ["scan"]) for _ in range(2))
    assert one.node != other.node
    assert (one.role, one.model, one.digest, one.resources, one.version) == (
        "resources",
        "scan_cell",
        "d" * 64,
        ("scan",),
        VERSION,
    )
    assert one.since_ns <= other.since_ns
