"""What all tests share: golden files, the command line in the process, and Hypothesis settings."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

from scbm.cli import main
from support.domains import LOOPBACK, own_domain

collect_ignore = ["models"]
"""The models and cases there are right and wrong on purpose; they belong to tests of their own."""

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytest_plugins = ["pytester"]

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
BROWSER_ARGUMENTS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
)

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


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """A DDS domain of the test's own, on the loopback interface. Without cyclonedds the test is skipped."""
    if find_spec("cyclonedds") is None:
        pytest.skip("not installed: cyclonedds")
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    with own_domain() as number:
        yield number


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """Chromium, without a window: one for all tests, as a process can have Playwright running only once.

    Without Chromium or Playwright the tests that need it are skipped; with SCBM_ALL_TOOLS=1 they fail.
    """
    path = next(filter(None, map(shutil.which, BROWSERS)), None)
    missing = ["playwright"] * (find_spec("playwright") is None) + ["chromium"] * (path is None)
    if missing and os.environ.get("SCBM_ALL_TOOLS") == "1":
        pytest.fail(f"not installed: {', '.join(missing)}; SCBM_ALL_TOOLS=1 says that it is there")
    if missing:
        pytest.skip(f"not installed: {', '.join(missing)}")
    from playwright.sync_api import sync_playwright  # noqa: PLC0415 - it may be missing

    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=path, args=BROWSER_ARGUMENTS)
        yield started
        started.close()
