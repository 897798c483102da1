"""Which change of state disables an operation, what is left of a guard with known variables, and what inputs are."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.closing.scripts.closing_injections import HOLD_NS, changes_that_disable, injection, residual
from scbm.files import Scope, parse_predicate, read_model
from scbm.model import BehaviorModel, State, Value
from scbm.testing import RandomCases
from support.profiles import examples
from support.strategies import predicates, running_models

LIFT = """
behavior_model: lift
variables:
  level: {domain: 0..2, initial: 0}
  left: {domain: bool, initial: true}
  right: {domain: bool, initial: true}
  colour: {domain: [red, green], initial: red}
resources:
  motor: {}
operations:
  up:
    pre: {g: motor_req_state == initial && (left == true || right == true), a: [level += 1]}
    post: {g: true}
goals:
  top: level == 2
"""


def lift() -> tuple[BehaviorModel, State]:
    model = read_model(LIFT, "lift.yaml")
    return model, State(model.running_space, {v.name: v.initial for v in model.running_space})


def test_a_resource_in_use_comes_first_and_the_goal_is_not_reached_by_force() -> None:
    model, state = lift()
    changes = list(changes_that_disable(model, model.operation("up"), state, model.goals[0][1]))
    assert changes[0] == {"motor_req_state": "executing"}
    assert {"level": 2} not in changes  # the goal would be reached
    assert {"left": False, "right": False} in changes


def test_a_change_is_never_larger_than_needed() -> None:
    model, state = lift()
    changes = list(changes_that_disable(model, model.operation("up"), state, model.goals[0][1]))
    assert not any(a.items() < b.items() for a in changes for b in changes)
    assert all("colour" not in change for change in changes)


def test_an_injection_waits_for_the_head_of_the_queue_and_is_put_back() -> None:
    model, _ = lift()
    case = RandomCases(model, "lift.yaml").case(0, 1)
    injected = injection(case, "up", {"motor_req_state": "executing"})
    assert str(injected.when) == "current.name == up"
    assert injected.hold_ns == HOLD_NS
    assert injected.name == "up_waits"


DOORS = """
behavior_model: doors
variables:
  door: {domain: [open, closed], initial: closed}
  level: {domain: 0..3, initial: 0}
  weight: {domain: 0..5, initial: 0}
  moved: {domain: bool, initial: false}
resources:
  scale: {measures: [weight]}
operations:
  move:
    pre: {g: door == closed}
    post: {g: level < weight, a: [moved <- true]}
goals:
  moved: moved == true
"""


def doors() -> BehaviorModel:
    return read_model(DOORS, "doors.yaml")


@pytest.mark.parametrize(
    ("predicate", "left"),
    [
        ("door == open && moved == true", "moved == true"),
        ("door == closed && moved == true", "false"),
        ("door == open || moved == true", "true"),
        ("!(door == open) || moved == true", "moved == true"),
        ("door == open -> moved == true", "moved == true"),
        ("door in {open} && level == 2", "true"),
        ("level == weight", "weight == 2"),
        ("level < weight", "weight in {3, 4, 5}"),
        ("moved == true", "moved == true"),
        ("level >= weight", "weight in {0, 1, 2}"),
    ],
)
def test_what_is_left_of_a_predicate(predicate: str, left: str) -> None:
    model = doors()
    known: dict[str, Value] = {"door": "open", "level": 2}
    assert str(residual(parse_predicate(predicate, Scope.of(model)), known, model.running_space)) == left


@examples(200, usual=8)
@given(running_models(), st.data())
def test_what_is_left_says_the_same_where_the_known_values_are(model: BehaviorModel, data: st.DataObject) -> None:
    predicate = data.draw(predicates(list(model.space)))
    state = {v.name: data.draw(st.sampled_from(v.domain.values)) for v in model.space}
    names = data.draw(st.lists(st.sampled_from(list(state)), unique=True))
    rest = residual(predicate, {name: state[name] for name in names}, model.running_space)
    assert rest.holds(state) == predicate.holds(state)
    assert not any(name in names for name in rest.reads())
