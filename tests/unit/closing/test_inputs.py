"""What is left of a guard where some variables are known, and which variables are inputs."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.closing.scripts.inputs import inputs, residual
from scbm.files import Scope, parse_predicate, read_model
from scbm.model import BehaviorModel, Value
from support.profiles import examples
from support.strategies import predicates, running_models

TEXT = """
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
    return read_model(TEXT, "doors.yaml")


def test_inputs_are_what_nothing_assigns_or_measures() -> None:
    assert inputs(doors()) == ("door", "level")


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


@examples(200)
@given(running_models(), st.data())
def test_what_is_left_says_the_same_where_the_known_values_are(model: BehaviorModel, data: st.DataObject) -> None:
    predicate = data.draw(predicates(list(model.space)))
    state = {v.name: data.draw(st.sampled_from(v.domain.values)) for v in model.space}
    names = data.draw(st.lists(st.sampled_from(list(state)), unique=True))
    rest = residual(predicate, {name: state[name] for name in names}, model.running_space)
    assert rest.holds(state) == predicate.holds(state)
    assert not any(name in names for name in rest.reads())
