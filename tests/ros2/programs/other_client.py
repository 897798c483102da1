"""A client of `rclpy.action` that sends a goal to `/fibonacci`, prints its id, and cancels it on a line."""

import sys

import rclpy
from rclpy.action import ActionClient
from test_msgs.action import Fibonacci

rclpy.init()
node = rclpy.create_node("other_client")
client = ActionClient(node, Fibonacci, "/fibonacci")
client.wait_for_server()
sent = client.send_goal_async(Fibonacci.Goal(order=int(sys.argv[1])))
rclpy.spin_until_future_complete(node, sent)
handle = sent.result()
print("up", bytes(handle.goal_id.uuid).hex(), flush=True)
sys.stdin.readline()
rclpy.spin_until_future_complete(node, handle.cancel_goal_async())
rclpy.spin_until_future_complete(node, handle.get_result_async())
print("over", flush=True)
