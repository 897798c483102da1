"""The cell of the example in ROS 2: a controller, simulated resources, and a scanner that is real.

ros2 launch examples/robot_in_the_air/ros2/cell.launch.py
"""

from launch import LaunchDescription
from launch.actions import ExecuteProcess

MODEL = "examples/robot_in_the_air/after.yaml"
BINDINGS = "examples/robot_in_the_air/ros2/bindings.yaml"


def generate_launch_description() -> LaunchDescription:
    """Two processes of scbm; the driver of the scanner is started as it always is."""
    return LaunchDescription(
        [
            ExecuteProcess(
                cmd=["scbm", "node", "controller", MODEL, "--bindings", BINDINGS, "--real", "scanner"],
                output="screen",
            ),
            ExecuteProcess(
                cmd=["scbm", "node", "resources", MODEL, "robot", "gantry", "gripper"],
                output="screen",
            ),
        ]
    )
