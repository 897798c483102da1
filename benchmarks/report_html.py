"""The HTML report of campaigns of the example: how large it is, how long it takes to make, and to open in Chromium.

Every case is drawn and run, and run again for its timeline; none is repeated under another name. The browser is started
once. Each round opens the file in a new window and measures from the first byte until what is waited for is there.
"""

from __future__ import annotations

import shutil
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from playwright.sync_api import sync_playwright

from scbm.files import load_model
from scbm.reports.html import html_report
from scbm.store import Drawn, History, ModelSource, Replays, StoredCase, StoredRun, digest_of, key_of
from scbm.testing import RandomCases, Tester

if TYPE_CHECKING:
    from collections.abc import Callable

    from playwright.sync_api import Browser, Page

    from scbm.model import BehaviorModel
    from scbm.testing import Execution

ROOT = Path(__file__).parent.parent
MODEL = ROOT / "examples" / "robot_in_the_air" / "before.yaml"
SIZES = (2_000, 10_000)
ROUNDS = 5
ARGUMENTS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run")


def history(model: BehaviorModel, cases: int) -> History:
    """What a store would hold after one run."""
    tester, random, digest = Tester(model), RandomCases(model), digest_of(model)
    kept = []
    for number in range(1, cases + 1):
        recipe = Drawn(1, number)
        ran = tester.execute(random.case(1, number)).result
        key, place = key_of(recipe, digest), number
        fields = (ran.case.goal, 0, place, ran.verdict, ran.ended_ns, ran.requests, ran.visited)
        kept.append(StoredCase(key, ran.case.name, recipe, *fields))
    source = ModelSource(str(MODEL.relative_to(ROOT)), MODEL.read_text(encoding="utf-8"))
    run = StoredRun(
        "0" * 32, "2026-01-01T00:00:00.000000Z", f"scbm test {source.path} --cases {cases}", source, 0, cases
    )
    return History(model, (run,), tuple(kept))


def made(tested: History) -> tuple[str, float, float]:
    """The report, the seconds that it took to run all cases again, and the seconds for all else."""
    replays = Replays(tested)
    spent = 0.0

    def replay(case: StoredCase) -> Execution | None:
        nonlocal spent
        begin = time.perf_counter()
        execution = replays.execute(case)
        spent += time.perf_counter() - begin
        return execution

    begin = time.perf_counter()
    text = html_report(tested, replay)
    return text, spent, time.perf_counter() - begin - spent


def first_page(page: Page) -> None:
    """The figure is drawn."""
    page.locator(".page.shown .large").wait_for()


def list_of_cases(page: Page) -> None:
    """The list is drawn, and a word was searched for in all of it."""
    page.locator(".page.shown tbody tr").first.wait_for()
    page.locator("input.of-cases").fill("case-1999")
    page.locator(".found", has_text=" of ").wait_for()


def last_timeline(page: Page) -> None:
    """A case is shown with its timeline."""
    page.locator(".page.shown .of-timeline svg").first.wait_for()


def seconds(browser: Browser, address: str, wait: Callable[[Page], None]) -> str:
    """The median and the worst of some rounds."""
    times = []
    for _ in range(ROUNDS):
        page = browser.new_page()
        begin = time.perf_counter()
        page.goto(address, wait_until="commit")
        wait(page)
        times.append(time.perf_counter() - begin)
        page.close()
    return f"{sorted(times)[ROUNDS // 2]:.2f} s (worst {max(times):.2f} s)"


def main() -> None:
    """Prints a block of lines for each size."""
    model = load_model(MODEL)
    with sync_playwright() as playwright, TemporaryDirectory() as directory:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        for cases in map(int, sys.argv[1:]) if sys.argv[1:] else SIZES:
            text, replayed, rest = made(history(model, cases))
            file = Path(directory) / "report.html"
            file.write_text(text, encoding="utf-8")
            print(f"{cases:,} cases, all run: {file.stat().st_size / 1e6:.1f} MB")
            print(f"  made in {rest:.1f} s, and {replayed:.1f} s to run them again")
            print(f"  opened at the first page in {seconds(browser, file.as_uri(), first_page)}")
            print(f"  at the cases, and searched in {seconds(browser, f'{file.as_uri()}#/cases', list_of_cases)}")
            last = f"{file.as_uri()}#/case/seed-1-case-{cases}"
            print(f"  at the timeline of the last case in {seconds(browser, last, last_timeline)}")
        browser.close()


if __name__ == "__main__":
    main()
