"""Coverage stores on the command line: `test --store`, `combine`, `report`, and what is wrong."""

from __future__ import annotations

import json
import shlex
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import pytest

from scbm.reports.formats import FORMATS
from scbm.reports.stored_cases import again
from scbm.store import Replays, StoreWriter, read_history
from support.profiles import slow_beyond
from support.wording import Wording, diagnostic_heads

BEFORE = "examples/robot_in_the_air/before.yaml"
AFTER = "examples/robot_in_the_air/after.yaml"
CASES = "examples/robot_in_the_air/cases"
HOME = "always gantry_req_state == executing -> robot_at == home"


class Ran(Protocol):
    code: int
    out: str
    err: str


Scbm = Callable[..., Ran]


@pytest.fixture
def store(tmp_path: Path) -> Path:
    return tmp_path / "cov.db"


@pytest.fixture(scope="module")
def made() -> dict[str, bytes]:
    """Stores that a test of this module has made, for others to copy."""
    return {}


@pytest.fixture
def filled(scbm: Scbm, store: Path, made: dict[str, bytes]) -> Path:
    """A store of 20 cases."""
    if "filled" in made:
        store.write_bytes(made["filled"])
    else:
        assert scbm("test", BEFORE, "--cases", 20, "--seed", 1, "--store", store).code == 0
        made["filled"] = store.read_bytes()
    return store


@pytest.mark.slow
def test_a_run_is_added_and_compared_with_the_last(scbm: Scbm, store: Path, wording: Wording) -> None:
    first = scbm("test", BEFORE, "--cases", 5, "--seed", 1, "--store", store)
    second = scbm("test", BEFORE, "--cases", 5, "--seed", 2, "--store", store)
    third = scbm("test", BEFORE, "--cases", 5, "--seed", 2, "--store", store)
    wording(first.out.splitlines()[-2:])
    *_, since, total = second.out.splitlines()
    wording(since)
    wording(total)
    wording(third.out.splitlines()[-2])
    assert third.out.splitlines()[-1] == total
    commands = [run.command for run in read_history(store).runs]
    assert commands[0] == f"scbm test {BEFORE} --cases 5 --seed 1 --store {store}"


def test_json_has_the_same(scbm: Scbm, filled: Path) -> None:
    ran = scbm("test", BEFORE, "--cases", 5, "--seed", 2, "--store", filled, "--json")
    report = json.loads(ran.out)["store"]
    history = read_history(filled)
    first, second = (run.visited for run in history.runs)
    assert report == {
        "file": str(filled),
        "is_whole": True,
        "cases": 25,
        "visited": history.coverage.figure.visited,
        "percent": history.coverage.figure.percent,
        "is_first_run": False,
        "later_start": None,
        "gained": list(history.obligations.names(second & ~first)),
        "lost": list(history.obligations.names(first & ~second)),
    }


def test_a_clock_that_went_back_is_reported(scbm: Scbm, filled: Path) -> None:
    with sqlite3.connect(filled) as connection:
        connection.execute("UPDATE run SET started = '9998-01-01T00:00:00.000000Z'")
    connection.close()
    ran = scbm("test", BEFORE, "--cases", 1, "--store", filled)
    line = f"the clock went back: {filled} has a run that began at 9998-01-01T00:00:00.000000Z; this run counts as the"
    assert line in ran.out
    assert read_history(filled).runs[-1].cases == 1


@pytest.mark.longer
def test_what_the_command_line_adds_to_cases_is_kept(scbm: Scbm, store: Path) -> None:
    scbm("test", AFTER, CASES, "--cases", 2, "--network", "loss: 5 %", "--require", HOME, "--time-limit", "5 min",
         "--store", store)  # fmt: skip
    report = json.loads(scbm("report", store, "--json").out)
    drawn = [case["recipe"] for case in report["cases"] if case["recipe"]["kind"] == "drawn"]
    assert [(recipe["number"], recipe["network"], recipe["time_limit_seconds"]) for recipe in drawn] == [
        (1, "loss: 5 %", 300.0),
        (2, "loss: 5 %", 300.0),
    ]
    assert [recipe["requirements"] for recipe in drawn] == [{"required_1": HOME}] * 2
    assert len(report["cases"]) == 9


@pytest.mark.slow
def test_a_store_that_cannot_be_written_any_more_does_not_end_the_campaign(
    scbm: Scbm, store: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    add = StoreWriter.add

    def filling(self: StoreWriter, position: int, *rest: Any) -> None:  # noqa: ANN401 - as it is called
        if position == 3:
            self._connection.execute("PRAGMA max_page_count = 1")
            self._connection.execute("CREATE TEMP TRIGGER full BEFORE INSERT ON main.test_case BEGIN"
                                     " SELECT RAISE(ABORT, 'database or disk is full'); END")  # fmt: skip
        add(self, position, *rest)

    monkeypatch.setattr(StoreWriter, "add", filling)
    ran = scbm("test", BEFORE, "--cases", 5, "--store", store)
    assert ran.code == 2
    assert "error[store-unusable]" in ran.err
    wording(ran.err)
    assert ran.err.count("error[") == 1
    assert "SCBM-IAS" in ran.out
    assert len(read_history(store).cases) == 2


FAILS = "tests/models/fails_at_run/livelock.yaml"


@pytest.fixture
def broken(monkeypatch: pytest.MonkeyPatch) -> None:
    """The store breaks behind the last case: its run cannot be finished."""
    finish = StoreWriter.finish

    def break_first(self: StoreWriter) -> None:
        self._connection.execute("CREATE TEMP TRIGGER full BEFORE UPDATE OF is_finished ON main.run BEGIN"
                                 " SELECT RAISE(ABORT, 'database or disk is full'); END")  # fmt: skip
        finish(self)

    monkeypatch.setattr(StoreWriter, "finish", break_first)


@pytest.mark.longer
@pytest.mark.usefixtures("broken")
def test_a_store_that_breaks_behind_the_last_case_takes_nothing_from_the_campaign(
    scbm: Scbm, store: Path, tmp_path: Path, wording: Wording
) -> None:
    saved, failures = tmp_path / "saved", tmp_path / "failures"
    command = ("test", FAILS, "--cases", 2, "--store", store, "--save", saved, "--failures", failures)
    ran = scbm(*command)
    assert ran.code == 2
    assert diagnostic_heads(ran.err) == [f"{store}: error[store-unusable]"]
    wording(ran.err)
    wording(ran.out.splitlines()[7])
    assert f"again: scbm replay {failures}" in ran.out
    assert len(list(saved.iterdir())) == 2
    assert [run.is_finished for run in read_history(store).runs] == [False]


@pytest.mark.usefixtures("broken")
def test_json_reports_that_the_store_broke(scbm: Scbm, store: Path) -> None:
    report = json.loads(scbm("test", BEFORE, "--cases", 2, "--store", store, "--json").out)
    assert report["store"] == {"file": str(store), "is_whole": False}
    assert "ended_early" not in report


def test_a_store_whose_sums_cannot_be_read_takes_nothing_from_the_campaign(
    scbm: Scbm, store: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    totals = StoreWriter.totals

    def damaged(self: StoreWriter) -> Any:  # noqa: ANN401 - what it gives is of no matter
        self._connection.execute("DROP TABLE test_case")
        return totals(self)

    monkeypatch.setattr(StoreWriter, "totals", damaged)
    ran = scbm("test", BEFORE, "--cases", 2, "--store", store)
    assert (ran.code, ran.err.count("error[")) == (2, 1)
    wording(ran.out.splitlines()[3])


@pytest.mark.parametrize("is_first", [True, False])
def test_who_interrupts_a_store_at_its_end_gets_no_message_that_may_be_false(
    scbm: Scbm, store: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording, *, is_first: bool
) -> None:
    finish = StoreWriter.finish

    def interrupted(self: StoreWriter) -> None:
        if not is_first:
            finish(self)
        raise KeyboardInterrupt

    monkeypatch.setattr(StoreWriter, "finish", interrupted)
    ran = scbm("test", BEFORE, "--cases", 2, "--store", store)
    assert ran.code == 130
    wording(ran.err)
    assert [run.is_finished for run in read_history(store).runs] == [not is_first]


def test_stores_are_combined(scbm: Scbm, filled: Path, tmp_path: Path, wording: Wording) -> None:
    other, target = tmp_path / "other.db", tmp_path / "all.db"
    scbm("test", BEFORE, "--cases", 20, "--seed", 2, "--store", other)
    ran = scbm("combine", filled, other, "-o", target)
    assert (ran.code, ran.err) == (0, "")
    assert str(read_history(target).coverage.figure) in ran.out
    wording(ran.out)
    report = json.loads(scbm("combine", filled, other, "-o", target, "--json").out)
    assert (report["cases"], report["runs"], report["dropped"]) == (40, 2, [])


def test_stores_of_two_models_are_combined_only_on_request(
    scbm: Scbm, filled: Path, tmp_path: Path, wording: Wording
) -> None:
    other, target = tmp_path / "other.db", tmp_path / "all.db"
    scbm("test", AFTER, CASES, "--store", other)
    refused = scbm("combine", filled, other, "-o", target)
    assert refused.code == 2
    assert "error[store-other-model]" in refused.err
    wording(refused.err)
    taken = scbm("combine", filled, other, "-o", target, "--across-edits")
    wording(taken.out.splitlines())
    wording(scbm("report", target).out.splitlines()[5])


def test_the_report_is_that_of_all_cases(scbm: Scbm, filled: Path) -> None:
    alone = scbm("test", BEFORE, "--cases", 20, "--seed", 1).out.splitlines()
    stored = scbm("report", filled).out.splitlines()
    assert stored[2] == alone[2]
    first, other = (next(i for i, line in enumerate(lines) if "Visited" in line) for lines in (stored, alone))
    assert stored[first : first + 7] == alone[other : other + 7]
    assert [line for line in stored if "○" in line] == [line for line in alone if "○" in line]


def test_only_what_is_missing_and_why(scbm: Scbm, filled: Path, wording: Wording) -> None:
    short = scbm("report", filled, "--missing").out
    assert short == scbm("test", BEFORE, "--cases", 20, "--seed", 1, "--missing").out
    assert len(short.splitlines()) < 50
    out = scbm("report", filled, "--missing", "--all").out
    assert "●" not in out
    lines = out.splitlines()
    place = lines.index("  op: gantry_move_to_agv")
    wording(lines[place + 1 : place + 4])
    wording(line for line in lines if line.startswith(f"  scbm close {BEFORE} "))


def test_nothing_missing_is_reported_in_two_lines(scbm: Scbm, store: Path, wording: Wording) -> None:
    scbm("test", AFTER, CASES, "--store", store)
    out = scbm("report", store, "--missing").out
    wording(out.splitlines()[0])
    assert len(out.splitlines()) == 4


@pytest.mark.longer
def test_the_smallest_suite_visits_the_same(scbm: Scbm, filled: Path, tmp_path: Path) -> None:
    ran = scbm("report", filled, "--minimize", "--save", tmp_path / "small")
    assert ran.code == 0
    files = sorted((tmp_path / "small").iterdir())
    assert 1 < len(files) < 20
    again = json.loads(scbm("test", BEFORE, tmp_path / "small", "--json").out)
    assert again["coverage"]["visited"] == read_history(filled).coverage.figure.visited
    assert again["coverage"]["queued"]["visited"] == 14
    assert scbm("test", BEFORE, tmp_path / "small", "--store", tmp_path / "small.db").code == 0
    report = json.loads(scbm("report", tmp_path / "small.db", "--minimize", "--json").out)
    assert len(report["smallest"]["cases"]) == len(files)


def test_saving_needs_the_smallest_suite(scbm: Scbm, filled: Path, tmp_path: Path, wording: Wording) -> None:
    ran = scbm("report", filled, "--save", tmp_path / "small")
    assert (ran.code, diagnostic_heads(ran.err)) == (2, ["--save: error[bad-option]"])
    wording(ran.err)


def test_cases_of_an_earlier_model_are_not_saved_and_that_is_reported(
    scbm: Scbm, filled: Path, tmp_path: Path, wording: Wording
) -> None:
    other, target = tmp_path / "other.db", tmp_path / "all.db"
    scbm("test", AFTER, "--cases", 1, "--store", other)
    scbm("combine", filled, other, "-o", target, "--across-edits")
    ran = scbm("report", target, "--minimize", "--save", tmp_path / "small")
    assert ran.code == 1
    wording(ran.err)


@pytest.mark.longer
def test_every_format_is_written_and_the_same_twice(scbm: Scbm, filled: Path, tmp_path: Path) -> None:
    def write(directory: str) -> list[bytes]:
        (tmp_path / directory).mkdir()
        files = {kind: tmp_path / directory / kind for kind in FORMATS}
        options = [word for kind, path in files.items() for word in (f"--{kind}", path)]
        ran = scbm("report", filled, *options)
        assert ran.code == 0
        assert ran.err == f"Written: {', '.join(str(path) for path in files.values())}\n"
        return [path.read_bytes() for path in files.values()]

    first = write("first")
    assert all(first)
    assert write("second") == first


def test_two_formats_in_one_file_are_refused(scbm: Scbm, filled: Path, tmp_path: Path) -> None:
    ran = scbm("report", filled, "--junit", tmp_path / "x", "--lcov", tmp_path / "x", "--sarif", filled)
    assert ran.code == 2
    assert [line.split(": error")[0] for line in ran.err.splitlines() if "error[" in line] == ["--lcov", "--sarif"]
    assert len(read_history(filled).cases) == 20


def test_files_that_cannot_be_written_are_reported_all_at_once(scbm: Scbm, filled: Path, tmp_path: Path) -> None:
    ran = scbm(
        "report", filled, "--junit", tmp_path / "a/j.xml", "--lcov", tmp_path / "b/l", "--badge", tmp_path / "b.svg"
    )
    assert ran.code == 2
    assert [line.split(": error")[0] for line in ran.err.splitlines() if "error[" in line] == ["--junit", "--lcov"]
    assert (ran.out, (tmp_path / "b.svg").exists()) == ("", False), "refused before the report is made"


THRESHOLDS = (
        (["46.5"], 0), (["46.52"], 1), (["executing=87.5"], 0), (["executing=87.6"], 1), (["automatic=50"], 0),
        (["40", "queued=90"], 1), (["all=46"], 0), (["disabled=0"], 0), (["46.5 %", "executing=87%"], 0),
        (["100"], 1), (["executing=100.0"], 1), ([" executing = 87 "], 0), ([" executing =88"], 1), ([" 46 "], 0),
)  # fmt: skip
"""Thresholds for the store `filled`, and the exit code."""


@pytest.mark.parametrize(("thresholds", "code"), THRESHOLDS)
def test_thresholds_are_for_everything_or_for_a_kind(
    scbm: Scbm, filled: Path, thresholds: list[str], code: int
) -> None:
    options = [word for threshold in thresholds for word in ("--fail-under", threshold)]
    assert scbm("report", filled, *options).code == code


@pytest.mark.parametrize("expected", slow_beyond(4, THRESHOLDS), ids=str)
def test_thresholds_of_a_campaign_are_those_of_its_store(scbm: Scbm, expected: tuple[list[str], int]) -> None:
    thresholds, code = expected
    options = [word for threshold in thresholds for word in ("--fail-under", threshold)]
    assert scbm("test", BEFORE, "--cases", 20, "--seed", 1, *options).code == code


def test_all_that_is_wrong_with_thresholds_is_reported_at_once(scbm: Scbm, filled: Path, wording: Wording) -> None:
    wrong = ["failde=3", "101", "executing=nan", "=3", "executing=", "4_6", "1e1", "-1"]
    options = [word for threshold in wrong for word in ("--fail-under", threshold)]
    ran = scbm("report", filled, *options)
    assert ran.code == 2
    assert ran.err.count("error[bad-option]") == 8
    wording(ran.err)


def test_what_falls_short_is_reported_for_each(scbm: Scbm, filled: Path, wording: Wording) -> None:
    ran = scbm("report", filled, "--fail-under", "90", "--fail-under", "executing=90")
    wording(ran.err.splitlines())


def test_another_model_is_refused_before_anything_is_run(scbm: Scbm, filled: Path, wording: Wording) -> None:
    ran = scbm("test", AFTER, "--cases", 5, "--store", filled)
    assert (ran.code, ran.out) == (2, "")
    assert "error[store-other-model]" in ran.err
    wording(ran.err)


@pytest.mark.parametrize("verb", ["report", "combine"])
def test_what_is_no_store_is_reported_in_one_line(scbm: Scbm, tmp_path: Path, verb: str, wording: Wording) -> None:
    wrong = tmp_path / "x.db"
    wrong.write_text("no store", encoding="utf-8")
    ran = scbm(verb, wrong, *(["-o", tmp_path / "y.db"] if verb == "combine" else []))
    assert ran.code == 2
    wording(ran.err.splitlines()[0])


def test_a_report_of_failures_names_them(scbm: Scbm, store: Path) -> None:
    scbm("test", BEFORE, "--cases", 20, "--seed", 1, "--require", HOME, "--no-shrink", "--store", store)
    out = scbm("report", store).out
    failed = len(read_history(store).failed)
    assert f"Failed: {failed} cases" in out
    assert "mores" not in out
    assert "again: scbm run" in out
    assert f"--require '{HOME}'" in out
    with sqlite3.connect(store) as connection:
        assert connection.execute("SELECT count(*) FROM test_case WHERE failures IS NOT NULL").fetchone() == (failed,)
    connection.close()


def test_names_of_files_that_are_no_text_are_kept_as_what_can_be_written(scbm: Scbm, tmp_path: Path) -> None:
    model = tmp_path / "caf\udce9.yaml"
    store = tmp_path / "s\udce9.db"
    model.write_bytes(Path(BEFORE).read_bytes())
    assert scbm("test", model, "--cases", 2, "--store", store).code == 0
    assert scbm("report", store, "--lcov", tmp_path / "l.info").code == 0
    assert "udce9.yaml" in read_history(store).source.path


def test_a_model_whose_name_is_not_utf_8_is_tested_and_not_named_in_files(scbm: Scbm, tmp_path: Path) -> None:
    model = tmp_path / "caf\udce9.yaml"
    model.write_bytes(Path(BEFORE).read_bytes())
    ran = scbm("test", model, "--cases", 2, "--require", "never robot_at == home", "--failures", tmp_path / "failures")
    assert ran.code == 2
    assert "is not UTF-8" in ran.err
    assert "Coverability report" in ran.out


def test_links_that_go_round_are_reported(scbm: Scbm, filled: Path, tmp_path: Path) -> None:
    (tmp_path / "round").symlink_to(tmp_path / "round")
    ran = scbm("report", filled, "--junit", tmp_path / "round")
    assert ran.code == 2
    assert diagnostic_heads(ran.err) == ["--junit: error[bad-option]"]


def test_a_directory_with_other_cases_is_no_smallest_suite_and_that_is_reported(
    scbm: Scbm, filled: Path, tmp_path: Path, wording: Wording
) -> None:
    scbm("test", BEFORE, "--cases", 2, "--seed", 9, "--save", tmp_path / "small")
    ran = scbm("report", filled, "--minimize", "--save", tmp_path / "small")
    assert ran.code == 1
    wording(ran.err)


def test_saved_cases_need_the_model(
    scbm: Scbm, filled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(monkeypatch, "chdir", lambda _: None)
    ran = scbm("report", filled, "--minimize", "--save", "small")
    assert ran.code == 2
    assert "error[bad-option]" in ran.err
    wording(ran.err)


@pytest.mark.longer
@pytest.mark.parametrize("is_link", [False, True])
def test_reports_replace_neither_the_model_nor_the_store_nor_a_case(
    scbm: Scbm, tmp_path: Path, wording: Wording, *, is_link: bool
) -> None:
    model = tmp_path / "model.yaml"
    model.write_bytes(Path(AFTER).read_bytes())
    case = tmp_path / "case.yaml"
    case.write_text("case: scans\ngoal: item_a_scanned\n", encoding="utf-8")
    kept = tmp_path / "kept.db"
    scbm("test", model, case, "--store", kept)
    targets = [model, case, kept]
    if is_link:
        targets = [target.with_name(f"{target.name}.link") for target in targets]
        for target, link in zip((model, case, kept), targets, strict=True):
            link.hardlink_to(target)
    before = [path.read_bytes() for path in (model, case, kept)]
    ran = scbm("report", kept, "--html", targets[0], "--junit", targets[1], "--lcov", targets[2])
    assert ran.code == 2
    assert diagnostic_heads(ran.err) == [f"--{kind}: error[bad-option]" for kind in ("html", "junit", "lcov")]
    wording(ran.err)
    assert [path.read_bytes() for path in (model, case, kept)] == before


def test_a_file_that_cannot_be_written_whole_stays_as_it_was(
    scbm: Scbm, filled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    target = tmp_path / "j.xml"
    target.write_text("old", encoding="utf-8")

    def full(path: Path, _: object) -> None:
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(Path, "replace", full)
    ran = scbm("report", filled, "--junit", target)
    assert ran.code == 2
    wording(ran.err)
    assert target.read_text(encoding="utf-8") == "old"
    assert not list(tmp_path.glob("*.part"))


def test_what_the_command_line_added_is_in_the_command_that_shows_a_case_again(scbm: Scbm, store: Path) -> None:
    scbm("test", AFTER, CASES, "--require", "always scan_timeouts < 1", "--time-limit", "40 min", "--no-shrink",
         "--store", store)  # fmt: skip
    again = [line for line in scbm("report", store).out.splitlines() if "again: " in line]
    assert again
    words = "--model examples/robot_in_the_air/after.yaml --time-limit '40 min' --require 'always scan_timeouts < 1'"
    assert all(line.endswith(words) for line in again)


def test_of_a_case_file_that_was_mended_only_the_last_version_is_reported(
    scbm: Scbm, store: Path, tmp_path: Path, wording: Wording
) -> None:
    case = tmp_path / "case.yaml"
    case.write_text("case: a\ngoal: item_a_scanned\nexpect: {verdict: unsolvable}\n", encoding="utf-8")
    assert scbm("test", AFTER, case, "--store", store).code == 1
    case.write_text("case: a\ngoal: item_a_scanned\n", encoding="utf-8")
    assert scbm("test", AFTER, case, "--store", store).code == 0
    wording(scbm("report", store).out.splitlines()[4])
    report = json.loads(scbm("report", store, "--json").out)
    assert [case["passed"] for case in report["cases"]] == [True]


def test_a_wrong_command_leaves_no_store(scbm: Scbm, store: Path) -> None:
    assert scbm("test", "tests/models/valid/smallest.yaml", "--cases", 2, "--store", store).code == 2
    assert not store.exists()


def test_of_several_stores_the_wrong_one_is_named(scbm: Scbm, filled: Path, tmp_path: Path) -> None:
    bad = tmp_path / "bad.db"
    bad.write_bytes(filled.read_bytes())
    connection = sqlite3.connect(bad)
    connection.execute("DROP VIEW visit")
    connection.execute("DROP TABLE test_case")
    connection.commit()
    connection.close()
    for order in ([bad, filled], [filled, bad]):
        ran = scbm("combine", *order, "-o", tmp_path / "all.db")
        assert ran.err.startswith(f"{bad}: error[store-damaged]: ")
    stderr = scbm("test", BEFORE, "--cases", 2, "--store", bad).err
    assert stderr.count("error[") == 1


@pytest.mark.longer
def test_saving_overwrites_no_file_that_says_something_else(
    scbm: Scbm, filled: Path, tmp_path: Path, wording: Wording
) -> None:
    small = tmp_path / "small"
    assert scbm("report", filled, "--minimize", "--save", small).code == 0
    first, *others = sorted(small.iterdir())
    before = [path.read_bytes() for path in others]
    assert scbm("report", filled, "--minimize", "--save", small).code == 0  # the same is no loss
    first.write_text("case: mine\n", encoding="utf-8")
    others[0].unlink()
    ran = scbm("report", filled, "--minimize", "--save", small)
    assert ran.code == 2
    assert "error[bad-option]" in ran.err
    wording(ran.err)
    assert first.read_text(encoding="utf-8") == "case: mine\n"
    assert [path.read_bytes() for path in others[1:]] == before[1:]
    assert not others[0].exists()


@pytest.mark.longer
def test_saved_cases_of_one_name_are_files_of_their_labels(scbm: Scbm, store: Path, tmp_path: Path) -> None:
    """By the name of the case, one of them would replace the other."""
    for goal in ("item_a_scanned", "robot_at == agv"):
        case = tmp_path / f"{len(goal)}.yaml"
        case.write_text(f"case: alike\ngoal: {goal}\n", encoding="utf-8")
        assert scbm("test", AFTER, case, "--store", store).code == 0
    assert scbm("report", store, "--minimize", "--save", tmp_path / "small").code == 0
    report = json.loads(scbm("report", store, "--minimize", "--json").out)
    assert {case["name"] for case in report["cases"]} == {"alike"}
    labels = sorted(report["smallest"]["cases"])
    assert len(labels) == 2
    assert sorted(path.name for path in (tmp_path / "small").iterdir()) == [f"{label}.yaml" for label in labels]
    again = json.loads(scbm("test", AFTER, tmp_path / "small", "--json").out)
    assert sorted(case["name"] for case in again["cases"]) == labels


def test_several_reports_have_an_empty_line_between_them(scbm: Scbm, filled: Path) -> None:
    options = ("--missing", "--contexts", "--minimize")
    alone = [scbm("report", filled, option).out for option in options]
    assert scbm("report", filled, *options).out == "\n".join(alone)


@pytest.mark.parametrize("name", ["x", "./x", "below/../x", "{here}/x"])
def test_one_file_by_several_names_is_one_file(
    scbm: Scbm, filled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    (tmp_path / "below").mkdir()
    monkeypatch.chdir(tmp_path)
    ran = scbm("report", filled, "--junit", "x", "--lcov", name.format(here=tmp_path))
    assert ran.code == 2
    assert diagnostic_heads(ran.err) == ["--lcov: error[bad-option]"]
    assert "--junit" in ran.err
    assert not (tmp_path / "x").exists()


def test_nowhere_takes_every_format(scbm: Scbm, filled: Path) -> None:
    ran = scbm("report", filled, "--junit", "/dev/null", "--lcov", "/dev/null")
    assert (ran.code, ran.err) == (0, "Written: /dev/null, /dev/null\n")
    assert Path("/dev/null").is_char_device()


@pytest.mark.slow
def test_lines_of_files_end_alike_on_every_system(
    scbm: Scbm, filled: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def as_on_windows(path: Path, data: str, encoding: str, newline: str | None = None) -> int:
        return path.write_bytes(data.replace("\n", newline or "\r\n").encode(encoding))

    monkeypatch.setattr(Path, "write_text", as_on_windows)
    files = [tmp_path / kind for kind in FORMATS]
    options = [word for kind, path in zip(FORMATS, files, strict=True) for word in (f"--{kind}", path)]
    assert scbm("report", filled, *options).code == 0
    assert all(b"\n" in path.read_bytes() and b"\r" not in path.read_bytes() for path in files)


@pytest.mark.parametrize(
    ("threshold", "place", "caret"),
    [
        ("101", "1:1", "    ^~~"),
        ("executing=9x", "1:11", "              ^~"),
        ("executing=", "1:11", "              ^"),
        ("failde=3", "1:1", "    ^~~~~~"),
        ("=3", "1:1", "    ^"),
    ],
)
def test_what_is_wrong_with_a_threshold_is_pointed_at(
    scbm: Scbm, filled: Path, threshold: str, place: str, caret: str
) -> None:
    lines = scbm("report", filled, "--fail-under", threshold).err.splitlines()
    assert lines[0].startswith(f"--fail-under:{place}: error[bad-option]: ")
    assert lines[1:3] == [f"    {threshold}", caret]


def test_a_saved_random_case_is_kept_as_the_file_that_it_is(scbm: Scbm, store: Path, tmp_path: Path) -> None:
    assert scbm("test", BEFORE, "--cases", 1, "--seed", 3, "--save", tmp_path / "saved").code == 0
    (saved,) = (tmp_path / "saved").iterdir()
    assert "\ndrawn:" in saved.read_text(encoding="utf-8")
    assert scbm("test", BEFORE, saved, "--cases", 1, "--seed", 4, "--store", store).code == 0
    kept = json.loads(scbm("report", store, "--json").out)["cases"]
    assert [case["recipe"]["kind"] for case in kept] == ["written", "drawn"]
    assert kept[0]["recipe"]["path"] == str(saved)
    assert kept[0]["again"] == f"scbm replay {saved} --model {BEFORE}"


@pytest.mark.longer
def test_a_killed_run_is_not_compared_with(scbm: Scbm, filled: Path, wording: Wording) -> None:
    scbm("test", BEFORE, "--cases", 20, "--seed", 2, "--store", filled)
    (compared,) = (line for line in scbm("report", filled).out.splitlines() if "46.51 % → 45.35 %" in line)
    wording(compared)
    scbm("test", BEFORE, "--cases", 1, "--seed", 3, "--store", filled)
    connection = sqlite3.connect(filled)
    connection.execute("UPDATE run SET is_finished = 0 WHERE command LIKE '%--seed 3%'")
    connection.commit()
    connection.close()
    assert compared in scbm("report", filled).out


BUTTON = """
behavior_model: button
variables:
  button: {domain: [released, pressed], initial: released, source: input}
  done: {domain: 0..3, initial: 0}
resources:
  arm: {simulation: {latency: 8 s}}
operations:
  work:
    deadline: 20 s
    pre: {g: done < 3 && arm_req_state == initial, a: [arm_req_trigger <- true]}
    post:
      g: true
      gr: arm_req_state == succeeded
      a: [done += 1, arm_req_trigger <- false, arm_req_state <- initial]
goals: {finished: done == 3}
"""


def test_cases_whose_inputs_are_drawn_are_run_again_with_the_same_inputs(
    scbm: Scbm, store: Path, tmp_path: Path
) -> None:
    model = tmp_path / "button.yaml"
    model.write_text(BUTTON, encoding="utf-8")
    never = ("--require", "never button == pressed")
    asked = ("test", model, "--cases", 4, "--seed", 1, "--store", store, *never, "--failures", tmp_path / "failures")
    assert scbm(*asked).code == 0
    assert scbm(*asked, "--inputs", "drawn").code == 1
    history = read_history(store)
    plain, drawn = history.cases[:4], history.cases[4:]
    assert [case.name for case in plain] == [case.name for case in drawn]
    replays = Replays(history)
    for case in history.cases:
        execution = replays.execute(case)
        assert execution is not None
        assert (execution.verdict.failures, execution.ended_ns) == (case.verdict.failures, case.ended_ns)
        assert any("pressed" in dict(r.changes).values() for r in execution.trace.records) == bool(
            case.verdict.failures
        )
    failed = next(case for case in drawn if case.verdict.failures)
    words = shlex.split(again(failed, str(model), history.runs))
    ran = scbm(*words[1:], "--json")
    assert (ran.code, json.loads(ran.out)["simulated_seconds"] * 1e9) == (1, failed.ended_ns)
    both = tmp_path / "both.db"
    assert scbm("combine", store, "--out", both).code == 0
    assert read_history(both).cases == history.cases
