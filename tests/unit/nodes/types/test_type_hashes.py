"""Hashes of types, next to those of `rosbags` and those that rosidl wrote for `test_msgs` of ROS 2 Jazzy."""

from __future__ import annotations

from pathlib import Path

import pytest
import rosbags.typesys.store

from scbm.nodes.types.definitions import CANCEL_GOAL, KNOWN, SET_BOOL, TRIGGER, MessageDefinition
from scbm.nodes.types.interface_files import InterfaceFolder
from scbm.nodes.types.type_hashes import type_hash, user_data
from scbm.nodes.types.type_library import TypeLibrary
from support.ros_values import STORE

GOLDEN = {
    "test_msgs/action/Fibonacci_Goal": ("RIHS01_e58ef5a8f4f039ab522a740823547c460b1d5aed8031c8b7825d33d345d90df8"),
    "test_msgs/action/Fibonacci_Result": ("RIHS01_0774b095467813c6904d475498b5486b7ebd4cda6a4569f97e8de8c862689049"),
    "test_msgs/action/Fibonacci_Feedback": ("RIHS01_7d1110f2efa019ad5ad8ad2244db98d862f39dc9fae8c976814b0065fa2f32d5"),
    "test_msgs/action/Fibonacci_FeedbackMessage": (
        "RIHS01_37487bae8cea358366b97003c1ef1ca7ce7c08df36f9e8cca496624226aee64e"
    ),
    "std_srvs/srv/Trigger_Request": "RIHS01_d010825374ce8918e72bfd826c82603e60f45419e932ea976f807b74a863a199",
    "std_srvs/srv/Trigger_Response": "RIHS01_2d946c21e2fc3f1e9ca6986a8191d85fcc70097a8bb7771a053564bc47009cdf",
    "std_srvs/srv/SetBool_Request": "RIHS01_c62fbb99d94e1b25e8ef9e109f9581956bb1b3361a45a4e5810c36a90d29932e",
    "std_srvs/srv/SetBool_Response": "RIHS01_d0814e7f7b4880ab77e9c57426c7aa1562ab69f11eef8e2e968812f9cbd0b059",
    "action_msgs/srv/CancelGoal_Request": ("RIHS01_3d3c84653c1f96918086887e1dcb236faec88b81a5b14fd4cf4840065bcdf8af"),
    "action_msgs/srv/CancelGoal_Response": ("RIHS01_35e682cf3f510e83c70a82a4aac888496dedee56773bf9d8e5e0aa81f9e1c960"),
    "test_msgs/action/Fibonacci_SendGoal_Request": (
        "RIHS01_dfe75c73dc2c090cbc8fd8c45039bfa279d16aa6aadd348f812c6adad26e669e"
    ),
    "test_msgs/action/Fibonacci_SendGoal_Response": (
        "RIHS01_1e7e84f7edf1fb020d9e51c7842bceef4cbdbd847f354125f3227cf4f314a683"
    ),
    "test_msgs/action/Fibonacci_GetResult_Request": (
        "RIHS01_c65e93c4c4328d7f1abd6ace83dba8e5fa0f32de76b4d2c96b5c655d94803b92"
    ),
    "test_msgs/action/Fibonacci_GetResult_Response": (
        "RIHS01_ef88159d47a3d21d9bf4bec690cf668939d9542db28a9cfd77dbcd97eaf1add2"
    ),
}
"""Hashes in files `.json` of the packages `test_msgs`, `std_srvs` and `action_msgs`."""

FIBONACCI = "int32 order\n---\nint32[] sequence\n---\nint32[] sequence\n"


def test_messages_of_ros_2_have_the_hashes_that_rosbags_computes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(rosbags.typesys.store.TIDMAP, "char", 3)  # as in ROS 2, where a `char` is a `uint8`
    library = TypeLibrary()
    for name in STORE.fielddefs:
        assert type_hash(library.message(name)) == STORE.hash_rihs01(name), name


def test_parts_of_services_and_actions_have_the_hashes_of_rosidl(tmp_path: Path) -> None:
    file = tmp_path / "test_msgs" / "action" / "Fibonacci.action"
    file.parent.mkdir(parents=True)
    file.write_text(FIBONACCI, encoding="utf-8")
    action = TypeLibrary([InterfaceFolder.of(str(tmp_path), Path())]).action("test_msgs/action/Fibonacci")
    services = (TRIGGER, SET_BOOL, CANCEL_GOAL, action.send_goal, action.get_result)
    parts = [action.goal, action.result, action.feedback, action.feedback_message]
    parts += [half for service in services for half in (service.request, service.response)]
    assert {part.name: type_hash(part) for part in parts} == GOLDEN


def test_the_definitions_that_need_no_look_up_are_those_of_rosbags(monkeypatch: pytest.MonkeyPatch) -> None:
    known = [each for each in KNOWN.values() if isinstance(each, MessageDefinition)]
    monkeypatch.setattr("scbm.nodes.types.type_library.KNOWN", {})
    assert [TypeLibrary().message(each.name) for each in known] == known


def test_endpoints_say_the_hash_behind_their_identity() -> None:
    assert user_data(TRIGGER.request, "clientid=1;").decode() == f"clientid=1;typehash={type_hash(TRIGGER.request)};"
    assert user_data(TRIGGER.request).startswith(b"typehash=RIHS01_")
