"""An action server of rclpy with nested messages. It prints the goal, and repeats its number as feedback and result."""

import rclpy
from rclpy.action import ActionServer
from rclpy.action.server import ServerGoalHandle
from test_msgs.action import NestedMessage


def execute(handle: ServerGoalHandle) -> NestedMessage.Result:
    goal = handle.request
    number = goal.nested_field.int32_value
    print("goal", number, goal.nested_field_no_pkg.duration_value.sec, goal.nested_different_pkg.nanosec, flush=True)
    feedback, result = NestedMessage.Feedback(), NestedMessage.Result()
    feedback.nested_field.float64_value = float(number)
    handle.publish_feedback(feedback)
    result.nested_field_no_pkg.time_value.sec = number
    handle.succeed()
    return result


rclpy.init()
node = rclpy.create_node("nested_server")
server = ActionServer(node, NestedMessage, "/nested", execute, result_timeout=10)
print("up", rclpy.get_rmw_implementation_identifier(), flush=True)
rclpy.spin(node)
