"""The summary in Markdown: what a renderer that is not ours makes of it, and that it never becomes too long."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from lxml import etree
from markdown_it import MarkdownIt
from msgspec.structs import replace

from scbm.cases.coverage import Aspect, Obligation
from scbm.cases.trace import End
from scbm.files import read_model
from scbm.reports.ci.markdown import MAX_CHARACTERS, markdown
from scbm.reports.missed_reasons import Missed
from scbm.store import History, ModelSource
from scbm.testing import Failure, FailureKind, Verdict
from support.histories import EXAMPLE, history_of, with_lost_cases
from support.wording import Wording

FAILS = Path(__file__).parents[2] / "models/fails_at_run"
RENDERER = MarkdownIt("commonmark", {"html": True}).enable("table")


def rendered(text: str) -> etree._Element:
    return etree.HTML(f"<div>{RENDERER.render(text)}</div>")


def nodes(page: etree._Element, path: str) -> list[etree._Element]:
    found = page.xpath(path)
    assert isinstance(found, list)
    return [each for each in found if isinstance(each, etree._Element)]


def texts(page: etree._Element, path: str) -> list[str]:
    return ["".join(map(str, each.itertext())) for each in nodes(page, path)]


def with_failure(history: History, message: str) -> History:
    first, *others = history.cases
    verdict = Verdict(End.REACHED, (Failure(FailureKind.REQUIREMENT, "safe", message),))
    return replace(history, cases=(replace(first, verdict=verdict), *others))


def test_the_figure_comes_first(wording: Wording) -> None:
    page = rendered(markdown(history_of(EXAMPLE / "before.yaml", 20)))
    wording(texts(page, "//h2"))
    shown = texts(page, "//p")
    wording(shown[0])
    wording(shown[1])
    assert texts(page, "//table[1]//tr/td[2]")[:7] == [
        "0 / 16",
        "14 / 16",
        "9 / 16",
        "0 / 16",
        "14 / 16",
        "3 / 6",
        "14 / 16",
    ]


def test_what_is_missing_is_reported_with_its_reasons_and_folded_if_it_is_long(wording: Wording) -> None:
    page = rendered(markdown(history_of(EXAMPLE / "before.yaml", 20)))
    assert texts(page, "//details/summary/b") == ["16 disabled", "7 failed", "16 timedout"]
    drawn = [text.split()[-1] for text in texts(page, "//details/summary[not(b)]")]
    assert drawn == ["robot_at", "mounted", "scan_timeouts"]
    assert texts(page, "//p/strong") == ["2 executing", "2 completed", "3 taken", "2 queued"]
    taken = nodes(page, "//p[strong='3 taken']/following-sibling::table[1]//tr")[2]
    wording(texts(taken, "td"))
    shown = [
        name for row in texts(page, "//details//td[1]|//p/following-sibling::table//td[1]") for name in row.split(", ")
    ]
    assert shown.count("robot_move_to_home") == 6
    commands = texts(page, "//h3[.='Missing']/following-sibling::p[1]/code")
    wording(commands)


def test_what_failed_comes_before_all_else(wording: Wording) -> None:
    page = rendered(markdown(history_of(FAILS / "requirement.yaml", 5)))
    wording(texts(page, "//h2|//h3"))
    kind, cases, command = texts(page, "(//table)[1]//td")
    assert kind.startswith("requirement: open_while_pumping ")
    wording((kind, cases))
    assert command.endswith("requirement.yaml --seed 1 --case 1 --goals 1")


@pytest.mark.parametrize(
    "message",
    [
        "a | b || c",
        "<script>alert(1)</script> & <b>",
        "`code` ``more`` *bold* _it_ ~~no~~ [a](b) ![a](b) <https://x.org> \\| \\",
        "@someone #12 $x$ ü 模 && !a",
    ],
)
def test_a_message_is_shown_as_it_is(message: str) -> None:
    page = rendered(markdown(with_failure(history_of(EXAMPLE / "before.yaml", 2), message)))
    assert texts(page, "(//table)[1]//td")[0] == f"requirement: {message}"
    assert nodes(page, "//script") == []
    assert nodes(page, "(//table)[1]//td[1]/*[not(self::strong)]") == []


def test_nobody_is_called_by_a_message() -> None:
    assert "@someone" not in markdown(with_failure(history_of(EXAMPLE / "before.yaml", 2), "@someone"))


def test_lines_and_control_characters_become_one_line(wording: Wording) -> None:
    page = rendered(markdown(with_failure(history_of(EXAMPLE / "before.yaml", 2), "one\n\n| two\x1b[31m\r\nthree")))
    wording(texts(page, "(//table)[1]//td")[0])


def test_a_path_with_ticks_and_pipes_stays_code(wording: Wording) -> None:
    history = with_failure(history_of(EXAMPLE / "before.yaml", 2), "broken")
    odd = replace(history.runs[0], source=ModelSource("a`b``c|d.yaml", history.source.text))
    page = rendered(markdown(replace(history, runs=(odd,))))
    wording(texts(page, "(//table)[1]//td")[2])


def test_a_long_report_is_cut_between_its_parts_and_says_so() -> None:
    history = history_of(EXAMPLE / "before.yaml", 20)
    whole = markdown(history)
    for most in range(600, len(whole), 97):
        text = markdown(history, most_characters=most)
        assert len(text) <= most
        assert text.rpartition("\n*")[2].count("`scbm report`") == 1
        assert text.count("<details>") == text.count("</details>")
        assert whole.startswith(text[: text.rindex("\n*The rest")])
    assert markdown(history, most_characters=len(whole)) == whole


@pytest.mark.longer
def test_hundreds_of_operations_fit_into_a_comment() -> None:
    operations = "".join(f"  {'o' * 60}_{n}: {{pre: {{g: true}}, post: {{g: true}}}}\n" for n in range(400))
    model = read_model(f"behavior_model: m\nvariables: {{}}\noperations:\n{operations}goals: {{done: true}}\n")
    history = replace(history_of(EXAMPLE / "before.yaml", 1), model=model, cases=())
    text = markdown(history)
    assert len(text) <= MAX_CHARACTERS
    assert "<b>400 disabled</b>" in text
    assert re.search("\nand 300 [a-z]+\n", text)
    assert "<b>400 queued</b>" in text or "`scbm report`" in text.splitlines()[-1]


def test_only_what_is_given_as_missing_is_reported(wording: Wording) -> None:
    missed = Missed(Obligation("go", Aspect.FAILED), "why not", "scbm explain m.yaml go/failed")
    text = markdown(history_of(EXAMPLE / "before.yaml", 20), [missed])
    assert "\n| `go` | why not |\n" in text
    wording(text[text.index("**1 failed**") :])
    assert "Missing" not in markdown(history_of(EXAMPLE / "before.yaml", 20), [])


def test_nothing_to_measure_and_no_cases(wording: Wording) -> None:
    model = read_model("behavior_model: m\nvariables: {}\noperations: {}\n")
    history = replace(history_of(EXAMPLE / "before.yaml", 1), model=model, cases=())
    page = rendered(markdown(history))
    wording(texts(page, "//h2"))
    wording(texts(page, "//p"))


def test_lost_cases_are_reported_without_a_command(wording: Wording) -> None:
    text = markdown(with_lost_cases(history_of(EXAMPLE / "before.yaml", 3), 2))
    (row,) = [line for line in text.splitlines() if line.startswith("| **lost**")]
    assert row.endswith(" |  |")
    wording(line for line in text.splitlines() if "**2 failed**" in line or line == row)
