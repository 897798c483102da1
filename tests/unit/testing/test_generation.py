"""Random cases: each of its own stream of chance, from allowed states only."""

from __future__ import annotations

from collections import Counter

import pytest
from msgspec.structs import replace

from scbm.cases.trace import End
from scbm.model import BehaviorModel, GoalOrder, InputError, RunsDeclaration, Slug
from scbm.testing import RandomCases
from scbm.testing.random_cases import most_goals
from support.models import scan_cell


def _model(*extra: tuple[str, str], more: str = "") -> BehaviorModel:
    return scan_cell(
        ("initial: green}", "initial: green, random: any}"),
        ("count: {domain: 0..2, initial: 0}", "count: {domain: 0..2, initial: 0, random: [0, 2]}"),
        *extra,
        more=more,
    )


def test_a_case_does_not_depend_on_the_cases_before_it() -> None:
    cases = RandomCases(_model())
    listed = list(cases.first(10, seed=4))
    assert [RandomCases(_model()).case(4, number) for number in range(10, 0, -1)] == listed[::-1]
    assert listed[0].name == "seed-4-case-1"


def test_another_seed_gives_other_cases() -> None:
    cases = RandomCases(_model())
    assert [c.initial for c in cases.first(20, 1)] != [c.initial for c in cases.first(20, 2)]


def test_values_and_goals_come_from_what_the_model_lists_alike_often() -> None:
    model = _model(("goals:", "goals:\n  red: light == red"))
    cases = list(RandomCases(model).first(1_200, seed=0))
    states = Counter((case.initial["light"], case.initial["count"]) for case in cases)
    assert set(states) == {(light, count) for light in ("green", "red", "blue") for count in (0, 2)}
    assert min(states.values()) > 140
    assert 500 < Counter(case.goal for case in cases)["red"] < 700
    assert all(case.initial["box_is_scanned"] is False for case in cases)


def test_further_goals_change_neither_the_first_one_nor_the_initial_state() -> None:
    model = _model(("goals:", "goals:\n  red: light == red"))
    short, long = (list(RandomCases(model, goals=goals).first(300, seed=1)) for goals in (1, 3))
    assert [(case.goal, case.initial) for case in short] == [(case.goal, case.initial) for case in long]
    assert all(not case.later for case in short)
    assert min(Counter(len(case.goals) for case in long)[count] for count in (1, 2, 3)) > 70
    assert {goal.name for case in long for goal in case.later} == {name for name, _ in model.goals}
    assert {goal.may_end for case in long for goal in case.later} == {(End.UNSOLVABLE,)}


def test_goals_follow_each_other_unless_runs_are_single() -> None:
    single, sequence = (
        replace(_model(), runs=RunsDeclaration(order)) for order in (GoalOrder.SINGLE, GoalOrder.SEQUENCE)
    )
    assert (most_goals(single), most_goals(sequence)) == (1, 3)


def test_initial_states_satisfy_the_predicate_of_the_model() -> None:
    model = _model(more="initial_states: light == red -> count == 2\n")
    states = Counter((c.initial["light"], c.initial["count"]) for c in RandomCases(model).first(1_000, 0))
    assert ("red", 0) not in states
    assert len(states) == 5


def test_a_predicate_that_hardly_any_state_satisfies_is_met_by_listing() -> None:
    wide = "".join(f"  w{index}: {{domain: 0..9, initial: 0, random: any}}\n" for index in range(4))
    needle = "initial_states: [w0 == 3, w1 == 1, w2 == 4, w3 == 1, light == red]\n"
    model = _model(("variables:\n", "variables:\n" + wide), more=needle)
    state = RandomCases(model).case(0, 1).initial
    assert [state[name] for name in ("w0", "w1", "w2", "w3", "light")] == [3, 1, 4, 1, "red"]


def test_no_allowed_state_is_distinguished_from_none_found() -> None:
    none = _model(more="initial_states: light == red && light == blue\n")
    with pytest.raises(InputError) as raised:
        RandomCases(none, "cell.yaml").case(0, 1)
    assert [d.slug for d in raised.value.diagnostics] == [Slug.NO_INITIAL_STATE]
    assert [d.place.file for d in raised.value.diagnostics] == ["cell.yaml"]
    wide = "".join(f"  w{index}: {{domain: 0..9, initial: 0, random: any}}\n" for index in range(8))
    needle = f"initial_states: [{', '.join(f'w{index} == 7' for index in range(8))}]\n"
    with pytest.raises(InputError) as raised:
        RandomCases(_model(("variables:\n", "variables:\n" + wide), more=needle)).case(0, 1)
    assert [d.slug for d in raised.value.diagnostics] == [Slug.INITIAL_STATE_NOT_FOUND]
