"""The HTML report as a file: what it fetches, what it escapes, and that it is the same each time."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from json import loads
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Coverage
from scbm.cases.trace import End
from scbm.model import BehaviorModel
from scbm.reports.html import html_report
from scbm.store import History, Replays, StoredCase
from scbm.testing import Execution, Failure, FailureKind, Verdict
from support.histories import EXAMPLE, history_of, with_lost_cases
from support.wording import Wording

ROOT = Path(__file__).parents[4]
NASTY = """</script><!--<script>alert("1" & '2')</script>]]> größer \u2028 😀"""
SHOWN = NASTY.replace("\u2028", "\\u2028")
COMMENT = NASTY.replace("\u2028", "")  # which would end the line
VOID = ("meta", "input", "wbr", "br", "hr")
FETCHING = ("src", "srcset", "data", "action", "poster", "background", "xlink:href")


class Page(HTMLParser):
    """Elements of a file, with their attributes and texts; complains where tags do not match."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[str] = []
        self.scripts: list[str] = []
        self._open: list[str] = []
        self.feed(text)
        self.close()
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        assert len(dict(attrs)) == len(attrs)
        if tag not in VOID:
            self._open.append(tag)
        if tag == "script":
            self.scripts.append("")

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag, self.getpos()

    def handle_data(self, data: str) -> None:
        if self._open and self._open[-1] == "script":
            self.scripts[-1] += data
        else:
            self.texts.append(data)

    @property
    def text(self) -> str:
        return "".join(self.texts)

    def json(self, name: str) -> Any:  # noqa: ANN401 - whatever JSON says
        found = [attributes.get("id") for tag, attributes in self.elements if tag == "script"]
        return loads(self.scripts[found.index(name)])

    def attributes(self) -> Iterator[tuple[str, str, str | None]]:
        for tag, attributes in self.elements:
            for name, value in attributes.items():
                yield tag, name, value


def report(history: History) -> Page:
    return Page(html_report(history, Replays(history).execute))


def no_run(_: StoredCase) -> Execution | None:
    return None


def nothing() -> History:
    """A model without operations and transitions, and no case."""
    tested = history_of(EXAMPLE / "before.yaml", 0)
    source = replace(tested.source, text="behavior_model: nothing\nvariables: {}\noperations: {}\n")
    return replace(tested, model=BehaviorModel("nothing", (), ()), runs=(replace(tested.runs[0], source=source),))


@pytest.fixture(scope="module")
def before() -> History:
    return history_of(EXAMPLE / "before.yaml", 20)


@pytest.fixture(scope="module")
def page(before: History) -> Page:
    return report(before)


@pytest.mark.slow
def test_it_is_the_same_file_each_time_and_in_each_process(before: History) -> None:
    script = (
        "import sys; from support.histories import EXAMPLE, history_of; from scbm.store import Replays\n"
        "from scbm.reports.html import html_report\n"
        "history = history_of(EXAMPLE / 'before.yaml', 20)\n"
        "sys.stdout.reconfigure(encoding='utf-8', newline='')\n"
        "sys.stdout.write(html_report(history, Replays(history).execute))\n"
    )
    once = html_report(before, Replays(before).execute)
    assert once == html_report(before, Replays(before).execute)
    for seed in "1", "2":
        environment = {**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT / "tests")}
        ran = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True, env=environment)
        assert ran.stdout.decode() == once


@pytest.mark.slow
def test_it_fetches_nothing(page: Page) -> None:
    policy = [a["content"] for tag, a in page.elements if a.get("http-equiv") == "Content-Security-Policy"]
    assert policy == ["default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"]
    assert not [tag for tag, _ in page.elements if tag in ("link", "img", "iframe", "object", "embed", "base")]
    for tag, name, value in page.attributes():
        assert name not in FETCHING, (tag, name, value)
        if name == "href":
            assert value is not None
            assert value.startswith("#"), (tag, value)
        if name == "style":
            assert "url(" not in str(value)
    for style in re.findall(r"<style>(.*?)</style>", html_report(nothing(), no_run), re.DOTALL):
        assert "@import" not in style
        assert not re.findall(r"url\((?!#)", style)


@pytest.mark.longer
def test_ids_are_unique(page: Page) -> None:
    ids = [value for _, name, value in page.attributes() if name == "id"]
    assert len(ids) == len(dict.fromkeys(ids)) > 350


def test_links_inside_lead_to_something(page: Page, before: History) -> None:
    """The addresses are those that the script knows; here each is looked up by what it says."""
    ids = [value for _, name, value in page.attributes() if name == "id"]
    obligations = [str(obligation) for obligation in before.obligations]
    for _, name, value in page.attributes():
        if name != "href" or value is None:
            continue
        address, _, query = value.removeprefix("#").partition("?")
        if address.startswith("/case/"):
            assert address.removeprefix("/case/") in before.labels
        elif query.startswith("visits="):
            assert query.removeprefix("visits=").replace("%2F", "/") in obligations
        else:
            assert address in ids, value


def test_the_figure_and_all_that_is_missing_is_plain_text(page: Page, before: History) -> None:
    assert "46.51 %" in page.text
    rows = [str(a["data-obligation"]) for _, a in page.elements if "data-obligation" in a]
    subjects = [row.rpartition("/")[0].removeprefix("automatic") or row.rpartition("/")[2] for row in rows]
    assert dict.fromkeys(sorted(subjects)) == dict.fromkeys(sorted(each.subject for each in before.coverage.missed()))
    for line in before.source.text.splitlines():
        assert line in page.text


def test_cases_are_columns(page: Page, before: History) -> None:
    columns = page.json("columns")
    names = ["/".join(obligation) for obligation in columns["obligations"]]
    assert names[:80] == [str(obligation) for obligation in before.obligations][:80]
    assert names[80] == "robot_failed/taken"
    assert columns["label"] == list(before.labels)
    for index, case in enumerate(before.cases):
        digits = columns["sets"][columns["set"][index]]
        assert int(digits[::-1], 16) == case.visited
        assert columns["goals"][columns["goal"][index]] == case.goal
        assert columns["ends"][columns["end"][index]] == case.verdict.end
        assert (columns["ended_ns"][index], columns["requests"][index]) == (case.ended_ns, case.requests)
        assert columns["visits"][index] == (case.visited & before.obligations.counted).bit_count()
        assert columns["only"][index] == visited_only_by(before.coverage, before.labels[index])
    assert columns["failures"] == {}


def visited_only_by(coverage: Coverage, label: str) -> int:
    return sum(o.counts and list(coverage.visitors(o)) == [label] for o in coverage.obligations)


@pytest.mark.slow
def test_each_case_has_its_command() -> None:
    history = history_of(EXAMPLE / "after.yaml", 2, written=[EXAMPLE / "cases/second_scan_succeeds.yaml"])
    written, drawn, other = history.cases
    details = report(replace(history, cases=(written, drawn, replace(other, is_earlier=True)))).json("details")
    assert details["commands"][0].startswith("scbm replay ")
    assert details["commands"][1:] == ["scbm run examples/robot_in_the_air/after.yaml --seed 1 --case 1", ""]
    assert list(details["texts"]) == list(details["paths"]) == ["0"]
    assert "case: second_scan_succeeds" in details["texts"]["0"]


@pytest.mark.longer
def test_nothing_that_is_reported_is_taken_for_html(before: History, page: Page) -> None:
    failure = Failure(FailureKind.REQUIREMENT, NASTY, f"message {NASTY}")
    case = replace(before.cases[0], name=NASTY, goal=NASTY, verdict=Verdict(End.ABORTED, (failure,)))
    run = replace(before.runs[0], command=f"scbm test {NASTY}", source=replace(before.source, path=NASTY))
    text = f"# {COMMENT}\n{before.source.text}"
    nasty = replace(
        before, runs=(replace(run, source=replace(run.source, text=text)),), cases=(case, *before.cases[1:])
    )
    found = Page(html_report(nasty, no_run))
    assert len(found.scripts) == len(page.scripts)
    assert [tag for tag, _ in found.elements if tag == "script"] == [tag for tag, _ in page.elements if tag == "script"]
    assert found.json("columns")["label"][0] == SHOWN
    assert found.json("columns")["failures"]["0"] == [["requirement", SHOWN, f"message {SHOWN}", 0]]
    assert f"scbm test {SHOWN}" in found.text
    assert f"message {SHOWN}" in found.text
    assert f"# {COMMENT}" in found.text
    assert not any("alert" in script and "\\u003c" not in script for script in found.scripts)


def test_data_cannot_end_their_element(before: History) -> None:
    case = replace(before.cases[0], name=NASTY)
    text = html_report(replace(before, cases=(case,)), no_run)
    for data in re.findall(r'<script type="application/json" id="\w+">(.*?)</script>', text, re.DOTALL):
        assert not re.search("[<>&]", data)


def test_a_model_without_anything_says_so(wording: Wording) -> None:
    sentences = [text for text in report(nothing()).texts if text.endswith(".") and "\n" not in text]
    assert sentences
    wording(sentences)


def test_no_case_has_been_run() -> None:
    page = report(history_of(EXAMPLE / "before.yaml", 0))
    assert "0.00 %" in page.text
    assert page.json("columns")["label"] == []


def test_failures_of_one_kind_are_one_finding(wording: Wording) -> None:
    history = history_of(ROOT / "tests/models/fails_at_run/requirement.yaml", 7)
    page = report(history)
    (cause,) = {failure.message for case in history.cases for failure in case.verdict.failures}
    assert page.text.count(cause) == 6
    assert len(page.json("columns")["failures"]) == 7
    wording(text for text in page.texts if "7 cases" in text or text.startswith("Reproduce"))


def test_code_in_a_reason_is_set_as_code() -> None:
    text = html_report(history_of(ROOT / "tests/models/fails_at_run/requirement.yaml", 1), no_run)
    assert len(re.findall("<code>failed</code> transition", text)) == 2


def test_the_page_of_an_operation_has_its_lines_and_no_others(before: History) -> None:
    text = html_report(before, no_run)
    for name, after in (("pick_item_a", "  place_item_a:"), ("place_item_a", "automatic_transitions:")):
        (section,) = re.findall(f'<section[^>]* id="/operation/{name}".*?</section>', text, re.DOTALL)
        ((first, last),) = re.findall('class="source"[^>]* data-first="(.*?)" data-last="(.*?)"', section)
        lines = before.source.text.splitlines()[int(first) - 1 : int(last)]
        block = before.source.text.split(f"  {name}:\n")[1].split(f"\n\n{after}")[0]
        assert lines == [f"  {name}:", *block.splitlines()]


def test_progress_is_reported_after_each_case(before: History) -> None:
    progress: list[tuple[int, int]] = []
    html_report(before, no_run, lambda done, of: progress.append((done, of)))
    assert progress == [(done, 20) for done in range(1, 21)]


def test_of_many_cases_those_that_other_pages_name_are_run_again(before: History) -> None:
    cases = tuple(replace(before.cases[i % 20], name=f"copy-{i + 1}", position=i + 1) for i in range(1_001))
    many = replace(before, cases=cases)
    executed: list[str] = []
    text = html_report(many, lambda case: executed.append(case.name))
    assert 20 <= len(executed) < 500
    named = dict.fromkeys(re.findall(r'href="#/case/([^"/?]+)"', text))
    assert dict.fromkeys(sorted(executed)) == dict.fromkeys(sorted(named))


# colours


def luminance(colour: str) -> float:
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    red, green, blue = (p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_texts_have_enough_contrast_in_all_themes() -> None:
    style = (ROOT / "src/scbm/reports/html/page.css").read_text(encoding="utf-8")
    themes = [dict(re.findall(r"--(\w+): (#\w{6});", block)) for block in re.findall(r"\{[^{}]*--bg:[^{}]*\}", style)]
    assert len(themes) == 3
    assert themes[1] == themes[2] != themes[0]
    for theme in themes:
        backgrounds = theme.pop("bg"), theme.pop("surface")
        theme.pop("line")
        assert len(theme) == 13
        for name, colour in theme.items():
            for background in backgrounds:
                assert contrast(colour, background) >= 4.5, (name, colour, background)


@pytest.mark.slow
def test_a_lost_case_has_a_page_without_a_run() -> None:
    history = with_lost_cases(history_of(EXAMPLE / "before.yaml", 3), 1)
    executions = [Replays(history).execute(case) for case in history.cases]
    assert [execution is None for execution in executions] == [True, False, False]
    page = Page(html_report(history, Replays(history).execute))
    (failure,) = history.cases[0].verdict.failures
    assert any(failure.message in text for text in (*page.texts, *page.scripts))
