"""Messages that nodes complain about cannot fill a disk: few complaints of a kind are shown, and all are counted."""

from __future__ import annotations

from dataclasses import replace

from scbm.nodes import ControllerNode
from scbm.nodes.limited_warnings import LimitedWarnings
from scbm.nodes.roles.cell_topics import CellTopics
from support.models import scan_cell
from support.nodes import Stage
from support.virtual_loop import VirtualLoop, run_virtually
from support.wording import Wording

SECOND_NS = 10**9


class Clock:
    """A clock that a test sets."""

    now_ns = 0

    def __call__(self) -> int:
        return self.now_ns


def test_a_flood_of_bad_messages_makes_some_lines(wording: Wording) -> None:
    shown: list[str] = []

    async def main(loop: VirtualLoop) -> None:
        model = scan_cell()
        stage, limited = Stage.virtual(model, loop), LimitedWarnings(shown.append, loop.now_ns)
        node = ControllerNode(replace(stage.context("controller"), warn=limited))
        topics, bus = CellTopics.of(model), stage.join("flood")
        for topic in (topics.case, topics.status, topics.reply("scan")):
            publisher = bus.publisher(topic)
            for number in range(18_000):
                publisher.publish({"data": f'{{"id": "run_{number}-{number}", "succeeded": {number}}}'})
        await loop.settle()
        assert len(shown) == 10
        await node.close()
        limited.close()

    run_virtually(main)
    assert len(shown) == 12
    wording(shown)


def test_after_some_warnings_one_is_shown_in_each_period_with_the_number_of_those_before() -> None:
    shown: list[str] = []
    clock = Clock()
    limited = LimitedWarnings(shown.append, clock)
    for _ in range(60):
        limited(f"a message was dropped: {clock.now_ns // SECOND_NS}")
        clock.now_ns += SECOND_NS
    more = [line.partition("(and ")[2].split()[:1] for line in shown]
    assert more == [*[[]] * 5, *[["9"]] * 5]
    limited("something else")
    assert shown[-1] == "something else"
    limited.close()
    assert [line.split()[0] for line in shown[11:]] == ["5"]


def test_kinds_without_end_share_their_limit() -> None:
    shown: list[str] = []
    limited = LimitedWarnings(shown.append, Clock())
    for number in range(10_000):
        limited(f"{'x' * number}: bad")
    limited.close()
    assert len(shown) == 50 + 5 + 1
