"""What tests over DDS share."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest


@pytest.fixture
def warn() -> Iterator[Callable[[str], None]]:
    """For a bus that has nothing to warn of."""
    complaints: list[str] = []
    yield complaints.append
    assert complaints == []
