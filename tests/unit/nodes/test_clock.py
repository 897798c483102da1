"""The time of a run: wall time since it began, some times faster, and never a fraction of a nanosecond too early."""

from __future__ import annotations

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.nodes.roles.wall_clock import Clock

SCALES = st.fractions(Fraction(1, 10_000), 10_000, max_denominator=10_000)
TIMES_NS = st.integers(0, 10**18)


@pytest.mark.parametrize(
    ("scale", "wall_ns", "of_run_ns"), [("1", 1_700, 700), ("20", 1_700, 14_000), ("1/2", 1_701, 350)]
)
def test_time_of_a_run_is_wall_time_since_it_began_times_the_scale(scale: str, wall_ns: int, of_run_ns: int) -> None:
    assert Clock(1_000, Fraction(scale)).of_run_ns(wall_ns) == of_run_ns


@given(TIMES_NS, SCALES, TIMES_NS)
def test_what_came_before_the_run_began_came_when_it_began(start_ns: int, scale: Fraction, before_ns: int) -> None:
    assert Clock(start_ns, scale).of_run_ns(start_ns - before_ns) == 0


@given(TIMES_NS, SCALES, st.integers(1, 10**18))
def test_a_time_of_the_run_comes_with_the_first_reading_that_is_not_before_it(
    start_ns: int, scale: Fraction, at_ns: int
) -> None:
    clock = Clock(start_ns, scale)
    wall_ns = clock.wall_ns(at_ns)
    assert clock.of_run_ns(wall_ns) >= at_ns
    assert clock.of_run_ns(wall_ns - 1) < at_ns


@given(TIMES_NS, SCALES, TIMES_NS)
def test_a_duration_lasts_as_long_from_whenever_it_begins(start_ns: int, scale: Fraction, duration_ns: int) -> None:
    assert Clock(start_ns, scale).lasts_ns(duration_ns) == Clock(0, scale).wall_ns(duration_ns)
    assert Clock(start_ns, scale).wall_ns(duration_ns) == start_ns + Clock(0, scale).lasts_ns(duration_ns)


@given(SCALES, TIMES_NS, TIMES_NS)
def test_time_never_runs_backwards(scale: Fraction, one_ns: int, other_ns: int) -> None:
    clock = Clock(0, scale)
    early_ns, late_ns = sorted((one_ns, other_ns))
    assert clock.of_run_ns(early_ns) <= clock.of_run_ns(late_ns)
    assert clock.wall_ns(early_ns) <= clock.wall_ns(late_ns)
