"""The changes from outside that the checker lets happen."""

from __future__ import annotations

from scbm.files import read_model
from scbm.model import BehaviorModel, Role, Value
from scbm.proofcheck.guarded_parts import GuardedRules
from scbm.proofcheck.values_check import all_possible

CELL = """
behavior_model: cell
variables:
  stop: {domain: [released, pressed], initial: released, source: input}
  door: {domain: [closed, open], initial: closed, source: input}
  visitors: {domain: 0..2, initial: 0}
  crowd: {domain: 0..2, initial: 0}
  item: {domain: [none, box, tube], initial: none}
resources:
  scanner: {publishes: {item: [none, box]}, shared: true}
  other: {}
operations:
  scan:
    pre: {g: stop == released && visitors == 0, a: [scanner_req_trigger <- true, other_req_trigger <- true]}
    post: {g: item == box}
goals: {done: item == box && door == open}
environment:
  press: {guard: visitors == 2, actions: [stop <- pressed]}
  enter: {guard: true, actions: [visitors += 1]}
"""


def model(*lines: str) -> BehaviorModel:
    return read_model(CELL + "".join(f"  {line}\n" for line in lines))


def changes(
    in_flight: tuple[str, ...] = (), cell: BehaviorModel | None = None, **values: Value
) -> list[dict[str, Value]]:
    cell = cell or model()
    names = [v.name for v in cell.running_space if v.role is not Role.OPERATION_STATE]
    rules = GuardedRules(cell, names)
    state = {name: cell.running_space[name].initial for name in names} | values
    return [dict(each) for each in rules.outside.changes(state, in_flight)]


FREE = [{"door": "closed"}, {"door": "open"}, {"item": "none"}, {"item": "box"}]
OCCUPIED, LEFT = {"scanner_req_state": "executing"}, {"scanner_req_state": "initial"}


def test_transitions_act_where_their_guards_hold_and_their_actions_fit() -> None:
    assert changes() == [*FREE, {"visitors": 1}, OCCUPIED]
    assert changes(visitors=2) == [*FREE, {"stop": "pressed"}, OCCUPIED]
    assert changes(visitors=2, stop="pressed") == [*FREE, OCCUPIED]


def test_the_actions_of_a_transition_act_together() -> None:
    drift = model("drift: {guard: visitors == 2, actions: [visitors <- crowd, crowd <- visitors]}")
    assert {"visitors": 1, "crowd": 2} in changes(cell=drift, visitors=2, crowd=1)


def test_others_occupy_and_leave_a_shared_resource_without_a_request_in_flight() -> None:
    assert changes(scanner_req_state="executing")[-1] == LEFT
    assert changes(("other",), scanner_req_state="executing")[-1] == LEFT
    assert changes(("scanner",), scanner_req_state="executing") == [*FREE, {"visitors": 1}]
    assert changes(scanner_req_state="succeeded") == [*FREE, {"visitors": 1}]


def test_values_change_from_outside_by_the_same_rules() -> None:
    sets: dict[str, tuple[Value, ...]] = {v.name: (v.initial,) for v in model().running_space}

    def given(visitors: tuple[Value, ...]) -> set[tuple[str, Value]]:
        possible = all_possible({**sets, "visitors": visitors}, model())
        outside = [each for each in possible if "outside" in each.what or "environment" in each.what]
        return {pair for each in outside for pair in each.gives}

    assert given((0,)) == {
        ("door", "closed"),
        ("door", "open"),
        ("item", "none"),
        ("item", "box"),
        ("visitors", 1),
        ("scanner_req_state", "initial"),
        ("scanner_req_state", "executing"),
    }
    assert ("stop", "pressed") in given((0, 1, 2))
