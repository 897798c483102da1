"""`scbm test -k`, `-x` and `--lf`."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import Ran
from scbm.cli.options.case_selection import LastFailed, name_filter
from scbm.model import InputError
from scbm.store import read_history
from support.wording import Wording, diagnostic_heads

Scbm = Callable[..., Ran]
BEFORE = "examples/robot_in_the_air/before.yaml"
FAILING = ("--require", "never robot_at == box_a", "--no-shrink")
NAMES = ("seed-1-case-1", "seed-1-case-12", "scan fails", "Scan twice")


@pytest.mark.parametrize(
    ("expression", "names"),
    [
        ("case-1", ["seed-1-case-1", "seed-1-case-12"]),
        ("scan", ["scan fails", "Scan twice"]),
        ("not seed", ["scan fails", "Scan twice"]),
        ("scan and fails", ["scan fails"]),
        ("case-12 or twice", ["seed-1-case-12", "Scan twice"]),
        ("not (scan or 12)", ["seed-1-case-1"]),
        ("not scan and 12 or fails", ["seed-1-case-12", "scan fails"]),
        ('"n f"', ["scan fails"]),
    ],
)
def test_an_expression_selects_by_parts_of_names(expression: str, names: list[str]) -> None:
    assert list(filter(name_filter(expression), NAMES)) == names


@pytest.mark.parametrize(
    ("expression", "place"),
    [("", "-k:1:1"), ("a and", "-k:1:6"), ("(a", "-k:1:3"), ("a b", "-k:1:3"), ("or", "-k:1:1")],
)
def test_an_expression_that_is_none_is_an_error_at_its_place(expression: str, place: str) -> None:
    with pytest.raises(InputError) as wrong:
        name_filter(expression)
    assert str(wrong.value.diagnostics[0].place) == place


def _cases(ran: Ran) -> list[str]:
    return [case["name"] for case in json.loads(ran.out)["cases"]]


def test_k_runs_the_cases_of_such_names_alone(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    arguments = ("test", BEFORE, "--cases", 20, "--seed", 1, "--failures", tmp_path)
    assert _cases(scbm(*arguments, "-k", "case-3 or case-17", "--json")) == ["seed-1-case-3", "seed-1-case-17"]
    wording(scbm(*arguments, "-k", "case-3 or case-17").out.splitlines()[3])
    ran = scbm(*arguments, "-k", "nothing")
    assert (ran.code, diagnostic_heads(ran.err)) == (2, ["-k: error[bad-option]"])
    wording(ran.err)


def test_x_stops_at_the_first_failure_and_leaves_the_run_of_the_store_unfinished(
    scbm: Scbm, tmp_path: Path, wording: Wording
) -> None:
    arguments = ("test", BEFORE, "--cases", 20, "--seed", 1, *FAILING, "--failures", tmp_path)
    every = json.loads(scbm(*arguments, "--json").out)["cases"]
    first = next(number for number, case in enumerate(every, start=1) if not case["passed"])
    ran = scbm(*arguments, "-x", "--store", tmp_path / "s.db")
    assert ran.code == 1
    wording(ran.out.splitlines()[5])
    wording(ran.err)
    assert [run.is_finished for run in read_history(tmp_path / "s.db").runs] == [False]
    assert _cases(scbm(*arguments, "-x", "--json")) == [case["name"] for case in every[:first]]


def test_lf_runs_what_failed_last_time_until_it_passes(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    arguments = ("test", BEFORE, "--cases", 20, "--seed", 1, "--failures", tmp_path)
    every = json.loads(scbm(*arguments, *FAILING, "--json").out)["cases"]
    failed = [case["name"] for case in every if not case["passed"]]
    assert 1 < len(failed) < 20
    assert _cases(scbm(*arguments, *FAILING, "--lf", "-x", "--json")) == failed[:1]
    assert _cases(scbm(*arguments, "-k", failed[-1], "--lf", "--json")) == failed[-1:]
    assert _cases(scbm(*arguments, "--lf", "--json")) == failed[:-1]
    ran = scbm(*arguments, "--lf", "--json")
    assert len(_cases(ran)) == 20
    wording(ran.err)


def test_lf_says_how_the_failed_cases_were_asked_for_if_they_are_not_among_these(scbm: Scbm, tmp_path: Path) -> None:
    assert scbm("test", BEFORE, "--cases", 9, "--seed", 7, *FAILING, "--failures", tmp_path).code == 1
    ran = scbm("test", BEFORE, "--failures", tmp_path, "--lf")
    assert (ran.code, "--cases 9 --seed 7" in ran.err) == (2, True)


def test_a_record_of_failed_cases_that_is_damaged_is_an_error(scbm: Scbm, tmp_path: Path) -> None:
    (tmp_path / "last-failed.json").write_text('{"format_version": 1, "models": []}', encoding="utf-8")
    ran = scbm("test", BEFORE, "--failures", tmp_path, "--lf")
    assert (ran.code, "last-failed.json:1:33: error[wrong-shape]" in ran.err) == (2, True)


@pytest.mark.parametrize("version", ["0", "2", "null"])
def test_a_record_of_failed_cases_of_another_version_is_an_error(
    version: str, scbm: Scbm, tmp_path: Path, wording: Wording
) -> None:
    (tmp_path / "last-failed.json").write_text(f'{{"format_version": {version}, "models": {{}}}}', encoding="utf-8")
    ran = scbm("test", BEFORE, "--failures", tmp_path, "--lf")
    assert (ran.code, "last-failed.json: error[format-version]" in ran.err) == (2, True)
    wording(ran.err)


@pytest.mark.parametrize(
    ("entry", "wrong"),
    [
        ('{"failed": [], "failed": ["a"]}', '"failed"'),
        (r'{"failed": ["\ud800"]}', r"\ud800"),
        ('{"failed": [NaN]}', "NaN"),
        ('{"failed": [1]}', "1]"),
        ('{"fails": ["a"]}', '["a"]'),
    ],
)
def test_a_record_of_failed_cases_is_read_as_strictly_as_other_json(
    entry: str, wrong: str, scbm: Scbm, tmp_path: Path
) -> None:
    model = tmp_path / "cell.yaml"
    model.write_text(Path(BEFORE).read_text(encoding="utf-8"), encoding="utf-8")
    record = tmp_path / "last-failed.json"
    text = f'{{"format_version": 1, "models": {{"cell.yaml": {entry}}}}}'
    record.write_text(text, encoding="utf-8")
    place = f":1:{text.rindex(wrong) + 1}"
    ran = scbm("test", model, "--failures", tmp_path, "--lf")
    assert (ran.code, diagnostic_heads(ran.err)) == (2, [f"{record}{place}: error[wrong-shape]"])


def test_a_campaign_in_which_nothing_fails_leaves_no_record(scbm: Scbm, tmp_path: Path) -> None:
    assert scbm("test", BEFORE, "--cases", 2, "--failures", tmp_path / "failures").code == 0
    assert list(tmp_path.iterdir()) == []
    assert LastFailed.read(tmp_path, Path(BEFORE)) == LastFailed()
