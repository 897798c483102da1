"""Tiers of tests: what a usual run leaves out, and how to run it. CONTRIBUTING.md describes them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING
from zlib import crc32

if TYPE_CHECKING:
    import pytest

TIERS: Mapping[str, str] = {
    "slow": "takes seconds of CPU: large counts, many processes",
    "longer": "takes tenths of a second of CPU, such as a closing of random models",
    "browser": "opens pages in Chromium",
    "peer": "needs a program or library of others: idlc, cargo, genhtml, Perfetto, Dask, scipy",
    "dds": "starts nodes as processes that meet over DDS",
}


def tier_of(item: pytest.Item) -> str | None:
    """Return the first tier whose mark a test has; `None` for a test of every run.

    So a longer test whose large parameters are slow is slow with them.
    """
    return next((tier for tier in TIERS if item.get_closest_marker(tier)), None)


def split(
    items: Iterable[pytest.Item], named: Iterable[str], *, runs_longer: bool = False
) -> tuple[list[pytest.Item], list[pytest.Item]]:
    """Return the tests of a usual run and those it leaves out; tests that the command line names always run.

    `runs_longer` keeps the tier `longer`, too: it needs nothing more, and has many of the golden files.
    """
    ids = tuple(name for name in named if "::" in name)
    kept: list[pytest.Item] = []
    left_out: list[pytest.Item] = []
    for item in items:
        tier = tier_of(item)
        is_kept = tier is None or (runs_longer and tier == "longer") or item.nodeid.startswith(ids)
        (kept if is_kept else left_out).append(item)
    return kept, left_out


def sample(items: Iterable[pytest.Item], one_in: int) -> tuple[list[pytest.Item], list[pytest.Item]]:
    """Return the tests of a sample and those it leaves out: about one of so many slow tests, and all others.

    The names of tests decide, so that the sample is the same everywhere, and stays when other tests come or go.
    """
    kept: list[pytest.Item] = []
    left_out: list[pytest.Item] = []
    for item in items:
        is_kept = tier_of(item) != "slow" or crc32(item.nodeid.encode()) % one_in == 0
        (kept if is_kept else left_out).append(item)
    return kept, left_out


def counts(items: Iterable[pytest.Item]) -> dict[str, int]:
    """Return how many tests there are of each tier."""
    found = Counter(tier_of(item) for item in items)
    return {tier: found[tier] for tier in TIERS if found[tier]}


def summary(left_out: Mapping[str, int]) -> str:
    """Return a sentence about the tests that were left out, and the commands that run them."""
    listed = _listed(left_out)
    some = next(iter(left_out))
    return (
        f"Left out: {listed}; properties drew a tenth of their examples.\n"
        f"`pytest -m {some}` runs one of these tiers, `pytest --full` everything (see CONTRIBUTING.md, Tiers of tests)."
    )


def sample_summary(left_out: Mapping[str, int]) -> str:
    """Return a sentence about the tests that a sample left out, and the command that runs them."""
    return f"Not in this sample: {_listed(left_out)}. `pytest -m slow` runs them, too."


def _listed(left_out: Mapping[str, int]) -> str:
    return ", ".join(f"{count} {tier}" for tier, count in left_out.items())
