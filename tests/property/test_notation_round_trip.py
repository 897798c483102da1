"""Everything that the notation can say prints back to itself."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from scbm.files import (
    Scope,
    parse_action,
    parse_predicate,
    parse_requirement,
    parse_state,
    read_model,
    write_model,
    write_operation,
)
from scbm.model import BehaviorModel, State, StateSpace
from support.profiles import examples
from support.strategies import actions, open_models, planning_models, predicates, running_models, sentences, variables


@given(st.data())
@examples(300)
def test_predicates(data: st.DataObject) -> None:
    space = data.draw(variables())
    predicate = data.draw(predicates(space, 4))
    again = parse_predicate(str(predicate), Scope.over(space))
    assert again == predicate
    assert hash(again) == hash(predicate)


@given(st.data())
@examples(200)
def test_actions_and_requirements(data: st.DataObject) -> None:
    space = data.draw(variables())
    scope = Scope.over(space)
    for action in data.draw(actions(space)):
        assert parse_action(str(action), scope) == action
    sentence = data.draw(sentences(space))
    assert parse_requirement(str(sentence), scope) == sentence


@given(st.data())
@examples(200)
def test_states(data: st.DataObject) -> None:
    space = StateSpace(data.draw(variables()))
    state = State(space, {v.name: data.draw(st.sampled_from(v.domain.values)) for v in space})
    again = parse_state(str(state), space)
    assert again == state
    assert hash(again) == hash(state)


@given(st.one_of(planning_models(), running_models(), open_models()))
@examples(150)
def test_models(model: BehaviorModel) -> None:
    again = read_model(write_model(model))
    assert again == model
    assert hash(again) == hash(model)
    for operation in model.operations:
        assert write_operation(operation) == write_operation(again.operation(operation.name))
