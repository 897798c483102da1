"""Real installations of rclpy."""

from __future__ import annotations

import pytest

from support.rclpy_installations import Rclpy, installed_rclpy


@pytest.fixture(scope="session")
def jazzy() -> Rclpy:
    """The sourced installation of ROS 2, else wheels of Jazzy."""
    return installed_rclpy("jazzy")


@pytest.fixture(scope="session")
def kilted() -> Rclpy:
    """Wheels of Kilted."""
    return installed_rclpy("kilted")
