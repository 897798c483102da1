"""Paths to fields: what they may say of a type, what they read from a message, and what they put into one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from scbm.nodes.types.cdr import Message, codec_of
from scbm.nodes.types.definitions import ListShape, MessageDefinition, Primitive
from scbm.nodes.types.field_paths import FieldPath, MissingElement, PathFault, read_path
from scbm.nodes.types.type_library import TypeLibrary
from support.wording import Wording

LIBRARY = TypeLibrary()
JOINTS = LIBRARY.message("sensor_msgs/msg/JointState")
DIAGNOSTICS = LIBRARY.message("diagnostic_msgs/msg/DiagnosticArray")
IMU = LIBRARY.message("sensor_msgs/msg/Imu")
TRAJECTORY = LIBRARY.message("trajectory_msgs/msg/JointTrajectory")
ODD = MessageDefinition("robot/msg/Odd", (("few", ListShape(Primitive("int8"), 3)),))


def path(definition: MessageDefinition, text: str) -> FieldPath:
    found = read_path(definition, text, "the message")
    assert isinstance(found, FieldPath)
    return found


@pytest.mark.parametrize(
    ("definition", "text", "kind", "owner"),
    [
        (JOINTS, "header.stamp.sec", "int32", "builtin_interfaces/msg/Time"),
        (JOINTS, "position[0]", "float64", "sensor_msgs/msg/JointState"),
        (JOINTS, "position[name=a.b-c d]", "float64", "sensor_msgs/msg/JointState"),
        (JOINTS, "name", "string[]", "sensor_msgs/msg/JointState"),
        (DIAGNOSTICS, "status[2].values[0].value", "string", "diagnostic_msgs/msg/KeyValue"),
        (DIAGNOSTICS, "status[0].level", "byte", "diagnostic_msgs/msg/DiagnosticStatus"),
        (IMU, "orientation_covariance[8]", "float64", "sensor_msgs/msg/Imu"),
        (IMU, "orientation", "geometry_msgs/msg/Quaternion", "sensor_msgs/msg/Imu"),
        (ODD, "few[2]", "int8", "robot/msg/Odd"),
    ],
)
def test_a_path_ends_at_a_field_of_a_message(definition: MessageDefinition, text: str, kind: str, owner: str) -> None:
    found = path(definition, text)
    assert (str(found.shape), found.owner.name, str(found)) == (kind, owner, text)


@pytest.mark.parametrize(
    ("definition", "text"),
    [
        (JOINTS, "positon[0]"),
        (JOINTS, "header.stmp.sec"),
        (JOINTS, "header.stamp.sec.more"),
        (JOINTS, "position.x"),
        (JOINTS, "header[0]"),
        (JOINTS, "position[nane=elbow]"),
        (JOINTS, "position[effort=elbow]"),
        (IMU, "orientation_covariance[9]"),
        (IMU, "orientation_covariance[name=x]"),
        (ODD, "few[3]"),
        (JOINTS, "position[9999999999]"),
        (JOINTS, "position[1000000]"),
        (JOINTS, "position[-1]"),
        (JOINTS, "position[0"),
        (JOINTS, "position[]"),
        (JOINTS, "position[0][0]"),
        (JOINTS, ""),
        (JOINTS, "header..stamp"),
        (JOINTS, ".header"),
        (JOINTS, "header."),
        (JOINTS, "a b"),
        (LIBRARY.message("std_msgs/msg/Empty"), "data"),
    ],
)
def test_a_path_that_the_type_does_not_have_is_reported_at_its_place(
    definition: MessageDefinition, text: str, wording: Wording
) -> None:
    found = read_path(definition, text, f"`{definition.name}`")
    assert isinstance(found, PathFault)
    wording((f"{text!r}: {text[found.begin : found.end]!r}", found.message, found.remedy))


def joints(**values: object) -> Message:
    return codec_of(JOINTS).complete(values)


def test_a_path_reads_one_value() -> None:
    message = joints(name=["elbow", "grip"], position=[1.5, 0.25], header={"frame_id": "base"})
    assert path(JOINTS, "position[1]").get(message) == 0.25
    assert path(JOINTS, "position[name=grip]").get(message) == 0.25
    assert path(JOINTS, "header.frame_id").get(message) == "base"
    diagnostics = codec_of(DIAGNOSTICS).complete({"status": [{"level": 2, "values": [{"key": "a", "value": "b"}]}]})
    assert path(DIAGNOSTICS, "status[0].level").get(diagnostics) == 2
    assert path(DIAGNOSTICS, "status[0].values[0].value").get(diagnostics) == "b"


def test_values_of_rclpy_are_plain() -> None:
    """In rclpy a `byte` is bytes, and an array is one of numpy."""
    message = SimpleNamespace(orientation_covariance=np.array([0.5] * 9))
    value = path(IMU, "orientation_covariance[3]").get(message)
    assert (value, type(value)) == (0.5, float)
    assert path(DIAGNOSTICS, "status[0].level").get(SimpleNamespace(status=[SimpleNamespace(level=b"\2")])) == 2


@pytest.mark.parametrize("text", ["position[2]", "position[name=wrist]", "effort[name=grip]"])
def test_a_message_without_the_element_says_so(text: str, wording: Wording) -> None:
    message = joints(name=["elbow", "grip"], position=[1.5, 0.25])
    with wording.raises(MissingElement):
        path(JOINTS, text).get(message)


def test_paths_put_values_into_a_message_and_make_the_elements_of_lists() -> None:
    values: dict[str, Any] = {}
    for text, value in (
        ("header.frame_id", "base"),
        ("joint_names", ["a", "b"]),
        ("points[0].positions[0]", 0.5),
        ("points[0].positions[1]", 1.5),
        ("points[0].time_from_start.sec", 3),
        ("points[1].velocities", [2.0]),
    ):
        path(TRAJECTORY, text).put(values, value)
    assert values == {
        "header": {"frame_id": "base"},
        "joint_names": ["a", "b"],
        "points": [{"positions": [0.5, 1.5], "time_from_start": {"sec": 3}}, {"velocities": [2.0]}],
    }
    made = codec_of(TRAJECTORY).complete(values)
    assert [point.time_from_start.sec for point in made.points] == [3, 0]


def test_paths_put_values_into_the_elements_of_arrays_in_any_order() -> None:
    values: dict[str, Any] = {}
    path(IMU, "orientation_covariance[8]").put(values, 8.0)
    path(IMU, "orientation_covariance[0]").put(values, 1.0)
    assert codec_of(IMU).complete(values).orientation_covariance == [1.0, *[0.0] * 7, 8.0]
