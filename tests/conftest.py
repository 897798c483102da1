"""What all tests share: tiers, golden files, the command line in the process, DDS domains and the browser."""

from __future__ import annotations

import support.bytecode
import support.whole_product  # noqa: F401 - before all other imports of scbm

# isort: split
import asyncio
import gc
import os
import shutil
import signal
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from math import inf
from pathlib import Path
from socket import gethostname
from typing import TYPE_CHECKING

import pytest

from scbm.cli import main
from support import core_tier, tiers
from support.domains import LOOPBACK, own_domain
from support.import_order import BackwardImports, begins_last
from support.loops import GUARD_S, PAGE_GUARD_S
from support.profiles import load_profile
from support.shared_closings import SharedCloser, shared_flaws
from support.shared_models import share_models
from support.shared_programs import share_programs
from support.wording import Wording

share_models()

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

_LEFT_OUT = pytest.StashKey[dict[str, int]]()
"""How many tests of each tier a process left out."""

_MOST_WORKERS = 4
"""Each worker imports all tests, which costs more than it saves beyond so many."""

_GARBAGE_THRESHOLD = 200_000
"""As in a closing. With 20,000, searching for garbage takes a twelfth of the time of some tests."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--core", action="store_true", help="run only tests of the core tier, as without any arguments")
    parser.addoption("--full", action="store_true", help="run all tiers of tests, with all examples of properties")
    parser.addoption("--one-in", type=int, default=1, metavar="N", help="run a fixed sample: one of N slow tests")
    parser.addoption("--update-golden", action="store_true", help="write golden files instead of comparing with them")


def pytest_configure(config: pytest.Config) -> None:
    load_profile(is_full=config.getoption("--full"))
    if core_tier.is_core_run(config):
        config.pluginmanager.register(core_tier.CoreCollection(core_tier.read_core_list()))
    if begins_last(config):
        config.pluginmanager.register(BackwardImports())
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # a shell does so for a job in the background
        signal.signal(signal.SIGINT, signal.default_int_handler)  # the processes that tests start inherit it


@pytest.hookimpl(optionalhook=True, tryfirst=True)
def pytest_xdist_auto_num_workers(config: pytest.Config) -> int | None:
    """Start no workers for a few files: one process is done before workers have imported everything."""
    if config.getoption("--update-golden"):
        return 0  # several examples of one page are written one after the other
    are_files = all(name.partition("::")[0].endswith(".py") for name in config.args)
    if are_files and len(config.args) <= _MOST_WORKERS:
        return 0
    return min(_MOST_WORKERS, os.cpu_count() or 1)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Search for garbage only after the collection, and then rarely: the modules of all tests stay until the end."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()  # without a search before, which takes half a second of each worker
        gc.set_threshold(_GARBAGE_THRESHOLD)
        gc.enable()


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the tiers of `support.tiers`, unless options choose tests, and what is not in the sample."""
    if "core" in config.getoption("markexpr"):
        core_tier.mark(items)
    if config.getoption("--full") or config.getoption("markexpr"):
        kept, left_out = tiers.sample(items, config.getoption("--one-in"))
    else:
        kept, left_out = tiers.split(items, config.args, runs_longer=config.getoption("--update-golden"))
    config.stash[_LEFT_OUT] = tiers.counts(left_out)
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = kept


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Send what a worker of pytest-xdist left out to the process that reports."""
    output = getattr(session.config, "workeroutput", None)
    if output is not None:
        output["left_out"] = session.config.stash.get(_LEFT_OUT, {})


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: object) -> None:
    config: pytest.Config = node.config  # type: ignore[attr-defined] # pytest-xdist has no types
    output = getattr(node, "workeroutput", {})  # missing if the worker crashed
    config.stash[_LEFT_OUT] = output.get("left_out", {})


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    if core_tier.is_core_run(config):
        terminalreporter.write_line(core_tier.SUMMARY)
        return
    left_out = config.stash.get(_LEFT_OUT, {})
    if left_out:
        is_sample = config.getoption("--one-in") > 1
        terminalreporter.write_line(tiers.sample_summary(left_out) if is_sample else tiers.summary(left_out))


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Callable[[str, str], None]:
    """Compares a text with the golden file of a name, or writes it with `--update-golden`."""

    def compare(name: str, text: str) -> None:
        path = GOLDEN / name
        if request.config.getoption("--update-golden"):
            path.write_text(text, encoding="utf-8")
        assert path.read_text(encoding="utf-8") == text

    return compare


@pytest.fixture
def wording(request: pytest.FixtureRequest, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory) -> Wording:
    """Compares texts with the golden wording of the module's tests, or writes it with `--update-golden`."""
    module = request.path.relative_to(ROOT / "tests").with_suffix(".txt")
    paths = {str(tmp_path): "TMP", str(tmp_path_factory.getbasetemp()): "BASE", str(ROOT): "ROOT"}
    paths[f"process {os.getpid()} on {gethostname()}"] = "process PID on HOST"
    return Wording(GOLDEN / "wording" / module, request.node.name, paths, request.config.getoption("--update-golden"))


@dataclass(frozen=True)
class Ran:
    """What a command did."""

    code: int
    out: str
    err: str


@pytest.fixture
def scbm(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Callable[..., Ran]:
    """Runs a command line in this process, from the root of the repository.

    However slow the machine is, it starts no processes without `-j`, and prints no lines of progress.
    """
    monkeypatch.setattr("scbm.testing.batches.all_cores.core_count", lambda: 1)
    monkeypatch.setattr("scbm.cli.output.progress._INTERVAL_S", inf)
    share_programs(monkeypatch)
    monkeypatch.chdir(ROOT)
    monkeypatch.delenv("COLUMNS", raising=False)

    def run(*arguments: object) -> Ran:
        monkeypatch.setattr("sys.argv", ["scbm", *map(str, arguments)])
        with pytest.raises(SystemExit) as exited:
            main()
        captured = capsys.readouterr()
        code = exited.value.code
        return Ran(code if isinstance(code, int) else 0, captured.out, captured.err)

    return run


@pytest.fixture
def shared_closings(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Makes the commands of a test reuse what earlier tests of this process closed and checked alike.

    Tests that change how closing works, or interrupt it, use the fixture `own_closings` too.
    """
    if "own_closings" not in request.fixturenames:
        monkeypatch.setattr("scbm.cli.verbs.close.Closer", SharedCloser)
        monkeypatch.setattr("scbm.cli.verbs.explain.Closer", SharedCloser)
        monkeypatch.setattr("scbm.proofcheck.check_certificate", shared_flaws)


@pytest.fixture
def own_closings() -> None:
    """Keeps the closings of a test apart from those of other tests."""


@pytest.fixture
def domain(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """A DDS domain of the test's own, on the loopback interface. Without cyclonedds the test is skipped."""
    if find_spec("cyclonedds") is None:
        pytest.skip("not installed: cyclonedds")
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    with own_domain() as number:
        yield number


@pytest.fixture(autouse=True)
def no_loop_runs(request: pytest.FixtureRequest) -> Iterator[None]:
    """Hide the event loop that Playwright keeps running between tests from all tests without a browser."""
    running = None if "browser" in request.fixturenames else asyncio._get_running_loop()
    if running is not None:
        asyncio._set_running_loop(None)
    yield
    if running is not None:
        asyncio._set_running_loop(running)


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
    from playwright.sync_api import expect, sync_playwright  # noqa: PLC0415 - it may be missing

    expect.set_options(timeout=PAGE_GUARD_S * 1_000)
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=path, args=BROWSER_ARGUMENTS, timeout=GUARD_S * 1_000)
        yield started
        started.close()
