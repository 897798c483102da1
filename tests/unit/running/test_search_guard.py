"""Limits of time and memory on a search, for a planner that asks whether it may go on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import SimpleNamespace

import pytest

from scbm.model import Predicate, Truth, Value
from scbm.planning import Limit, LimitReached, PlanLimits, SearchCancelledError, Unsolvable
from scbm.planning.plan_answers import Answer
from scbm.running.search_guard import memory_bytes, plan_guarded

ENDS = Unsolvable(0)


class _Search:
    """A planner that asks three times whether it may go on."""

    def plan(
        self,
        state: Mapping[str, Value],  # noqa: ARG002 - as the protocol says
        goal: Predicate,  # noqa: ARG002
        limits: PlanLimits = PlanLimits(),  # noqa: ARG002, B008
        should_continue: Callable[[], bool] = lambda: True,
    ) -> Answer:
        for _ in range(3):
            if not should_continue():
                raise SearchCancelledError
        return ENDS


@pytest.fixture
def used(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Time and memory as a test sets them."""
    use = SimpleNamespace(clock=iter((50, 52, 55, 58)), memory=100)
    clock = SimpleNamespace(monotonic_ns=lambda: next(use.clock))
    monkeypatch.setattr("scbm.running.search_guard.time", clock)
    monkeypatch.setattr("scbm.running.search_guard.memory_bytes", lambda: use.memory)
    return use


def answer(limits: PlanLimits, should_continue: Callable[[], bool] = lambda: True) -> Answer:
    return plan_guarded(_Search(), {}, Truth(True), limits, should_continue)


def test_a_search_without_limits_of_time_and_memory_ends_by_itself(used: SimpleNamespace) -> None:
    assert used.memory == 100
    assert answer(PlanLimits()) == ENDS


def test_a_search_may_use_as_much_time_as_its_limit(used: SimpleNamespace) -> None:
    assert answer(PlanLimits(time_ns=8)) == ENDS
    assert list(used.clock) == []


def test_a_search_that_takes_longer_reaches_the_limit_of_time(used: SimpleNamespace) -> None:
    assert answer(PlanLimits(time_ns=7)) == LimitReached(Limit.TIME, 0)
    assert list(used.clock) == []


def test_a_search_may_use_as_much_memory_as_its_limit(used: SimpleNamespace) -> None:
    used.memory = 200
    assert answer(PlanLimits(memory_bytes=200)) == ENDS


def test_a_search_that_uses_more_reaches_the_limit_of_memory(used: SimpleNamespace) -> None:
    used.memory = 201
    assert answer(PlanLimits(memory_bytes=200)) == LimitReached(Limit.MEMORY, 0)


def test_a_search_that_its_caller_cancels_has_no_answer(used: SimpleNamespace) -> None:
    with pytest.raises(SearchCancelledError):
        answer(PlanLimits(time_ns=8, memory_bytes=used.memory), lambda: False)


def test_this_process_uses_some_megabytes() -> None:
    assert 1_000_000 < memory_bytes() < 1 << 40


@pytest.mark.parametrize(("platform", "unit"), [("darwin", 1), ("freebsd14", 1024)])
def test_without_proc_the_maximum_so_far_counts_in_the_unit_of_the_system(
    platform: str, unit: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    resource = pytest.importorskip("resource", reason="not on Windows")

    def missing(*_: object, **__: object) -> str:
        raise FileNotFoundError

    monkeypatch.setattr("scbm.running.search_guard.Path.read_text", missing)
    monkeypatch.setattr("scbm.running.search_guard.sys.platform", platform)
    monkeypatch.setattr(resource, "getrusage", lambda _: SimpleNamespace(ru_maxrss=7))
    assert memory_bytes() == 7 * unit
