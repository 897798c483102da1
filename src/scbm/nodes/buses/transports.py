"""The transports by name (`TRANSPORTS`): each carries the messages between nodes.

To add one: a function that connects nodes, and an entry here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.nodes.buses.bus import Bus

LOOPBACK = "loopback"
"""The interface of nodes that reach only other programs of their machine."""

ALL_INTERFACES = "all"
"""All interfaces of the machine, with loopback."""

Join: TypeAlias = "Callable[[str], Bus]"
"""Opens the bus of a node, given the name of the node, on the running event loop. Raises `BusError`."""


@dataclass(frozen=True, slots=True)
class Transport:
    """A transport: it carries the messages of the nodes of a cell.

    Attributes:
        connect: gets the domain, a function for warnings, and the network interface, and returns what opens the buses
            of nodes. It is called once in each process. The interface is `loopback`, `all`, the name of one, or `None`
            for that of the configuration of the middleware.
        place: where nodes meet, for reports and messages; `{domain}` stands for the number of the domain.
        joins_processes: whether nodes of different processes reach each other. If not, all nodes of a cell run in the
            process of the tester: there are no domains, and no real drivers.
    """

    connect: Callable[[int, Callable[[str], None], str | None], Join]
    place: str
    joins_processes: bool

    def where(self, domain: int) -> str:
        """Return where the nodes of a domain meet, in words."""
        return self.place.format(domain=domain)


def connect_loopback(_: int, __: Callable[[str], None], ___: str | None) -> Join:
    """Connect the nodes of this process by one queue."""
    from scbm.nodes.buses.loopback import LoopbackHub  # noqa: PLC0415 - asyncio, which simulated runs do not need

    return LoopbackHub().join


def connect_dds(domain: int, warn: Callable[[str], None], interface: str | None) -> Join:
    """Connect nodes by Cyclone DDS, which is loaded with the first bus."""
    from scbm.nodes.buses.dds import open_dds  # noqa: PLC0415 - buses, which simulated runs do not need

    return lambda node: open_dds(f"scbm_{node}", domain, warn, interface)


TRANSPORTS: dict[str, Transport] = {
    "loopback": Transport(connect_loopback, "loopback", joins_processes=False),
    "dds": Transport(connect_dds, "DDS domain {domain}", joins_processes=True),
}
"""The transports by the names that `--transport` takes."""

DEFAULT_TRANSPORT = "dds"
"""The transport of nodes that are processes, if none is named."""
