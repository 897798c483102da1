"""Every page of the report, in a real browser."""

from __future__ import annotations

import re
from pathlib import Path
from struct import unpack
from typing import TYPE_CHECKING

import pytest

pytest.importorskip("playwright.sync_api", reason="there is no Playwright")
from playwright.sync_api import expect

from support.wording import Wording

if TYPE_CHECKING:
    from playwright.sync_api import Locator, Page

    from browser.conftest import Visit

pytestmark = pytest.mark.browser

PICTURES = Path(__file__).parents[2] / "docs/pictures"
ROUTES = (
    "missing",
    "operations",
    "operation/pick_item_a",
    "model",
    "source",
    "cases",
    "case/seed-1-case-6",
    "growth",
    "findings",
)
PICTURED = {
    "missing": ("#/missing", "light"),
    "operation": ("#/operation/scanner_scan_item_a", "light"),
    "source": ("#/source/206", "light"),
    "case": ("#/case/seed-1-case-6", "dark"),
}
"""The pictures of the documentation: an address and a theme for each."""

EXPLAIN_FIRST = "scbm explain examples/robot_in_the_air/before.yaml robot_move_to_toolbox_gripper/disabled"
RUN_CASE_6 = "scbm run examples/robot_in_the_air/before.yaml --seed 1 --case 6"


def shown(page: Page) -> Locator:
    return page.locator(".page.shown")


def notice(page: Page, name: str) -> Locator:
    """Return the sentence of the shown page that reports something, by its stable name."""
    return shown(page).locator(f"[data-notice={name}]")


def found(page: Page, count: int, all_cases: int) -> Locator:
    """Return the line above the list of cases, if it counts these."""
    return shown(page).locator(f".found[data-found='{count}'][data-of='{all_cases}']")


def link(page: Page, address: str) -> Locator:
    return page.locator(f"a[href='#/{address}']")


def column(page: Page, index: int) -> list[str]:
    return [cell.strip() for cell in shown(page).locator(f"tbody tr > :nth-child({index})").all_text_contents()]


def test_it_opens_with_the_figure_and_what_is_missing(visit: Visit, before: Path, wording: Wording) -> None:
    page = visit.open(before)
    expect(page).to_have_title(re.compile("robot_in_the_air"))
    expect(shown(page)).to_have_count(1)
    expect(shown(page).locator(".large")).to_have_text("46.51 %")
    groups = shown(page).locator("details.group")
    expect(groups).to_have_count(6)
    assert sum(int(group.get_attribute("data-count") or "") for group in groups.all()) == 46
    first = groups.first
    expect(first.locator(".command")).to_be_hidden()
    first.locator("summary").click()
    expect(first.locator(".command code")).to_have_text(EXPLAIN_FIRST)
    expect(first.locator("tbody tr").first).to_have_attribute(
        "data-obligation", "robot_move_to_toolbox_gripper/disabled"
    )
    expect(first.locator("tbody tr:visible")).to_have_count(14)
    expect(page.locator("header .runs[data-runs='1']")).to_have_attribute("data-started", "2026-11-21")
    wording(page.locator("header .runs").inner_text())


def test_a_report_without_missing_obligations_says_so(visit: Visit, after: Path, wording: Wording) -> None:
    page = visit.open(after, "#/missing")
    expect(notice(page, "nothing-missing")).to_be_visible()
    wording(notice(page, "nothing-missing").inner_text())
    expect(shown(page).locator(".large")).to_have_text("100.00 %")


@pytest.mark.parametrize("route", ROUTES)
def test_each_page_has_an_address(visit: Visit, before: Path, route: str) -> None:
    page = visit.open(before, f"#/{route}")
    expect(shown(page)).to_have_count(1)
    if route == "source":
        expect(shown(page).locator(".line.target")).to_be_in_viewport()
    expect(shown(page).locator("h1")).to_have_count(1)
    current = {"operation": "operations", "case": "cases"}.get(route.partition("/")[0], route)
    expect(page.locator("nav [aria-current=page]")).to_have_attribute("href", f"#/{current}")
    assert (page.evaluate("scrollY") == 0) is (route != "source"), "the source opens at the first hole"


def test_an_address_without_a_page_shows_the_page_for_such_addresses(
    visit: Visit, before: Path, wording: Wording
) -> None:
    page = visit.open(before, "#/nothing")
    expect(shown(page)).to_have_id("/nothing")
    for address in ("#/operation/none", "#/case/none", "#/results", "#/missing/more", "#/case/%"):
        page.evaluate("location.hash = '#/missing'")
        expect(shown(page)).to_have_id("/missing")
        page.evaluate(f"location.hash = '{address}'")
        expect(shown(page)).to_have_id("/nothing")
    wording(shown(page).inner_text())


def test_the_browser_goes_back_and_forward(visit: Visit, before: Path) -> None:
    page = visit.open(before)
    page.locator("nav a[href='#/cases']").click()
    page.get_by_role("link", name="seed-1-case-6").click()
    expect(shown(page).locator("h1")).to_have_text("seed-1-case-6")
    page.go_back()
    expect(shown(page)).to_have_id("/cases")
    page.go_back()
    expect(shown(page).locator(".large")).to_be_visible()
    page.go_forward()
    expect(shown(page)).to_have_id("/cases")


def test_back_is_where_one_was(visit: Visit, many: Path) -> None:
    page = visit.open(many, "#/cases")
    page.get_by_role("link", name="copy-180", exact=True).click()
    expect(shown(page).locator("h1")).to_have_text("copy-180")
    expect(shown(page).locator("a.next")).to_be_in_viewport()
    page.go_back()
    expect(page.get_by_role("link", name="copy-180", exact=True)).to_be_in_viewport()


def test_the_matrix_counts_cases_and_leads_to_them(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/operations")
    row = shown(page).get_by_role("row").filter(has_text="gripper_close")
    expect(row.locator("td").first).to_have_text("● 3")
    expect(row.locator("[data-value='0'].missed")).to_have_count(3)
    link(page, "cases?visits=gripper_close%2Fexecuting").and_(page.locator(":visible")).click()
    expect(shown(page).locator("tbody tr")).to_have_count(3)
    expect(shown(page).locator(".chip")).to_have_attribute("data-visits", "gripper_close/executing")


def test_tables_are_sorted_by_a_column(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/operations")
    head = shown(page).get_by_role("columnheader", name="executing")
    head.get_by_role("button").click()
    expect(head).to_have_attribute("aria-sort", "descending")
    counts = [int(re.sub(r"\D", "", text) or 0) for text in column(page, 4)[:16]]
    assert counts == sorted(counts, reverse=True)
    head.get_by_role("button").click()
    expect(head).to_have_attribute("aria-sort", "ascending")
    name = shown(page).get_by_role("columnheader", name="Operation", exact=True)
    name.get_by_role("button").click()
    assert column(page, 1)[:2] == ["gantry_move_to_agv", "gantry_move_to_box_a"]
    expect(head).not_to_have_attribute("aria-sort", re.compile(""))


def test_covered_rows_are_hidden(visit: Visit, after: Path, before: Path) -> None:
    page = visit.open(after, "#/operations")
    page.keyboard.press("h")
    expect(shown(page).locator("tbody tr:visible")).to_have_count(0)
    expect(shown(page).locator(".none")).to_be_visible()
    page = visit.open(before, "#/operations")
    shown(page).locator("input.hide-covered").check()
    expect(shown(page).locator("tbody tr:visible")).to_have_count(16 + 3)


def test_rows_are_filtered(visit: Visit, before: Path) -> None:
    page = visit.open(before)
    shown(page).locator("input.filter").fill("robot timedout")
    rows = shown(page).locator("tbody tr:visible")
    expect(rows).to_have_count(11)  # nine operations that are named so, and two whose requests it gets
    shown(page).locator("input.filter").fill("no such name")
    expect(shown(page).locator("details.group:visible")).to_have_count(0)
    shown(page).locator("input.filter").fill("")
    expect(shown(page).locator("details.group:visible")).to_have_count(6)


def test_an_operation_has_its_lifecycle_its_text_and_its_cases(visit: Visit, before: Path, wording: Wording) -> None:
    page = visit.open(before, "#/operation/pick_item_a")
    expect(shown(page).locator("svg.lifecycle")).to_be_visible()
    expect(shown(page).locator("svg.model .automaton")).to_have_count(2)
    texts = shown(page).locator(".line code").all_text_contents()
    assert texts[0] == "  pick_item_a:"
    assert texts[-1] == "    timedout: [robot_req_trigger <- false]"
    states = shown(page).locator(".states tbody tr")
    expect(states).to_have_count(6)
    expect(states.nth(3).locator(".command code")).to_have_text(
        "scbm explain examples/robot_in_the_air/before.yaml pick_item_a/failed"
    )
    wording(states.nth(3).locator("p").inner_text())
    expect(states.nth(2).get_by_role("link")).to_have_count(6)
    states.nth(2).get_by_role("link").last.click()
    expect(shown(page).locator("tbody tr")).to_have_count(10)


def test_a_click_in_the_picture_of_the_model_leads_to_the_cases(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/model")
    expect(shown(page).locator(".automaton")).to_have_count(7)
    shown(page).get_by_role("link", name="pick_item_a").first.click()
    expect(page).to_have_url(re.compile("#/cases\\?visits=pick_item_a%2Fcompleted$"))


def test_the_source_is_marked_and_unfolds_its_branches(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/source/104")
    line = shown(page).locator(".line.target")
    expect(line).to_be_in_viewport()
    assert "g: robot_req_state == initial" in line.locator("code").inner_text()
    expect(line.locator(".sign")).to_have_text("◐")
    expect(line.locator(".hits")).to_have_text("17")
    button = line.get_by_role("button")
    button.click()
    expect(button).to_have_attribute("aria-expanded", "true")
    expect(line.locator(".branches li")).to_have_text(
        ["○ robot_move_to_box_a/disabled missing", "● robot_move_to_box_a/executing 17 cases"], use_inner_text=True
    )
    assert len(shown(page).locator(".line").all()) == 348


def test_the_source_opens_at_its_first_hole_and_keys_lead_to_the_others(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/source")
    target = shown(page).locator(".line.target")
    expect(target).to_be_in_viewport()
    holes = shown(page).locator(".line:is(.missed, .partly) .no").all_text_contents()
    expect(target.locator(".no")).to_have_text(holes[0])
    page.keyboard.press("j")
    page.keyboard.press("j")
    expect(target.locator(".no")).to_have_text(holes[2])
    expect(page).to_have_url(re.compile(f"#/source/{holes[2]}$"))
    page.keyboard.press("k")
    expect(target.locator(".no")).to_have_text(holes[1])


def test_the_source_has_colours_without_elements_for_them(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/source")
    ranges = """name => [...(CSS.highlights.get(name) ?? [])].map(
        ({ startContainer, startOffset, endOffset }) => startContainer.data.slice(startOffset, endOffset))"""
    assert "operations" in page.evaluate(ranges, "scbm-key")
    assert any(text.strip().startswith("#") for text in page.evaluate(ranges, "scbm-comment"))
    expect(shown(page).locator(".line code *")).to_have_count(0)


def test_the_head_of_a_phone_is_low_and_wide_tables_show_that_there_is_more(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/operations", viewport={"width": 390, "height": 800})
    bar = page.locator(".bar-of-pages").bounding_box()
    assert bar is not None
    assert bar["y"] + bar["height"] <= 120
    expect(page.locator("#search")).to_be_in_viewport()
    wide = "each => [each.scrollWidth > each.clientWidth, getComputedStyle(each).backgroundImage.includes('gradient')]"
    assert shown(page).locator(".scroll").first.evaluate(wide) == [True, True]
    page.locator("#search").fill("pick")
    box = page.locator("#results").bounding_box()
    assert box is not None
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= 390


def test_a_line_gives_its_address(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/source")
    shown(page).locator(".gutter").filter(has_text=re.compile("^7$")).click()
    expect(page).to_have_url(re.compile("#/source/7$"))
    expect(shown(page).locator(".line.target code")).to_have_text("  robot_at:", use_inner_text=True)


def test_branches_show_below_the_pointer_and_the_focus(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/source/104")
    line = shown(page).locator(".line.target")
    expect(line.locator(".branches")).to_be_hidden()
    line.locator("code").hover()
    expect(line.locator(".branches")).to_be_visible()
    page.mouse.move(0, 0)
    expect(line.locator(".branches")).to_be_hidden()
    line.get_by_role("button").focus()
    expect(line.locator(".branches")).to_be_visible()


def test_covered_lines_are_folded(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/source")
    page.keyboard.press("h")
    lines = shown(page).locator(".line:visible")
    expect(lines.locator("code").filter(has_text="deadline")).to_have_count(16)
    heads = lines.filter(has=page.locator(".sign", has_text="✓")).locator("code").all_text_contents()
    assert heads
    assert all(re.fullmatch(r"  \w+:", head) for head in heads)
    shown(page).locator(".folded[data-first='1']").click()
    expect(lines.first.locator(".no")).to_have_text("1")
    page.evaluate("location.hash = '#/source/106'")
    expect(shown(page).locator(".line.target")).to_be_in_viewport()
    page.keyboard.press("h")
    expect(lines).to_have_count(348)
    expect(shown(page).locator(".folded")).to_have_count(0)


def test_cases_are_listed_sorted_and_searched(visit: Visit, before: Path, wording: Wording) -> None:
    page = visit.open(before, "#/cases")
    expect(shown(page).locator("tbody tr")).to_have_count(20)
    first = shown(page).locator("tbody tr").first
    expect(first).to_have_attribute("data-case", "seed-1-case-1")
    expect(first.locator("[data-verdict=passed]")).to_have_count(1)
    cells = [cell.strip() for cell in first.locator("td, th").all_text_contents()]
    assert cells[3:8] == ["item_a_scanned", "reached", "5.583 s", "6", "11"]
    shown(page).get_by_role("button", name="Requests").click()
    expect(shown(page).get_by_role("columnheader", name="Requests")).to_have_attribute("aria-sort", "descending")
    requests = [int(text) for text in column(page, 7)]
    assert requests == sorted(requests, reverse=True)
    assert page.url.endswith("#/cases?sort=-requests")
    shown(page).locator("input.of-cases").fill("Delivered")
    expect(found(page, 3, 20)).to_be_visible()
    wording(shown(page).locator(".found").inner_text())
    assert [int(text) for text in column(page, 7)] == sorted((int(text) for text in column(page, 7)), reverse=True)
    page.reload()
    expect(found(page, 3, 20)).to_be_visible()


def test_filters_of_an_address_can_be_removed(visit: Visit, before: Path, wording: Wording) -> None:
    page = visit.open(before, "#/cases?visits=gripper_open%2Fexecuting&visits=automatic%2Fscanner_failed&q=seed")
    expect(shown(page).locator(".chip")).to_have_count(2)
    few = int(shown(page).locator(".found").get_attribute("data-found") or "")
    shown(page).locator(".chip[data-visits='automatic/scanner_failed'] button").click()
    expect(shown(page).locator(".chip")).to_have_count(1)
    expect(found(page, 2, 20)).to_be_visible()
    assert few <= 2
    page = visit.open(before, "#/cases?visits=no/such")
    expect(shown(page).locator(".chip[data-known=false]")).to_have_count(1)
    expect(notice(page, "no-match")).to_be_visible()
    wording([shown(page).locator(".chip").inner_text(), notice(page, "no-match").inner_text()])


def test_a_case_shows_what_only_it_visits_and_how_to_run_it_again(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/case/seed-1-case-6")
    expect(shown(page).locator("[data-verdict=passed]")).to_have_count(1)
    expect(shown(page).locator(".again .command code")).to_have_text(RUN_CASE_6)
    expect(shown(page).locator(".own li")).to_have_text(
        ["robot_move_to_toolbox_gripper: failed", "robot_move_to_agv: failed"]
    )
    expect(shown(page).locator(".all")).to_be_hidden()
    shown(page).locator("summary[data-visited='28'][data-queued='12']").click()
    expect(link(page, "cases?visits=automatic%2Frobot_failed").and_(page.locator(".all a"))).to_be_visible()
    expect(shown(page).locator(".of-timeline svg").first).to_be_visible()
    expect(shown(page).locator(".of-timeline [data-notice]")).to_have_count(0)


def test_a_written_case_shows_its_text(visit: Visit, after: Path) -> None:
    page = visit.open(after, "#/cases")
    shown(page).get_by_role("link", name="second_scan_succeeds").click()
    expect(shown(page).locator(".again .command code")).to_have_text(re.compile("^scbm replay .*second_scan_succeeds"))
    assert "case: second_scan_succeeds" in shown(page).locator("pre.text").inner_text().splitlines()


def test_keys_lead_from_case_to_case_as_they_were_listed(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/cases?sort=-requests")
    names = column(page, 2)
    shown(page).get_by_role("link", name=names[0], exact=True).click()
    expect(shown(page).locator("h1")).to_have_text(names[0])
    page.keyboard.press("n")
    expect(shown(page).locator("h1")).to_have_text(names[1])
    page.keyboard.press("p")
    expect(shown(page).locator("h1")).to_have_text(names[0])
    page.keyboard.press("p")
    expect(shown(page).locator("h1")).to_have_text(names[0])


def test_growth_names_the_cases_that_added_something(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/growth")
    expect(shown(page).locator("svg").first).to_be_visible()
    assert column(page, 3)[0] == "12.79 %"
    assert column(page, 3)[-1] == "46.51 %"
    shown(page).get_by_role("link", name="seed-1-case-5", exact=True).last.click()
    expect(shown(page).locator("h1")).to_have_text("seed-1-case-5")


def test_findings_are_grouped_and_their_cases_found(visit: Visit, failing: Path, wording: Wording) -> None:
    page = visit.open(failing)
    notice(page, "failed").get_by_role("link").first.click()
    expect(shown(page).locator("article")).to_have_count(2)
    finding = shown(page).locator("article[data-cause='requirement open_while_pumping']")
    expect(finding.locator("tbody tr")).to_have_count(5)
    all_cases = finding.locator("a[data-cases]")
    count = int(all_cases.get_attribute("data-cases") or "")
    number = (all_cases.get_attribute("href") or "").rpartition("=")[2]
    all_cases.click()
    expect(found(page, count, 30)).to_be_visible()
    expect(shown(page).locator(".chip")).to_have_attribute("data-cause", number)
    wording(shown(page).locator(".chip").inner_text())
    expect(shown(page).locator(".verdict.visited")).to_have_count(0)
    shown(page).locator("tbody a").first.click()
    expect(shown(page).locator("[data-verdict=failed]")).to_have_count(1)
    wording(shown(page).locator(".failures li").first.inner_text())


def test_only_failed_cases_are_listed_if_that_is_asked_for(visit: Visit, failing: Path) -> None:
    page = visit.open(failing, "#/cases")
    shown(page).locator("input.only-failed").check()
    expect(page).to_have_url(re.compile("#/cases[?]failed$"))
    expect(shown(page).locator(".verdict.visited")).to_have_count(0)
    shown(page).locator("input.only-failed").uncheck()
    expect(found(page, 30, 30)).to_be_visible()


def test_what_looks_like_html_is_text(visit: Visit, failing: Path) -> None:
    page = visit.open(failing, "#/source")
    expect(shown(page).locator(".line code").first).to_have_text(
        """# </script><script>document.title = "broken"</script> <!-- & "quotes" 'too' — größer"""
    )
    expect(page).to_have_title("Source · failing")
    assert "failing & <b>.yaml" in page.locator("header .runs code").inner_text()


def test_search_finds_operations_obligations_cases_and_lines(visit: Visit, before: Path) -> None:
    page = visit.open(before)
    page.keyboard.press("/")
    expect(page.locator("#search")).to_be_focused()
    page.keyboard.type("gripper_cl")
    results = page.locator("#results")
    for group, count in (("Operations", 1), ("Obligations", 6), ("Cases", 3)):
        expect(results.locator(f"[data-group={group}][data-count='{count}']")).to_be_visible()
    expect(results.locator("[data-group=Lines]")).to_be_visible()
    page.keyboard.press("ArrowDown")
    expect(results.locator("[aria-selected=true]")).to_have_text(re.compile("gripper_close/disabled$"))
    page.keyboard.press("ArrowUp")
    page.keyboard.press("Enter")
    expect(shown(page).locator("h1")).to_have_text("gripper_close")
    expect(results).to_be_hidden()
    page.keyboard.press("/")
    page.keyboard.type("nothing like this")
    expect(results.locator("[data-notice=nothing-found]")).to_be_visible()
    page.keyboard.press("Escape")
    expect(results).to_be_hidden()


def test_keys_lead_to_the_pages(visit: Visit, before: Path) -> None:
    page = visit.open(before)
    for key, name in {
        "o": "operations",
        "d": "model",
        "s": "source",
        "c": "cases",
        "g": "growth",
        "f": "findings",
        "m": "missing",
    }.items():
        page.keyboard.press(key)
        expect(page).to_have_url(re.compile(f"#/{name}$"))
    page.keyboard.press("?")
    expect(page.get_by_role("dialog")).to_be_visible()
    page.keyboard.press("o")
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_be_hidden()
    expect(page).to_have_url(re.compile("#/missing$"))


def test_letters_in_a_field_are_no_keys(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/cases")
    shown(page).locator("input.of-cases").press_sequentially("gots?/")
    expect(page).to_have_url(re.compile("#/cases[?]q=gots%3F%2F$"))
    expect(page.get_by_role("dialog")).to_be_hidden()


def test_the_theme_is_chosen_and_remembered(visit: Visit, before: Path) -> None:
    page = visit.open(before, color_scheme="dark")
    background = "getComputedStyle(document.body).backgroundColor"
    dark = page.evaluate(background)
    expect(page.locator("html[data-theme=auto]")).to_have_count(1)
    page.locator("#theme").click()
    light = page.evaluate(background)
    assert light == "rgb(255, 255, 255)" != dark
    page.keyboard.press("t")
    expect(page.locator("html[data-theme=dark]")).to_have_count(1)
    assert page.evaluate(background) == dark
    page.reload()
    expect(page.locator("html[data-theme=dark]")).to_have_count(1)


def test_commands_are_copied(visit: Visit, before: Path) -> None:
    page = visit.open(before, permissions=["clipboard-read", "clipboard-write"])
    group = shown(page).locator("details.group").first
    group.locator("summary").click()
    button = group.locator("button.copy")
    button.click()
    expect(button).to_have_attribute("data-copied", "")
    assert page.evaluate("navigator.clipboard.readText()") == EXPLAIN_FIRST


def test_everything_is_reached_by_the_keyboard(visit: Visit, before: Path) -> None:
    page = visit.open(before)
    page.keyboard.press("Tab")
    skip = page.locator("a.skip")
    expect(skip).to_be_focused()
    expect(skip).to_be_in_viewport()
    page.keyboard.press("Enter")
    expect(shown(page).locator("h1")).to_be_focused()
    page.keyboard.press("Shift+Tab")
    expect(page.locator("#help-button")).to_be_focused()
    for _ in range(4):
        page.keyboard.press("Tab")
    outline = page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
    assert outline == "solid"
    assert page.evaluate("document.activeElement.closest('.page.shown') !== null")


def notice_without_script(page: Page) -> str:
    """Return the sentence about what is not shown; it is no text of the page where scripts run."""
    return page.locator("[data-notice=no-script]").inner_text()


def test_without_a_script_pages_stand_below_each_other(visit: Visit, before: Path, wording: Wording) -> None:
    page = visit.open(before, java_script_enabled=False)
    expect(page.locator(".large")).to_have_text("46.51 %")
    expect(page.locator("[data-missing='46']")).to_be_visible()
    group = page.locator("details.group").last
    group.locator("summary").click()
    expect(group.locator("[data-obligation='automatic/gripper_failed']")).to_be_visible()
    wording(group.inner_text())
    wording(notice_without_script(page))
    expect(page.locator('[id="/operations"] tbody tr:visible')).to_have_count(22)
    expect(page.locator('[id="/cases"] tbody tr:visible')).to_have_count(20)
    expect(page.locator('[id="/growth"] svg').first).to_be_visible()
    expect(page.locator('[id="/findings"] [data-notice=nothing-failed]')).to_be_visible()
    expect(page.locator("button:visible:not(.gutter), input:visible")).to_have_count(0)
    page.locator("nav a[href='#/growth']").click()
    expect(page.locator('[id="/growth"] h1')).to_be_in_viewport()


def test_paper_has_light_colours_and_no_controls(visit: Visit, before: Path) -> None:
    page = visit.open(before, color_scheme="dark")
    page.keyboard.press("t")
    page.keyboard.press("t")
    page.emulate_media(media="print", color_scheme="dark")
    for query in ("getComputedStyle(document.body).color", "getComputedStyle(document.querySelector('.large')).color"):
        assert page.evaluate(query) == "rgb(27, 31, 36)"
    expect(shown(page).locator(".large")).to_be_visible()
    expect(page.locator("nav:visible, button.copy:visible, input:visible, #theme:visible")).to_have_count(0)


@pytest.mark.parametrize("width", [400, pytest.param(800, marks=pytest.mark.slow)])
def test_narrow_windows_need_no_scrolling_to_the_side(visit: Visit, before: Path, failing: Path, width: int) -> None:
    for report in (before, failing):
        page = visit.open(report, "#/missing", viewport={"width": width, "height": 800})
        for link in page.locator("nav a").all():
            link.click()
            first_word = re.findall("[A-Z][a-z]+", link.inner_text())[0]
            expect(shown(page)).to_have_attribute("data-title", re.compile(f"^{first_word}"))
            assert page.evaluate("document.documentElement.scrollWidth") <= width
        page.locator("nav a[href='#/cases']").click()
        expect(shown(page)).to_have_attribute("data-title", "Cases")  # findings have links to cases too
        shown(page).locator("tbody a").first.click()
        expect(shown(page).locator(".of-timeline svg").first).to_be_visible()
        assert page.evaluate("document.documentElement.scrollWidth") <= width


def test_long_names_need_no_scrolling_to_the_side(visit: Visit, failing: Path) -> None:
    name = "a_very_long_name_of_an_operation_that_nothing_needs_but_that_has_to_fit_into_every_table_of_the_report"
    page = visit.open(failing, f"#/operation/{name}", viewport={"width": 400, "height": 800})
    expect(shown(page).locator("h1")).to_have_text(name)
    assert page.evaluate("document.documentElement.scrollWidth") <= 400


def test_ten_thousand_cases_are_listed_page_by_page(visit: Visit, many: Path, wording: Wording) -> None:
    page = visit.open(many, "#/cases")
    expect(found(page, 10_000, 10_000)).to_have_attribute("data-last", "200")
    wording(shown(page).locator(".found").inner_text())
    expect(shown(page).locator("tbody tr")).to_have_count(200)
    page.keyboard.press("n")
    expect(shown(page).locator("tbody tr").first).to_have_attribute("data-case", "copy-201")
    shown(page).locator("input.of-cases").fill("copy-999")
    expect(found(page, 11, 10_000)).to_be_visible()
    shown(page).get_by_role("button", name="Case").click()
    expect(shown(page).get_by_role("columnheader", name="Case")).to_have_attribute("aria-sort", "ascending")
    assert column(page, 2)[:3] == ["copy-999", "copy-9990", "copy-9991"]
    page.get_by_role("link", name="copy-9990", exact=True).click()
    expect(shown(page).locator("h1")).to_have_text("copy-9990")
    expect(shown(page).locator(".steps-between [data-place]")).to_have_attribute("data-place", "2 of 11")


def test_an_earlier_version_of_the_model_leaves_no_timeline(visit: Visit, earlier: Path, wording: Wording) -> None:
    page = visit.open(earlier, "#/case/seed-1-case-2")
    expect(notice(page, "earlier-model")).to_be_visible()
    expect(notice(page, "not-run-again")).to_be_visible()
    wording([notice(page, name).inner_text() for name in ("earlier-model", "not-run-again")])
    expect(shown(page).locator(".again")).to_have_count(0)


def test_cases_over_nodes_are_marked_in_the_list_and_found(visit: Visit, over_nodes: Path, wording: Wording) -> None:
    page = visit.open(over_nodes, "#/cases")
    expect(shown(page).get_by_role("columnheader", name="Ran")).to_have_count(1)
    expect(shown(page).get_by_role("columnheader", name="Simulated")).to_have_count(0)
    ran = column(page, 6)
    assert ["scanner" in where for where in ran] == [False] * 3 + [True] * 2
    wording(ran)
    shown(page).locator("input.only-nodes").check()
    expect(page).to_have_url(re.compile("#/cases[?]nodes$"))
    expect(found(page, 2, 5)).to_be_visible()
    shown(page).locator("input.only-failed").check()
    expect(page).to_have_url(re.compile("#/cases[?]nodes&failed$"))
    expect(notice(page, "no-match")).to_be_visible()
    shown(page).locator("input.only-failed").uncheck()
    shown(page).locator("input.only-nodes").uncheck()
    expect(found(page, 5, 5)).to_be_visible()
    shown(page).locator("input.of-cases").fill("dds domain 7")
    expect(found(page, 2, 5)).to_be_visible()


def test_a_store_of_simulated_cases_does_not_mention_nodes(visit: Visit, before: Path) -> None:
    page = visit.open(before, "#/cases")
    expect(shown(page).get_by_role("columnheader", name="Simulated")).to_have_count(1)
    expect(shown(page).locator("input.only-nodes")).to_have_count(0)
    page = visit.open(before, "#/case/seed-1-case-6")
    expect(shown(page).locator("[data-fact=Simulated]")).to_have_count(1)
    expect(shown(page).locator(".ran")).to_have_count(0)


def test_a_case_over_nodes_shows_where_it_ran_and_what_happened(
    visit: Visit, over_nodes: Path, wording: Wording
) -> None:
    page = visit.open(over_nodes, "#/cases?nodes")
    shown(page).locator("tbody a").first.click()
    place = "over DDS domain 7; real: scanner"
    expect(shown(page).locator(".ran")).to_have_attribute("data-place", place)
    expect(shown(page).locator(".again .command code")).to_have_text(re.compile("^scbm test cell.yaml "))
    expect(shown(page).locator("[data-fact=Simulated]")).to_have_count(0)
    expect(shown(page).locator(".of-timeline svg").first).to_be_visible()
    wording([shown(page).locator(".ran").inner_text(), shown(page).locator("h2").first.inner_text()])


def test_a_log_that_does_not_give_its_run_again_leaves_no_timeline(
    visit: Visit, over_nodes: Path, wording: Wording
) -> None:
    page = visit.open(over_nodes, "#/cases?nodes")
    shown(page).locator("tbody a").last.click()
    expect(notice(page, "log-of-another-version")).to_be_visible()
    wording(notice(page, "log-of-another-version").inner_text())


def take_picture(page: Page, name: str, request: pytest.FixtureRequest, height: int = 800) -> None:
    """Compare the size of a picture of the documentation with a new one; `--update-golden` writes the new one."""
    picture = page.screenshot(animations="disabled", caret="hide")
    path = PICTURES / f"{name}.png"
    if request.config.getoption("--update-golden"):
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(picture)
    assert unpack(">II", path.read_bytes()[16:24]) == unpack(">II", picture[16:24]) == (1280, height)


def test_the_pictures_of_the_documentation_are_of_this_size(
    visit: Visit, before: Path, request: pytest.FixtureRequest
) -> None:
    for name, (address, scheme) in PICTURED.items():
        page = visit.open(before, address, color_scheme=scheme, viewport={"width": 1280, "height": 800})
        expect(shown(page)).to_be_visible()
        if name == "case":
            expect(shown(page).locator(".of-timeline svg").first).to_be_visible()
            shown(page).get_by_role("heading", name="Timeline").scroll_into_view_if_needed()
        take_picture(page, f"report-{name}", request)


def test_the_picture_of_the_stop_shows_the_cancelled_cut(
    visit: Visit, dual_cnc: Path, request: pytest.FixtureRequest
) -> None:
    size = {"width": 1280, "height": 1240}
    page = visit.open(dual_cnc, "#/case/stop_reset_resume", color_scheme="light", viewport=size)
    expect(shown(page).locator(".of-timeline svg").first).to_be_visible()
    shown(page).get_by_role("heading", name="Timeline").evaluate("heading => heading.scrollIntoView()")
    take_picture(page, "dual-cnc-stop", request, size["height"])
