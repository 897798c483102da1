"""Publishes joints, a battery and diagnostics, again and again."""

import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import BatteryState, JointState

rclpy.init()
node = rclpy.create_node("sensor_driver")
joints = node.create_publisher(JointState, "/joint_states", 10)
batteries = node.create_publisher(BatteryState, "/battery", qos_profile_sensor_data)
diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)

values = [KeyValue(key="temperature", value="hot")]
status = DiagnosticStatus(name="drive: motor", level=DiagnosticStatus.WARN, message="ü", values=values)


def measure() -> None:
    joints.publish(JointState(name=["shoulder", "elbow"], position=[0.25, 1.75], velocity=[0.0, 0.0]))
    full = BatteryState.POWER_SUPPLY_STATUS_FULL
    batteries.publish(BatteryState(voltage=24.5, percentage=0.75, power_supply_status=full, cell_voltage=[4.0, 3.5]))
    diagnostics.publish(DiagnosticArray(status=[DiagnosticStatus(name="arm"), status]))


node.create_timer(0.1, measure)
print("up", rclpy.get_rmw_implementation_identifier(), flush=True)
rclpy.spin(node)
