"""The network interfaces of Cyclone DDS: its configuration for them, and sockets that take nothing from others."""

from __future__ import annotations

import os
import socket
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from scbm.testing.transports import ALL_INTERFACES, LOOPBACK

if TYPE_CHECKING:
    from collections.abc import Iterator

_FRAGMENT = (
    "<CycloneDDS><Domain Id='any'><General><Interfaces>{interfaces}</Interfaces>{multicast}</General><Discovery>"
    "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>60</MaxAutoParticipantIndex>"
    "<Peers><Peer Address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>"
)
"""Participants of the same machine are found at the ports of 60 of them, because loopback has no multicast."""

_DEVICE = b"lo\0"
_DESCRIPTORS = Path("/proc/self/fd")


def configuration(interface: str) -> str:
    """Return the configuration of Cyclone DDS for `loopback`, `all`, or the name of an interface."""
    if interface == LOOPBACK:
        one = "<NetworkInterface address='127.0.0.1' multicast='false'/>"
        return _FRAGMENT.format(interfaces=one, multicast="<AllowMulticast>false</AllowMulticast>")
    names = [name for _, name in socket.if_nameindex()] if interface == ALL_INTERFACES else [interface]
    is_required = "false" if interface == ALL_INTERFACES else "true"
    shown = (f"<NetworkInterface name='{name}' presence_required='{is_required}'/>" for name in names)
    return _FRAGMENT.format(interfaces="".join(shown), multicast="")


@contextmanager
def bound_to_loopback(warnings: list[str]) -> Iterator[None]:
    """Bind the UDP sockets that the block opens to the loopback device, or add the reason why not to `warnings`.

    Cyclone DDS receives at all addresses, whatever its interfaces are: a program in the network could send it messages.
    """
    before = _sockets()
    yield
    try:
        for descriptor in sorted(_sockets() - before):
            _bind(descriptor)
        why = None if _DESCRIPTORS.is_dir() else "only Linux can bind them to a device"
    except OSError as error:
        why = str(error)
    if why is not None:
        warnings.append(f"its sockets also take messages from the network: {why}")


def _sockets() -> set[int]:
    found = set()
    for path in _DESCRIPTORS.iterdir() if _DESCRIPTORS.is_dir() else ():
        with suppress(OSError):
            if str(path.readlink()).startswith("socket:"):
                found.add(int(path.name))
    return found


def _bind(descriptor: int) -> None:
    with socket.socket(fileno=os.dup(descriptor)) as opened:
        if opened.family == socket.AF_INET and opened.type == socket.SOCK_DGRAM:
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, _DEVICE)
