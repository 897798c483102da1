"""A driver of a scanner, in rclpy: a service, a pair of topics and two measured topics. It prints each request."""

import json

import rclpy
from std_msgs.msg import Bool, Float64, String
from std_srvs.srv import Trigger

rclpy.init()
node = rclpy.create_node("scanner_driver")
replies = node.create_publisher(String, "/scanner/reply", 10)
distances = node.create_publisher(Float64, "/scanner/distance", 10)
sights = node.create_publisher(Bool, "/scanner/sees", 10)


def scan(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
    print("called", flush=True)
    response.success = True
    return response


def take(message: String) -> None:
    request = json.loads(message.data)
    print(f"took {message.data}", flush=True)
    if "request" in request:
        replies.publish(String(data=json.dumps({"id": request["id"], "succeeded": True})))


def measure() -> None:
    distances.publish(Float64(data=0.25))
    sights.publish(Bool(data=True))


node.create_service(Trigger, "/scanner/scan_item_a", scan)
node.create_subscription(String, "/scanner/request", take, 10)
node.create_timer(0.1, measure)
print("up", rclpy.get_rmw_implementation_identifier(), flush=True)
rclpy.spin(node)
