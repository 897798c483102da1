"""What nodes say comes back as it was; whatever else comes is refused with a reason, and does no harm."""

from __future__ import annotations

import json
from fractions import Fraction
from typing import Any, get_args, get_origin, get_type_hints

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.model import Outcome
from scbm.model.json_reader import JsonError
from scbm.nodes.buses.bus import UnmatchedKind
from scbm.nodes.node_messages import (
    Abandon,
    Become,
    Go,
    Message,
    React,
    Trouble,
    decode,
    encode,
    read_object,
)
from scbm.running import PlanAnswered, PlanStatus, TimePassed
from scbm.running.simulation import MessageKind
from scbm.testing.event_logs.event_records import MessageRecord, event_record
from scbm.testing.real_drivers import GoalFate
from support.event_records import OPTIONS
from support.profiles import examples
from support.strings import CHARACTERS
from support.wording import Wording

TEXTS = st.text(CHARACTERS, max_size=20)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | TEXTS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXTS, inner, max_size=3),
    max_leaves=8,
)
KINDS = get_args(Message)
NUMBERS = st.integers(1, 10**18 - 1)
FRACTIONS = st.builds(Fraction, NUMBERS, NUMBERS).map(str)
VALUES = st.dictionaries(TEXTS, st.booleans() | st.integers(-(2**63), 2**63 - 1) | TEXTS, max_size=3)
EVENTS = st.sampled_from([event_record(TimePassed()), event_record(PlanAnswered(3, PlanStatus.SOLVED, ("scan",)))])
NOTES = st.builds(MessageRecord, st.integers(0, 9), TEXTS, st.sampled_from(MessageKind), st.integers(0, 3))

FIELDS = {
    "outcome": st.sampled_from([outcome.value for outcome in Outcome]),
    "factor": FRACTIONS,
    "time_scale": FRACTIONS,
    "measured": st.none() | VALUES,
    "options": st.just(OPTIONS),
    "event": EVENTS,
    "note": NOTES,
    "troubles": st.lists(
        st.builds(Trouble, st.sampled_from([kind.value for kind in UnmatchedKind]), TEXTS), max_size=3
    ).map(tuple),
    "fate": st.sampled_from([fate.value for fate in GoalFate]),
}
"""Fields whose types have more limits than those of others."""


def _values(type_: Any) -> st.SearchStrategy[Any]:  # noqa: ANN401 - a type, whatever it is
    if get_origin(type_) is tuple:
        return st.lists(_values(get_args(type_)[0]), max_size=3).map(tuple)
    return {str: TEXTS, int: st.integers(0, 2**63 - 1), bool: st.booleans()}[type_]


def messages(kind: Any = None) -> st.SearchStrategy[Any]:  # noqa: ANN401 - a class of messages
    if kind is None:
        return st.one_of([messages(known) for known in KINDS])
    types = get_type_hints(kind)
    return st.builds(
        kind, *[FIELDS[name] if name in FIELDS else _values(types[name]) for name in kind.__struct_fields__]
    )


def _name(kind: Any) -> str:  # noqa: ANN401 - a class of messages
    return str(kind.__struct_config__.tag)


@pytest.mark.parametrize("kind", KINDS, ids=_name)
def test_messages_of_every_kind_come_back_as_they_were(kind: Any) -> None:  # noqa: ANN401 - a class of messages
    @given(messages(kind))
    @examples(100, usual=5)
    def comes_back(message: Message) -> None:
        again = decode(encode(message))
        assert type(again) is type(message)
        assert again == message

    comes_back()


def test_no_two_kinds_have_one_name() -> None:
    assert len(set(map(_name, KINDS))) == len(KINDS)


def test_what_is_sent_is_json_that_a_person_can_read() -> None:
    assert encode(Go("run_1")) == '{"kind":"go","run":"run_1"}'
    assert json.loads(encode(Abandon("läuft"))) == {"kind": "abandon", "run": "läuft"}
    assert "läuft" in encode(Abandon("läuft"))


@given(st.one_of(JSON.map(json.dumps), TEXTS, st.binary(), JSON))
def test_anything_else_is_refused(data: object) -> None:
    with pytest.raises(JsonError):
        decode(data)


@given(messages(), st.data())
def test_a_message_with_a_field_of_another_sort_is_refused(message: Message, data: st.DataObject) -> None:
    document = json.loads(encode(message))
    name = data.draw(st.sampled_from([name for name in document if name != "kind"]))
    other = data.draw(JSON.filter(lambda value: _sort(value) != _sort(document[name])))
    if message.kind == "react" and name == "measured" and (other is None or isinstance(other, dict)):
        return  # either will do
    with pytest.raises(JsonError, match=rf"`{name}\b.*` of `{message.kind}`: "):
        decode(json.dumps({**document, name: other}))


def _sort(value: object) -> str:
    return type(value).__name__


@given(messages(), st.data())
def test_a_message_with_a_field_too_few_or_too_many_is_refused(message: Message, data: st.DataObject) -> None:
    document = json.loads(encode(message))
    name = data.draw(st.sampled_from([name for name in document if name != "kind"]))
    fewer = {key: value for key, value in document.items() if key != name}
    for wrong, field in ((fewer, name), ({**document, "more": 1}, "more")):
        with pytest.raises(JsonError, match=rf"`{message.kind}`: .* `{field}`"):
            decode(json.dumps(wrong))


@pytest.mark.parametrize(
    "wrong",
    [
        b"{}",
        None,
        "",
        "{",
        "[" * 1_000_000,
        '{"kind": ' * 500_000,
        "[]",
        "1" * 100_000,
        "{}",
        '{"kind": ["go"], "run": "x"}',
        json.dumps({"kind": "k" * 1_000}),
        '{"kind": "go", "run": "\\ud800"}',
        '{"kind": "go", "\\udfff": ""}',
        json.dumps({"kind": "go", "run": "x" * 8_000_000}),
    ],
    ids=lambda wrong: ascii(wrong)[:40],
)
def test_what_is_malformed_huge_or_deep_is_refused_with_a_reason(wrong: object, wording: Wording) -> None:
    with wording.raises(JsonError) as reported:
        decode(wrong)
    assert len(str(reported.value)) < 200


def test_what_is_as_deep_as_just_can_be_read_is_refused_as_well() -> None:
    for depth in range(800, 1_000):
        with pytest.raises(JsonError):
            decode(f'{{"kind": "\\u00e4", "deep": {"[" * depth}{"]" * depth}}}')


@pytest.mark.parametrize("latency", [-1, 2**63, 10**400, 1.0, True, "1", None])
def test_numbers_are_counts_that_clocks_can_take(latency: object, wording: Wording) -> None:
    document = json.loads(encode(React("run", 1, "scanner", "succeed", 1, None, (0,))))
    with wording.raises(JsonError):
        decode(json.dumps({**document, "latency_ns": latency}))
    with wording.raises(JsonError):
        decode(json.dumps({**document, "copies": [0, latency]}))


@pytest.mark.parametrize(
    "wrong", ["", "0", "-1", "1/0", "0/1", "1e9", "1e999999999", "nan", "1.5", " 1", "1 ", "1/", "¹", "1" * 30]
)
def test_what_is_no_fraction_greater_than_zero_is_refused(wrong: str, wording: Wording) -> None:
    document = json.loads(encode(Become("run", "scanner", "slower", "2")))
    with wording.raises(JsonError):
        decode(json.dumps({**document, "factor": wrong}))


def test_an_object_is_read_as_it_is() -> None:
    assert read_object('{"a": [1, {"ä": null}], "b": "\\u00e4"}') == {"a": [1, {"ä": None}], "b": "ä"}
