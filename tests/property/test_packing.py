"""Packed functions against predicates and actions on named states."""

from __future__ import annotations

from itertools import product

from hypothesis import given
from hypothesis import strategies as st

from scbm.closing.advice import is_satisfiable
from scbm.model import Packing, State, StateSpace
from scbm.model.operations import apply
from support.profiles import examples
from support.strategies import actions, predicates, variables


def _states(space: StateSpace) -> list[State]:
    """Every state of a space."""
    choices = product(*(variable.domain.values for variable in space))
    return [State(space, dict(zip(space.names, values, strict=True))) for values in choices]


@given(st.data())
@examples(150)
def test_packing_and_unpacking_are_inverse(data: st.DataObject) -> None:
    space = StateSpace(data.draw(variables()))
    packing = Packing(space)
    states = _states(space)
    packed = [packing.pack(state) for state in states]
    assert [packing.unpack(state) for state in packed] == states
    assert len(set(packed)) == len(states)


@given(st.data())
@examples(300)
def test_a_packed_test_is_the_predicate(data: st.DataObject) -> None:
    space = StateSpace(data.draw(variables()))
    predicate = data.draw(predicates(space.variables, 4))
    packing = Packing(space)
    test = packing.test(predicate)
    mask, bits = packing.cube(predicate)
    for state in _states(space):
        packed = packing.pack(state)
        assert test(packed) == predicate.holds(state)
        assert packed & mask == bits or not predicate.holds(state)


@given(st.data())
@examples(200)
def test_a_packed_update_takes_all_actions_at_once(data: st.DataObject) -> None:
    space = StateSpace(data.draw(variables()))
    chosen = data.draw(actions(space.variables))
    packing = Packing(space)
    update = packing.update(chosen)
    for state in _states(space):
        after = update(packing.pack(state))
        expected = apply(chosen, state)
        assert (None if after is None else packing.unpack(after)) == expected
        if after is not None and expected is not None:
            changed = tuple((name, expected[name]) for name in expected if expected[name] != state[name])
            assert packing.changes(packing.pack(state), after) == changed


@given(st.data())
@examples(300)
def test_a_predicate_is_satisfiable_if_some_state_satisfies_it(data: st.DataObject) -> None:
    space = StateSpace(data.draw(variables()))
    predicate = data.draw(predicates(space.variables, 4))
    assert is_satisfiable(predicate, space) is any(predicate.holds(state) for state in _states(space))
