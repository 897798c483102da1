"""Tiers of tests: what a usual run leaves out, and how to run it. CONTRIBUTING.md describes them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pytest

TIERS: Mapping[str, str] = {
    "slow": "takes seconds of CPU: large counts, many processes",
    "browser": "opens pages in Chromium",
    "peer": "needs a program or library of others: idlc, cargo, genhtml, Perfetto, rosbags, lxml",
    "dds": "starts nodes as processes that meet over DDS",
}


def tier_of(item: pytest.Item) -> str | None:
    """Return the first tier whose mark a test has; `None` for a test of every run."""
    return next((tier for tier in TIERS if item.get_closest_marker(tier)), None)


def split(items: Iterable[pytest.Item], named: Iterable[str]) -> tuple[list[pytest.Item], list[pytest.Item]]:
    """Return the tests of a usual run and those it leaves out; tests that the command line names always run."""
    ids = tuple(name for name in named if "::" in name)
    kept: list[pytest.Item] = []
    left_out: list[pytest.Item] = []
    for item in items:
        is_kept = tier_of(item) is None or item.nodeid.startswith(ids)
        (kept if is_kept else left_out).append(item)
    return kept, left_out


def counts(items: Iterable[pytest.Item]) -> dict[str, int]:
    """Return how many tests there are of each tier."""
    found = Counter(tier_of(item) for item in items)
    return {tier: found[tier] for tier in TIERS if found[tier]}


def summary(left_out: Mapping[str, int]) -> str:
    """Return a sentence about the tests that were left out, and the commands that run them."""
    listed = ", ".join(f"{count} {tier}" for tier, count in left_out.items())
    some = next(iter(left_out))
    return (
        f"Left out: {listed}; properties drew a tenth of their examples.\n"
        f"`pytest -m {some}` runs one of these tiers, `pytest --full` everything (see CONTRIBUTING.md, Tiers of tests)."
    )
