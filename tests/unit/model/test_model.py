"""Values, domains and states: immutable, hashable, strict about kinds."""

from __future__ import annotations

import pytest

from scbm.model import (
    Constant,
    Domain,
    Equal,
    InitialStates,
    Reference,
    State,
    StateSpace,
    ValueKind,
    Variable,
    format_duration,
)
from support.models import scan_cell
from support.wording import Wording


def test_booleans_and_integers_are_different_values_though_python_thinks_otherwise() -> None:
    assert Constant(True) != Constant(1)
    assert hash(Constant(True)) != hash(Constant(1))
    assert Equal(Reference("a"), Constant(False)) != Equal(Reference("a"), Constant(0))
    assert Domain.boolean() != Domain.integers(0, 1)
    assert 1 not in Domain.boolean()
    assert True not in Domain.integers(0, 1)
    assert "1" not in Domain.integers(0, 1)


def test_domains_print_as_they_are_written() -> None:
    assert [str(d) for d in (Domain.boolean(), Domain.integers(-2, 5), Domain.symbols("a", "b"))] == [
        "bool",
        "-2..5",
        "[a, b]",
    ]
    kinds = [domain.kind for domain in (Domain.boolean(), Domain.integers(0, 0), Domain.symbols("a"))]
    assert kinds == [ValueKind.BOOLEAN, ValueKind.INTEGER, ValueKind.SYMBOL]


@pytest.mark.parametrize(
    ("nanoseconds", "text"),
    [
        (0, "0 s"),
        (10**10, "10 s"),
        (1_500_000_000, "1.5 s"),
        (200_000_000, "200 ms"),
        (999_999_999, "999.999999 ms"),
        (1_275_000_000, "1.275 s"),
        (7, "7 ns"),
        (9_999, "9.999 us"),
        (60 * 10**9, "1 min"),
        (90 * 60 * 10**9, "90 min"),
        (90_500_000_000, "90.5 s"),
        (100_000 * 10**9, "100000 s"),
        (523_123_000, "523.123 ms"),
        (3_543_407_000, "3.543407 s"),
        (10_001, "10.001 us"),
        (12_345_000_000, "12.345 s"),
        (7_200_000_001_000, "7200.000001 s"),
    ],
)
def test_durations_print_in_the_largest_unit_in_which_they_are_at_least_1(nanoseconds: int, text: str) -> None:
    assert format_duration(nanoseconds) == text


SPACE = StateSpace(
    [
        Variable("light", Domain.symbols("green", "red"), "green", ("green",)),
        Variable("count", Domain.integers(0, 2), 0, (0,)),
    ]
)


def test_a_state_is_a_hashable_mapping_that_never_changes() -> None:
    state = State(SPACE, {"count": 1, "light": "red"})
    assert dict(state) == {"light": "red", "count": 1}
    assert state.replace({"count": 2})["count"] == 2
    assert state["count"] == 1
    assert {state: "found"}[State(SPACE, {"light": "red", "count": 1})] == "found"
    assert str(state) == "light=red, count=1"
    with pytest.raises(AttributeError):
        SPACE.variables[0].name = "other"  # type: ignore[misc] # that is the point


@pytest.mark.parametrize(
    "values",
    [
        {"light": "red"},
        {"light": "red", "count": 1, "extra": 1},
        {"light": "red", "count": 3},
        {"light": "red", "count": True},
    ],
)
def test_a_state_has_one_value_of_its_domain_for_each_variable(
    values: dict[str, bool | int | str], wording: Wording
) -> None:
    with wording.raises(ValueError):
        State(SPACE, values)


def test_initial_states_are_numbered_with_the_last_variable_running_fastest() -> None:
    model = scan_cell(
        ("initial: green}", "initial: green, random: [blue, red]}"),
        ("count: {domain: 0..2, initial: 0}", "count: {domain: 0..2, initial: 0, random: any}"),
        more='initial_states: "!(light == red && count == 1)"\n',
    )
    states = InitialStates(model)
    drawn = [(state["light"], state["count"]) for state in states.allowed(100)]
    assert states.combinations == 6
    assert drawn == [("blue", 0), ("blue", 1), ("blue", 2), ("red", 0), ("red", 2)]
    assert len(list(states.allowed(2))) == 2
