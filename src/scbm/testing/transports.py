"""The transports by name (`TRANSPORTS`): each carries the messages between nodes.

To add one: a function that connects nodes, and an entry here, which names the function as text. So nothing here imports
`nodes`, and a middleware is loaded only by commands that use it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgspec import Struct

from scbm.model.lazy_exports import load_named

if TYPE_CHECKING:
    from collections.abc import Callable

LOOPBACK = "loopback"
"""The interface of nodes that reach only other programs of their machine."""

ALL_INTERFACES = "all"
"""All interfaces of the machine, with loopback."""


class Transport(Struct, frozen=True):
    """A transport: it carries the messages of the nodes of a cell.

    Attributes:
        function: the function that connects nodes, as `package.module:name`. It gets the domain, a function for
            warnings, and the network interface, and returns what opens the buses of nodes. It is called once in each
            process. The interface is `loopback`, `all`, the name of one, or `None` for that of the configuration of
            the middleware.
        place: where nodes meet, for reports and messages; `{domain}` stands for the number of the domain.
        joins_processes: whether nodes of different processes reach each other. If not, all nodes of a cell run in the
            process of the tester: there are no domains, and no real drivers.
    """

    function: str
    place: str
    joins_processes: bool

    def connect(self, domain: int, warn: Callable[[str], None], interface: str | None) -> Callable[[str], Any]:
        """Return what opens the bus of a node, given its name; see `Join` in `nodes/buses/bus.py`."""
        join: Callable[[str], Any] = load_named(self.function)(domain, warn, interface)
        return join

    def where(self, domain: int) -> str:
        """Return where the nodes of a domain meet, in words."""
        return self.place.format(domain=domain)


TRANSPORTS: dict[str, Transport] = {
    "loopback": Transport("scbm.nodes.buses.loopback:connect_loopback", "loopback", joins_processes=False),
    "dds": Transport("scbm.nodes.buses.dds:connect_dds", "DDS domain {domain}", joins_processes=True),
}
"""The transports by the names that `--transport` takes."""

DEFAULT_TRANSPORT = "dds"
"""The transport of nodes that are processes, if none is named."""

RUN_OVER_NODES = "scbm.nodes.verbs.over_nodes:run_over_nodes"
"""The function that runs the cases of `scbm test` over a transport."""
