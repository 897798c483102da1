from __future__ import annotations

import asyncio
from collections.abc import Callable
from functools import partial
from threading import Barrier, Thread
from typing import Any

import pytest

from scbm.nodes.buses.dds import thread_bridge as module
from scbm.nodes.buses.dds.thread_bridge import HandOver
from support import loops

BELLS = [module._Bell, module._ThreadsafeBell]


@pytest.fixture(params=BELLS, ids=lambda bell: bell.__name__, autouse=True)
def bell(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each system has its own way to wake a loop; both are tested where there are both."""
    monkeypatch.setattr(module, "_Bell", request.param)


def test_the_loop_does_all_work_of_all_threads_each_in_its_order() -> None:
    async def scenario() -> list[tuple[int, int]]:
        done: list[tuple[int, int]] = []
        is_done = asyncio.Event()
        hand_over = HandOver(asyncio.get_running_loop())
        begin = Barrier(4)

        def work(thread: int, number: int) -> None:
            done.append((thread, number))
            if len(done) == 4_000:
                is_done.set()

        def give(thread: int) -> None:
            begin.wait()
            for number in range(1_000):
                hand_over(partial(work, thread, number))

        threads = [Thread(target=give, args=(thread,)) for thread in range(4)]
        for thread in threads:
            thread.start()
        await is_done.wait()
        for thread in threads:
            thread.join()
        hand_over.close()
        return done

    done = loops.run(scenario())
    for thread in range(4):
        assert [number for of, number in done if of == thread] == list(range(1_000))


def test_a_burst_wakes_the_loop_once(monkeypatch: pytest.MonkeyPatch) -> None:
    rung: list[None] = []
    ring: Callable[[Any], None] = module._Bell.ring

    def counted(bell: object) -> None:
        rung.append(None)
        ring(bell)

    monkeypatch.setattr(module._Bell, "ring", counted)

    async def scenario() -> int:
        hand_over = HandOver(asyncio.get_running_loop())
        is_done = asyncio.Event()
        for _ in range(100):
            hand_over(lambda: None)
        hand_over(is_done.set)
        await is_done.wait()
        hand_over.close()
        return len(rung)

    assert loops.run(scenario()) == 1


def test_work_that_is_given_by_work_is_done() -> None:
    async def scenario() -> None:
        hand_over = HandOver(asyncio.get_running_loop())
        is_done = asyncio.Event()
        hand_over(lambda: hand_over(is_done.set))
        await is_done.wait()
        hand_over.close()

    loops.run(scenario())


def test_work_that_fails_is_reported_and_takes_nothing_with_it() -> None:
    async def scenario() -> list[str]:
        reported: list[str] = []
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(lambda _, context: reported.append(repr(context["exception"])))
        hand_over = HandOver(loop)
        is_done = asyncio.Event()

        def fail() -> None:
            raise RuntimeError("no")

        hand_over(fail)
        hand_over(is_done.set)
        await is_done.wait()
        hand_over.close()
        return reported

    assert loops.run(scenario()) == ["RuntimeError('no')"]


def test_nothing_is_done_once_it_is_stopped() -> None:
    async def scenario() -> list[str]:
        done: list[str] = []
        hand_over = HandOver(asyncio.get_running_loop())
        other = HandOver(asyncio.get_running_loop())
        is_over = asyncio.Event()
        hand_over(hand_over.stop)
        hand_over(lambda: done.append("in the same burst"))
        hand_over(is_over.set)
        other(lambda: hand_over(lambda: done.append("later")))
        other(lambda: other(is_over.set))
        await is_over.wait()
        await asyncio.sleep(0)
        hand_over.close()
        other.close()
        return done

    assert loops.run(scenario()) == []


def test_work_for_a_loop_that_is_gone_is_dropped() -> None:
    async def scenario() -> HandOver:
        return HandOver(asyncio.get_running_loop())

    hand_over = loops.run(scenario())
    hand_over(lambda: pytest.fail("no loop is there to do it"))
