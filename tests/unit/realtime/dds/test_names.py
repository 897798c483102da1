"""Names of ROS 2 over DDS."""

from __future__ import annotations

import pytest

from scbm.realtime.dds import names


def test_topics_and_services_have_the_names_that_ros_2_gives_them() -> None:
    assert names.topic_name("/scanner/request") == "rt/scanner/request"
    assert names.topic_name("/a") == "rt/a"
    assert names.request_name("/scanner/scan_item_a") == "rq/scanner/scan_item_aRequest"
    assert names.reply_name("/scanner/scan_item_a") == "rr/scanner/scan_item_aReply"


@pytest.mark.parametrize(
    "name", ["", "/", "a", "a/b", "/a/", "//a", "/a//b", "/1a", "/a b", "/a-b", "~/a", "/ä", "/a\n"]
)
def test_a_name_that_ros_2_does_not_have_is_refused(name: str) -> None:
    for make in (names.topic_name, names.request_name, names.reply_name):
        with pytest.raises(ValueError, match="is no name of ROS 2 from the root, such as `/scanner/request`"):
            make(name)


def test_types_have_the_names_that_ros_2_gives_them() -> None:
    assert names.message_type("std_msgs/msg/Bool") == "std_msgs::msg::dds_::Bool_"
    assert names.request_type("std_srvs/srv/Trigger") == "std_srvs::srv::dds_::Trigger_Request_"
    assert names.response_type("std_srvs/srv/Trigger") == "std_srvs::srv::dds_::Trigger_Response_"


@pytest.mark.parametrize(
    "name", ["", "Bool", "std_msgs/Bool", "std_msgs/srv/Bool", "Std/msg/Bool", "std_msgs/msg/bool"]
)
def test_a_type_that_ros_2_does_not_have_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match="is no type such as `std_msgs/msg/String`"):
        names.message_type(name)


@pytest.mark.parametrize("make", [names.request_type, names.response_type])
def test_a_type_of_messages_is_none_of_services(make: object) -> None:
    assert callable(make)
    with pytest.raises(ValueError, match="`std_msgs/msg/Bool` is no type such as `std_srvs/srv/Trigger`"):
        make("std_msgs/msg/Bool")


def test_types_come_back_as_ros_2_writes_them() -> None:
    assert names.ros_type("std_msgs::msg::dds_::Bool_") == "std_msgs/msg/Bool"
    assert names.ros_type("std_srvs::srv::dds_::Trigger_Request_") == "std_srvs/srv/Trigger"
    assert names.ros_type("std_srvs::srv::dds_::Trigger_Response_") == "std_srvs/srv/Trigger"


@pytest.mark.parametrize(
    "name", ["HelloWorldData::Msg", "std_msgs::msg::Bool", "std_msgs::msg::dds_::Bool", "Bool_", ""]
)
def test_a_type_that_is_none_of_ros_2_keeps_its_name(name: str) -> None:
    assert names.ros_type(name) == name
