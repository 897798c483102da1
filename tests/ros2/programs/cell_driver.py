"""The drivers of a cell, in rclpy: an action of a gantry, a service of a scanner, topics of a gripper, a battery."""

import json

import rclpy
from rclpy.action import ActionServer
from rclpy.action.server import ServerGoalHandle
from sensor_msgs.msg import BatteryState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci

rclpy.init()
node = rclpy.create_node("cell_driver")
replies = node.create_publisher(String, "/gripper/reply", 10)
batteries = node.create_publisher(BatteryState, "/battery", 10)


def move(handle: ServerGoalHandle) -> Fibonacci.Result:
    print("moves", handle.request.order, flush=True)
    handle.succeed()
    return Fibonacci.Result(sequence=[handle.request.order])


def scan(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
    print("scans", flush=True)
    response.success = True
    return response


def grip(message: String) -> None:
    request = json.loads(message.data)
    if "request" in request:
        print("grips", request["request"]["gripper_command"], flush=True)
        replies.publish(String(data=json.dumps({"id": request["id"], "succeeded": True})))


server = ActionServer(node, Fibonacci, "/gantry/move", move, result_timeout=10)
node.create_service(Trigger, "/scanner/scan_item_a", scan)
node.create_subscription(String, "/gripper/request", grip, 10)
node.create_timer(0.2, lambda: batteries.publish(BatteryState(cell_voltage=[4.0, 3.5])))
print("up", rclpy.get_rmw_implementation_identifier(), flush=True)
rclpy.spin(node)
