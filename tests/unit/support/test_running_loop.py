"""Tests that start an event loop may follow those that leave one running, as Playwright does, in one process."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import pytest


@pytest.fixture(scope="module")
def left_running() -> Iterator[None]:
    loop = asyncio.new_event_loop()
    asyncio._set_running_loop(loop)
    yield
    assert asyncio._get_running_loop() is loop
    asyncio._set_running_loop(None)
    loop.close()


@pytest.mark.usefixtures("left_running")
def test_a_test_without_a_browser_starts_its_own_loop() -> None:
    assert asyncio.run(asyncio.sleep(0, "done")) == "done"
