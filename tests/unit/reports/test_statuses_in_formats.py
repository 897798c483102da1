"""All formats of `scbm report` show all statuses of obligations."""

from __future__ import annotations

import json

import pytest
from lxml import etree
from msgspec.structs import replace

from scbm.cases.coverage import Decision, Statuses, StatusProof, WaiverReview
from scbm.model import Waiver
from scbm.reports.ci.badge import badge
from scbm.reports.ci.cobertura import cobertura_xml
from scbm.reports.ci.history_json import history_json
from scbm.reports.ci.junit import junit_xml
from scbm.reports.ci.lcov import lcov_info
from scbm.reports.ci.markdown import markdown
from scbm.reports.ci.sarif import sarif_log
from scbm.reports.cover_advice import CampaignKind
from scbm.reports.figure_table import STATUS_MARKS
from scbm.reports.html import html_report
from scbm.reports.terminal.coverage_report import missing_lines
from scbm.reports.terminal.store_report import stored_report
from scbm.store import History
from support.histories import EXAMPLE, history_of
from support.wording import Wording


@pytest.fixture(scope="module")
def history() -> History:
    """A store in which obligations have all six statuses, and waivers and certificates do not count."""
    plain = history_of(EXAMPLE / "before.yaml", 5)
    missed = [str(obligation) for obligation in plain.coverage.missed()]
    visited = next(o for o in plain.obligations if o not in plain.coverage.missed())
    forced = [o for o in plain.obligations if plain.coverage.visits()[o] and o.counts][-1]
    proofs = {
        missed[0]: StatusProof(Decision.UNCOVERABLE, "nothing fails it", "a.json"),
        missed[1]: StatusProof(Decision.EXCLUDED, "no plan has it", "b.json"),
    }
    waivers = (
        Waiver(missed[2], "tested by hand", "Ada", "2026-11-20"),
        Waiver(str(visited), "not needed", "Ada", "2026-11-20"),
        Waiver(missed[3], "not yet", "Ada", "2026-11-20", "2026-11-22"),
    )
    bit = plain.obligations.bit(forced)
    review = WaiverReview.on("2026-11-23", waivers)
    decided = Statuses.of(plain.coverage, proofs, review, ["c.json: it has a flaw"], forced=bit)
    assert {entry.decision for entry in decided.entries} == set(Decision)
    return replace(plain, decided=decided)


SPECIAL = (Decision.UNCOVERABLE, Decision.EXCLUDED, Decision.WAIVED)
WARNINGS = ("Waived, but a case visits it", "Expired waiver", "c.json: it has a flaw")


def _figures(history: History) -> tuple[str, str]:
    assert history.decided is not None
    return str(history.coverage.figure), str(history.decided.coverable)


def test_the_terminal_shows_them(history: History) -> None:
    text = "\n".join(line.plain for line in stored_report(history, "cov.db", 120))
    for status in SPECIAL:
        assert f"{STATUS_MARKS[status]} {status.words}" in text
    assert all(words in text for words in (*WARNINGS, *_figures(history)))


def test_the_missing_obligations_have_their_statuses(history: History) -> None:
    lines = missing_lines(history, "m.yaml", CampaignKind(), 200)
    text = "\n".join(line.plain for line in lines)
    for words in ("uncoverable: nothing fails it", "excluded by the planner: no plan has it", "waived: tested by hand"):
        assert words in text


def test_html_shows_them_with_marks_words_and_colours(history: History) -> None:
    text = html_report(history, lambda _: None)
    for status in SPECIAL:
        assert f'class="{status.value}">{STATUS_MARKS[status]} {status.words}' in text
        assert f".{status.value} {{ color: var(--{status.value}); }}" in text
        assert text.count(f"--{status.value}: #") == 3
    assert f'data-coverable="{_figures(history)[1]}"' in text
    assert text.count('data-notice="status"') == 3


def test_junit_has_them_as_properties(history: History) -> None:
    root = etree.fromstring(junit_xml(history).encode())
    properties = {each.get("name"): each.get("value") for each in root.iter("property")}
    assert (properties["scbm_ias"], properties["of_what_can_be_covered"]) == _figures(history)
    assert all(properties[f"obligations_{status.value}"] == "1" for status in SPECIAL)


def test_cobertura_has_them_as_types_and_keeps_its_rates(history: History) -> None:
    text = cobertura_xml(history)
    for status in SPECIAL:
        assert f', {status.words}"' in text
    plain = etree.fromstring(cobertura_xml(replace(history, decided=None)).encode())
    assert etree.fromstring(text.encode()).get("branch-rate") == plain.get("branch-rate")


def test_lcov_has_them_as_comments(history: History) -> None:
    comments = [line for line in lcov_info(history).splitlines() if line.startswith("#")]
    text = "\n".join(comments)
    assert all(f": {status.words}" in text for status in SPECIAL)
    assert all(words in text for words in (*WARNINGS, *_figures(history)))
    rest = [line for line in lcov_info(history).splitlines() if not line.startswith("#")]
    assert rest == lcov_info(replace(history, decided=None)).splitlines()


def test_sarif_has_them_as_properties_and_suppressed_results(history: History) -> None:
    (run,) = json.loads(sarif_log(history))["runs"]
    assert run["properties"]["statuses"]["waived"] == 1
    results = {result["ruleId"]: result for result in run["results"]}
    rules = [rule["id"] for rule in run["tool"]["driver"]["rules"]]
    assert results["waived"]["suppressions"][0]["justification"] == "tested by hand (Ada, 2026-11-20)"
    for rule in ("waived", "visited_waiver", "expired_waiver", "ignored_certificate"):
        assert rules[results[rule]["ruleIndex"]] == rule


def test_markdown_shows_them(history: History, wording: Wording) -> None:
    text = markdown(history)
    assert f"**{_figures(history)[1]} of what" in text
    wording(line for line in text.splitlines() if _figures(history)[1] in line or "uncoverable: " in line)
    assert text.count("⚠️") == 3


def test_the_badge_shows_both_figures(history: History) -> None:
    text = badge(history)
    assert "{}, {} of what can be covered".format(*_figures(history)) in text


def test_json_has_all_of_them(history: History) -> None:
    statuses = history_json(history)["statuses"]
    assert [statuses["counts"][status.value] for status in SPECIAL] == [1, 1, 1]
    assert len(statuses["visited_waivers"]) == len(statuses["expired_waivers"]) == 1
    assert len(statuses["ignored_certificates"]) == 1
