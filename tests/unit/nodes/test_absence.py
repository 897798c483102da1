"""A process that did not run for a while notices it; one that was only busy does not."""

from __future__ import annotations

import asyncio
from threading import Event

import pytest

from scbm.nodes.roles import node_process
from scbm.nodes.roles.node_process import AbsenceWatch
from support import loops

LEASE_NS = 1_000_000_000
MISSED_NS = 800_000_000
"""The peers may have heard the last announcement a fifth of a lease before."""


class Clock:
    """A clock that advances by the next of the given steps at each reading, and reports when all are used."""

    def __init__(self, jumps_ns: list[int]) -> None:
        self._jumps_ns = jumps_ns
        self._now_ns = 0
        self.looks = 0
        self.is_over = Event()

    def __call__(self) -> int:
        if not self._jumps_ns:
            self.is_over.set()
            return self._now_ns
        self.looks += 1
        self._now_ns += self._jumps_ns.pop(0)
        return self._now_ns


def looked(monkeypatch: pytest.MonkeyPatch, jumps_ns: list[int], lease_ns: int | None = LEASE_NS) -> tuple[bool, int]:
    """Whether an absence was noticed, and after how many looks at the clock."""
    clock = Clock(jumps_ns)
    monkeypatch.setattr(node_process, "monotonic_ns", clock)
    monkeypatch.setattr(node_process, "_LOOK_S", 0.001)

    async def scene() -> bool:
        away: list[int] = []

        def was_away() -> None:
            away.append(clock.looks)
            clock.is_over.set()

        watch = AbsenceWatch(asyncio.get_running_loop(), lease_ns, was_away)
        await asyncio.to_thread(clock.is_over.wait, loops.GUARD_S)
        watch.close()
        return bool(away)

    return loops.run(scene()), clock.looks


def test_who_was_away_as_long_as_a_lease_notices_it(monkeypatch: pytest.MonkeyPatch) -> None:
    assert looked(monkeypatch, [5, MISSED_NS, MISSED_NS + 1, 0, 0]) == (True, 3)


def test_shorter_absences_are_none(monkeypatch: pytest.MonkeyPatch) -> None:
    assert looked(monkeypatch, [MISSED_NS] * 20) == (False, 20)


@pytest.mark.parametrize("lease_ns", [10 * LEASE_NS, None])
def test_the_lease_decides_what_an_absence_is(monkeypatch: pytest.MonkeyPatch, lease_ns: int | None) -> None:
    assert looked(monkeypatch, [MISSED_NS, 8 * LEASE_NS], lease_ns) == (False, 2)


def test_whoever_asks_learns_of_an_absence_before_anybody_is_called(monkeypatch: pytest.MonkeyPatch) -> None:
    now_ns = [7]
    monkeypatch.setattr(node_process, "monotonic_ns", lambda: now_ns[0])
    monkeypatch.setattr(node_process, "_LOOK_S", loops.GUARD_S)

    async def scene() -> list[bool]:
        away: list[None] = []
        watch = AbsenceWatch(asyncio.get_running_loop(), LEASE_NS, lambda: away.append(None))
        noticed = []
        for passed_ns in (0, MISSED_NS, 1):
            now_ns[0] += passed_ns
            noticed.append(watch.has_noticed)
        watch.close()
        return [*noticed, bool(away)]

    assert loops.run(scene()) == [False, False, True, False]
