"""Bindings to actions: what they mean, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.files import read_bindings, read_model
from scbm.model import InputError
from scbm.nodes.bindings.ros_binding import ActionCall, CallChoice, RosBinding, request_values
from support.wording import Wording

MODEL = read_model("""
behavior_model: cell
variables:
  target: {domain: [home, box_a], initial: home}
  slip: {domain: bool, initial: false}
  zone: {domain: [near, far], initial: near}
resources:
  gantry: {request: [target], measures: [slip], publishes: [zone]}
operations: {}
""")
INTERFACES = Path(__file__).parents[3] / "models" / "interfaces"
HEAD = f"bindings_of: cell\ninterfaces: [{INTERFACES}]\nresources:\n  gantry:\n"
MOVE = """
          name: /gantry/move
          type: my_robot/action/Move
          goal:
            joint_names: [{text: x}]
            "positions[0]": {variable: target, values: {home: 0.0, box_a: 1.25}}
          succeeded: {error_code: SUCCESSFUL}
          measured: {slip: {field: error_code, values: {GOAL_TOLERANCE_VIOLATED: true, SUCCESSFUL: false}}}
          feedback: {zone: {field: "actual[0]", ranges: {near: ..0.5, far: 0.5..}}}
"""


def requests_of(text: str) -> object:
    (resource,) = read_bindings(HEAD + text, MODEL, "drivers.yaml").resources
    assert isinstance(resource.binding, RosBinding)
    return resource.binding.requests


def test_an_action_for_all_requests() -> None:
    call = requests_of(f"    action:{MOVE}")
    assert isinstance(call, ActionCall)
    assert (call.name, call.type.name) == ("/gantry/move", "my_robot/action/Move")
    assert request_values(call.goal, {"target": "box_a"}) == {"joint_names": ["x"], "positions": [1.25]}
    assert [(str(path), value) for path, value in call.succeeded] == [("error_code", 0)]
    assert [reading.variable for reading in call.readings] == ["slip", "zone"]
    assert call.measured[0].meanings == ((-5, True), (0, False))


def test_an_action_for_each_value_of_a_variable() -> None:
    home = "{name: /gantry/home, type: my_robot/action/Move}"
    choice = requests_of(f"    actions:\n      target:\n        home: {home}\n        box_a:{MOVE}")
    assert isinstance(choice, CallChoice)
    assert [(value, call.name) for value, call in choice.calls] == [("home", "/gantry/home"), ("box_a", "/gantry/move")]


@pytest.mark.parametrize(
    "text",
    [
        "action: {name: /a, type: my_robot/action/Mov}",
        "action: {name: /a, type: my_robot/srv/Light}",
        "action: {name: /a, type: my_robot/action/Move, goal: {position: 1}}",
        "action: {name: /a, type: my_robot/action/Move, succeeded: {error_code: SUCESSFUL}}",
        "action: {name: /a, type: my_robot/action/Move, feedback: {slip: 'actual[0]'}}",
        "action: {name: /a, type: my_robot/action/Move, measured: {zone: error_code}}",
        "action: {type: my_robot/action/Move, gaol: {}}",
        "action: {name: /a, type: my_robot/action/Move, goal: {positions: [.nan, .inf, 1e400]}}",
        "{action: {name: /a, type: my_robot/action/Move}, service: {name: /a, type: std_srvs/srv/Trigger}}",
        "actions: {target: {homm: {name: /a, type: my_robot/action/Move}}}",
    ],
)
def test_what_is_wrong_is_reported(text: str, wording: Wording) -> None:
    with pytest.raises(InputError) as raised:
        requests_of(
            f"    {text}"
            if text[0] != "{"
            else f"    {text}".replace("    {", "    ", 1)[:-1].replace("}, s", "}\n    s")
        )
    wording("".join(f"{each.message}\n= {each.remedy}\n" for each in raised.value.diagnostics))
