"""Which conjuncts are blamed, and which transitions go first."""

from __future__ import annotations

import pytest

from scbm.closing.proofs.blame import blame, shadowing
from scbm.files import read_model
from scbm.model import And, Constant, Equal, Predicate, Reference, Truth, Value
from scbm.model.predicates import conjuncts

WORLD = """
behavior_model: world
variables:
  light: {domain: [green, red, blue], initial: green}
  count: {domain: 0..2, initial: 0}
  done: {domain: bool, initial: false}
operations:
  work: {pre: {g: true}, post: {g: true}}
automatic_transitions:
  first: {g: light == red, a: [light <- green]}
  second: {g: count == 1, a: [count += 1]}
  third: {g: light != green || count == 2, a: [done <- true]}
  fails: {g: light == blue, a: [work.state <- failed]}
  last: {g: light == blue, a: [light <- green]}
  adds: {g: true, a: [count += 1]}
"""
MODEL = read_model(WORLD)


def _is(name: str, value: Value) -> Predicate:
    return Equal(Reference(name), Constant(value))


def _state(**values: Value) -> dict[str, Value]:
    return {variable.name: variable.initial for variable in MODEL.running_space} | values


RED, BLUE, ONE, DONE = _is("light", "red"), _is("light", "blue"), _is("count", 1), _is("done", True)


def test_conjunctions_are_taken_apart_and_nothing_else_is() -> None:
    assert conjuncts(And((RED, And((ONE, DONE))))) == (RED, ONE, DONE)
    assert conjuncts(ONE) == (ONE,)
    assert conjuncts(Truth(True)) == (Truth(True),)


@pytest.mark.parametrize(
    ("predicates", "states", "blamed"),
    [
        ((RED, ONE), [_state(light="red", count=1)], ()),
        ((And((RED, ONE)), DONE), [_state(light="red", done=True)], (ONE,)),
        ((RED, ONE, DONE), [_state(light="red", count=1), _state(done=True, light="red")], (ONE, DONE)),
        ((RED, ONE, DONE), [_state(count=1, done=True), _state(light="red")], (RED, DONE)),
        ((RED, BLUE), [_state(light="red"), _state(light="blue")], (RED, BLUE)),
        ((RED, RED, Truth(False)), [_state(light="red")], (Truth(False),)),
    ],
)
def test_few_conjuncts_are_blamed(
    predicates: tuple[Predicate, ...], states: list[dict[str, Value]], blamed: tuple[Predicate, ...]
) -> None:
    assert blame(predicates, lambda predicate: any(predicate.holds(state) for state in states)) == blamed


@pytest.mark.parametrize(
    ("name", "states", "names"),
    [
        ("third", [_state(light="red")], ("first",)),
        ("third", [_state(count=1, light="blue"), _state(light="red", count=1)], ("first", "second")),
        ("third", [_state(light="red"), _state(count=2)], ()),
        ("third", [_state()], ()),
        ("third", [_state(light="red", done=True)], ()),
        ("last", [_state(light="blue")], ("third",)),
        ("last", [_state(light="blue", done=True)], ()),
        ("last", [_state(light="blue", done=True) | {"work.state": "executing"}], ("fails",)),
        ("adds", [_state(count=2), _state(count=1)], ("second",)),
        ("first", [_state(light="red")], ()),
    ],
)
def test_what_always_goes_first_is_named(name: str, states: list[dict[str, Value]], names: tuple[str, ...]) -> None:
    transition = next(each for each in MODEL.automatic_transitions if each.name == name)
    assert shadowing(MODEL, transition, states) == names
