"""Certificates as files: how they are written, and what is said of a text that is none."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from scbm.model import InputError
from scbm.proofcheck import (
    Awaits,
    Certificate,
    Claim,
    Fact,
    RunsArgument,
    Situation,
    StructureArgument,
    ValuesArgument,
    certificate_text,
    read_certificate,
)

DIGEST = "0123456789abcdef" * 4
CLAIMS = (Claim("scan/failed", "no reply fails it"), Claim("automatic/hook", "“hook” comes too late"))
STRUCTURE = Certificate("cell", DIGEST, CLAIMS, StructureArgument((Fact.CANNOT_FAIL, Fact.NO_DEADLINE)))
VALUES = Certificate("cell", DIGEST, CLAIMS, ValuesArgument((("at", ("home", "box")), ("n", (0, 1)), ("on", (True,)))))
RUNS = Certificate(
    "cell",
    DIGEST,
    CLAIMS,
    RunsArgument(
        ("at", "n", "on"),
        (
            ("there", (Situation(("home", 1, True)), Situation(("box", 0, False), ("scan", "move"), ("robot",)))),
            ("back", (Situation(("box", 0, True), ("scan",), ("robot", "eye"), Awaits.PLAN),)),
            ("never", ()),
        ),
    ),
)
RUNS_TEXT = """\
{"scbm_certificate": 1,
"model": "cell",
"digest": "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef",
"claims": [
{"obligation": "scan/failed", "reason": "no reply fails it"},
{"obligation": "automatic/hook", "reason": "“hook” comes too late"}
],
"argument": "runs",
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


def refused(text: str) -> list[str]:
    """What is said of a text, each with the line and the column."""
    with pytest.raises(InputError) as caught:
        read_certificate(text, "c.json")
    return [f"{d.place.line}:{d.place.column} {d.message}" for d in caught.value.diagnostics]


def test_a_situation_stands_on_a_line() -> None:
    assert certificate_text(RUNS) == RUNS_TEXT


def test_the_other_arguments_are_written_like_that() -> None:
    assert '"argument": "structure",\n"facts": ["cannot_fail", "no_deadline"]}\n' in certificate_text(STRUCTURE)
    values = '"argument": "values",\n"values": {\n"at": ["home", "box"],\n"n": [0, 1],\n"on": [true]\n}}\n'
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
    assert [type(value) for value in argument.runs[0][1][0].values] == [str, int, bool]


def test_the_page_of_messages_shows_how_a_text_is_refused() -> None:
    page = (Path(__file__).parents[3] / "docs" / "reference" / "messages.md").read_text(encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_certificate('{"scbm_certificate": 2}', "runs.json")
    assert f"```text\n{caught.value}\n```" in page


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (RUNS_TEXT, "", "1:1 this is not JSON: expecting value"),
        (RUNS_TEXT, "[]", "1:1 this is not a certificate of scbm"),
        (RUNS_TEXT, '{"format": "scbm-trace"}', "1:1 this is not a certificate of scbm"),
        ('te": 1,', 'te": 2,', "1:22 version 2 of the format of certificates; this scbm reads version 1"),
        ('te": 1,', 'te": true,', "1:22 version ? of the format of certificates; this scbm reads version 1"),
        ('"cell"', '""', "2:10 here is a text of one line with 1 to 1000 characters"),
        ('"cell"', '"a\\nb"', "2:10 here is a text of one line with 1 to 1000 characters"),
        ('"cell"', '"\\ud800"', "2:11 here is half of a surrogate pair, which is not a character"),
        ('"cell"', f'"{"x" * 1001}"', "2:10 here is a text of one line with 1 to 1000 characters"),
        ('"cell"', "[" * 100_000, "1:1 this JSON is nested too deeply"),
        ('"0123', '"012x', "3:11 a digest has 64 digits, `0` to `9` and `a` to `f`"),
        ('"claims"', '"claim"', "1:1 the key `claims` is missing"),
        ('"claims"', '"x": 1, "claims"', "4:6 `x` is not a key here"),
        ('"claims"', '"model": "m", "claims"', "4:1 the key `model` stands twice in one object"),
        ('"runs",', '"rums",', "8:13 the key `argument` says which one it is: structure, values, runs"),
        ('"argument": "runs",\n', "", "1:1 the key `argument` says which one it is: structure, values, runs"),
        ('"runs",', '"values",', "1:1 the key `values` is missing"),
        ('{"obligation": "scan/failed", ', "{", "5:1 the key `obligation` is missing"),
        ('{"obligation": "scan/failed"', '["obligation"', "5:24 this is not JSON: expecting ',' delimiter"),
        ("[],[]],", "[]],", "12:1 a situation is a list of values, queue, requests in flight, and what it awaits"),
        ("[],[]],", "[],{}],", "12:21 here is a list"),
        ("[],[]],", "[],[3]],", "12:22 here is a text of one line with 1 to 1000 characters"),
        ('"home",1', '"home",null', "12:10 here is a text of one line with 1 to 1000 characters"),
        ('"home",1', '"home",1.5', "12:10 `1.5` is not a whole number"),
        ('"home",1', '"home",NaN', "12:10 `NaN` is not a JSON number"),
        ('"home",1', '"home",99999999999999999999', "12:10 this is a number that no variable can have"),
        ('"home",1', f'"home",{"9" * 5000}', "1:1 this JSON holds a number with too many digits"),
        ('"plan"', '"plans"', "16:42 what a situation awaits is one of nothing, plan, unsolvable, stale, change"),
        ('"goal": "never", ', "", "18:1 the key `goal` is missing"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_where_it_stands(old: str, new: str, said: str) -> None:
    assert old in RUNS_TEXT
    assert refused(RUNS_TEXT.replace(old, new, 1)) == [said]


def test_everything_that_is_wrong_is_told_at_once_from_the_top() -> None:
    text = RUNS_TEXT.replace('"plan"', "3").replace("true", "null").replace('"reason"', '"because"')
    assert refused(text) == [
        "5:1 the key `reason` is missing",
        "6:1 the key `reason` is missing",
        "12:12 here is a text of one line with 1 to 1000 characters",
        "16:11 here is a text of one line with 1 to 1000 characters",
        "16:42 what a situation awaits is one of nothing, plan, unsolvable, stale, change",
    ]


def test_no_more_than_a_hundred_faults_are_told() -> None:
    text = RUNS_TEXT.replace("[],[]],", "[],[" + ",".join(["1"] * 300) + "]],")
    assert len(refused(text)) == 100


@pytest.mark.parametrize(
    ("new", "said"),
    [
        ('"facts": ["cannot_fail", "no"]', "8:26 a fact is one of no_deadline, cannot_fail, always_enabled"),
        ('"facts": {}', "9:10 here is a list"),
    ],
)
def test_facts_have_names(new: str, said: str) -> None:
    text = certificate_text(STRUCTURE).replace('"facts": ["cannot_fail", "no_deadline"]', new)
    assert refused(text) == [said.replace("8:", "9:")]


def test_values_stand_under_their_variables() -> None:
    text = certificate_text(VALUES)
    assert refused(text.replace('"n": [0, 1]', '"n": 0')) == ["11:6 here is a list"]
    assert refused(text.replace('"n": [0, 1]', '"at": [0, 1]')) == ["11:1 the key `at` stands twice in one object"]
    everything = text[text.index('{\n"at"') : -2]
    assert refused(text.replace(everything, "3")) == ["9:11 here is an object of variables, each with a list of values"]


def test_a_text_can_be_too_large(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scbm.proofcheck.certificate_reader.MAX_CHARACTERS", 100)
    assert refused(RUNS_TEXT) == ["1:1 the text has more than 100 characters"]
