"""The names of ROS 2 topics, services and types in DDS, and back."""

from __future__ import annotations

import re

_NAME = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")
_DDS_TYPE = re.compile(r"([a-z][a-z0-9_]*)::(msg|srv|action)::dds_::(\w+?)(_Request|_Response)?_")


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


def ros_type(dds_type: str) -> str:
    """`std_msgs::msg::dds_::Bool_` is `std_msgs/msg/Bool`; both halves of a service are the service's type.

    A type that is not of ROS 2 is called what DDS calls it.
    """
    match = _DDS_TYPE.fullmatch(dds_type)
    return dds_type if match is None else "/".join(match.group(1, 2, 3))
