"""An action with small messages, and a resource that is bound to it."""

from __future__ import annotations

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
