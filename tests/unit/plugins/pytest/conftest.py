"""A directory with a model, as users have it."""

from __future__ import annotations

import pytest

from support.cells import write
from support.models import SCAN_CELL


@pytest.fixture
def cell(pytester: pytest.Pytester) -> pytest.Pytester:
    """A directory with the model `cell.yaml`, which alone is no test."""
    write(pytester.path, cell=SCAN_CELL)
    return pytester
