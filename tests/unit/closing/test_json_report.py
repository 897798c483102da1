"""What closing came to as JSON: exactly the obligations of the figure, each with what decides it."""

from __future__ import annotations

import json
from pathlib import Path

from msgspec.structs import replace

from scbm.cases.coverage import Obligations
from scbm.closing import Suggestion, SuggestionKind
from scbm.closing.closing_files import ClosingFiles
from scbm.closing.closing_json import closing_json
from scbm.files import parse_predicate, read_case
from scbm.files.language.scope import Scope
from support.closings import closing_of, obligation, result_of
from support.models import scan_cell
from support.wording import Wording

CELL = scan_cell()
SCANS = read_case("case: scans\ngoal: scanned\n", CELL)
FAILS = read_case("case: fails\ngoal: scanned\noutcomes: {scan: [fail]}\n", CELL)


def test_obligations_are_those_of_the_figure_and_queued_ones_stand_beside() -> None:
    report = closing_json(result_of(closing_of(CELL, [SCANS])))
    counted = [str(each) for each in Obligations.of(CELL) if each.counts]
    assert [entry["name"] for entry in report["obligations"]] == counted
    assert [entry["name"] for entry in report["queued"]] == ["scan_box/queued"]
    assert list(report)[:2] == ["format_version", "model"]


def test_every_entry_has_what_decides_it(wording: Wording) -> None:
    report = closing_json(result_of(closing_of(CELL, [SCANS], undecided=["scan_box/failed", "automatic/scan_failed"])))
    by_name = {entry["name"]: entry for entry in report["obligations"]}
    covered = dict(by_name["scan_box/executing"])
    wording(covered.pop("reason"))
    assert covered == {"name": "scan_box/executing", "decision": "covered", "is_forced": False, "case": "scans"}
    assert by_name["scan_box/disabled"]["certificate"] == "structure"
    undecided = dict(by_name["scan_box/failed"])
    wording(undecided.pop("reason"))
    assert undecided == {"name": "scan_box/failed", "decision": "undecided", "is_forced": False}
    counts = {"covered": 2, "uncoverable": 2, "excluded": 0, "waived": 0, "undecided": 2}
    assert report["decisions"] == counts
    assert report["coverable"] == {"visited": 2, "of": 4, "percent": 50.0}
    assert all(entry["reason"] for entry in (*report["obligations"], *report["queued"]))


def test_figures_and_cases() -> None:
    report = closing_json(result_of(closing_of(CELL, [FAILS], suite=[SCANS])))
    assert (report["before"], report["after"]) == (
        {"visited": 2, "of": 6, "percent": 33.33},
        {"visited": 4, "of": 6, "percent": 66.67},
    )
    (case,) = report["cases"]
    assert case["adds"] == ["scan_box/failed", "automatic/scan_failed"]
    assert (case["name"], case["goal"], case["verdict"], case["passed"]) == ("fails", "scanned", "reached", True)
    assert (case["file"], case["simulated_seconds"]) == (None, 0.0)


def test_what_was_written_is_named_by_its_path() -> None:
    output = ClosingFiles(
        Path("out"), {"scans": Path("out/cases/scans.yaml")}, {"structure": Path("out/c/structure.json")}
    )
    report = closing_json(replace(result_of(closing_of(CELL, [SCANS])), output=output))
    assert report["cases"][0]["file"] == "out/cases/scans.yaml"
    assert report["certificates"][0]["file"] == "out/c/structure.json"
    assert {entry.get("certificate") for entry in report["obligations"]} == {None, "out/c/structure.json"}


def test_suggestions() -> None:
    about = (obligation(CELL, "scan_box/failed"), obligation(CELL, "automatic/scan_failed"))
    goal = parse_predicate("light == red", Scope.of(CELL))
    suggestions = [
        Suggestion(about, SuggestionKind.GOAL, "a goal would", "needs_scan_box", goal),
        Suggestion(about[:1], SuggestionKind.GUARD, "a guard is in the way", blamed=("a == b",)),
    ]
    first, second = closing_json(result_of(closing_of(CELL, suggestions=suggestions)))["suggestions"]
    assert first == {
        "obligation": "scan_box/failed",
        "obligations": ["scan_box/failed", "automatic/scan_failed"],
        "obligations_by_force": [],
        "kind": "goal",
        "text": "a goal would",
        "goal": "light == red",
        "name": "needs_scan_box",
        "blamed": [],
    }
    assert (second["goal"], second["name"], second["blamed"]) == (None, None, ["a == b"])


def test_it_can_be_written() -> None:
    report = closing_json(result_of(closing_of(CELL, [SCANS], suite=[FAILS], undecided=["scan_box/disabled"])))
    assert json.loads(json.dumps(report)) == report
