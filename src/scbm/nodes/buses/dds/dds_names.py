"""The names of ROS 2 topics, services and types in DDS, and back."""

from __future__ import annotations

import re

_NAME = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")
_TYPE = re.compile(r"[a-z][a-z0-9_]*/(msg|srv)/[A-Z][A-Za-z0-9]*")
_DDS_TYPE = re.compile(r"([a-z][a-z0-9_]*)::(msg|srv)::dds_::([A-Z][A-Za-z0-9]*)(_Request|_Response)?_")


def topic_name(name: str) -> str:
    """`/a/b` is `rt/a/b`. Raises `ValueError` if that is no name of ROS 2, from the root."""
    return f"rt{_checked(name)}"


def request_name(service: str) -> str:
    """Return the topic of the requests to a service: `/a/b` is `rq/a/bRequest`; raise as `topic_name` does."""
    return f"rq{_checked(service)}Request"


def reply_name(service: str) -> str:
    """Return the topic of the responses of a service: `/a/b` is `rr/a/bReply`; raise as `topic_name` does."""
    return f"rr{_checked(service)}Reply"


def _checked(name: str) -> str:
    if not _NAME.fullmatch(name):
        raise ValueError(f"`{name}` is not an absolute ROS 2 name such as `/scanner/request`")
    return name


def message_type(name: str) -> str:
    """`std_msgs/msg/Bool` is `std_msgs::msg::dds_::Bool_`. Raises `ValueError` if that is no type of messages."""
    return f"{_dds_type(name, 'msg')}_"


def request_type(name: str) -> str:
    """`std_srvs/srv/Trigger` takes `std_srvs::srv::dds_::Trigger_Request_`. Raises as `message_type` does."""
    return f"{_dds_type(name, 'srv')}_Request_"


def response_type(name: str) -> str:
    """`std_srvs/srv/Trigger` gives `std_srvs::srv::dds_::Trigger_Response_`. Raises as `message_type` does."""
    return f"{_dds_type(name, 'srv')}_Response_"


def _dds_type(name: str, kind: str) -> str:
    match = _TYPE.fullmatch(name)
    if match is None or match[1] != kind:
        raise ValueError(f"`{name}` is not a ROS 2 type such as `{_EXAMPLES[kind]}`")
    package, _, name = name.split("/")
    return f"{package}::{kind}::dds_::{name}"


_EXAMPLES = {"msg": "std_msgs/msg/String", "srv": "std_srvs/srv/Trigger"}


def ros_type(dds_type: str) -> str:
    """`std_msgs::msg::dds_::Bool_` is `std_msgs/msg/Bool`; both halves of a service are the service's type.

    A type that is not of ROS 2 is called what DDS calls it.
    """
    match = _DDS_TYPE.fullmatch(dds_type)
    return dds_type if match is None else "/".join(match.group(1, 2, 3))
