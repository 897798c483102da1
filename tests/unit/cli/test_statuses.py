"""Certificates and waivers in `scbm test` and `scbm close`."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from scbm.closing.symbolic import decision_diagrams
from scbm.proofcheck import CertificateFlaw
from scbm.reports.figure_table import FORCED_MARK
from scbm.reports.formats import FORMATS
from support.wording import Wording, diagnostic_heads, paragraphs

if TYPE_CHECKING:
    from conftest import Ran

    Scbm = Callable[..., Ran]

MODEL = """
behavior_model: lamp
variables: {on: {domain: bool, initial: false}}
operations:
  switch: {pre: {g: on == false}, post: {g: true, a: [on <- true]}}
goals: {lit: on == true}
"""
WAIVERS = """
waivers:
  - {obligation: switch/failed, reason: it is a lamp, author: Ada, date: 2026-11-20, expires: 2026-11-30}
"""
ALL_COVERED = {"visited": 2, "of": 2, "percent": 100.0}
ON_THE_23RD, IN_DECEMBER = "1795392000", "1796083200"


@pytest.fixture
def lamp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", ON_THE_23RD)
    path = tmp_path / "lamp.yaml"
    path.write_text(MODEL)
    return path


@pytest.fixture
def closed(lamp: Path, scbm: Scbm) -> Path:
    assert scbm("close", lamp, "--out", lamp.parent / "closed").code == 0
    return lamp.parent / "closed"


def _json(ran: Ran) -> Any:  # noqa: ANN401 - as `json.loads`
    return json.loads(ran.out)


COVERABLE = "Of what can be covered"


def test_a_test_reaches_what_closing_reached(lamp: Path, closed: Path, scbm: Scbm, wording: Wording) -> None:
    ran = scbm("test", lamp, closed, "--certificates", closed, "--fail-under", "coverable=100")
    assert ran.code == 0
    assert "SCBM-IAS: 40.00 %" in ran.out
    assert _json(scbm("test", lamp, closed, "--certificates", closed, "--json"))["statuses"]["coverable"] == ALL_COVERED
    wording(paragraphs(ran.out, COVERABLE))
    assert scbm("test", lamp, closed, "--certificates", closed, "--fail-under", "100").code == 1


def test_closing_names_the_command_that_reaches_its_figure(lamp: Path, scbm: Scbm) -> None:
    out = lamp.parent / "closed"
    ran = scbm("close", lamp, "--out", out)
    command = f"scbm test {lamp} {out} --certificates {out} --fail-under coverable=100"
    assert command in ran.out
    assert scbm(*command.split()[1:]).code == 0


def test_without_certificates_the_threshold_is_missed(lamp: Path, closed: Path, scbm: Scbm, wording: Wording) -> None:
    ran = scbm("test", lamp, closed, "--fail-under", "coverable=100")
    assert ran.code == 1
    wording(ran.err)


def test_a_directory_without_certificates_proves_nothing(lamp: Path, closed: Path, scbm: Scbm) -> None:
    assert scbm("test", lamp, closed, "--certificates", closed / "cases").code == 0


def test_certificates_of_another_model_do_not_count(lamp: Path, closed: Path, scbm: Scbm, wording: Wording) -> None:
    lamp.write_text(MODEL.replace("g: true", "g: on == false"))
    ran = scbm("test", lamp, closed, "--certificates", closed, "--fail-under", "coverable=100")
    assert ran.code == 1
    assert {head.split(": ")[-1] for head in diagnostic_heads(ran.err)} == {"warning[certificate-wrong]"}
    wording(ran.err)
    wording(paragraphs(ran.out, "Certificate"))


def test_certificates_with_flaws_do_not_count(lamp: Path, closed: Path, scbm: Scbm) -> None:
    (certificate,) = sorted(closed.rglob("structure.json"))
    certificate.write_text(certificate.read_text().replace("switch/failed", "switch/completed"))
    ran = scbm("test", lamp, closed, "--certificates", closed, "--json")
    assert f"{certificate}: warning[certificate-wrong]: " in ran.err
    assert "close it again" in ran.err
    statuses = _json(ran)["statuses"]
    assert statuses["counts"]["uncoverable"] == 1  # by another certificate
    assert str(certificate) in statuses["ignored_certificates"][0]


@pytest.mark.slow
def test_reports_say_what_proofs_assume(lamp: Path, closed: Path, scbm: Scbm) -> None:
    words = "Goals of the model follow each other in any order"
    assert words in scbm("test", lamp, closed, "--certificates", closed).out
    statuses = _json(scbm("test", lamp, closed, "--certificates", closed, "--json"))["statuses"]
    assert statuses["assumptions"][0].startswith(words)
    assert _json(scbm("test", lamp, closed, "--json"))["statuses"]["assumptions"] == []
    store = lamp.parent / "runs.db"
    ran = scbm("test", lamp, closed, "--certificates", closed, "--store", store)
    assert ran.code == 0
    for name in FORMATS:
        file = lamp.parent / f"report-{name}"
        assert scbm("report", store, f"--{name}", file).code == 0
        assert words in file.read_text(encoding="utf-8"), name


def test_goals_that_the_model_does_not_have_lie_outside(lamp: Path, closed: Path, scbm: Scbm, wording: Wording) -> None:
    own = closed / "cases" / "own.yaml"
    own.write_text(f"case: own\nmodel: {lamp}\ngoals:\n  - goal: on == true || on == false\n  - goal: on == true\n")
    statuses = _json(scbm("test", lamp, closed, "--certificates", closed, "--json"))["statuses"]
    (sentence,) = statuses["outside_proofs"]
    assert "on == true || on == false" in sentence
    wording(sentence)
    own.write_text(f"case: own\nmodel: {lamp}\ngoals:\n  - goal: lit\n  - goal: lit\n")
    store = lamp.parent / "runs.db"
    assert scbm("test", lamp, closed, "--certificates", closed, "--store", store).code == 0
    assert _json(scbm("report", store, "--json"))["statuses"]["outside_proofs"] == []
    own.write_text(f"case: own\nmodel: {lamp}\ngoals:\n  - goal: on == true || on == false\n  - goal: on == true\n")
    lamp.write_text(MODEL + "runs: {goals: single}\n")
    statuses = _json(scbm("test", lamp, closed, "--certificates", closed, "--json"))["statuses"]
    assert len(statuses["outside_proofs"]) == 2
    wording(statuses["outside_proofs"])


def test_a_file_that_is_no_certificate_is_an_error(lamp: Path, scbm: Scbm) -> None:
    ran = scbm("test", lamp, "--certificates", lamp)
    assert ran.code == 2
    assert "error[bad-certificate]" in ran.err


def test_waivers_of_the_model_count_in_both_commands(lamp: Path, scbm: Scbm, wording: Wording) -> None:
    lamp.write_text(MODEL + WAIVERS.replace("failed", "disabled"))
    ran = scbm("test", lamp, "--json")
    statuses = _json(ran)["statuses"]
    assert statuses["counts"]["waived"] == 1
    waived_for = statuses["obligations"][0]["reason"]
    wording(waived_for)
    assert statuses["obligations"] == [
        {
            "name": "switch/disabled",
            "status": "waived",
            "reason": waived_for,
            "is_forced": False,
            "certificate": None,
            "engine": None,
        }
    ]


def test_a_proof_goes_before_a_waiver(lamp: Path, closed: Path, scbm: Scbm) -> None:
    beside = lamp.parent / "waivers.yaml"
    beside.write_text("waivers_of: lamp" + WAIVERS)
    ran = scbm("test", lamp, closed, "--certificates", closed, "--waivers", beside, "--json")
    counts = _json(ran)["statuses"]["counts"]
    assert (counts["uncoverable"], counts["waived"]) == (3, 0)
    assert _json(scbm("close", lamp, "--waivers", beside, "--json"))["decisions"]["waived"] == 0


def test_an_expired_waiver_does_not_count(
    lamp: Path, scbm: Scbm, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    lamp.write_text(MODEL + WAIVERS)
    assert _json(scbm("test", lamp, "--json"))["statuses"]["counts"]["waived"] == 1
    monkeypatch.setenv("SOURCE_DATE_EPOCH", IN_DECEMBER)
    assert _json(scbm("test", lamp, "--json"))["statuses"]["counts"]["waived"] == 0
    for verb in ("test", "close"):
        wording(paragraphs(scbm(verb, lamp).out, "Expired"))


def test_check_warns_of_a_waiver_that_has_expired(
    lamp: Path, scbm: Scbm, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    lamp.write_text(MODEL + WAIVERS)
    assert scbm("check", lamp, "--strict").code == 0
    monkeypatch.setenv("SOURCE_DATE_EPOCH", IN_DECEMBER)
    ran = scbm("check", lamp, "--strict")
    assert (ran.code, f"{lamp}:9:86: warning[waiver-date]" in ran.out) == (1, True)
    wording(ran.out)
    (report,) = _json(scbm("check", lamp, "--json"))["models"]
    assert [(warning["slug"], warning["line"]) for warning in report["warnings"]] == [("waiver-date", 9)]


def test_check_warns_of_a_waiver_that_is_dated_after_today(lamp: Path, scbm: Scbm, wording: Wording) -> None:
    lamp.write_text(MODEL + WAIVERS.replace("2026-11-20", "2026-11-23"))
    assert scbm("check", lamp, "--strict").code == 0
    lamp.write_text(MODEL + WAIVERS.replace("2026-11-20", "2026-11-24"))
    ran = scbm("check", lamp, "--strict")
    assert (ran.code, f"{lamp}:9:68: warning[waiver-date]" in ran.out) == (1, True)
    wording(ran.out)


def test_a_waiver_of_a_visited_obligation_is_reported(lamp: Path, scbm: Scbm, wording: Wording) -> None:
    lamp.write_text(MODEL + WAIVERS.replace("failed", "completed"))
    wording(paragraphs(scbm("test", lamp).out, "Waived, but"))
    report = _json(scbm("close", lamp, "--json"))
    assert [waiver["obligation"] for waiver in report["waivers"]["visited"]] == ["switch/completed"]


LOCKED = MODEL.replace("}}\noperations", "}, ok: {domain: bool, initial: true, source: constant}}\noperations").replace(
    "pre: {g: on == false}", "pre: {g: on == false, gr: ok == true}"
)
FORCED = """
case: forced
model: lamp.yaml
goal: lit
injections:
  - {name: broken, when: plan.state == executing, set: {ok: false}, hold: 1 s}
"""
OPEN = """
behavior_model: lamp
variables:
  on: {domain: bool, initial: false}
resources:
  bulb: {simulation: {latency: 2 s}}
operations:
  switch:
    deadline: 10 s
    pre: {g: bulb_req_state == initial && on == false, a: [bulb_req_trigger <- true]}
    post:
      g: true
      gr: bulb_req_state == succeeded
      a: [bulb_req_trigger <- false, bulb_req_state <- initial, on <- true]
    timedout: [bulb_req_trigger <- false]
goals: {lit: on == true}
"""


@pytest.mark.slow
def test_a_waiver_of_what_only_a_forced_state_visits_is_in_use(lamp: Path, scbm: Scbm, wording: Wording) -> None:
    lamp.write_text(LOCKED + WAIVERS.replace("failed", "disabled"))
    case, store = lamp.parent / "forced.yaml", lamp.parent / "cov.db"
    case.write_text(FORCED)
    ran = scbm("test", lamp, case, "--store", store)
    assert "Waived, but" not in ran.out
    statuses = _json(scbm("report", store, "--json"))["statuses"]
    assert statuses["visited_waivers"] == []
    (entry,) = (each for each in statuses["obligations"] if each["status"] == "waived")
    assert entry["name"] == "switch/disabled"
    wording(entry["reason"])
    html = lamp.parent / "report.html"
    assert scbm("report", store, "--html", html).code == 0
    assert 'data-forced="switch/disabled"' in html.read_text()
    sarif = lamp.parent / "log.sarif"
    assert scbm("report", store, "--sarif", sarif).code == 0
    assert '"ruleId": "visited_waiver"' not in sarif.read_text()
    for report in ("--markdown", "--junit", "--lcov"):
        assert scbm("report", store, report, lamp.parent / "out").code == 0
        assert "Waived, but" not in (lamp.parent / "out").read_text()
    wording(scbm("report", store, "--contexts").out)


def test_closing_and_explaining_keep_a_waiver_of_what_only_a_forced_state_visits(
    lamp: Path, scbm: Scbm, wording: Wording, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(decision_diagrams, "ENGINES", {})
    lamp.write_text(OPEN + WAIVERS.replace("failed", "disabled"))
    few = ("--max-states", "2")
    report = _json(scbm("close", lamp, *few, "--json"))
    (entry,) = (each for each in report["obligations"] if each["name"] == "switch/disabled")
    assert (entry["decision"], "case" in entry) == ("waived", True)
    assert report["waivers"]["visited"] == []
    wording(scbm("explain", lamp, "switch/disabled", *few).out)


@pytest.mark.slow
def test_closing_waives_what_it_cannot_decide(lamp: Path, scbm: Scbm) -> None:
    undecided = ("--max-states", "1", "--max-planning", "1", "--max-random", "0", "--max-changes", "0")
    model = Path("examples/robot_in_the_air/before.yaml").read_text()
    lamp.write_text(model)
    before = _json(scbm("close", lamp, *undecided, "--json"))
    names = [each["name"] for each in before["obligations"] if each["decision"] == "undecided"]
    names += [each["name"] for each in before["queued"] if each["decision"] == "undecided"]
    assert names
    entries = [f"  - {{obligation: {name}, reason: tested by hand, author: Ada, date: 2026-11-20}}" for name in names]
    lamp.write_text(model + "\nwaivers:\n" + "\n".join(entries))
    ran = scbm("close", lamp, *undecided, "--json")
    assert ran.code == 0
    assert _json(ran)["decisions"]["undecided"] == 0
    assert "Waived: " in scbm("close", lamp, *undecided).out


def test_one_obligation_has_one_waiver_in_both_files(lamp: Path, scbm: Scbm, wording: Wording) -> None:
    lamp.write_text(MODEL + WAIVERS)
    beside = lamp.parent / "waivers.yaml"
    beside.write_text("waivers_of: lamp" + WAIVERS)
    ran = scbm("test", lamp, "--waivers", beside)
    assert ran.code == 2
    assert diagnostic_heads(ran.err) == [f"{beside}:3:18: error[duplicate-value]"]
    wording(ran.err)


# stores


@pytest.fixture
def stored(lamp: Path, closed: Path, scbm: Scbm) -> Path:
    lamp.write_text(MODEL + WAIVERS.replace("switch/failed", "switch/disabled"))
    store = lamp.parent / "cov.db"
    assert scbm("test", lamp, closed, "--certificates", closed, "--store", store).code == 0
    return store


def test_a_store_keeps_certificates_and_waivers(stored: Path, closed: Path, scbm: Scbm, wording: Wording) -> None:
    for path in closed.rglob("*.json"):
        path.unlink()
    ran = scbm("report", stored, "--fail-under", "coverable=100")
    assert ran.code == 0
    wording(paragraphs(ran.out, COVERABLE))
    assert scbm("report", stored, "--fail-under", "100").code == 1


def test_a_store_gives_statuses_as_json(stored: Path, scbm: Scbm) -> None:
    report = _json(scbm("report", stored, "--json"))
    assert report["statuses"]["counts"]["covered"] == 2
    assert report["statuses"]["coverable"] == ALL_COVERED


def test_a_waiver_of_a_store_can_expire(lamp: Path, scbm: Scbm, monkeypatch: pytest.MonkeyPatch) -> None:
    lamp.write_text(MODEL + WAIVERS)
    store = lamp.parent / "cov.db"
    scbm("test", lamp, "--store", store)
    assert _json(scbm("report", store, "--json"))["statuses"]["counts"]["waived"] == 1
    monkeypatch.setenv("SOURCE_DATE_EPOCH", IN_DECEMBER)
    statuses = _json(scbm("report", store, "--json"))["statuses"]
    assert statuses["counts"]["waived"] == 0
    assert [waiver["obligation"] for waiver in statuses["expired_waivers"]] == ["switch/failed"]


def test_certificates_of_an_earlier_model_stop_counting(lamp: Path, stored: Path, scbm: Scbm, wording: Wording) -> None:
    lamp.write_text(MODEL.replace("g: true", "g: on == false"))
    new, united = lamp.parent / "new.db", lamp.parent / "all.db"
    scbm("test", lamp, "--store", new)
    assert scbm("combine", stored, new, "-o", united, "--across-edits").code == 0
    ran = scbm("report", united)
    assert "0 uncoverable" in ran.out
    wording(paragraphs(ran.out, "Certificate"))


def test_a_store_checks_certificates_again_that_another_version_has_checked(
    stored: Path, scbm: Scbm, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr("scbm.cli.options.status_options.__version__", "9.9.9")
    assert scbm("report", stored, "--fail-under", "coverable=100").code == 0
    flaws = (CertificateFlaw("switch/failed", "an input can do it"),)
    monkeypatch.setattr("scbm.proofcheck.check_certificate", lambda *_: flaws)
    ran = scbm("report", stored, "--fail-under", "coverable=100")
    assert ran.code == 1
    assert "an input can do it" in ran.out
    wording(paragraphs(ran.out, "Certificate"))


def test_certificates_of_another_format_in_a_store_do_not_count(
    stored: Path, scbm: Scbm, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr("scbm.cli.options.status_options.__version__", "9.9.9")
    monkeypatch.setattr("scbm.proofcheck.certificate_json.FORMAT_VERSION", 99)
    assert scbm("report", stored, "--fail-under", "coverable=100").code == 1
    wording(_json(scbm("report", stored, "--json"))["statuses"]["ignored_certificates"])


def test_a_report_takes_certificates_and_waivers_too(lamp: Path, closed: Path, scbm: Scbm) -> None:
    store = lamp.parent / "plain.db"
    scbm("test", lamp, closed, "--store", store)
    assert scbm("report", store, "--fail-under", "coverable=100").code == 1
    assert scbm("report", store, "--certificates", closed, "--fail-under", "coverable=100").code == 0


# forced states


def test_an_obligation_that_only_a_forced_state_visits_is_not_covered(lamp: Path, scbm: Scbm) -> None:
    lamp.write_text(LOCKED)
    case = lamp.parent / "forced.yaml"
    case.write_text(FORCED)
    store = lamp.parent / "cov.db"
    statuses = _json(scbm("test", lamp, case, "--store", store, "--json"))["statuses"]
    names = [entry["name"] for entry in statuses["obligations"] if entry["is_forced"]]
    assert names == ["switch/disabled", "switch/executing", "switch/completed"]
    assert statuses["coverable"] == {"visited": 0, "of": 5, "percent": 0.0}
    assert _json(scbm("report", store, "--json"))["statuses"] == statuses
    tables = (scbm("test", lamp, case).out, scbm("report", store).out)
    (row,), of_store = ([line for line in text.splitlines() if line.startswith("  op: ")] for text in tables)
    assert (row.count(FORCED_MARK), of_store) == (3, [row])
    assert scbm("test", lamp, "--store", store).code == 0
    names = [entry["name"] for entry in _json(scbm("report", store, "--json"))["statuses"]["obligations"]]
    assert names == ["switch/disabled"]
