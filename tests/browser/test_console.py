"""The page of `scbm console`, as people use it: clicks, keys, errors, and a saved case."""

from __future__ import annotations

import json
import re
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

pytest.importorskip("playwright.sync_api", reason="there is no Playwright")
from playwright.sync_api import expect

from browser.test_access import AXE, WINDOWS
from scbm.files import load_model, read_case
from scbm.testing import Tester
from support.console_pages import ServedConsole, served
from support.consoles import CELL
from support.loops import PAGE_GUARD_S

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from playwright.sync_api import Browser, Page

    from conftest import Ran

pytestmark = pytest.mark.browser

AIR = Path(__file__).parents[2] / "examples" / "robot_in_the_air"


@pytest.fixture
def cell(tmp_path: Path) -> Path:
    path = tmp_path / "cell.yaml"
    path.write_text(CELL, encoding="utf-8")
    return path


@pytest.fixture
def console(cell: Path) -> Iterator[ServedConsole]:
    with served(cell, "case: my_case   # mine\nmodel: ../cell.yaml\ngoal: gripped\n") as found:
        yield found


@pytest.fixture
def open_page(browser: Browser) -> Iterator[Callable[..., Page]]:
    """Opens a console; nothing may go wrong in its page."""
    complaints: list[str] = []
    contexts = []

    def opened(console: ServedConsole, *, width: int = 1440, scheme: str = "light") -> Page:
        context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)  # type: ignore[arg-type]
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PAGE_GUARD_S * 1_000)
        expect.set_options(timeout=PAGE_GUARD_S * 1_000)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on("console", lambda message: complaints.append(message.text) if message.type == "error" else None)
        page.goto(console.address)
        page.locator("html[data-ready]").wait_for()
        return page

    yield opened
    for context in contexts:
        context.close()
    ended = ("ERR_CONNECTION_REFUSED", "no server")  # the page outlives its server
    assert [each for each in complaints if not any(word in each for word in ended)] == []


def text_of(page: Page) -> str:
    return page.locator("#text").input_value()


def click(page: Page, edit: str) -> None:
    before = text_of(page)
    page.locator(f"[data-edit={edit}]").click()
    expect(page.locator("#text")).not_to_have_value(before)


def test_ten_clicks_are_saved_and_give_the_same_run(
    open_page: Callable[..., Page], scbm: Callable[..., Ran], tmp_path: Path
) -> None:
    model = AIR / "after.yaml"
    with served(model, "case: ten\nmodel: m\ngoal: item_a_scanned\n", tmp_path / "cases") as console:
        page = open_page(console)
        for edit, target in (("time_out", "1"), ("fail", "2"), ("late", "3"), ("lose", "4")):
            page.select_option("#target-request", target)
            click(page, edit)
        page.locator(".tl-records tr[data-record='8']").click()
        page.select_option("#target-variable", "gripper_act")
        page.select_option("#value-variable", "closed")
        click(page, "set")
        page.select_option("#target-variable", "scan_timeouts")
        click(page, "hold")
        click(page, "restart")
        kept = text_of(page)
        page.select_option("#target-goal", "item_a_gripped")
        click(page, "goal")
        page.keyboard.press("Escape")
        page.locator("#undo").click()
        expect(page.locator("#text")).to_have_value(kept)
        page.locator("[aria-label='first record']").click()
        page.select_option("#target-variable", "scanned_a")
        click(page, "set")  # a branch: an earlier moment
        page.select_option("#target-goal", "gripper_closed_at_agv")
        click(page, "goal")
        page.locator("#save-button").click()
        expect(page.locator("#said")).to_contain_text("ten.yaml")
        records = int(page.locator(".tl-count").inner_text().split(" of ")[1])
        text = text_of(page)
        trace = console.ask("trace", text)
    saved = tmp_path / "cases" / "ten.yaml"
    assert saved.read_text(encoding="utf-8") == text
    replayed = scbm("replay", saved, "--json")
    assert json.loads(replayed.out) | {"is_recorded_run": None} == trace | {"is_recorded_run": None}
    assert len(trace["trace"]) == records
    assert (scbm("test", model, saved).code == 0) is trace["passed"]


def test_by_keyboard_alone_from_an_empty_console_to_a_saved_case(
    open_page: Callable[..., Page], console: ServedConsole, cell: Path
) -> None:
    page = open_page(console)
    press = page.keyboard.press
    press("?")
    expect(page.locator("#help")).to_be_visible()
    press("Escape")
    expect(page.locator("#help")).to_be_hidden()
    press("e")
    expect(page.locator("#text")).to_be_focused()
    press("Escape")
    press("r")
    expect(page.locator("#target-request")).to_be_focused()
    for _ in range(3):
        press("Tab")
    expect(page.locator("[data-edit=time_out]")).to_be_focused()
    press("Enter")
    expect(page.locator("#text")).to_have_value(re.compile("timeout"))
    expect(page.locator("[data-edit=time_out]")).to_be_focused()
    expect(page.locator("#said")).not_to_be_empty()
    for _ in range(6):
        press("ArrowRight")
    expect(page.locator(".tl-count")).to_contain_text("7 of")
    press("u")
    expect(page.locator("#text")).not_to_have_value("timeout")
    press("U")
    expect(page.locator("#text")).to_have_value(re.compile("timeout"))
    press("s")
    expect(page.locator("#name")).to_be_focused()
    press("Control+a")
    page.keyboard.type("by_keys")
    press("Tab")
    press("Space")
    press("Enter")
    expect(page.locator("#said")).to_contain_text("by_keys.yaml")
    model = load_model(cell)
    case = read_case((cell.parent / "cases" / "by_keys.yaml").read_text(encoding="utf-8"), model)
    assert case.recorded is not None
    assert Tester(model).execute(case).verdict.passed


def test_errors_have_their_lines_and_the_run_before_stays(
    open_page: Callable[..., Page], console: ServedConsole
) -> None:
    page = open_page(console)
    page.locator("#text").fill("case: a\ngoal: nothing\n")
    page.locator("#errors button").click()
    expect(page.locator("#text")).to_be_focused()
    assert page.evaluate("document.activeElement.selectionStart") == 8
    expect(page.locator("#middle.stale .tl-lanes")).to_be_visible()
    page.locator("#undo").click()
    expect(page.locator("#errors button")).to_have_count(0)
    expect(page.locator("#middle:not(.stale)")).to_be_visible()


def test_a_reload_loses_nothing(open_page: Callable[..., Page], console: ServedConsole) -> None:
    page = open_page(console)
    click(page, "fail")
    page.keyboard.press("Escape")
    page.locator("[aria-label='last record']").click()
    count, text = page.locator(".tl-count").inner_text(), text_of(page)
    page.reload()
    page.locator("html[data-ready]").wait_for()
    assert (page.locator(".tl-count").inner_text(), text_of(page)) == (count, text)
    page.locator("#undo").click()
    expect(page.locator("#text")).to_have_value(console.text)


def test_the_right_side_shows_the_moment(open_page: Callable[..., Page], console: ServedConsole) -> None:
    page = open_page(console)
    page.select_option("#operation", "release")
    expect(page.locator("#guards li.bad").first).to_contain_text("gripped")
    page.locator("#state tr", has_text="door").first.locator("td").first.click()
    expect(page.locator("#value-variable")).to_be_focused()
    expect(page.locator("#automata img").first).to_be_visible()
    page.select_option("#value-variable", "open")
    expect(page.locator("#hint")).to_contain_text("can happen")
    click(page, "happen")
    page.locator("[aria-label='last record']").click()
    expect(page.locator("#requirements li.bad")).to_have_count(1)


def test_show_me_opens_a_case_or_says_why_there_is_none(open_page: Callable[..., Page], console: ServedConsole) -> None:
    page = open_page(console)
    page.select_option("#obligation", "grip/timedout")
    page.locator("#show-me").click()
    expect(page.locator("#text")).to_have_value(re.compile("timeout"))
    page.select_option("#obligation", "release/failed")
    page.locator("#show-me").click()
    page.locator("#cancel").click()
    expect(page.locator("#cancel")).to_be_hidden()
    expect(page.locator("#found")).not_to_be_empty()
    console.searches.was_ended.clear()
    page.reload()
    assert console.searches.was_ended.wait(PAGE_GUARD_S)  # else the search runs on unseen


def test_each_of_two_pages_gets_its_own_case(open_page: Callable[..., Page], console: ServedConsole) -> None:
    pages = {name: open_page(console) for name in ("grip/timedout", "grip/failed")}
    for name, page in pages.items():
        page.select_option("#obligation", name)
        page.locator("#show-me").click()
    for name, page in pages.items():
        expect(page.locator("#cancel")).to_be_hidden()
        expect(page.locator("#found")).to_contain_text(f"{name}: here it is")


def test_cells_show_what_the_store_has_and_what_is_new(open_page: Callable[..., Page], cell: Path) -> None:
    stored = ("grip/executing", "grip/failed", "release/executing")
    with served(cell, "case: a\ngoal: gripped\n", stored=stored) as console:
        page = open_page(console)
        expect(page.locator("#cells .store")).to_have_count(2)
        visited = page.locator("#cells .run").count()
        expect(page.locator("#counts")).to_contain_text(f"{visited - 1} of them new to the store")
        click(page, "fail")
        expect(page.locator("#cells [title='grip/failed'].run")).to_have_count(1)
        page.locator("#undo").click()
        expect(page.locator("#cells [title='grip/failed'].seen")).to_have_count(1)
        colours = "cells => [...new Set(cells.map(each => getComputedStyle(each).backgroundColor))].length"
        assert page.locator("#cells span").evaluate_all(colours) == 4


def test_what_was_saved_before_is_not_shown_beside_a_refusal(
    open_page: Callable[..., Page], console: ServedConsole
) -> None:
    page = open_page(console)
    for name, shown in (("mine", re.compile("mine.yaml")), ("no name", "")):
        page.locator("#name").fill(name)
        page.locator("#save-button").click()
        expect(page.locator("#saved")).to_have_text(shown)


def test_a_changed_model_is_loaded_again(open_page: Callable[..., Page], console: ServedConsole, cell: Path) -> None:
    page = open_page(console)
    cell.write_text(CELL.replace("goals:", "goals:\n  opened: door == open"), encoding="utf-8")
    expect(page.locator("#target-goal option")).to_have_count(3)
    cell.unlink()
    expect(page.locator("#notice")).to_contain_text("cell.yaml: there is no such file")
    expect(page.locator("#middle.stale .tl-lanes")).to_be_visible()
    cell.write_text(CELL, encoding="utf-8")
    expect(page.locator("#notice")).to_be_empty()


def test_a_server_that_is_gone_is_a_sentence(browser: Browser, cell: Path) -> None:
    with served(cell, "case: a\ngoal: gripped\n") as console:
        page = browser.new_page()
        page.set_default_timeout(PAGE_GUARD_S * 1_000)
        page.goto(console.address)
        page.locator("html[data-ready]").wait_for()
    page.locator("[data-edit=fail]").click()
    expect(page.locator("#notice")).to_contain_text("ended")
    assert text_of(page).startswith("case: a")
    page.close()


def test_a_wrong_token_is_a_sentence(browser: Browser, console: ServedConsole) -> None:
    page = browser.new_page()
    page.goto(f"{console.address}x")
    expect(page.locator("#notice")).to_contain_text("token")
    page.close()


@pytest.mark.parametrize(("width", "scheme"), WINDOWS)
def test_axe_finds_no_violation(
    open_page: Callable[..., Page], console: ServedConsole, scheme: str, width: int
) -> None:
    page = open_page(console, width=width, scheme=scheme)
    source = files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8")
    page.evaluate(source)
    assert page.evaluate(AXE) == []
    click(page, "time_out")
    page.locator("[aria-label='last record']").click()
    page.locator("#keys").click()
    assert page.evaluate(AXE) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
