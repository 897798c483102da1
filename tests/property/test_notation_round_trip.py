"""Everything that the notation can say prints back to itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

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
from scbm.model import (
    And,
    BehaviorModel,
    Equal,
    Extreme,
    Implies,
    Not,
    NotEqual,
    Or,
    Order,
    State,
    StateSpace,
    Sum,
)
from support.profiles import examples
from support.strategies import actions, open_models, planning_models, predicates, running_models, sentences, variables

if TYPE_CHECKING:
    from scbm.model import Predicate
    from scbm.model.predicates import Term


@given(st.data())
@examples(300, usual=15)
def test_predicates(data: st.DataObject) -> None:
    space = data.draw(variables())
    predicate = data.draw(predicates(space, 4))
    again = parse_predicate(str(predicate), Scope.over(space))
    assert again == predicate
    assert hash(again) == hash(predicate)


@given(st.data())
@examples(200, usual=10)
def test_predicates_with_brackets_around_terms(data: st.DataObject) -> None:
    space = data.draw(variables())
    predicate = data.draw(predicates(space, 3))
    assert parse_predicate(bracketed(predicate, data), Scope.over(space)) == predicate


def bracketed(part: Predicate | Term, data: st.DataObject) -> str:
    """The text of a predicate or a term, in which each of its parts can have brackets that mean nothing."""
    brackets = data.draw(st.integers(0, 2))
    match part:
        case Equal() | NotEqual() | Order():
            symbol = part.relation if isinstance(part, Order) else "==" if isinstance(part, Equal) else "!="
            text = f"{bracketed(part.left, data)} {symbol} {bracketed(part.right, data)}"
        case Sum():
            (_, first), *others = part.parts
            signs = ((" + " if sign > 0 else " - ") + operand(term, data) for sign, term in others)
            text = operand(first, data) + "".join(signs)
        case Extreme():
            text = f"{part.kind}({', '.join(bracketed(term, data) for term in part.terms)})"
        case Not():
            text = f"!({bracketed(part.operand, data)})"
        case And() | Or():
            symbol = " && " if isinstance(part, And) else " || "
            text = symbol.join(f"({bracketed(each, data)})" for each in part.operands)
        case Implies():
            text = f"({bracketed(part.condition, data)}) -> ({bracketed(part.consequence, data)})"
        case _:
            text = str(part)
    return "(" * brackets + text + ")" * brackets


def operand(term: Term, data: st.DataObject) -> str:
    text = bracketed(term, data)
    return f"({text})" if isinstance(term, Sum) else text


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
@examples(150, usual=6)
def test_models(model: BehaviorModel) -> None:
    again = read_model(write_model(model))
    assert again == model
    assert hash(again) == hash(model)
    for operation in model.operations:
        assert write_operation(operation) == write_operation(again.operation(operation.name))
