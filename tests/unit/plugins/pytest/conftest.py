"""A directory with a model, as users have it."""

from __future__ import annotations

import pytest

from support.cells import write
from support.models import SCAN_CELL


@pytest.fixture
def cell(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """A directory with the model `cell.yaml`, which alone is no test, and sessions that print the same everywhere."""
    for name in ("CI", "BUILD_NUMBER"):  # pytest does not shorten its summary where one of them is set
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("COLUMNS", "80")
    write(pytester.path, cell=SCAN_CELL)
    return pytester
