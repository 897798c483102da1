"""What tests over DDS share."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest


@pytest.fixture
def complain() -> Iterator[Callable[[str], None]]:
    """For a bus that has nothing to complain of."""
    complaints: list[str] = []
    yield complaints.append
    assert complaints == []
