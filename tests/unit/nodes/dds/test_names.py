"""Names of ROS 2 over DDS."""

from __future__ import annotations

import re

import pytest

from scbm.nodes.buses.dds import dds_names
from support.wording import Wording


def test_topics_and_services_have_the_names_that_ros_2_gives_them() -> None:
    assert dds_names.topic_name("/scanner/request") == "rt/scanner/request"
    assert dds_names.topic_name("/a") == "rt/a"
    assert dds_names.request_name("/scanner/scan_item_a") == "rq/scanner/scan_item_aRequest"
    assert dds_names.reply_name("/scanner/scan_item_a") == "rr/scanner/scan_item_aReply"


@pytest.mark.parametrize(
    "name", ["", "/", "a", "a/b", "/a/", "//a", "/a//b", "/1a", "/a b", "/a-b", "~/a", "/ä", "/a\n"]
)
def test_a_name_that_ros_2_does_not_have_is_refused(name: str, wording: Wording) -> None:
    messages = []
    for make in (dds_names.topic_name, dds_names.request_name, dds_names.reply_name):
        with pytest.raises(ValueError, match=re.escape(f"`{name}`")) as raised:
            make(name)
        messages.append(str(raised.value))
    first, *others = messages
    assert others == [first, first]
    wording(first)


def test_types_come_back_as_ros_2_writes_them() -> None:
    assert dds_names.ros_type("std_msgs::msg::dds_::Bool_") == "std_msgs/msg/Bool"
    assert dds_names.ros_type("std_srvs::srv::dds_::Trigger_Request_") == "std_srvs/srv/Trigger"
    assert dds_names.ros_type("std_srvs::srv::dds_::Trigger_Response_") == "std_srvs/srv/Trigger"
    send_goal = "test_msgs::action::dds_::Fibonacci_SendGoal_Request_"
    assert dds_names.ros_type(send_goal) == "test_msgs/action/Fibonacci_SendGoal"


@pytest.mark.parametrize(
    "name", ["HelloWorldData::Msg", "std_msgs::msg::Bool", "std_msgs::msg::dds_::Bool", "Bool_", ""]
)
def test_a_type_that_is_none_of_ros_2_keeps_its_name(name: str) -> None:
    assert dds_names.ros_type(name) == name
