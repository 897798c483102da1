"""An action with small messages, and a resource that is bound to it."""

from __future__ import annotations

from pathlib import Path

from scbm.model import Reference, Resource
from scbm.nodes.bindings.ros_binding import ActionCall, Interval, Reading, RosBinding
from scbm.nodes.types.definitions import ActionDefinition, ListShape, MessageDefinition, Primitive
from scbm.nodes.types.field_paths import FieldPath, read_path

INT = Primitive("int32")
FIBONACCI = ActionDefinition(
    "test_msgs/action/Fibonacci",
    MessageDefinition("test_msgs/action/Fibonacci_Goal", (("order", INT),)),
    MessageDefinition("test_msgs/action/Fibonacci_Result", (("sequence", ListShape(INT)),)),
    MessageDefinition("test_msgs/action/Fibonacci_Feedback", (("sequence", ListShape(INT)),)),
)


def path(definition: MessageDefinition, text: str) -> FieldPath:
    found = read_path(definition, text, "a message")
    assert isinstance(found, FieldPath)
    return found


ZONES = (("near", Interval(None, 3)), ("far", Interval(3, None)))
CALL = ActionCall(
    "/fibonacci",
    FIBONACCI,
    goal=((path(FIBONACCI.goal, "order"), Reference("shelf")),),
    succeeded=((path(FIBONACCI.result, "sequence[0]"), 0),),
    measured=(Reading("zone", path(FIBONACCI.result, "sequence[1]"), ZONES),),
    feedback=(Reading("zone", path(FIBONACCI.feedback, "sequence[0]"), ZONES),),
)
GANTRY = Resource("gantry", ("shelf",), ("zone",), binding=RosBinding({}, CALL))

CELL = """
behavior_model: gantry_cell
variables:
  lifted: {domain: bool, initial: false}
  wish: {domain: 0..100, initial: 3}
  order: {domain: 0..100, initial: 0}
  zone: {domain: [near, far], initial: near}
resources:
  gantry: {request: [order], publishes: [zone]}
operations:
  lift:
    request: gantry
    with: {order: wish}
    deadline: 2 s
    guard: lifted == false
    effects: [lifted <- true]
    on_timeout: [wish <- 2]
goals: {done: lifted == true}
"""
"""A gantry lifts; if it takes too long, it is asked for a short lift."""

INTERFACES = Path(__file__).parents[1] / "models" / "interfaces"
BINDINGS = f"""
bindings_of: gantry_cell
interfaces: [{INTERFACES}]
resources:
  gantry:
    action:
      name: /fibonacci
      type: test_msgs/action/Fibonacci
      goal: {{order: order}}
      feedback: {{zone: {{field: "sequence[2]", ranges: {{near: ..2, far: 2..}}}}}}
"""
