"""Campaigns in simulation that a user interrupts."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scbm.cases import Case
from scbm.cases.coverage import Obligations
from scbm.cli.campaigns import campaign_loop
from scbm.cli.output import progress
from scbm.cli.output.progress import CampaignLines
from scbm.cli.verbs import report
from scbm.files import read_model
from scbm.store import read_history
from scbm.testing import Execution, RandomCases, Tester
from scbm.testing.batches.batch_summary import SummaryBuilder
from support.models import SCAN_CELL
from support.wording import Wording, diagnostic_heads

FAILS = "tests/models/fails_at_run/livelock.yaml"


@pytest.fixture
def interrupted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Interrupt the third case; return the names of the cases that were begun."""
    begun: list[str] = []
    execute = Tester.execute

    def interrupt(self: Tester, case: Case, most_records: int | None = None) -> Execution:
        begun.append(case.name)
        if len(begun) == 3:
            raise KeyboardInterrupt
        return execute(self, case, most_records)

    monkeypatch.setattr(Tester, "execute", interrupt)
    return begun


def test_the_cases_that_were_done_are_reported_and_nothing_more_is_run(
    scbm: Callable[..., Any], interrupted: list[str], tmp_path: Path, wording: Wording
) -> None:
    saved, failures = tmp_path / "saved", tmp_path / "failures"
    ran = scbm("test", FAILS, "--cases", 9, "--save", saved, "--failures", failures)
    assert ran.code == 130
    wording(ran.err)
    wording(ran.out.splitlines()[6:9])
    assert interrupted == [f"seed-0-case-{number}" for number in (1, 2, 3)]
    assert [path.name for path in tmp_path.rglob("*")] == ["failures", "last-failed.json"]
    assert f"again: scbm run {FAILS} --seed 0 --case 1" in ran.out


@pytest.mark.parametrize("written", [1, 2, 4])
def test_only_cases_that_were_run_are_counted(
    scbm: Callable[..., Any], interrupted: list[str], tmp_path: Path, written: int, wording: Wording
) -> None:
    model = "examples/robot_in_the_air/before.yaml"
    saved = tmp_path / "saved"
    saved.mkdir()
    for number in range(written):
        drawn = f"case: scans_{number}\ngoal: item_a_scanned\ndrawn: {{seed: 4}}\n"
        (saved / f"scans_{number}.yaml").write_text(drawn, encoding="utf-8")
    ran = scbm("test", model, saved, "--cases", 5)
    wording(ran.out.splitlines()[3:5])
    interrupted.clear()
    report = json.loads(scbm("test", model, saved, "--cases", 5, "--json").out)
    assert [case["name"] for case in report["cases"]] == ["scans_0", "scans_1" if written > 1 else "seed-0-case-1"]


def tables(path: Path) -> list[object]:
    """What a store holds, without the token and the time of its run."""
    history = read_history(path)
    return [(case, history.labels[place]) for place, case in enumerate(history.cases)]


@pytest.mark.slow
def test_output_and_store_do_not_depend_on_the_number_of_workers(scbm: Callable[..., Any], tmp_path: Path) -> None:
    outputs = []
    for jobs in (1, 2, 3):
        store = tmp_path / f"{jobs}.db"
        options = ("--cases", 150, "--seed", 4, "--network", "drawn", "--failures", tmp_path / "failures")
        ran = scbm("test", "examples/robot_in_the_air/before.yaml", *options, "--store", store, "-j", jobs, "--json")
        report = json.loads(ran.out)
        report["store"]["file"] = ""
        outputs.append((ran.code, ran.err, report, tables(store)))
    assert outputs[0] == outputs[1] == outputs[2]


def test_workers_are_for_simulation(scbm: Callable[..., Any], wording: Wording) -> None:
    ran = scbm("test", FAILS, "--transport", "loopback", "-j", 2)
    assert (ran.code, diagnostic_heads(ran.err)) == (2, ["-j: error[bad-option]"])
    wording(ran.err)


AFTER = "examples/robot_in_the_air/after.yaml"


@pytest.mark.slow
def test_a_campaign_can_end_when_it_is_dry(scbm: Callable[..., Any], tmp_path: Path) -> None:
    ran = scbm("test", AFTER, "--until-dry", 20, "--seed", 2, "--save", tmp_path / "saved", "--json")
    report = json.loads(ran.out)
    assert (ran.code, report["dry"]) == (0, {"cases": 20, "reached": True})
    first, *_, last = report["cases"]
    assert last["name"] == f"seed-2-case-{report['case_count']}"
    assert not {name for case in report["cases"][-20:] for name in case["visited"]} - {
        name for case in report["cases"][:-20] for name in case["visited"]
    }
    assert len(list((tmp_path / "saved").iterdir())) == report["case_count"]
    assert first["name"] == "seed-2-case-1"


@pytest.mark.longer
def test_the_report_says_whether_a_campaign_is_dry(scbm: Callable[..., Any], wording: Wording) -> None:
    ended = scbm("test", AFTER, "--until-dry", 20, "--seed", 2)
    limited = scbm("test", AFTER, "--until-dry", 20, "--seed", 2, "--cases", 5)
    wording([line for ran in (ended, limited) for line in ran.out.splitlines() if "ry: " in line])


@pytest.mark.parametrize("option", [("-k", "case"), ("--lf",)])
def test_cases_without_an_end_cannot_be_selected(scbm: Callable[..., Any], option: tuple[str, ...]) -> None:
    ran = scbm("test", AFTER, "--until-dry", 20, *option)
    assert (ran.code, diagnostic_heads(ran.err)) == (2, [f"{option[0]}: error[bad-option]"])


@pytest.mark.slow
def test_a_report_of_many_random_cases_has_a_forecast(scbm: Callable[..., Any]) -> None:
    ran = scbm("test", AFTER, "--cases", 100, "--no-shrink")
    assert "\n  Forecast: 1000 cases would visit " in ran.out
    report = json.loads(scbm("test", AFTER, "--cases", 100, "--no-shrink", "--json").out)["forecast"]
    assert report["cases"] == 1000
    assert 50 < report["visited"] <= 86


def test_without_a_terminal_a_long_campaign_has_a_line_every_ten_seconds(wording: Wording) -> None:
    model = read_model(SCAN_CELL)
    obligations, messages = Obligations.of(model), list[str]()
    times_s = iter([100.0, 109.9, 110.0, 119.0, 130.0, 131.0, 460.0])
    lines = CampaignLines(
        1_000, obligations, lambda text, elapsed: messages.append(f"{text} ({elapsed})"), lambda: next(times_s)
    )
    builder = SummaryBuilder(len(obligations.all))
    tester = Tester(model)
    for position, case in enumerate(RandomCases(model).first(6, 0), start=1):
        builder.add(tester.execute(case).result.outcome(position))
        lines.advance(builder.summary(), None)
    assert [line.partition(" of 1000 cases, 0 failed, ")[0] for line in messages] == ["2", "4", "6"]
    wording(messages[0])


LAMP = """behavior_model: lamp
variables: {light: {domain: [off, on], initial: off}}
operations:
  switch_on: {pre: {g: light == off}, post: {g: true, a: [light <- on]}}
goals: {lit: light == on}
"""


def test_without_a_terminal_all_long_work_has_lines(
    scbm: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "_INTERVAL_S", 0.0)  # then each line is due
    monkeypatch.setattr(report, "_SLOW", 1)
    store, closed, model = (tmp_path / name for name in ("cov.db", "closed", "lamp.yaml"))
    model.write_text(LAMP, encoding="utf-8")
    for words in (
        ("test", model, "--cases", 2, "--store", store),
        ("report", store, "--html", tmp_path / "report.html"),
        ("close", model, "--cases", 2, "--out", closed),
        ("close", "--check", closed),
        ("explain", model, "switch_on"),
        ("mutate", model, "--cases", 2),
        ("check", model),
    ):
        lines = [line for line in scbm(*words).err.splitlines() if line.startswith("scbm: ")]
        assert lines, words
        assert "--out" not in words or any("2 of 2" in line for line in lines)
        assert all(re.fullmatch(r"scbm: .* \(\d+ (?:s|min)\)", line) and len(line) <= 120 for line in lines), lines


def test_a_terminal_shows_how_many_cases_failed_and_the_figure(
    scbm: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(campaign_loop, "_SLOW", 1)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    ran = scbm("test", AFTER, "--cases", 3)
    assert "3/3 0 failed, " in re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", ran.err)


NEVER = """
behavior_model: never
variables: {done: {domain: bool, initial: false}}
resources: {press: {simulation: {latency: 1 s, outcomes: {fail: 1}}}}
operations: {form: {request: press, deadline: 5 s, guard: done == false, effects: [done <- true]}}
automatic_transitions: {give_up: {g: form.state == failed, a: [plan.state <- aborted]}}
goals: {formed: done == true}
may_end: [aborted]
"""


@pytest.mark.parametrize(("cases", "code"), [(1, 0), (9, 0), (10, 1)])
def test_random_cases_of_which_none_reaches_its_goal_fail_if_they_are_enough(
    scbm: Callable[..., Any], tmp_path: Path, cases: int, code: int, wording: Wording
) -> None:
    model = tmp_path / "never.yaml"
    model.write_text(NEVER)
    ran = scbm("test", model, "--cases", cases, "--failures", tmp_path / "failures")
    assert ran.code == code
    wording(ran.out.splitlines()[0])
    assert "--seed 0 --case 1" in ran.out.splitlines()[1]
    asked = json.loads(scbm("test", model, "--cases", cases, "--json", "--failures", tmp_path / "failures").out)
    assert (asked["random_cases"], asked["passed"]) == ({"count": cases, "reached": 0}, True)


def test_written_cases_do_not_count_as_random_ones(scbm: Callable[..., Any], tmp_path: Path) -> None:
    model, case = tmp_path / "never.yaml", tmp_path / "one.yaml"
    model.write_text(NEVER)
    case.write_text("case: one\nmodel: never.yaml\ngoal: formed\noutcomes: {press: [succeed]}\n")
    assert scbm("test", model, case, "--cases", 10, "--failures", tmp_path / "failures").code == 1
    assert scbm("test", model, case, "--failures", tmp_path / "failures").code == 0


def test_numbers_of_ends_and_of_verdicts_add_up(scbm: Callable[..., Any], tmp_path: Path) -> None:
    lines = scbm("test", FAILS, "--cases", 2, "--failures", tmp_path / "failures").out.splitlines()
    place = next(index for index, line in enumerate(lines) if line.startswith("  Testing duration"))
    assert lines[place].endswith(": 2 livelock")
    assert lines[place + 1] == "  Verdicts: 0 passed, 2 failed"


STUCK = """
behavior_model: stuck
variables:
  stuck: {domain: bool, initial: false, random: any, source: constant}
  done: {domain: bool, initial: false}
operations:
  work:
    deadline: 5 s
    pre: {g: done == false}
    post: {g: true, gr: stuck == false, a: [done <- true]}
requirements: {in_time: never work.state == timedout}
goals: {done: done == true}
"""


def test_findings_with_equal_small_cases_share_one(scbm: Callable[..., Any], tmp_path: Path, wording: Wording) -> None:
    (tmp_path / "stuck.yaml").write_text(STUCK, encoding="utf-8")
    arguments = ("test", tmp_path / "stuck.yaml", "--cases", 10, "--failures", tmp_path / "failures")
    report = scbm(*arguments).out
    wording(report[report.index("Failed") : report.index("Missed")])
    found = json.loads(scbm(*arguments, "--json").out)["findings"]
    assert [finding["kind"] for finding in found] == ["requirement", "not_reached"]
    assert len({finding["smallest"]["case"] for finding in found}) == 1
    assert len({finding["again"] for finding in found}) == 1
