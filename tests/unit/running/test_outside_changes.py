"""Who can change what from outside in a settled state (semantics 7.2, 9.2, 9.4, 9.5)."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.files import read_model
from scbm.model import Value
from scbm.running import Program
from scbm.running.outside_changes import FreeMaker, OtherUser, TransitionMaker

CELL = read_model(
    """
behavior_model: cell
variables:
  gate: {domain: [locked, unlocked], initial: locked, source: state}
  door: {domain: [closed, open], initial: closed}
  count: {domain: 0..2, initial: 0}
  button: {domain: [up, down], initial: up, source: input}
  near: {domain: [a, b, c], initial: a}
  lit: {domain: bool, initial: false}
resources:
  eye: {publishes: {near: [a, b], lit: any}}
  robot: {shared: true}
environment:
  opens: {guard: gate == unlocked && door == closed, actions: [door <- open]}
  counts: {guard: true, actions: [count += 1]}
operations:
  work:
    pre:
      g: button == up && near == a && lit == false && door == closed && robot_req_state == initial
      a: [robot_req_trigger <- true]
    post: {g: true, gr: robot_req_state == succeeded, a: [gate <- unlocked]}
goals: {done: gate == unlocked && count == 2}
"""
)
PROGRAM = Program(CELL)


def packed(**values: Value) -> int:
    return PROGRAM.packing.pack({v.name: values.get(v.name, v.initial) for v in CELL.running_space})


def changed(state: int, **values: Value) -> int:
    keep, bits = PROGRAM.packing.assignment(values)
    return state & keep | bits


def following(state: int, in_flight: tuple[int, ...] = ()) -> list[tuple[str, dict[str, Value]]]:
    found = PROGRAM.outside.following(state, in_flight)
    return [(each.maker.name, dict(PROGRAM.packing.changes(state, each.after))) for each in found]


def test_all_changes_of_a_state_have_their_makers() -> None:
    kinds = {maker.name: type(maker) for maker in PROGRAM.outside.makers}
    assert kinds == {
        "button": FreeMaker,
        "eye": FreeMaker,
        "opens": TransitionMaker,
        "counts": TransitionMaker,
        "robot": OtherUser,
    }
    found = following(packed())
    assert [each for each in found if each[0] != "eye"] == [
        ("button", {"button": "down"}),
        ("counts", {"count": 1}),
        ("robot", {"robot_req_state": "executing"}),
    ]
    assert ("eye", {"near": "b", "lit": True}) in found
    assert not any("c" in changes.values() for _, changes in found)


def test_a_guard_and_a_domain_decide_whether_a_transition_acts() -> None:
    assert ("opens", {"door": "open"}) in following(packed(gate="unlocked"))
    assert "counts" not in [name for name, _ in following(packed(count=2))]


def test_others_leave_a_resource_alone_while_a_request_is_in_flight() -> None:
    assert "robot" not in [name for name, _ in following(packed(), (1,))]
    assert ("robot", {"robot_req_state": "initial"}) in following(packed(robot_req_state="executing"))


@pytest.mark.parametrize(
    ("before", "change", "by", "maker"),
    [
        ({}, {"count": 1}, "", "counts"),
        ({}, {"count": 2}, "", None),
        ({}, {"door": "open"}, "", None),
        ({"gate": "unlocked"}, {"door": "open"}, "", "opens"),
        ({"gate": "unlocked"}, {"door": "open"}, "opens", "opens"),
        ({"gate": "unlocked"}, {"door": "open"}, "counts", None),
        ({"gate": "unlocked"}, {"door": "open", "count": 1}, "", None),
        ({}, {"near": "b", "lit": True}, "", "eye"),
        ({}, {"near": "c"}, "", None),
        ({}, {"near": "b", "button": "down"}, "", None),
        ({}, {"gate": "unlocked"}, "", None),
    ],
)
def test_the_maker_of_a_change_makes_all_of_it_at_once(
    before: dict[str, Value], change: dict[str, Value], by: str, maker: str | None
) -> None:
    state = packed(**before)
    found = PROGRAM.outside.maker_of(state, changed(state, **change), (), by)
    assert (None if found is None else found.name) == maker


def test_several_changes_can_follow_each_other_while_the_moment_stays_settled() -> None:
    state = packed()
    target = changed(state, near="b", button="down", count=1)
    assert PROGRAM.outside.can_lead(state, target, (), lambda _: True)
    assert not PROGRAM.outside.can_lead(state, target, (), lambda here: here == state)
    assert not PROGRAM.outside.can_lead(state, changed(state, gate="unlocked"), (), lambda _: True)


def test_the_parts_of_a_change_are_those_of_its_sources_in_the_order_written() -> None:
    values: tuple[tuple[str, Value], ...] = (
        ("lit", True),
        ("button", "down"),
        ("near", "b"),
        ("count", 1),
        ("door", "open"),
    )
    assert PROGRAM.outside.parts(values) == [
        (("lit", True), ("near", "b")),
        (("button", "down"),),
        (("count", 1),),
        (("door", "open"),),
    ]


def test_a_mutant_has_the_world_of_the_model() -> None:
    mutant = replace(CELL, environment=CELL.environment[1:])
    names = [maker.name for maker in PROGRAM.of_mutant(mutant).outside.makers]
    assert names == [maker.name for maker in PROGRAM.outside.makers if maker.name != "opens"]
