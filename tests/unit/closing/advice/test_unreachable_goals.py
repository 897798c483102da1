"""Why no plan reaches a goal: the conjunct that stays false, from the state that comes nearest."""

from __future__ import annotations

import pytest

from scbm.closing.advice.unreachable_goals import root_of_unreachable, why_unreachable
from scbm.files import read_model
from scbm.planning import Planner
from support.wording import Wording

PLACING = """
behavior_model: placing
variables:
  at: {domain: [home, table], initial: home}
  held: {domain: bool, initial: false}
  lid: {domain: [open, closed], initial: closed, source: SOURCE}
  placed: {domain: bool, initial: false}
operations:
  go: {pre: {g: at == home}, post: {g: true, a: [at <- table]}}
  pick: {pre: {g: at == table && held == false}, post: {g: true, a: [held <- true]}}
  place: {pre: {g: held == true && lid == open}, post: {g: true, a: [placed <- true, held <- false]}}
AUTOMATIC
goals: {placed: placed == true}
"""


@pytest.mark.parametrize(
    ("source", "automatic"),
    [
        ("constant", ""),
        ("input", ""),
        ("state", "automatic_transitions: {opens: {g: held == true, a: [lid <- open]}}"),
    ],
)
def test_the_guard_on_the_way_is_named_that_stays_false(source: str, automatic: str, wording: Wording) -> None:
    model = read_model(PLACING.replace("SOURCE", source).replace("AUTOMATIC", automatic))
    goal, of_place, why = why_unreachable(Planner(model), model.nominal_state, model.goals[0][1])
    assert "placed == true" in goal
    assert of_place.startswith("place needs lid == open, which never holds in any of the 3 states")
    wording([goal, of_place, why])


FILLING = """
behavior_model: filling
variables:
  level: {domain: 0..9, initial: 0}
  tank: {domain: [left, right], initial: left}
  lid: {domain: [open, closed], initial: closed, source: constant}
  drained: {domain: bool, initial: false}
operations:
  fill: {pre: {g: level < 5}, post: {g: true, a: [level += 1]}}
  turn: {pre: {g: tank == left}, post: {g: true, a: [tank <- right]}}
  drain: {pre: {g: true}, post: {g: level > 6 && level != 9, a: [drained <- true]}}
goals:
  high: level >= 8
  not_low: "!(level < 8 || drained == true)"
  either: level == 8 || lid == open
  both: "(level == 8 || lid == open) && tank == right"
  implied: "(tank == right -> level == 8) && tank == right"
  drained: drained == true
"""


@pytest.mark.parametrize("goal", ["high", "not_low", "either", "both", "implied", "drained"])
def test_the_nearest_state_counts_numbers_and_alternatives(goal: str, wording: Wording) -> None:
    model = read_model(FILLING)
    found = why_unreachable(Planner(model), model.nominal_state, dict(model.goals)[goal])
    assert any("level == 5" in line for line in found)
    assert any("fill would change level, but needs level < 5" in line for line in found)
    wording(found)


@pytest.mark.parametrize("goal", ["false", "!true", "true && false"])
def test_a_goal_that_reads_no_variable_has_no_nearest_state(goal: str) -> None:
    model = read_model(f'{FILLING}  nothing: "{goal}"\n')
    (why,) = why_unreachable(Planner(model), model.nominal_state, dict(model.goals)["nothing"])
    assert why.startswith("the goal needs ")
    assert why.endswith(" states")


STOPPING = """
behavior_model: stopping
variables:
  n: {domain: 0..10, initial: 0}
  m: {domain: 0..10, initial: 0}
operations:
  count: {pre: {g: n < 5}, post: {g: true, a: [n += 1]}}
  up: {pre: {g: m < 10 && n == 9}, post: {g: true, a: [m += 1]}}
  down: {pre: {g: m > 0 && n == 9}, post: {g: true, a: [m -= 1]}}
  copy: {pre: {g: n == 8}, post: {g: true, a: [n <- m]}}
goals: {far: n > m + 5}
"""


@pytest.mark.parametrize("goal", ["n > m + 5", "n - m >= 6", "n - m == 6"])
def test_an_operation_that_moves_away_from_the_goal_is_not_named(goal: str) -> None:
    model = read_model(STOPPING.replace("n > m + 5", goal))
    words = "; ".join(why_unreachable(Planner(model), model.nominal_state, model.goals[0][1]))
    assert words.endswith("needs n < 5")
    assert "up" not in words
    assert "down" not in words
    assert "copy" not in words


def test_an_operation_that_copies_another_variable_is_named() -> None:
    model = read_model(STOPPING.replace("n > m + 5", "n == 7"))
    words = "; ".join(why_unreachable(Planner(model), model.nominal_state, model.goals[0][1]))
    assert "copy needs n == 8" in words


def test_an_operation_that_moves_away_is_named_if_no_other_assigns_the_variable() -> None:
    model = read_model(STOPPING.replace("n += 1", "m += 1").replace("n < 5", "m == 0 && n == 1"))
    words = why_unreachable(Planner(model), model.nominal_state, model.goals[0][1])
    assert not any("no operation makes" in line for line in words)


MEASURED = """
behavior_model: belt
variables:
  item: {domain: [none, box], initial: none}
  packed: {domain: bool, initial: false}
resources: {eye: {measures: [item]}}
operations:
  look: {request: eye, guard: item == none, deadline: 2 s}
  pack: {pre: {g: item == box}, post: {g: true, a: [packed <- true]}}
goals: {packed: packed == true}
"""


def test_a_value_that_only_a_resource_measures_is_the_root_of_what_plans_cannot_do(wording: Wording) -> None:
    model = read_model(MEASURED)
    root = root_of_unreachable(Planner(model), model.nominal_state, model.goals[0][1])
    assert root is not None
    wording(root)
    assert root == why_unreachable(Planner(model), model.nominal_state, model.goals[0][1])[-1]
