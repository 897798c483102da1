"""The cases of the example, run by pytest from the root of the repository, as its users do."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[4]


@pytest.mark.slow
def test_the_cases_of_the_example_are_tests() -> None:
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "examples/robot_in_the_air"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == 0
    assert "7 passed" in done.stdout
    assert "SCBM-IAS: 100.00 %" in done.stdout
