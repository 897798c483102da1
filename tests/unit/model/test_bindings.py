"""Types of fields, ranges of numbers, and what a binding is made of."""

from __future__ import annotations

from math import inf, nan

import pytest

from scbm.model import (
    SET_BOOL,
    TRIGGER,
    Binding,
    FieldType,
    Interval,
    MeasuredTopic,
    MessageType,
    Reading,
    Resource,
    Scalar,
    ServiceCall,
    ServiceChoice,
    TopicPair,
    ValueKind,
)

INTEGERS = {
    FieldType.INT8: (-128, 127),
    FieldType.INT16: (-(2**15), 2**15 - 1),
    FieldType.INT32: (-(2**31), 2**31 - 1),
    FieldType.INT64: (-(2**63), 2**63 - 1),
    FieldType.UINT8: (0, 255),
    FieldType.UINT16: (0, 2**16 - 1),
    FieldType.UINT32: (0, 2**32 - 1),
    FieldType.UINT64: (0, 2**64 - 1),
}
OTHERS = (FieldType.BOOL, FieldType.FLOAT32, FieldType.FLOAT64, FieldType.STRING)


def test_each_type_of_fields_is_looked_at_here() -> None:
    assert {*INTEGERS, *OTHERS} == set(FieldType)


@pytest.mark.parametrize(("kind", "ends"), INTEGERS.items())
def test_a_field_of_whole_numbers_holds_those_of_its_bits_and_nothing_else(
    kind: FieldType, ends: tuple[int, int]
) -> None:
    least, most = ends
    assert (kind.integers[0], kind.integers[-1]) == ends
    assert kind.holds(least)
    assert kind.holds(most)
    assert not kind.holds(least - 1)
    assert not kind.holds(most + 1)
    assert not any(kind.holds(other) for other in (True, False, 1.0, "1"))
    assert kind.kind is ValueKind.INTEGER
    assert kind.is_number
    assert not kind.is_float


@pytest.mark.parametrize(
    ("kind", "held", "others"),
    [
        (FieldType.BOOL, (True, False), (0, 1, 0.0, "true")),
        (FieldType.STRING, ("", "a b"), ("a\0b", 0, True, 0.5)),
        (FieldType.FLOAT32, (0, 0.1, 3.4028234663852886e38, -1), (3.402823466385289e38, inf, -inf, nan, True, "1")),
        (FieldType.FLOAT32, (1e-44, -(2.0**-149)), (1e-60, -(2.0**-151))),
        (FieldType.FLOAT64, (1e-60, 0, 0.1, 1.7976931348623157e308, 10**308), (10**309, inf, -inf, nan, False, "1")),
    ],
)
def test_the_other_types_hold_what_they_say(
    kind: FieldType, held: tuple[Scalar, ...], others: tuple[Scalar, ...]
) -> None:
    assert all(kind.holds(value) for value in held)
    assert not any(kind.holds(value) for value in others)
    assert not list(kind.integers)


def test_the_kinds_of_values_that_types_hold_as_they_are() -> None:
    assert [kind.kind for kind in OTHERS] == [ValueKind.BOOLEAN, None, None, ValueKind.SYMBOL]
    assert [kind.is_number for kind in OTHERS] == [False, True, True, False]
    assert [kind.is_float for kind in OTHERS] == [False, True, True, False]


def test_the_data_of_messages() -> None:
    assert {kind: kind.data for kind in MessageType} == {
        MessageType.BOOL: FieldType.BOOL,
        MessageType.STRING: FieldType.STRING,
        MessageType.INT64: FieldType.INT64,
        MessageType.FLOAT64: FieldType.FLOAT64,
    }


@pytest.mark.parametrize(
    ("interval", "inside", "outside"),
    [
        (Interval(0.5, 2.0), (0.5, 1, 1.9999999999999998), (0.49999999999999994, 2, 2.0, nan, inf, -inf)),
        (Interval(None, 0.5), (-inf, 0), (0.5, nan, inf)),
        (Interval(0.5, None), (inf, 0.5), (-inf, 0, nan)),
        (Interval(None, None), (inf, -inf, 0), (nan,)),
        (Interval(2**53 + 1, None), (2**53 + 1,), (2**53,)),
    ],
)
def test_a_range_begins_with_its_first_end_and_stops_before_the_other(
    interval: Interval, inside: tuple[float, ...], outside: tuple[float, ...]
) -> None:
    assert all(number in interval for number in inside)
    assert not any(number in interval for number in outside)


@pytest.mark.parametrize(
    ("low", "high", "is_empty"), [(1, 1, True), (2, 1, True), (1, 2, False), (None, 0, False), (0, None, False)]
)
def test_a_range_without_numbers_is_empty(low: int | None, high: int | None, is_empty: bool) -> None:  # noqa: FBT001 - what is expected
    assert Interval(low, high).is_empty is is_empty


@pytest.mark.parametrize(
    ("one", "other", "overlaps"),
    [
        ((0, 1), (1, 2), False),
        ((0, 1), (0.5, 2), True),
        ((0, 9), (3, 4), True),
        ((None, 1), (1, None), False),
        ((None, 2), (1, None), True),
        ((None, 0), (None, -5), True),
        ((5, None), (7, None), True),
        ((None, None), (1, 2), True),
    ],
)
def test_ranges_that_have_a_number_in_common_overlap(
    one: tuple[float | None, float | None],
    other: tuple[float | None, float | None],
    overlaps: bool,  # noqa: FBT001 - what is expected
) -> None:
    assert Interval(*one).overlaps(Interval(*other)) is overlaps
    assert Interval(*other).overlaps(Interval(*one)) is overlaps


def test_ranges_print_as_they_are_written() -> None:
    assert [str(Interval(*ends)) for ends in ((0.5, 2), (None, 0.5), (-1, None), (None, None))] == [
        "0.5..2",
        "..0.5",
        "-1..",
        "..",
    ]


def test_a_binding_names_its_services_and_topics() -> None:
    scan, light = ServiceCall("/scan", TRIGGER), ServiceCall("/light", SET_BOOL, (("data", True),))
    lit = MeasuredTopic("/lit", MessageType.BOOL, Reading("lit"))
    one, choice = Binding(scan, (lit,)), Binding(ServiceChoice("command", (("scan", scan), ("light", light))))
    pair = Binding(TopicPair("/request", "/reply"), (lit,))
    assert (one.calls, choice.calls, pair.calls, Binding().calls) == ((scan,), (scan, light), (), ())
    assert list(one.topics()) == [("/lit", MessageType.BOOL)]
    assert list(pair.topics()) == [
        ("/request", MessageType.STRING),
        ("/reply", MessageType.STRING),
        ("/lit", MessageType.BOOL),
    ]
    assert Resource("arm").binding is None
    assert hash(one) == hash(Binding(scan, (lit,)))
