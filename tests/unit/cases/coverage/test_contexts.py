"""Who visits what, compared with asking case by case."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from scbm.cases.coverage import Coverage, Obligations, bits_of, only_by, visitors_of_each
from support.models import scan_cell

OBLIGATIONS = Obligations.of(scan_cell())
COVERAGE = st.lists(st.integers(0, (1 << len(OBLIGATIONS.all)) - 1), max_size=8).map(
    lambda visited: Coverage(OBLIGATIONS, tuple((f"case{place}", bits) for place, bits in enumerate(visited)))
)


def test_bits_come_from_the_lowest_on() -> None:
    assert list(bits_of(0)) == []
    assert list(bits_of(0b1010_0001)) == [0, 5, 7]


@given(COVERAGE)
def test_visitors_of_each_are_the_visitors_of_one(coverage: Coverage) -> None:
    names = [name for name, _ in coverage.cases]
    for obligation, places in zip(OBLIGATIONS, visitors_of_each(coverage), strict=True):
        assert [names[place] for place in places] == list(coverage.visitors(obligation))


@given(COVERAGE)
def test_a_case_alone_visits_what_has_no_other_visitor(coverage: Coverage) -> None:
    for (name, _), alone in zip(coverage.cases, only_by(coverage), strict=True):
        expected = [str(each) for each in OBLIGATIONS if list(coverage.visitors(each)) == [name]]
        assert list(OBLIGATIONS.names(alone)) == expected
