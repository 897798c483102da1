"""The timeline of a case, by keyboard and by pointer: what it shows is what the trace says."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from scbm.cases.trace import Record, state_after
from scbm.files import load_model
from scbm.model import format_value
from scbm.testing import Execution, RandomCases, Tester, load_suite
from support.histories import EXAMPLE, history_of
from support.wording import Wording

pytest.importorskip("playwright.sync_api", reason="there is no Playwright")
from playwright.sync_api import expect

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

    from browser.conftest import Visit

pytestmark = pytest.mark.browser

MODELS = Path(__file__).parents[1] / "models"
CASE = "#/case/seed-1-case-6"


@pytest.fixture(scope="session")
def run() -> Execution:
    """What `CASE` shows."""
    model = load_model(EXAMPLE / "before.yaml")
    return Tester(model).execute(RandomCases(model).case(1, 6))


@pytest.fixture(scope="session")
def of_model(write_report: Callable[..., Path]) -> Callable[[str], Path]:
    """The report of one random case of a model that fails at run."""
    return lambda name: write_report(history_of(MODELS / f"fails_at_run/{name}.yaml", 1))


def _shown(page: Page) -> Locator:
    shown = page.locator(".tl")
    expect(shown.locator(".tl-lanes .tl-base").first).to_be_attached()
    return shown


def _press(page: Page, *keys: str) -> None:
    for key in keys:
        page.keyboard.press(key)


def _state(page: Page) -> dict[str, str]:
    """The state panel: name and value of each row."""
    rows = "rows => rows.map(row => [row.cells[0].innerText, row.cells[1].innerText])"
    return dict(page.locator(".tl-state tbody tr").evaluate_all(rows))


def _changed(page: Page) -> set[str]:
    rows = "rows => rows.map(row => row.cells[0].innerText)"
    return {*page.locator(".tl-state tr.changed").evaluate_all(rows)}


def _count(page: Page) -> str:
    return page.locator(".tl-count").inner_text()


def _in_words(values: dict[str, Any]) -> dict[str, str]:
    return {name: format_value(value) for name, value in values.items()}


def _names(record: Record) -> set[str]:
    return {name for name, _ in record.changes}


def _ticks(page: Page) -> list[str]:
    return page.locator(".tl-axis .tl-words").all_text_contents()


@pytest.mark.slow
def test_every_record_can_be_stepped_through_by_keyboard_and_shows_its_state(
    visit: Visit, before: Path, run: Execution
) -> None:
    page = visit.open(before, CASE)
    _shown(page)
    records = run.trace.records
    for index in range(len(records)):
        assert _count(page) == f"{index + 1} of {len(records)}"
        if index % 9 == 0 or index < 10:
            assert _state(page) == _in_words(state_after(records[: index + 1]))
            if index:
                assert _changed(page) == _names(records[index])
        _press(page, "ArrowRight")
    assert _count(page) == f"{len(records)} of {len(records)}"


def test_steps_back_show_the_state_that_was(visit: Visit, before: Path, run: Execution) -> None:
    page = visit.open(before, CASE)
    _shown(page)
    _press(page, *["j"] * 20, *["k"] * 5, "ArrowLeft")
    assert _count(page).startswith("15 of ")
    assert _state(page) == _in_words(state_after(run.trace.records[:15]))


def test_nothing_is_before_the_first_record_and_behind_the_last(visit: Visit, before: Path, run: Execution) -> None:
    page = visit.open(before, CASE)
    shown = _shown(page)
    _press(page, "ArrowLeft")
    assert _count(page).startswith("1 of ")
    shown.locator(".tl-chart").focus()
    _press(page, "End", "ArrowRight")
    total = len(run.trace.records)
    assert _count(page) == f"{total} of {total}"
    assert _state(page) == _in_words(state_after(run.trace.records))
    _press(page, "Home")
    assert _count(page).startswith("1 of ")


def test_brackets_go_from_moment_to_moment(visit: Visit, before: Path, run: Execution) -> None:
    page = visit.open(before, CASE)
    _shown(page)
    times = [record.at_ns for record in run.trace.records]
    firsts = [times.index(at_ns) for at_ns in dict.fromkeys(times)]
    _press(page, "]", "]")
    assert _count(page).startswith(f"{firsts[2] + 1} of ")
    _press(page, "j", "[")
    assert _count(page).startswith(f"{firsts[1] + 1} of ")


def test_a_screen_reader_announces_the_selected_record_with_its_changes(
    visit: Visit, before: Path, run: Execution, wording: Wording
) -> None:
    page = visit.open(before, CASE)
    announced = _shown(page).locator("[aria-live=polite]")
    failed = next(i for i, record in enumerate(run.trace.records) if record.kind == "automatic")
    _press(page, *["ArrowRight"] * failed)
    expect(announced).to_have_attribute("data-kind", "automatic")
    expect(announced).to_have_attribute("data-subject", "robot_failed")
    assert "robot_mount_scanner.state" in _names(run.trace.records[failed])
    wording(announced.inner_text())


def test_the_table_has_every_record_and_a_click_selects(visit: Visit, before: Path, run: Execution) -> None:
    page = visit.open(before, CASE)
    rows = _shown(page).locator(".tl-records tbody tr")
    expect(rows).to_have_count(len(run.trace.records))
    times = rows.locator("td:nth-child(2)").all_text_contents()
    assert times == [f"{record.at_ns / 1e9:.3f} s" for record in run.trace.records]
    rows.nth(30).click()
    assert _count(page).startswith("31 of ")
    expect(rows.nth(30)).to_have_attribute("aria-current", "true")
    assert _state(page) == _in_words(state_after(run.trace.records[:31]))


def test_up_and_down_step_in_the_table(visit: Visit, before: Path) -> None:
    page = visit.open(before, CASE)
    _shown(page).locator(".tl-records").focus()
    _press(page, "ArrowDown", "ArrowDown", "ArrowDown", "ArrowUp")
    assert _count(page).startswith("3 of ")


def test_a_click_on_a_bar_selects_where_it_begins_and_then_where_it_ends(
    visit: Visit, before: Path, run: Execution
) -> None:
    page = visit.open(before, CASE)
    bar = _shown(page).locator(".tl-lane.operations .tl-bar.failed").first
    steps = [i for i, r in enumerate(run.trace.records) if getattr(r, "target", None) == "executing"]
    failed = next(i for i, record in enumerate(run.trace.records) if record.kind == "automatic")
    begin = max(i for i in steps if i < failed)
    bar.click()
    assert _count(page).startswith(f"{begin + 1} of ")
    bar.click()
    assert _count(page).startswith(f"{failed + 1} of ")


def test_operations_are_bars_that_say_how_they_ended(visit: Visit, before: Path, run: Execution) -> None:
    page = visit.open(before, CASE, viewport={"width": 1600, "height": 1000})
    shown = _shown(page)
    for state, look in (("completed", "completed"), ("failed", "failed")):
        ends = [
            r
            for r in run.trace.records
            if getattr(r, "target", None) == state or (state == "failed" and getattr(r, "failed", None))
        ]
        assert ends
        expect(shown.locator(f".tl-lane.operations .tl-bar.{look}")).to_have_count(len(ends))
    failed = shown.locator(".tl-lane.operations .tl-bar.failed").first
    expect(failed.locator("rect").nth(1)).to_have_attribute("fill", re.compile("url"))  # a pattern, beside the colour
    assert "✗" in "".join(failed.locator("text").all_text_contents())


def test_it_zooms_pans_and_shows_all_again_by_keyboard(visit: Visit, before: Path) -> None:
    page = visit.open(before, CASE)
    shown = _shown(page)
    whole = _ticks(page)
    expect(shown.locator(".tl-map")).to_be_hidden()
    _press(page, "+", "+", "+")
    expect(shown.locator(".tl-map")).to_be_visible()
    expect(shown.locator(".tl-axis .tl-words").last).not_to_have_text(whole[-1])
    zoomed = _ticks(page)
    _press(page, *["Shift+ArrowRight"] * 3)
    expect(shown.locator(".tl-axis .tl-words").first).not_to_have_text(zoomed[0])
    _press(page, "0")
    expect(shown.locator(".tl-map")).to_be_hidden()
    assert _ticks(page) == whole


def test_it_zooms_by_wheel_with_ctrl_only_and_pans_by_dragging(visit: Visit, before: Path) -> None:
    page = visit.open(before, CASE)
    shown = _shown(page)
    box = shown.locator(".tl-chart").bounding_box()
    assert box is not None
    middle = (box["x"] + box["width"] * 0.6, box["y"] + 100)
    page.mouse.move(*middle)
    page.mouse.wheel(0, 10)
    expect(shown.locator(".tl-map")).to_be_hidden()
    page.keyboard.down("Control")
    page.mouse.wheel(0, -400)
    page.keyboard.up("Control")
    expect(shown.locator(".tl-map")).to_be_visible()
    count, ticks = _count(page), _ticks(page)
    page.mouse.move(*middle)
    page.mouse.down()
    page.mouse.move(middle[0] - 300, middle[1], steps=5)
    page.mouse.up()
    expect(shown.locator(".tl-axis .tl-words").first).not_to_have_text(ticks[0])
    assert _count(page) == count, "a drag selects nothing"


def test_what_is_selected_stays_in_view_when_zoomed(visit: Visit, before: Path) -> None:
    page = visit.open(before, CASE)
    shown = _shown(page)
    _press(page, *["+"] * 6)
    shown.locator(".tl-chart").focus()
    _press(page, "End")
    expect(shown.locator(".tl-cursor")).to_have_count(1)
    _press(page, "Home")
    expect(shown.locator(".tl-cursor")).to_have_count(1)


def test_the_state_can_be_sifted(visit: Visit, before: Path, run: Execution) -> None:
    page = visit.open(before, CASE)
    shown = _shown(page)
    _press(page, *["j"] * 7)
    names = "rows => rows.filter(row => row.offsetParent).map(row => row.cells[0].innerText)"
    rows = shown.locator(".tl-state tbody tr")
    shown.locator(".tl-state input[type=checkbox]").focus()
    _press(page, " ")
    assert {*rows.evaluate_all(names)} == _names(run.trace.records[7])
    _press(page, "j")
    assert {*rows.evaluate_all(names)} == _names(run.trace.records[8])
    _press(page, " ")
    shown.locator(".tl-state input[type=search]").fill("GRIPPER_req")
    assert rows.evaluate_all(names) == ["gripper_req_trigger", "gripper_req_state"]


def test_keys_in_a_field_are_letters(visit: Visit, before: Path) -> None:
    page = visit.open(before, CASE)
    _shown(page).locator(".tl-state input[type=search]").focus()
    _press(page, "j", "j", "ArrowLeft", "-")
    assert _count(page).startswith("1 of ")


def test_a_variable_becomes_a_lane_with_its_values(visit: Visit, before: Path, run: Execution) -> None:
    page = visit.open(before, CASE, viewport={"width": 1600, "height": 1000})
    shown = _shown(page)
    name = shown.locator(".tl-state").get_by_role("button", name="robot_at", exact=True)
    name.focus()
    _press(page, "Enter")
    expect(name).to_have_attribute("aria-pressed", "true")
    start = state_after(run.trace.records[:1])["robot_at"]
    values = [start, *(value for r in run.trace.records for n, value in r.changes if n == "robot_at")]
    lane = shown.locator(".tl-lane.values")
    assert [t.split(" = ")[1].split("\n")[0] for t in lane.locator(".tl-bar title").all_text_contents()] == values
    _press(page, "Enter")
    expect(lane).to_have_count(0)


def test_record_by_record_gives_every_record_a_place_of_its_own(visit: Visit, before: Path, run: Execution) -> None:
    page = visit.open(before, CASE)
    shown = _shown(page)
    cursor = shown.locator(".tl-cursor")
    over_time = cursor.get_attribute("x1")
    _press(page, "j")
    assert cursor.get_attribute("x1") == over_time  # it is at the same moment
    shown.locator("select").select_option("records")
    expect(shown.locator(".tl-axis .tl-words").first).to_have_text("0.000 s")
    assert {*_ticks(page)} <= {f"{record.at_ns / 1e9:.3f} s" for record in run.trace.records}
    first = float(cursor.get_attribute("x1") or "")
    _press(page, "j")
    assert float(cursor.get_attribute("x1") or "") > first


def test_a_livelock_of_a_thousand_records_at_one_instant_can_be_stepped(
    visit: Visit, of_model: Callable[[str], Path]
) -> None:
    page = visit.open(of_model("livelock"), CASE.replace("6", "1"))
    shown = _shown(page)
    expect(shown.locator("select")).to_be_disabled()  # there is no time to show
    shown.locator(".tl-chart").focus()
    _press(page, "End", "k", "k")
    assert re.fullmatch(r"(\d+) of (\d+)", _count(page))
    selected, total = map(int, _count(page).split(" of "))
    assert total > 1000
    assert selected == total - 2
    expect(shown.locator("tr[aria-current]")).to_have_attribute("data-record", f"{selected - 1}")
    model = load_model(MODELS / "fails_at_run/livelock.yaml")
    records = Tester(model).execute(RandomCases(model).case(1, 1)).trace.records
    assert _state(page) == _in_words(state_after(records[:selected]))


@pytest.mark.slow
def test_all_rows_of_a_long_run_are_there_when_it_is_printed(visit: Visit, of_model: Callable[[str], Path]) -> None:
    page = visit.open(of_model("livelock"), CASE.replace("6", "1"))
    shown = _shown(page)
    total = int(_count(page).split(" of ")[1])
    assert shown.locator(".tl-records tr[data-record]").count() < total
    page.emulate_media(media="print")
    page.pdf()  # the page gets the event `beforeprint`
    expect(shown.locator(".tl-records tr[data-record]")).to_have_count(total)
    expect(shown.locator(".tl-lanes")).to_be_visible()
    expect(shown.get_by_role("button", name="zoom in")).to_be_hidden()


def test_an_hour_has_ticks_in_minutes(visit: Visit, of_model: Callable[[str], Path]) -> None:
    page = visit.open(of_model("time_limit"), CASE.replace("6", "1"))
    _shown(page)
    assert _ticks(page)[0] == "0 s"
    assert _ticks(page)[1].endswith(" min")
    assert _ticks(page)[-1] in ("1 h", "1:00 h")


def test_violated_requirements_have_a_lane_and_stand_beside_their_record(
    visit: Visit, of_model: Callable[[str], Path]
) -> None:
    page = visit.open(of_model("requirement"), CASE.replace("6", "1"))
    shown = _shown(page)
    model = load_model(MODELS / "fails_at_run/requirement.yaml")
    (violation,) = Tester(model).execute(RandomCases(model).case(1, 1)).violations
    expect(shown.locator(".tl-lane.requirements")).to_have_attribute("data-name", violation.requirement)
    row = shown.locator(f"tr[data-record='{violation.record}']")
    broken = row.locator(f"[data-requirement='{violation.requirement}']")
    assert broken.inner_text().endswith(violation.reason)
    shown.locator(".tl-lane.requirements .tl-mark").click()
    assert _count(page).startswith(f"{violation.record + 1} of ")
    expect(shown.locator(f".tl-now [data-requirement='{violation.requirement}']")).to_have_count(1)


def test_a_held_injection_is_a_bar_until_it_is_put_back(visit: Visit, after: Path) -> None:
    model = load_model(EXAMPLE / "after.yaml")
    written = {w.case.name: w.case for w in load_suite([EXAMPLE / "cases"], model)}
    records = Tester(model).execute(written["scanner_used_by_someone_else"]).trace.records
    applied = next(i for i, record in enumerate(records) if record.kind == "injection")
    put_back = next(i for i, record in enumerate(records) if record.kind == "put_back")
    page = visit.open(after, "#/case/scanner_used_by_someone_else")
    shown = _shown(page)
    bar = shown.locator(".tl-lane.injections .tl-bar")
    bar.click()
    assert _count(page).startswith(f"{applied + 1} of ")
    bar.click()
    assert _count(page).startswith(f"{put_back + 1} of ")
    expect(shown.locator(".tl-lane.operations .tl-bar.disabled")).to_have_count(1)


def test_it_is_no_wider_than_a_phone(visit: Visit, before: Path) -> None:
    page = visit.open(before, CASE, viewport={"width": 400, "height": 800})
    shown = _shown(page)
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    sizes = "texts => Math.min(...texts.map(t => parseFloat(getComputedStyle(t).fontSize)))"
    assert shown.locator("svg text").evaluate_all(sizes) >= 11


def test_leaving_a_case_takes_its_keys_with_it(visit: Visit, before: Path) -> None:
    page = visit.open(before, CASE)
    _shown(page)
    page.evaluate("location.hash = '#/cases'")
    expect(page.locator(".tl")).to_have_count(0)
    _press(page, "ArrowRight", "j", "+", "0", "]")
    page.evaluate(f"location.hash = '{CASE}'")
    _shown(page)
    _press(page, "ArrowRight")
    assert _count(page).startswith("2 of ")


def test_only_the_blocks_that_are_looked_at_are_opened(visit: Visit, many: Path) -> None:
    page = visit.open(many)
    opened = """async () => {
        const packed = JSON.parse(document.getElementById("timelines").textContent);
        const calls = [];
        const read = (target, name) => (calls.push(name), target[name]);
        const timelines = new Timelines({ ...packed, blocks: new Proxy(packed.blocks, { get: read }) });
        for (const index of [9000, 9001, 9000]) await timelines.load(index);
        return [calls.length, packed.blocks.length, await timelines.load(10000), await timelines.load(-1)];
    }"""
    calls, blocks, *nothing = page.evaluate(opened)
    assert calls <= 2
    assert blocks > 100
    assert nothing == [None, None]
