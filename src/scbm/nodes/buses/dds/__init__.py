"""Cyclone DDS in the layout of ROS 2: the only package that imports cyclonedds, which may be missing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.nodes.buses.bus import BusError

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.nodes.buses.bus import Bus, Join

__all__ = ["connect_dds", "open_dds"]


def open_dds(node: str, domain: int, warn: Callable[[str], None], interface: str | None = None) -> Bus:
    """Open a bus on the running event loop.

    Args:
        node: the name that tools show.
        domain: of DDS, from 0 to 232; in ROS 2 that is `ROS_DOMAIN_ID`.
        warn: gets a sentence about each message that cannot be understood, and all that Cyclone DDS warns of
            while it starts. It is called on the loop.
        interface: `loopback`, `all`, or the name of a network interface; `None` for what `CYCLONEDDS_URI` says.

    Raises:
        BusError: cyclonedds is not installed, or Cyclone DDS does not start: `CYCLONEDDS_URI`, the network.
    """
    try:
        from scbm.nodes.buses.dds.dds_bus import DdsBus  # noqa: PLC0415 - cyclonedds may be missing
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != "cyclonedds":
            raise
        raise BusError("cyclonedds is not installed", "pip install 'scbm[dds]'") from error
    return DdsBus.open(node, domain, warn, interface)


def connect_dds(domain: int, warn: Callable[[str], None], interface: str | None) -> Join:
    """Connect nodes by Cyclone DDS, which is loaded with the first bus."""
    return lambda node: open_dds(f"scbm_{node}", domain, warn, interface)
