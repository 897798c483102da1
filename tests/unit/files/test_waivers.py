"""Waivers in model files and in files of their own."""

from __future__ import annotations

from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from scbm.files import (
    digest_of,
    load_waivers,
    model_schema,
    read_model,
    read_waivers,
    waivers_schema,
    write_model,
    write_waivers,
)
from scbm.model import InputError, Slug, Waiver

MODEL = """
behavior_model: lamp
variables: {on: {domain: bool, initial: false}}
operations:
  switch: {pre: {g: on == false}, post: {g: true, a: [on <- true]}}
goals: {lit: on == true}
"""
WAIVERS = """
waivers:
  - {obligation: switch/failed, reason: it is a lamp, author: Ada, date: 2026-11-23, expires: 2027-11-23}
  - {obligation: switch/queued, reason: "as  before", author: Ada, date: 2026-11-23}
"""
WAIVED = (
    Waiver("switch/failed", "it is a lamp", "Ada", "2026-11-23", "2027-11-23"),
    Waiver("switch/queued", "as before", "Ada", "2026-11-23"),
)


def slugs(text: str) -> list[Slug]:
    with pytest.raises(InputError) as raised:
        read_waivers(text, read_model(MODEL))
    return [each.slug for each in raised.value.diagnostics]


def test_a_model_has_its_waivers_in_the_order_of_the_file() -> None:
    model = read_model(MODEL + WAIVERS)
    assert model.waivers == WAIVED
    assert model.waivers[0].place is not None
    assert model.waivers[0].place.line == 9


def test_a_model_is_written_with_its_waivers() -> None:
    model = read_model(MODEL + WAIVERS)
    assert read_model(write_model(model)) == model


def test_waivers_do_not_change_the_digest_of_a_model() -> None:
    assert digest_of(read_model(MODEL + WAIVERS)) == digest_of(read_model(MODEL))


def test_a_waivers_file_says_what_the_section_of_a_model_says() -> None:
    model = read_model(MODEL)
    assert read_waivers("waivers_of: lamp" + WAIVERS, model) == WAIVED
    assert read_waivers(write_waivers(WAIVED, model), model) == WAIVED


def test_a_waiver_counts_until_the_end_of_its_last_day() -> None:
    waiver = WAIVED[0]
    assert [waiver.is_expired(day) for day in ("2026-01-01", "2027-11-23", "2027-11-24")] == [False, False, True]
    assert not WAIVED[1].is_expired("9999-12-31")


def test_all_errors_of_a_waivers_file_are_reported_at_once() -> None:
    text = """
waivers_of: lamp
waivers:
  - {obligation: switch/fail, reason: " ", author: Ada, date: 2026-11-31}
  - {obligation: switch/failed, author: Ada, date: 2026-11-23, expires: 2026-11-22}
"""
    assert slugs(text) == [
        Slug.UNKNOWN_OBLIGATION,
        Slug.MISSING_KEY,
        Slug.BAD_DATE,
        Slug.MISSING_KEY,
        Slug.CONTRADICTION,
    ]


@pytest.mark.parametrize("date", ["2026-11-3", "23.11.2026", "20261123", "2026-W47-1", "yes", "2026-02-29"])
def test_other_texts_are_no_dates(date: str) -> None:
    text = f"waivers_of: lamp\nwaivers: [{{obligation: switch/failed, reason: a, author: b, date: {date}}}]"
    assert slugs(text) == [Slug.BAD_DATE]


def test_an_obligation_has_one_waiver() -> None:
    entry = "{obligation: switch/failed, reason: a, author: b, date: 2026-11-23}"
    assert slugs(f"waivers_of: lamp\nwaivers: [{entry}, {entry}]") == [Slug.DUPLICATE_VALUE]


def test_waivers_of_another_model_are_refused() -> None:
    assert slugs("waivers_of: door" + WAIVERS) == [Slug.WRONG_SHAPE]
    assert slugs(MODEL + WAIVERS) == [Slug.WRONG_SHAPE]


def test_a_missing_waivers_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError) as raised:
        load_waivers(tmp_path / "none.yaml", read_model(MODEL))
    assert raised.value.diagnostics[0].slug is Slug.FILE_MISSING


def test_the_schemas_know_waivers() -> None:
    entry = {"obligation": "switch/failed", "reason": "it is a lamp", "author": "Ada", "date": "2026-11-23"}
    validator = Draft202012Validator(waivers_schema())
    assert not list(validator.iter_errors({"waivers_of": "lamp", "waivers": [entry]}))
    del entry["author"]
    assert list(validator.iter_errors({"waivers_of": "lamp", "waivers": [entry]}))
    assert "WaiverFile" in model_schema()["$defs"]
