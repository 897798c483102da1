"""Packed functions against predicates and actions on named states."""

from __future__ import annotations

from itertools import combinations, product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.model import And, Domain, NotEqual, Packing, Reference, State, StateSpace, Variable
from scbm.model.normal_form import bits_of, normal_form
from scbm.model.operations import apply
from scbm.model.satisfiability import is_satisfiable, satisfiable
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
@examples(300, usual=12)
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
@examples(300, usual=20)
def test_a_predicate_is_satisfiable_if_some_state_satisfies_it(data: st.DataObject) -> None:
    space = StateSpace(data.draw(variables()))
    predicate = data.draw(predicates(space.variables, 4))
    assert is_satisfiable(predicate, space) is any(predicate.holds(state) for state in _states(space))


@given(st.data())
@examples(300, usual=20)
def test_satisfiability_within_sets_of_values_is_that_of_the_states_made_of_them(data: st.DataObject) -> None:
    space = StateSpace(data.draw(variables()))
    predicate = data.draw(predicates(space.variables, 4))
    kept = [data.draw(st.lists(st.sampled_from(variable.domain.values), max_size=3)) for variable in space]
    bits = [bits_of(map(variable.domain.index, values)) for variable, values in zip(space, kept, strict=True)]
    states = (dict(zip(space.names, values, strict=True)) for values in product(*kept))
    expected = any(predicate.holds(state) for state in states)
    if all(bits):
        assert satisfiable(normal_form(predicate, space), bits) is expected


@pytest.mark.slow
def test_a_search_with_too_many_branches_has_no_answer() -> None:
    pigeons = [Variable(f"p{number}", Domain.integers(0, 8), 0, (0,)) for number in range(10)]
    apart = [NotEqual(Reference(one.name), Reference(other.name)) for one, other in combinations(pigeons, 2)]
    assert is_satisfiable(And(tuple(apart)), StateSpace(pigeons)) is None
    assert is_satisfiable(And(tuple(apart[:9])), StateSpace(pigeons)) is True
