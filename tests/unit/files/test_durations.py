"""Durations: a number and a unit, exact to the nanosecond."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.files import parse_duration
from scbm.files.language.quantities import DURATION_PATTERN
from scbm.model import format_duration

SECOND_NS = 1_000_000_000

DURATIONS = {
    "1 h": 3600 * SECOND_NS,
    "2 hours": 7200 * SECOND_NS,
    "1 hour": 3600 * SECOND_NS,
    "1.5 h": 5400 * SECOND_NS,
    "1 min": 60 * SECOND_NS,
    "90 minutes": 5400 * SECOND_NS,
    "1 minute": 60 * SECOND_NS,
    "10 s": 10 * SECOND_NS,
    "10 sec": 10 * SECOND_NS,
    "1 second": SECOND_NS,
    "10 seconds": 10 * SECOND_NS,
    "10s": 10 * SECOND_NS,
    "010 s": 10 * SECOND_NS,
    "0 s": 0,
    "0.1 s": 100_000_000,
    "0.000000001 s": 1,
    "500 ms": 500_000_000,
    "1 millisecond": 1_000_000,
    "2.5 milliseconds": 2_500_000,
    "3 us": 3_000,
    "3 µs": 3_000,
    "1 microsecond": 1_000,
    "4 microseconds": 4_000,
    "5 ns": 5,
    "1 nanosecond": 1,
    "6 nanoseconds": 6,
    "999999999999999 h": 999_999_999_999_999 * 3600 * SECOND_NS,
}

NO_DURATIONS = [
    "",
    "s",
    "10",
    "1.5",
    "ten s",
    "-1 s",
    "+1 s",
    "1. s",
    ".5 s",
    "1e3 s",
    "1_000 s",
    "1,5 s",
    "1 s 500 ms",
    "10 parsecs",
    "10 secs",
    "10 S",
    "10 MS",
    "2 Minutes",
    "10 m",
    "10 d",
    "10 s.",
    "10 %",
    "1:30",
    "0.5 ns",
    "0.0000000001 s",
    "1" * 16 + " s",
    "٣ s",
    "10 s\N{ZERO WIDTH SPACE}",
]


@pytest.mark.parametrize(("text", "duration_ns"), DURATIONS.items())
def test_a_number_with_a_unit_is_a_duration(text: str, duration_ns: int) -> None:
    assert parse_duration(text) == duration_ns


@pytest.mark.parametrize("text", NO_DURATIONS)
def test_anything_else_is_no_duration(text: str) -> None:
    assert parse_duration(text) is None


@pytest.mark.parametrize("text", DURATIONS)
def test_blanks_around_a_duration_do_not_matter(text: str) -> None:
    assert parse_duration(f"  {text}\n") == DURATIONS[text]


@pytest.mark.parametrize("text", DURATIONS)
def test_the_pattern_for_editors_takes_what_the_loader_takes(text: str) -> None:
    assert re.search(DURATION_PATTERN, text)


@pytest.mark.parametrize("text", NO_DURATIONS)
def test_the_pattern_for_editors_takes_nothing_else_but_fractions_of_nanoseconds_and_long_numbers(text: str) -> None:
    taken = re.search(DURATION_PATTERN, text, re.ASCII) is not None
    assert taken == (text in {"0.5 ns", "0.0000000001 s", "1" * 16 + " s"})


@given(st.integers(0, 10**24))
def test_a_duration_that_is_written_is_read_as_the_same(duration_ns: int) -> None:
    text = format_duration(duration_ns)
    expected = duration_ns if len(text.split()[0].partition(".")[0]) <= 15 else None
    assert parse_duration(text) == expected
