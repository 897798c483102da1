"""The thread in which a controller plans."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import Future
from threading import Event, get_ident

import pytest

from scbm.realtime.planner_thread import PlannerThread

GUARD_S = 60


def test_one_thing_is_done_after_another_in_a_thread_of_its_own() -> None:
    thread, may_go, done = PlannerThread(), Event(), list[int]()

    def work(number: int) -> int:
        may_go.wait(GUARD_S)
        done.append(number)
        return get_ident()

    futures = [thread.submit(work, number) for number in range(5)]
    may_go.set()
    threads = [future.result(GUARD_S) for future in futures]
    assert done == [0, 1, 2, 3, 4]
    assert threads == [threads[0]] * 5 != [get_ident()] * 5
    thread.shutdown()


def test_what_is_raised_is_raised_to_whoever_waits_and_the_next_is_done() -> None:
    thread = PlannerThread()
    wrong: Future[int] = thread.submit(int, "no number")
    right = thread.submit(int, "1")
    with pytest.raises(ValueError, match="no number"):
        wrong.result(GUARD_S)
    assert right.result(GUARD_S) == 1
    thread.shutdown()


def test_what_is_cancelled_before_its_turn_is_not_done() -> None:
    thread, may_go = PlannerThread(), Event()
    first = thread.submit(may_go.wait, GUARD_S)
    second = thread.submit(pytest.fail, "this is not wanted")
    assert second.cancel()
    may_go.set()
    assert first.result(GUARD_S)
    assert thread.submit(int).result(GUARD_S) == 0
    thread.shutdown()


def test_a_process_that_ends_does_not_wait_for_it() -> None:
    program = """
from threading import Event
from scbm.realtime.planner_thread import PlannerThread
thread, begun = PlannerThread(), Event()
thread.submit(lambda: (begun.set(), Event().wait()))
begun.wait()
thread.shutdown()
"""
    subprocess.run([sys.executable, "-c", program], check=True, timeout=GUARD_S)
