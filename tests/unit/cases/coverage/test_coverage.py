"""Obligations, figures, and coverage that adds up by union (semantics 8)."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from scbm.cases.coverage import Aspect, Coverage, Figure, Obligation, Obligations, Unnamed, visited_by
from scbm.cases.trace import AutomaticTaken, OperationStepped, PlanReceived, Record
from scbm.model import OperationState
from support.models import scan_cell
from support.wording import Wording

OBLIGATIONS = Obligations.of(scan_cell())
BITS = st.integers(0, (1 << len(OBLIGATIONS.all)) - 1)
COVERAGE = st.dictionaries(st.sampled_from("abcde"), BITS).map(
    lambda cases: Coverage(OBLIGATIONS, tuple(cases.items()))
)


def test_a_model_has_five_obligations_for_each_operation_and_one_for_each_automatic_transition() -> None:
    names = OBLIGATIONS.names(OBLIGATIONS.counted)
    assert names == (
        "scan_box/disabled",
        "scan_box/executing",
        "scan_box/failed",
        "scan_box/timedout",
        "scan_box/completed",
        "automatic/scan_failed",
    )
    assert OBLIGATIONS.names(OBLIGATIONS.mask(Aspect.QUEUED)) == ("scan_box/queued",)


def test_records_visit_what_they_show() -> None:
    initial, executing, completed = OperationState.INITIAL, OperationState.EXECUTING, OperationState.COMPLETED
    records: list[Record] = [
        PlanReceived(0, 1, "solved", ("scan_box",), ()),
        OperationStepped(0, "scan_box", initial, executing, None, ()),
        AutomaticTaken(1, "scan_failed", "scan_box", ()),
        OperationStepped(2, "scan_box", completed, initial, None, ()),
        OperationStepped(3, "not_of_this_model", initial, executing, None, ()),
    ]
    assert OBLIGATIONS.names(visited_by(records, OBLIGATIONS)) == (
        "scan_box/executing",
        "scan_box/failed",
        "automatic/scan_failed",
        "scan_box/queued",
    )


def test_queued_is_beside_the_figure() -> None:
    queued = OBLIGATIONS.bit(Obligation("scan_box", Aspect.QUEUED))
    coverage = Coverage(OBLIGATIONS, (("case", queued),))
    assert coverage.figure == Figure(0, 6)
    assert coverage.figure_of(Aspect.QUEUED) == Figure(1, 1)
    assert coverage.missed(Aspect.QUEUED) == ()
    assert len(coverage.missed()) == 6


def test_cases_that_are_only_counted_are_cases_too() -> None:
    disabled, executing = (OBLIGATIONS.bit_of("scan_box", aspect) for aspect in (Aspect.DISABLED, Aspect.EXECUTING))
    first = Coverage(OBLIGATIONS, (("a", disabled),), Unnamed(3, (2, 0)))
    both = first + Coverage(OBLIGATIONS, (("b", disabled | executing),), Unnamed(4, (1, 4)))
    assert (first.count, both.count) == (4, 9)
    assert [both.visits()[obligation] for obligation in OBLIGATIONS][:3] == [5, 5, 0]
    assert Coverage(OBLIGATIONS, (), Unnamed(2)).count == 2  # they visited nothing


def test_the_first_visitor_is_the_case_that_was_run_first() -> None:
    executing = Obligation("scan_box", Aspect.EXECUTING)
    bit = OBLIGATIONS.bit(executing)
    coverage = Coverage(OBLIGATIONS, (("none", 0), ("first", bit), ("second", bit)))
    assert coverage.first_visitor(executing) == "first"
    assert list(coverage.visitors(executing)) == ["first", "second"]
    assert coverage.first_visitor(Obligation("scan_box", Aspect.FAILED)) is None


@given(COVERAGE, COVERAGE, COVERAGE)
def test_adding_is_associative_commutative_and_idempotent(one: Coverage, two: Coverage, three: Coverage) -> None:
    assert (one + two) + three == one + (two + three)
    assert one + one == one
    assert dict((one + two).cases) == dict((two + one).cases)
    assert (one + two).visited == (two + one).visited == one.visited | two.visited
    assert (one + two).figure == (two + one).figure


def test_coverage_of_different_models_does_not_add_up(wording: Wording) -> None:
    other = Obligations.of(scan_cell(("scan_box:", "scan_crate:")))
    with wording.raises(ValueError):
        _ = Coverage(OBLIGATIONS) + Coverage(other)


@given(st.integers(1, 10**7).flatmap(lambda of: st.tuples(st.integers(0, of), st.just(of))))
def test_a_figure_never_rounds_up_to_all_or_down_to_nothing(pair: tuple[int, int]) -> None:
    figure = Figure(*pair)
    assert figure.percent is not None
    assert (figure.percent == 100) == (figure.visited == figure.of)
    assert (figure.percent == 0) == (figure.visited == 0)
    assert abs(figure.percent - 100 * figure.visited / figure.of) <= 0.01


def test_the_figure_of_the_paper(wording: Wording) -> None:
    assert str(Figure(36, 86)) == "41.86 %"
    assert str(Figure(99_999, 100_000)) == "99.99 %"
    assert str(Figure(1, 100_000)) == "0.01 %"
    wording(Figure(0, 0))
    assert Figure(0, 0).percent is None


@given(st.lists(BITS, max_size=3), st.lists(st.integers(0, 2), max_size=9))
def test_visits_count_the_visitors_also_where_cases_visit_alike(kinds: list[int], choices: list[int]) -> None:
    visited = [kinds[choice] for choice in choices if choice < len(kinds)]
    coverage = Coverage(OBLIGATIONS, tuple((f"case-{number}", bits) for number, bits in enumerate(visited)))
    assert coverage.visits() == {each: len(list(coverage.visitors(each))) for each in OBLIGATIONS}
