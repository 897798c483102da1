"""An action server of rclpy whose goals end as their order says. It prints what it is asked, and each overlap of goals.

`goal_server.py KIND` serves `/fibonacci` or `/nested`, of which KIND is the type in `test_msgs`.

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
from test_msgs.action import Fibonacci, NestedMessage

STEP_S = 0.05
REJECTED_FROM = 100
ABORTED, UNTIL_CANCELLED, LATE, REFUSING, IGNORING = 10, 20, 60, 80, 90
STEPS = 3
RESULTS_S = 10


def say(*words: object) -> None:
    print(*words, flush=True)


class Numbers:
    """Small messages: the order is asked for alone, and the sequence grows."""

    name, type = "/fibonacci", Fibonacci

    def order(self, goal: Fibonacci.Goal) -> int:
        return int(goal.order)

    def fields(self, _: Fibonacci.Goal) -> tuple[int, ...]:
        return ()

    def feedback(self, _: int, step: int) -> Fibonacci.Feedback:
        return Fibonacci.Feedback(sequence=[0, 1, 1, 2, 3][: step + 2])

    def result(self, _: Fibonacci.Goal) -> Fibonacci.Result:
        return Fibonacci.Result(sequence=[0, 1, 1, 2, 3])


class Nested:
    """Nested messages: the order is a field of one of them, and comes back in others."""

    name, type = "/nested", NestedMessage

    def order(self, goal: NestedMessage.Goal) -> int:
        return int(goal.nested_field.int32_value)

    def fields(self, goal: NestedMessage.Goal) -> tuple[int, ...]:
        return goal.nested_field_no_pkg.duration_value.sec, goal.nested_different_pkg.nanosec

    def feedback(self, order: int, _: int) -> NestedMessage.Feedback:
        feedback = NestedMessage.Feedback()
        feedback.nested_field.float64_value = float(order)
        return feedback

    def result(self, goal: NestedMessage.Goal) -> NestedMessage.Result:
        result = NestedMessage.Result()
        result.nested_field_no_pkg.time_value.sec = self.order(goal)
        result.nested_different_pkg.nanosec = goal.nested_different_pkg.nanosec
        return result


class Driver:
    """The server, with its active goals."""

    def __init__(self, kind: Numbers | Nested) -> None:
        self.kind = kind
        self.active = 0
        self.cancelled: list[int] = []

    def decide(self, goal: Fibonacci.Goal | NestedMessage.Goal) -> GoalResponse:
        order = self.kind.order(goal)
        say("goal", order)
        say("fields", *self.kind.fields(goal))
        if order == LATE:
            sys.stdin.readline()
        return GoalResponse.REJECT if order >= REJECTED_FROM else GoalResponse.ACCEPT

    def decide_cancel(self, handle: ServerGoalHandle) -> CancelResponse:
        order = self.kind.order(handle.request)
        say("cancel", order)
        self.cancelled.append(order)
        return CancelResponse.REJECT if order == REFUSING else CancelResponse.ACCEPT

    def is_to_end(self, handle: ServerGoalHandle, order: int) -> bool:
        """Whether a goal that runs until it is to be cancelled has been asked to."""
        if order in (REFUSING, IGNORING):
            return order in self.cancelled
        return bool(handle.is_cancel_requested)

    def execute(self, handle: ServerGoalHandle) -> Fibonacci.Result | NestedMessage.Result:
        order = self.kind.order(handle.request)
        self.active += 1
        if self.active > 1:
            say("overlap", order)
        step = 0
        while step < STEPS or (order >= UNTIL_CANCELLED and not self.is_to_end(handle, order)):
            time.sleep(STEP_S)
            step += 1
            handle.publish_feedback(self.kind.feedback(order, step))
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
        return self.kind.result(handle.request)


rclpy.init()
node = rclpy.create_node("goal_server")
driver = Driver(Nested() if sys.argv[1] == "NestedMessage" else Numbers())
server = ActionServer(
    node, driver.kind.type, driver.kind.name, driver.execute,
    goal_callback=driver.decide, cancel_callback=driver.decide_cancel,
    callback_group=ReentrantCallbackGroup(), result_timeout=RESULTS_S,
)  # fmt: skip
executor = MultiThreadedExecutor(num_threads=8)
executor.add_node(node)
say("up", rclpy.get_rmw_implementation_identifier())
executor.spin()
