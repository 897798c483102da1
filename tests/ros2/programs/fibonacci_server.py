"""An action server of rclpy whose goals end as their order says. It prints what it is asked, and each overlap of goals.

Orders from 100 on are rejected, and those from 20 on run until they are to be cancelled: 60 is accepted when a line
comes on the standard input; 80 refuses cancellations and 90 ignores them, and both succeed. 10 is aborted, others
succeed.
"""

import sys
import time

import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from test_msgs.action import Fibonacci

STEP_S = 0.05
REJECTED_FROM = 100
ABORTED, UNTIL_CANCELLED, LATE, REFUSING, IGNORING = 10, 20, 60, 80, 90
LENGTH = 5
RESULTS_S = 10


def say(*words: object) -> None:
    print(*words, flush=True)


class Driver:
    """The server, with its active goals."""

    def __init__(self) -> None:
        self.active = 0
        self.cancelled: list[int] = []

    def decide(self, goal: Fibonacci.Goal) -> GoalResponse:
        say("goal", goal.order)
        if goal.order == LATE:
            sys.stdin.readline()
        return GoalResponse.REJECT if goal.order >= REJECTED_FROM else GoalResponse.ACCEPT

    def decide_cancel(self, handle: ServerGoalHandle) -> CancelResponse:
        say("cancel", handle.request.order)
        self.cancelled.append(handle.request.order)
        return CancelResponse.REJECT if handle.request.order == REFUSING else CancelResponse.ACCEPT

    def is_to_end(self, handle: ServerGoalHandle) -> bool:
        """Whether a goal that runs until it is to be cancelled has been asked to."""
        if handle.request.order in (REFUSING, IGNORING):
            return handle.request.order in self.cancelled
        return bool(handle.is_cancel_requested)

    def execute(self, handle: ServerGoalHandle) -> Fibonacci.Result:
        order = handle.request.order
        self.active += 1
        if self.active > 1:
            say("overlap", order)
        sequence = [0, 1]
        while len(sequence) < LENGTH or (order >= UNTIL_CANCELLED and not self.is_to_end(handle)):
            time.sleep(STEP_S)
            sequence = [*sequence, sequence[-1] + sequence[-2]][:LENGTH]
            handle.publish_feedback(Fibonacci.Feedback(sequence=sequence))
        self.active -= 1
        # It is printed first: the next goal may come before this thread goes on.
        if handle.is_cancel_requested and order != IGNORING:
            say("canceled", order)
            handle.canceled()
        elif order == ABORTED:
            say("aborted", order)
            handle.abort()
        else:
            say("succeeded", order)
            handle.succeed()
        return Fibonacci.Result(sequence=sequence)


rclpy.init()
node = rclpy.create_node("fibonacci_server")
driver = Driver()
server = ActionServer(
    node, Fibonacci, "/fibonacci", driver.execute,
    goal_callback=driver.decide, cancel_callback=driver.decide_cancel,
    callback_group=ReentrantCallbackGroup(), result_timeout=RESULTS_S,
)  # fmt: skip
executor = MultiThreadedExecutor(num_threads=8)
executor.add_node(node)
say("up", rclpy.get_rmw_implementation_identifier())
executor.spin()
