"""Records of JSON: known fields, limits, and errors that name the field and quote little of the data."""

from __future__ import annotations

from typing import Annotated

import pytest

from scbm.model.json_reader import (
    MAX_LONG_TEXT,
    Count,
    JsonError,
    JsonRecord,
    LongText,
    Names,
    Text,
    Values,
    matching,
    one_of,
    read_record,
)
from support.wording import Wording


class Inner(JsonRecord, frozen=True):
    count: Count
    words: Names = ()


class Outer(JsonRecord, frozen=True):
    name: Text
    values: Values
    inner: Inner | None
    light: Annotated[str, one_of(["on", "off"])] = "off"
    text: LongText = ""
    digits: Annotated[str, matching("[0-9]+", "digits")] = "1"

    def __post_init__(self) -> None:
        if self.name == "wrong":
            raise ValueError("this name is wrong")


GOOD = {"name": "lamp", "values": {"a": 1, "b": True, "c": "x"}, "inner": {"count": 3}}


def test_a_record_has_the_values_of_its_data() -> None:
    record: Outer = read_record(GOOD, Outer, "the lamp")
    assert record == Outer("lamp", {"a": 1, "b": True, "c": "x"}, Inner(3))
    assert read_record(GOOD | {"light": "on"}, Outer, "the lamp").light == "on"


@pytest.mark.parametrize(
    "wrong",
    [
        {"name": "n" * 1_001},
        {"name": "wrong"},
        {"text": "t" * (MAX_LONG_TEXT + 1)},
        {"values": {str(number): number for number in range(10_001)}},
        {"values": {"a": 2**63}},
        {"values": {"a": 0.5}},
        {"values": {"k" * 1_001: 1}},
        {"values": {"a": "t" * (MAX_LONG_TEXT + 1)}},
        {"inner": {"count": -1}},
        {"inner": {"count": 2**63}},
        {"inner": {"count": 1, "words": ["a", 1]}},
        {"inner": {"count": 1, "words": [""] * 100_001}},
        {"inner": {"count": 1, "more\n": 1}},
        {"inner": {}},
        {"light": "green"},
        {"digits": "12\n"},
        {"digits": "\u0663"},
        {"m" * 1_000_000: 1},
    ],
    ids=lambda wrong: str(wrong)[:30],
)
def test_what_is_no_such_record_is_refused_by_its_field(wrong: dict[str, object], wording: Wording) -> None:
    with wording.raises(JsonError) as raised:
        read_record(GOOD | wrong, Outer, "the lamp")
    assert len(str(raised.value)) < 150
    assert str(raised.value).isprintable()
