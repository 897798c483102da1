"""Certificates as files: their text, and the errors for texts that are no certificates."""

from __future__ import annotations

import json

import pytest

from scbm.model import FIRST_PLANNER, InputError, PlanSet, Slug
from scbm.proofcheck import (
    Awaits,
    Certificate,
    Fact,
    GoalRuns,
    RunsArgument,
    Situation,
    StructureArgument,
    ValuesArgument,
    certificate_text,
    read_certificate,
    read_certificate_file,
)
from support.wording import Wording

DIGEST = "0123456789abcdef" * 4
CLAIMS = ("scan/failed", "automatic/“hook”")
STRUCTURE = Certificate("cell", DIGEST, CLAIMS, StructureArgument((Fact.CANNOT_FAIL, Fact.NO_DEADLINE)), None)
VALUES = Certificate("cell", DIGEST, CLAIMS, ValuesArgument({"at": ("home", "box"), "n": (0, 1), "on": (True,)}), None)
RUNS = Certificate(
    "cell",
    DIGEST,
    CLAIMS,
    RunsArgument(
        ("at", "n", "on"),
        (
            GoalRuns(
                "there",
                (Situation(("home", 1, True), None, ()), Situation(("box", 0, False), ("scan", "move"), ("robot",))),
            ),
            GoalRuns("back", (Situation(("box", 0, True), ("scan",), ("robot", "eye"), Awaits.PLAN),)),
            GoalRuns("never", ()),
        ),
    ),
    FIRST_PLANNER,
)
RUNS_TEXT = """\
{"scbm_certificate": 5,
"model": "cell",
"digest": "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef",
"claims": [
"scan/failed",
"automatic/“hook”"
],
"argument": "runs", "planner": {"name": "canonical", "version": "1"},
"goals": "single", "plans": "canonical",
"variables": ["at", "n", "on"],
"runs": [
{"goal": "there", "situations": [
[["home",1,true],[],[]],
[["box",0,false],["scan","move"],["robot"]]
]},
{"goal": "back", "situations": [
[["box",0,true],["scan"],["robot","eye"],"plan"]
]},
{"goal": "never", "situations": [

]}
]}
"""


def refused(text: str, wording: Wording) -> list[str]:
    """Return the line and the column of each error of a text, and compare the errors with the golden wording."""
    with pytest.raises(InputError) as caught:
        read_certificate(text, "c.json")
    diagnostics = caught.value.diagnostics
    assert {d.slug for d in diagnostics} == {Slug.BAD_CERTIFICATE}
    wording(f"{d.place}: {d.message}" for d in diagnostics)
    return [f"{d.place.line}:{d.place.column}" for d in diagnostics]


def test_a_situation_stands_on_a_line() -> None:
    assert certificate_text(RUNS) == RUNS_TEXT


def test_the_other_arguments_are_written_like_that() -> None:
    structure = '"goals": "sequence", "plans": "any",\n"facts": ["cannot_fail", "no_deadline"]}\n'
    assert structure in certificate_text(STRUCTURE)
    values = '"plans": "any",\n"values": {\n"at": ["home", "box"],\n"n": [0, 1],\n"on": [true]'
    assert values in certificate_text(VALUES)


@pytest.mark.parametrize("certificate", [STRUCTURE, VALUES, RUNS])
def test_what_is_written_is_read_again(certificate: Certificate) -> None:
    text = certificate_text(certificate)
    again = read_certificate(text)
    assert again == certificate
    assert certificate_text(again) == text
    assert read_certificate("\N{BYTE ORDER MARK}" + json.dumps(json.loads(text), indent=3)) == certificate


def test_true_is_not_read_as_one() -> None:
    argument = read_certificate(RUNS_TEXT).argument
    assert isinstance(argument, RunsArgument)
    assert [type(value) for value in argument.runs[0].situations[0].values] == [str, int, bool]


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        (RUNS_TEXT, "", "1:1"),
        (RUNS_TEXT, "[]", "1:1"),
        (RUNS_TEXT, "5", "1:1"),
        (RUNS_TEXT, '["scbm_certificate"]', "1:1"),
        (RUNS_TEXT, '"scbm_certificate"', "1:1"),
        (RUNS_TEXT, '{"format": "scbm-trace"}', "1:1"),
        ('"cell"', '""', "2:10"),
        ('"cell"', '"\\ud800"', "2:11"),
        ('"cell"', f'"{"x" * 1001}"', "2:10"),
        ('"cell"', "[" * 100_000, "1:1"),
        ('"0123', '"012x', "3:11"),
        (f'"{DIGEST}"', "5", "3:11"),
        (f'"{DIGEST}"', f'"{DIGEST}0"', "3:11"),
        ('"claims"', '"x": 1, "claims"', "4:6"),
        ('"claims"', '"model": "m", "claims"', "4:1"),
        ('"runs",', '"rums",', "8:13"),
        ('"argument": "runs", ', "", "1:1"),
        (', "planner": {"name": "canonical", "version": "1"}', "", "1:1"),
        ('"version": "1"}', '"version": 1}', "8:65"),
        ('"scan/failed",', '{"obligation": "scan/failed"},', "5:1"),
        ('"scan/failed",', '"",', "5:1"),
        ('{"name": "canonical", "version": "1"}', "5", "8:32"),
        ('{"name": "canonical", "version": "1"}', '["name", "version"]', "8:32"),
        ("[],[]],", "[]],", "13:1"),
        ("[],[]],", '[],[],"plan",5],', "13:1"),
        ('[["home",1,true],[],[]],', '"abc",', "13:1"),
        ('[["home",1,true],[],[]],', '{"a": 1, "b": 2, "c": 3},', "13:1"),
        ('["home",1,true]', '"n"', "13:2"),
        ("[],[]],", "5,[]],", "13:18"),
        ("[],[]],", "[null],[]],", "13:19"),
        ("[],[]],", "[],{}],", "13:21"),
        ("[],[]],", "[],[3]],", "13:22"),
        ('"home",1', '"home",null', "13:10"),
        ('"home",1', '"home",1.5', "13:10"),
        ('"home",1', '"home",NaN', "13:10"),
        ('"home",1', '"home",99999999999999999999', "13:10"),
        ('"home",1', f'"home",{2**63}', "13:10"),
        ('"home",1', f'"home",-{2**63 + 1}', "13:10"),
        ('"home",1', f'"home",{"9" * 5000}', "1:1"),
        ('"plan"', '"plans"', "17:42"),
        ('"plan"', "[]", "17:42"),
        ('"plan"', "5", "17:42"),
        ('"goal": "never", ', "", "19:1"),
        ('"single"', '"any"', "9:10"),
        ('"plans": "canonical"', '"plans": "all"', "9:29"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_reported_where_it_stands(old: str, new: str, place: str, wording: Wording) -> None:
    assert old in RUNS_TEXT
    assert refused(RUNS_TEXT.replace(old, new, 1), wording) == [place]


def test_missing_and_unknown_keys_are_reported_at_once(wording: Wording) -> None:
    assert refused(RUNS_TEXT.replace('"claims"', '"claim"'), wording) == ["1:1", "4:10"]
    others = ["1:1", "9:10", "9:29", "10:14", "11:9"]
    assert refused(RUNS_TEXT.replace('"runs",', '"values",'), wording) == others


def test_everything_that_is_wrong_is_reported_at_once_from_the_top(wording: Wording) -> None:
    text = RUNS_TEXT.replace('"plan"', "3").replace("true", "null")
    text = text.replace('"scan/failed"', "1").replace('"automatic/“hook”"', '""')
    assert refused(text, wording) == ["5:1", "6:1", "13:12", "17:11", "17:42"]


def test_no_more_than_a_hundred_faults_are_reported() -> None:
    text = RUNS_TEXT.replace("[],[]],", "[],[" + ",".join(["1"] * 300) + "]],")
    with pytest.raises(InputError) as caught:
        read_certificate(text)
    assert len(caught.value.diagnostics) == 100


@pytest.mark.parametrize(("new", "place"), [('"facts": ["cannot_fail", "no"]', "10:26"), ('"facts": {}', "10:10")])
def test_facts_have_names(new: str, place: str, wording: Wording) -> None:
    text = certificate_text(STRUCTURE).replace('"facts": ["cannot_fail", "no_deadline"]', new)
    assert refused(text, wording) == [place]


def test_facts_hold_in_runs_of_any_goals_and_plans(wording: Wording) -> None:
    text = certificate_text(STRUCTURE)
    assert refused(text.replace('"sequence"', '"single"'), wording) == ["9:10"]
    assert refused(text.replace('"plans": "any"', '"plans": "canonical"'), wording) == ["9:31"]


def test_values_stand_under_their_variables(wording: Wording) -> None:
    text = certificate_text(VALUES)
    assert refused(text.replace('"n": [0, 1]', '"n": 0'), wording) == ["12:6"]
    assert refused(text.replace('"n": [0, 1]', '"at": [0, 1]'), wording) == ["12:1"]
    everything = text[text.index('{\n"at"') : -2]
    assert refused(text.replace(everything, "3"), wording) == ["10:11"]


def test_a_text_can_be_too_large(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    monkeypatch.setattr("scbm.proofcheck.certificate_json.MAX_CHARACTERS", 100)
    assert refused(RUNS_TEXT, wording) == ["1:1"]


@pytest.mark.parametrize("version", ["4", "6", "true", "5.0", "null", '"5"', "9" * 30])
def test_another_version_of_the_format_is_refused(version: str, wording: Wording) -> None:
    with pytest.raises(InputError) as caught:
        read_certificate(RUNS_TEXT.replace('te": 5,', f'te": {version},'), "c.json")
    (found,) = caught.value.diagnostics
    assert (found.slug, str(found.place)) == (Slug.FORMAT_VERSION, "c.json")
    wording(found)


def test_large_numbers_and_long_names_are_read() -> None:
    """The limits themselves are allowed."""
    name = "x" * 1_000
    text = RUNS_TEXT.replace('"home",1', f'"{name}",{2**63 - 1}').replace('"box",0', f'"{name}",-{2**63}')
    argument = read_certificate(text).argument
    assert isinstance(argument, RunsArgument)
    assert argument.runs[0].situations[0].values == (name, 2**63 - 1, True)


def test_words_of_any_alphabet_are_written_as_they_are() -> None:
    situation = Situation(("früh",), ("öffnen",), ("Tür",))
    certificate = Certificate(
        "cell", DIGEST, CLAIMS, RunsArgument(("schicht",), (GoalRuns("ende", (situation,)),)), None
    )
    assert '[["früh"],["öffnen"],["Tür"]]' in certificate_text(certificate)


def test_the_queue_of_any_plans_is_a_state(wording: Wording) -> None:
    situations = (Situation((1,), ("home", 1, True), ("robot",), Awaits.PLAN), Situation((2,), None, ()))
    argument = RunsArgument(("n",), (GoalRuns("there", situations, ("at", "n", "on")),), plans=PlanSet.ANY)
    certificate = Certificate("cell", DIGEST, CLAIMS, argument)
    text = certificate_text(certificate)
    assert '[[1],["home",1,true],["robot"],"plan"],\n[[2],null,[]]' in text
    assert read_certificate(text) == certificate
    assert refused(text.replace('["home",1,true]', '["home",1.5,true]'), wording) == ["13:14"]
    assert refused(text.replace('["home",1,true]', '"home"'), wording) == ["13:6"]


# the model file


def with_model_file(written: str) -> str:
    return RUNS_TEXT.replace('"digest"', f'"model_file": {written},\n"digest"')


@pytest.mark.parametrize("path", ["m", "cells/a b.yaml", "x" * 1_000])
def test_a_certificate_may_name_the_file_of_its_model(path: str) -> None:
    text = certificate_text(RUNS, path)
    assert text == with_model_file(json.dumps(path))
    assert read_certificate_file(text) == (RUNS, path)
    assert read_certificate_file(RUNS_TEXT) == (RUNS, None)


@pytest.mark.parametrize("written", ['""', "5", '["m"]', f'"{"x" * 1_001}"'])
def test_the_name_of_a_model_file_is_a_text(written: str, wording: Wording) -> None:
    assert refused(with_model_file(written), wording) == ["3:15"]


def test_without_its_model_file_a_certificate_still_has_all_its_faults(wording: Wording) -> None:
    assert refused(with_model_file("5").replace('"home",1', '"home",null'), wording) == ["3:15", "14:10"]


def test_a_certificate_for_any_plan_names_no_planner() -> None:
    text = RUNS_TEXT.replace('{"name": "canonical", "version": "1"}', "null")
    certificate = read_certificate(text)
    assert certificate.planner is None
    assert certificate_text(certificate) == text
