"""What all tests share: golden files, the command line in the process, and Hypothesis settings."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest
from hypothesis import settings

from scbm.cli import main

collect_ignore = ["models"]
"""The models and cases there are right and wrong on purpose; they belong to tests of their own."""

pytest_plugins = ["pytester"]

ROOT = Path(__file__).parent.parent
GOLDEN = Path(__file__).parent / "golden"

# Examples are the same in every run: a test that fails only sometimes tells nothing. To look further than that,
# SCBM_EXPLORE=1 draws new ones.
# No deadlines: how fast a machine is says nothing about what is right.
settings.register_profile("same", derandomize=True, deadline=None)
settings.register_profile("explore", derandomize=False, deadline=None)
settings.load_profile("explore" if os.environ.get("SCBM_EXPLORE") else "same")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="write golden files instead of comparing with them")


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Callable[[str, str], None]:
    """Compares a text with the golden file of a name, or writes it with `--update-golden`."""

    def compare(name: str, text: str) -> None:
        path = GOLDEN / name
        if request.config.getoption("--update-golden"):
            path.write_text(text, encoding="utf-8")
        assert path.read_text(encoding="utf-8") == text

    return compare


@dataclass(frozen=True)
class Ran:
    """What a command did."""

    code: int
    out: str
    err: str


@pytest.fixture
def scbm(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Callable[..., Ran]:
    """Runs a command line in this process, from the root of the repository."""
    monkeypatch.chdir(ROOT)

    def run(*arguments: object) -> Ran:
        monkeypatch.setattr("sys.argv", ["scbm", *map(str, arguments)])
        with pytest.raises(SystemExit) as exited:
            main()
        captured = capsys.readouterr()
        code = exited.value.code
        return Ran(code if isinstance(code, int) else 0, captured.out, captured.err)

    return run
