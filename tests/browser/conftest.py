"""Reports to open in a real browser.

The tests are skipped where Chromium or Playwright is missing; with SCBM_ALL_TOOLS=1 they fail there instead.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from msgspec.structs import replace

from scbm.reports.html import html_report
from scbm.store import History, Replays, StoredCase
from scbm.testing import Execution, RandomCases
from support.flat_factory import flat_factory
from support.histories import EXAMPLE, history_of, since_another_run
from support.loops import PAGE_GUARD_S
from support.real_runs import with_real_runs

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Page

if os.environ.get("SCBM_ALL_TOOLS") == "1":
    import playwright.sync_api  # noqa: F401 - the modules with tests skip themselves where it is missing

FAILING = """\
# </script><script>document.title = "broken"</script> <!-- & "quotes" 'too' — größer
behavior_model: failing
variables:
  valve: {domain: [shut, open], initial: shut, random: any}
  pump: {domain: [off, on], initial: off}
  level: {domain: 0..3, initial: 0}
operations:
  start_pump: {pre: {g: pump == off && level < 3}, post: {g: true, a: [pump <- on]}}
  a_very_long_name_of_an_operation_that_nothing_needs_but_that_has_to_fit_into_every_table_of_the_report:
    pre: {g: pump == on && level < 3 && valve == open}
    post: {g: true, a: [level += 1]}
automatic_transitions:
  open_valve: {g: pump == on && valve == shut, a: [valve <- open]}
goals:
  pumping: pump == on
  drained: level == 3 && pump == off
requirements:
  open_while_pumping: always pump == on -> valve == open
"""

OPERATIONS = 314
"""The number of operations of a large model."""


@dataclass
class Visit:
    """Opens reports in the browser, and remembers all that it should not have done.

    Windows with equal options share a context of the browser, as a new one costs as much as a page.
    """

    browser: Browser
    contexts: dict[str, BrowserContext]
    complaints: list[str] = field(default_factory=list)
    pages: list[Page] = field(default_factory=list)

    def open(self, report: Path, address: str = "", **options: Any) -> Page:  # noqa: ANN401 - as Playwright has them
        """A new window with a report; `options` are those of Playwright's `new_context`."""
        key = str(sorted(options.items()))
        if key not in self.contexts:
            self.contexts[key] = self.browser.new_context(**options)
        page = self.contexts[key].new_page()
        self.pages.append(page)
        page.set_default_timeout(PAGE_GUARD_S * 1_000)
        file = report.as_uri()
        page.on("console", lambda message: self._complain(message.type in ("error", "warning"), message.text))
        page.on("pageerror", lambda error: self._complain(True, str(error)))
        page.on("request", lambda request: self._complain(request.url.split("#")[0] != file, f"asks for {request.url}"))
        page.goto(file + address)
        return page

    def close(self) -> None:
        """Close all windows, and forget what they kept in the browser."""
        for page in self.pages:
            page.evaluate("localStorage.clear()")
            page.close()

    def _complain(self, is_wrong: bool, words: str) -> None:  # noqa: FBT001 - a private method with two callers
        if is_wrong:
            self.complaints.append(words)


@pytest.fixture(scope="session")
def contexts() -> dict[str, BrowserContext]:
    """The contexts of the browser, by their options."""
    return {}


@pytest.fixture
def visit(browser: Browser, contexts: dict[str, BrowserContext]) -> Iterator[Visit]:
    """Opens reports; in the end nothing may have been complained of, and nothing fetched but the report."""
    made = Visit(browser, contexts)
    yield made
    made.close()
    assert made.complaints == []


@pytest.fixture(scope="session")
def write_report(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Writes the report of a history into a file."""

    def write(history: History, replay: Callable[[StoredCase], Execution | None] | None = None) -> Path:
        path = tmp_path_factory.mktemp("report") / "report.html"
        path.write_text(html_report(history, replay or Replays(history).execute), encoding="utf-8")
        return path

    return write


@pytest.fixture(scope="session")
def factory(write_report: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the report of ten random cases of a factory with 314 operations."""
    model = tmp_path_factory.mktemp("factory") / "factory.yaml"
    model.write_text(flat_factory(OPERATIONS), encoding="utf-8")
    return write_report(history_of(model, 10))


@pytest.fixture(scope="session")
def before(write_report: Callable[..., Path]) -> Path:
    """20 random cases of the example, 46.51 %."""
    return write_report(history_of(EXAMPLE / "before.yaml", 20))


@pytest.fixture(scope="session")
def after(write_report: Callable[..., Path]) -> Path:
    """The repaired example with its written cases."""
    return write_report(history_of(EXAMPLE / "after.yaml", 10, written=[EXAMPLE / "cases"]))


@pytest.fixture(scope="session")
def dual_cnc(write_report: Callable[..., Path]) -> Path:
    """The written cases of the cell with two CNC machines."""
    folder = EXAMPLE.parent / "dual_cnc"
    return write_report(history_of(folder / "cell.yaml", 0, written=[folder / "cases"]))


@pytest.fixture(scope="session")
def failing(write_report: Callable[..., Path], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Cases that fail, of a model that says things that must not be taken for HTML."""
    model = tmp_path_factory.mktemp("model") / "failing & <b>.yaml"
    model.write_text(FAILING, encoding="utf-8")
    return write_report(since_another_run(history_of(model, 30)))


@pytest.fixture(scope="session")
def many(write_report: Callable[..., Path]) -> Path:
    """10,000 cases: those of 20 under other names, each with the run of its like."""
    history = history_of(EXAMPLE / "before.yaml", 20)
    runs = {case.key: Replays(history).execute(case) for case in history.cases}
    cases = tuple(replace(history.cases[i % 20], name=f"copy-{i + 1}", position=i + 1) for i in range(10_000))
    return write_report(replace(history, cases=cases), lambda case: runs[case.key])


@pytest.fixture(scope="session")
def earlier(write_report: Callable[..., Path]) -> Path:
    """Two cases; the second was run on an earlier version of the model."""
    history = history_of(EXAMPLE / "before.yaml", 2)
    first, second = history.cases
    return write_report(replace(history, cases=(first, replace(second, is_earlier=True))))


@pytest.fixture(scope="session")
def over_nodes(write_report: Callable[..., Path]) -> Path:
    """Three simulated cases, and the first two of them over nodes; the log of the second gives another run."""
    simulated = history_of(EXAMPLE / "before.yaml", 3)
    history = with_real_runs(simulated, tuple(RandomCases(simulated.model).first(2, 1)), ("scanner",))
    replays = Replays(history)
    return write_report(history, lambda case: None if case == history.cases[-1] else replays.execute(case))
