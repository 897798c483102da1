"""Which change of state disables an operation, and how it is injected."""

from __future__ import annotations

from scbm.closing.scripts.disabling import HOLD_NS, changes_that_disable, injection
from scbm.files import read_model
from scbm.model import BehaviorModel, State
from scbm.testing import RandomCases

TEXT = """
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
    model = read_model(TEXT, "lift.yaml")
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
